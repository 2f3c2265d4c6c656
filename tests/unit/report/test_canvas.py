from __future__ import annotations

import matplotlib
import numpy as np
import pytest

from fiveaxis.report.canvas import break_jumps, drawing, thin_rows
from fiveaxis.report.comparison_figure import Bar, comparison_figure


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


def test_drawing_leaves_the_settings_of_matplotlib_as_they_were() -> None:
    with matplotlib.rc_context({"font.size": 31.0}):
        with drawing("some"):
            assert matplotlib.rcParams["font.size"] == 9.0
        assert matplotlib.rcParams["font.size"] == 31.0


@pytest.mark.parametrize(
    "setting", [{"font.size": 31.0}, {"axes.facecolor": "red"}, {"svg.fonttype": "path"}]
)
def test_a_figure_does_not_depend_on_the_settings_of_its_user(setting: dict[str, object]) -> None:
    bars = [Bar("one", 5.0, 7.0, "fine"), Bar("other", 6.0, 7.0, "fine")]
    plain = comparison_figure("a job", bars, "normal")
    with matplotlib.rc_context(setting):  # type: ignore[arg-type]
        assert comparison_figure("a job", bars, "normal") == plain
