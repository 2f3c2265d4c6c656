"""Reports of a run: a JSON document, a self-contained HTML page, and the power surface to look at."""

from fiveaxis.report.document import ReportDocument as ReportDocument
from fiveaxis.report.document import write_json as write_json
from fiveaxis.report.facts import InputFile as InputFile
from fiveaxis.report.facts import describe_input as describe_input
from fiveaxis.report.page import write_finished as write_finished
from fiveaxis.report.page import write_report as write_report
from fiveaxis.report.questions import Answer as Answer
from fiveaxis.report.questions import Answers as Answers
from fiveaxis.report.surfaces import LocationSurface as LocationSurface
from fiveaxis.report.surfaces import Valley as Valley
from fiveaxis.report.surfaces import location_surface as location_surface
from fiveaxis.report.surfaces import path_valley as path_valley
from fiveaxis.report.surfaces import tip_surface as tip_surface
