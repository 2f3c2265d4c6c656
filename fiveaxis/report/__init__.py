"""Reports of a run: a JSON document, a self-contained HTML page, and the power surface to look at."""

from fiveaxis.report.document import describe_input, report_document, write_json
from fiveaxis.report.page import write_report
from fiveaxis.report.questions import Answer, Answers, answers
from fiveaxis.report.surfaces import LocationSurface, Valley, location_surface, path_valley, tip_surface

__all__ = [
    "Answer",
    "Answers",
    "LocationSurface",
    "Valley",
    "answers",
    "describe_input",
    "location_surface",
    "path_valley",
    "report_document",
    "tip_surface",
    "write_json",
    "write_report",
]
