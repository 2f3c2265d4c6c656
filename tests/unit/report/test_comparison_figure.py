"""Variants of a job as bars."""

import re

import pytest

from fiveaxis.errors import SettingError
from fiveaxis.report.comparison_figure import LONGEST, MOST, Bar, comparison_figure


def test_each_variant_shows_its_energy_or_why_it_has_none():
    bars = [Bar("tilt 15", 8151.4, 14610.0, "fine"), Bar("tilt 1", None, None, "no posture")]
    figure = comparison_figure("cup", bars, "normal").decode()
    for said in ("8 151 J", "no posture", "tilt 15", "tilt 1", "normal", "optimised", "(J)", "cup"):
        assert said in figure


def test_variants_that_all_failed_are_shown_too():
    assert b"no posture" in comparison_figure("cup", [Bar("a", None, None, "no posture")], "")


def test_the_bytes_are_the_same_every_time():
    bars = [Bar("a", 1.0, 2.0, "fine")]
    assert comparison_figure("cup", bars, "normal") == comparison_figure("cup", bars, "normal")


def test_names_from_files_are_no_markup_and_no_formula():
    figure = comparison_figure("<b>$x$", [Bar("$a$ <script> " + "y" * 99, 1.0, None, "fine")], "").decode()
    assert "<script" not in figure
    assert "$a$ &lt;script&gt;" in figure
    assert "&lt;b&gt;$x$" in figure
    assert "y" * LONGEST not in figure


def test_more_bars_than_can_be_read_are_cut_and_said():
    figure = comparison_figure("cup", [Bar(f"v{i}", 1.0, 2.0, "fine") for i in range(MOST + 5)], "n").decode()
    assert f"the first {MOST} of {MOST + 5}" in figure
    assert len(re.findall(r">v\d+<", figure)) == MOST


def test_nothing_to_compare_is_refused():
    with pytest.raises(SettingError, match="no variants"):
        comparison_figure("cup", [], "")
