"""Charts of shares: strips of what limits the speed, and bars of where the edge cuts."""

import numpy as np
import pytest

from fiveaxis.model.toolpath.cutter import Zone
from fiveaxis.model.toolpath.edge import EdgeUse
from fiveaxis.show import ReportDocument
from fiveaxis.show.report.sections import edge_bars, edge_section, limit_strips


def test_the_strips_show_for_which_share_of_the_time_each_cause_limits_the_speed(solution):
    limited = solution.limiting()
    assert limited.times.sum() == pytest.approx(solution.timed().time.sum())
    drawn = limit_strips(solution, "normal")
    for cause in limited.by_cause:
        assert f">{cause}</text>" in drawn
    assert drawn == limit_strips(solution, "normal")
    # One strip for each program, of one area per cause.
    assert drawn.count('class="panel"') == 2
    assert limit_strips(solution, None).count('class="panel"') == 1


def test_the_bars_say_angle_diameter_and_speed_of_the_edge():
    ball = Zone("ball", 5.0, 0.0, 5.0, 0.0, np.pi)
    use = EdgeUse(
        np.radians([25.0, 30.0, 35.0]), {"optimised": np.array([0.0, 12.0])}, {"optimised": 0.0}, ball
    )
    silent = edge_bars(use, ["optimised"])
    assert ">30°</text>" in silent
    assert ">5 mm</text>" in silent  # 10 mm of diameter, sin 30° of it
    assert "m/min" not in silent
    turning = EdgeUse(use.edges, use.lengths, use.unknown, ball, spindle=8000 * np.pi / 30.0)
    assert f">{np.pi * 5.0 * 8000 / 1000:.3g} m/min</text>" in edge_bars(turning, ["optimised"])


def test_a_report_has_no_bars_where_nobody_asked(solution, verdict):
    assert edge_section(ReportDocument(solution, verdict)) == ""
    assert "edge_use" not in ReportDocument(solution, verdict).as_dict()
