"""What the axes do over time, as drawn in the report."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.energy import move_powers
from fiveaxis.posture import Solution
from fiveaxis.report.time_figures import drive_powers, mean_speeds, power_lines, speed_lines


def words(svg: str) -> set[str]:
    return set(re.findall(r"<text[^>]*>([^<]*)</text>", svg))


def test_speeds_of_every_axis_have_their_unit_over_time(solution: Solution) -> None:
    units = {"X (mm/min)", "Y (mm/min)", "Z (mm/min)", "A (deg/min)", "C (deg/min)", "time (s)"}
    assert units | {"normal", "optimised"} <= words(speed_lines(solution, "normal"))


def test_powers_of_every_drive_and_of_all_have_their_unit_over_time(solution: Solution) -> None:
    units = {"X (W)", "Y (W)", "Z (W)", "A (W)", "C (W)", "all (W)", "time (s)"}
    assert units | {"normal", "optimised"} <= words(power_lines(solution, "normal"))


@pytest.mark.parametrize("draw", [speed_lines, power_lines])
def test_without_a_baseline_the_result_alone_is_drawn_over_time(solution: Solution, draw: object) -> None:
    text = words(draw(replace(solution, compared={}), None))  # type: ignore[operator]
    assert "optimised" in text
    assert "normal" not in text


def test_speed_times_time_is_the_way_of_the_axis(solution: Solution) -> None:
    motion = solution.motion
    np.testing.assert_allclose(mean_speeds(motion) * motion.time[:, None], motion.moves, atol=1e-9)


def test_the_area_under_the_last_band_is_the_power_integral(solution: Solution) -> None:
    powers = drive_powers(solution, "optimised")
    assert float(powers[-1] @ solution.motion.time) == pytest.approx(solution.energy.total)
    np.testing.assert_allclose(powers[-1], move_powers(solution.machine, solution.motion).sum(axis=1))


@pytest.mark.parametrize(("share", "dotted"), [(1.2, True), (30.0, False)])
def test_a_highest_speed_is_dotted_only_where_the_motion_comes_near_it(
    solution: Solution, share: float, dotted: bool
) -> None:
    top = np.abs(mean_speeds(solution.motion)).max(axis=0)
    axes = tuple(
        replace(a, max_speed=share * float(v)) for a, v in zip(solution.machine.axes, top, strict=True)
    )
    quick = replace(solution, machine=replace(solution.machine, axes=axes), compared={})
    assert ("#555555" in speed_lines(quick, None)) is dotted
