"""The page's tables."""

import re

from fiveaxis.report.tables import WORDS, measured_table
from fiveaxis.verification import verify

THIN = "\u2009"


def cells(text: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", text)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


def test_measured_figures_are_described_with_their_units():
    figures = {"tilt_max_deg": 75.027976, "speed_share": 0.5, "off": -1.5, "held_axis_off_deg": None}
    head, *rows = cells(measured_table(figures))
    assert head == ["measured in the program, the worst", "value"]
    assert rows == [
        ["largest angle of the tool axis", "75.03°"],
        ["speed, of an axis’s highest", f"50{THIN}%"],
        ["off", "−1.5"],
        ["held axis off its angle", "–"],
    ]


def test_a_number_as_small_as_rounding_is_none():
    assert cells(measured_table({"contact_error_mm": 1.6e-14}))[1] == ["tool off its path", f"0{THIN}mm"]


def test_every_figure_of_a_verification_has_words(solution):
    figures = verify(solution.motion, solution.machine, solution.toolpath).figures
    assert set(figures) <= set(WORDS)
