"""Figures that are files of their own: their words, their bytes, what they refuse."""

import io
import re

import numpy as np
import pytest
from by_degrees import find_front
from matplotlib import image

from fiveaxis.errors import SettingError
from fiveaxis.posture.strategy.front import Front
from fiveaxis.report.chart import svg, text
from fiveaxis.report.plots import (
    LONGEST,
    MOST,
    Bar,
    comparison_figure,
    write_figure,
    write_front_figure,
)
from fiveaxis.toolpath import Tool, Toolpath


def test_each_variant_shows_its_energy_or_why_it_has_none():
    bars = [Bar("tilt 15", 8151.4, 14610.0, "fine"), Bar("tilt 1", None, None, "no posture")]
    figure = comparison_figure("cup", bars, "normal")
    for message in ("8\u2009151 J", "no posture", "tilt 15", "tilt 1", "normal", "optimised", "(J)", "cup"):
        assert message in figure


def test_variants_that_all_failed_are_shown_too():
    assert "no posture" in comparison_figure("cup", [Bar("a", None, None, "no posture")], "")


def test_the_bytes_are_the_same_every_time():
    bars = [Bar("a", 1.0, 2.0, "fine")]
    assert comparison_figure("cup", bars, "normal") == comparison_figure("cup", bars, "normal")


def test_names_from_files_are_no_markup_and_no_formula():
    figure = comparison_figure("<b>$x$", [Bar("$a$ <script> " + "y" * 99, 1.0, None, "fine")], "")
    assert "<script" not in figure
    assert "$a$ &lt;script&gt;" in figure
    assert "&lt;b&gt;$x$" in figure
    assert "y" * LONGEST not in figure


def test_of_more_bars_than_are_legible_the_first_are_drawn_and_the_title_says_so():
    figure = comparison_figure("cup", [Bar(f"v{i}", 1.0, 2.0, "fine") for i in range(MOST + 5)], "n")
    assert f"the first {MOST} of {MOST + 5}" in figure
    assert len(re.findall(r">v\d+<", figure)) == MOST


def test_nothing_to_compare_is_refused():
    with pytest.raises(SettingError, match="no variants"):
        comparison_figure("cup", [], "")


@pytest.fixture(scope="module")
def found(hayashi):
    angle = np.linspace(0.0, 2.0, 25)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(25, -0.2)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    return find_front(path, hayashi, 3, tilt=(15, 75), effort="quick")


def test_the_figure_names_both_ends_and_what_the_axes_show(found, tmp_path):
    drawn = write_front_figure(found, tmp_path / "front.svg").read_text(encoding="utf-8")
    assert "<svg" in drawn
    for words in ("cheapest", "smoothest", "deg/mm", "energy of the feed drives"):
        assert words in drawn


def test_the_figure_is_the_same_for_the_same_front(found, tmp_path):
    for suffix in (".svg", ".png"):
        first = write_front_figure(found, tmp_path / f"a{suffix}").read_bytes()
        assert first == write_front_figure(found, tmp_path / f"b{suffix}").read_bytes()
        assert len(first) > 1000


def test_no_points_and_no_format_are_refused(found, tmp_path):
    with pytest.raises(SettingError, match="no points"):
        write_front_figure(Front((), 0, found.solution), tmp_path / "front.svg")
    with pytest.raises(SettingError, match=r"let it end in \.svg, \.png or \.html"):
        write_front_figure(found, tmp_path / "front.pdf")


def test_a_png_has_the_letters_of_the_package_whatever_fonts_the_computer_has(tmp_path):
    for name, title in (("titled", "What steadiness costs"), ("untitled", "")):
        chart = svg(60.0, [text(title, 10.0, 30.0, bold=True)])
        write_figure(chart, tmp_path / f"{name}.png", "a title")
    titled, untitled = ((tmp_path / f"{name}.png").read_bytes() for name in ("titled", "untitled"))
    assert titled != untitled
    ink = [image.imread(io.BytesIO(data))[..., :3].min() for data in (titled, untitled)]
    assert ink[0] < 0.5 < ink[1]
