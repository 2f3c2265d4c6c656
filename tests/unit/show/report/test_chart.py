"""Charts drawn as SVG: numbers have their places, ticks are round, gaps stay gaps."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.show.report.chart import Panel, break_jumps, labelled, svg, text, thin_rows, ticks, widened

PANEL = Panel(20.0, 100.0, (0.0, 10.0), (-1.0, 1.0))


def points(svg: str) -> list[list[tuple[float, float]]]:
    """Return the points of a line piece by piece, points from the left and from the top."""
    scale = float(re.search(r"scale\(([\d.]+)\)", svg)[1])  # type: ignore[index]
    found = []
    for piece in re.findall(r"M([^M\"]+)", svg):
        steps = np.array(re.findall(r"-?\d+", piece), dtype=float).reshape(-1, 2)
        found.append([(round(x * scale, 6), round(y * scale, 6)) for x, y in np.cumsum(steps, axis=0)])
    return found


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_are_round_and_lie_inside(low: float, width: float) -> None:
    places = ticks((low, low + width))
    assert 4 <= len(places) <= 11
    slack = 1e-6 * width + 1e-9 * abs(low)
    assert low - slack <= places[0]
    assert places[-1] <= low + width + slack
    np.testing.assert_allclose(np.diff(places), places[1] - places[0], rtol=1e-6, atol=1e-9 * abs(low))


def test_labels_have_the_decimals_of_their_step_and_a_true_minus() -> None:
    assert list(labelled([-0.5, 0.0, 0.5]).values()) == ["\u22120.5", "0.0", "0.5"]
    assert list(labelled([0.0, 5000.0, 10000.0]).values()) == ["0", "5\u2009000", "10\u2009000"]
    assert list(labelled([-0.0, 25.0]).values()) == ["0", "25"]


def test_corners_of_the_range_are_corners_of_the_panel() -> None:
    assert float(PANEL.down(-1.0)) == PANEL.bottom
    assert float(PANEL.down(1.0)) == PANEL.top
    assert float(PANEL.across(10.0) - PANEL.across(0.0)) == pytest.approx(PANEL.width)


def test_a_line_is_broken_where_a_number_is_missing() -> None:
    values = np.array([0.0, 0.5, np.nan, 0.5, 0.0])
    drawn = points(PANEL.line(np.arange(5.0), values, "#000000", 1.0))
    assert [len(piece) for piece in drawn] == [2, 2]
    assert drawn[1][1] == (float(PANEL.across(4.0)), float(PANEL.down(0.0)))


def test_a_step_has_the_value_of_its_end() -> None:
    path = PANEL.steps(np.array([1.0, 2.0]), np.array([0.0, 1.0]), "#000000", 1.0)
    (places,) = points(path)
    assert [y for _, y in places] == [70.0, 20.0, 20.0]


def test_a_constant_line_lies_in_the_middle() -> None:
    low, high = widened(np.full(5, 3.0))
    assert low < 3.0 < high
    assert 3.0 - low == pytest.approx(high - 3.0)
    assert widened(np.array([np.nan]))[0] < widened(np.array([np.nan]))[1]


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=40))
def test_a_line_passes_its_points_without_an_error_that_adds_up(values: list[float]) -> None:
    (drawn,) = points(PANEL.line(np.linspace(0.0, 10.0, len(values)), np.array(values), "#000000", 1.0))
    expected = PANEL.down(np.array(values))
    np.testing.assert_allclose([y for _, y in drawn][: len(values)], expected, atol=0.0051)


def test_a_panel_says_where_its_lines_are_and_what_they_are_called() -> None:
    line = PANEL.line(np.arange(2.0), np.zeros(2), "#000000", 1.0, 'a "b"')
    drawn = ElementTree.fromstring(svg(60.0, [PANEL.group("X <mm>", [line])], "what <it> shows", "location"))
    assert (drawn.get("role"), drawn.get("aria-label")) == ("img", "what <it> shows")
    assert drawn.get("data-over") == "location"
    group = drawn[0]
    assert group.get("data-box") == f"58 20 {PANEL.width:g} 100"
    assert (group.get("data-x"), group.get("data-y")) == ("0 10", "-1 1")
    assert group[0].get("data-name") == 'a "b"'


def test_text_is_escaped_and_the_chart_is_well_formed() -> None:
    drawn = svg(60.0, [text("a < b & c", 1.0, 2.0), PANEL.frame("y", "x"), PANEL.level(0.5)])
    assert "a < b" not in drawn
    ElementTree.fromstring(drawn)


def test_a_thinned_line_keeps_its_ends_and_every_extreme() -> None:
    values = np.sin(np.linspace(0.0, 40.0, 20_000))
    values[7_777], values[12_345] = 5.0, -7.0
    rows = thin_rows(values, buckets=100)
    assert len(rows) <= 202
    assert {0, 7_777, 12_345, 19_999} <= set(rows.tolist())
    assert np.all(np.diff(rows) > 0)


def test_a_thinned_line_strays_from_the_line_by_no_more_than_a_bucket() -> None:
    values = np.cumsum(np.random.default_rng(3).normal(size=9_000))
    rows = thin_rows(values, buckets=150)
    for bucket in np.array_split(np.arange(9_000), 150):
        kept = values[rows[(rows >= bucket[0]) & (rows <= bucket[-1])]]
        assert kept.max() >= values[bucket].max()
        assert kept.min() <= values[bucket].min()


def test_a_short_line_is_kept_whole() -> None:
    np.testing.assert_array_equal(thin_rows(np.zeros(7), buckets=4), np.arange(7))


def test_a_line_with_nothing_in_it_can_be_thinned() -> None:
    assert len(thin_rows(np.full(5_000, np.nan), buckets=10)) > 2


def test_a_wrapped_angle_is_not_drawn_across_the_figure() -> None:
    broken = break_jumps(np.array([170.0, 179.0, -179.0, -170.0]), 180.0)
    np.testing.assert_array_equal(np.isnan(broken), [False, False, True, False])
