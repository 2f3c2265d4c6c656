"""Reports of a run: a JSON document and a self-contained HTML page."""

from fiveaxis.report.document import describe_input, report_document, write_json
from fiveaxis.report.page import write_report
from fiveaxis.report.questions import Answer, Answers, answers

__all__ = [
    "Answer",
    "Answers",
    "answers",
    "describe_input",
    "report_document",
    "write_json",
    "write_report",
]
