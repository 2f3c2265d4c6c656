"""What a run leaves for people and for scripts: one JSON document, one page that stands by itself."""

from fiveaxis.report.document import describe_input, main_baseline, report_document, write_json
from fiveaxis.report.page import write_report

__all__ = ["describe_input", "main_baseline", "report_document", "write_json", "write_report"]
