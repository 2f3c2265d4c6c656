"""Places of axes on the command line."""

from __future__ import annotations

import pytest

from fiveaxis.cli.terminal import parse_places
from fiveaxis.errors import SettingError


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("X18,Y74,Z0", {"X": 18, "Y": 74, "Z": 0}),
        (" x-1.5 , c30", {"X": -1.5, "C": 30}),
        ("G55X18,g54.1p3z-2", {"G55X": 18, "G54.1P3Z": -2}),
    ],
)
def test_places_are_of_axes_or_of_axes_of_a_work_offset(text, places):
    assert parse_places("--program-zero", text) == places


@pytest.mark.parametrize("text", ["18", "X", "X1;Y2", "", "X1,,Y2"])
def test_what_is_no_place_is_refused_with_the_form(text):
    with pytest.raises(SettingError, match="isn't of the form X18,Y74,Z0"):
        parse_places("--start", text)


def test_an_axis_is_named_once():
    with pytest.raises(SettingError, match="names an axis twice"):
        parse_places("--start", "X1,x2")
