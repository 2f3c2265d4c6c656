"""Reports of a run: a JSON document, a self-contained HTML page, and the power surface to look at."""

from fiveaxis.report.document import ReportDocument, write_json
from fiveaxis.report.facts import InputFile, describe_input
from fiveaxis.report.page import write_finished, write_report
from fiveaxis.report.questions import Answer, Answers
from fiveaxis.report.surfaces import LocationSurface, Valley, location_surface, path_valley, tip_surface

__all__ = [
    "Answer",
    "Answers",
    "InputFile",
    "LocationSurface",
    "ReportDocument",
    "Valley",
    "describe_input",
    "location_surface",
    "path_valley",
    "tip_surface",
    "write_finished",
    "write_json",
    "write_report",
]
