import re
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import TiltBounds, move_powers
from fiveaxis.posture import Optimum
from fiveaxis.show.report.figures import (
    axis_lines,
    drive_powers,
    energy_bars,
    power_lines,
    speed_lines,
    spending_lines,
    tilts_shown,
)


def words(svg: str) -> list[str]:
    """Return the pieces of text in a figure."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


def test_every_bar_is_labelled_with_the_energy_of_its_axis(solution: Optimum) -> None:
    text = words(energy_bars(solution, "normal"))
    for energy in (solution.energy, solution.baselines["normal"]):
        for joules in energy.by_axis.values():
            assert f"{joules:,.0f}".replace(",", "\u2009") in text
    assert {"X", "Y", "Z", "A", "C", "energy (J)", "machine axis", "normal", "optimised"} <= set(text)


def test_returned_energy_has_a_true_minus_sign(solution: Optimum) -> None:
    energy = replace(solution.energy, by_axis=solution.energy.by_axis | {"Z": -1234.0})
    text = words(energy_bars(replace(solution, energy=energy), "normal"))
    assert "\u22121\u2009234" in text


def test_every_axis_has_its_unit_and_both_lines_a_name(solution: Optimum) -> None:
    text = words(axis_lines(solution, "normal"))
    assert {"X (mm)", "Y (mm)", "Z (mm)", "A (deg)", "C (deg)", "tilt (deg)"} <= set(text)
    assert {"normal", "optimised", "location along the path (row, from 0)"} <= set(text)


def test_the_energy_along_the_path_has_its_unit(solution: Optimum) -> None:
    assert {"energy so far (J)", "normal", "optimised"} <= set(words(spending_lines(solution, "normal")))


@pytest.mark.parametrize("draw", [energy_bars, axis_lines, spending_lines, speed_lines, power_lines])
def test_without_a_baseline_the_result_is_drawn_alone(solution: Optimum, draw: object) -> None:
    text = words(draw(replace(solution, compared={}), None))  # type: ignore[operator]
    assert "optimised" in text
    assert "normal" not in text


@pytest.mark.parametrize("draw", [energy_bars, axis_lines, spending_lines])
def test_a_chart_carries_no_date_and_no_link(solution: Optimum, draw: object) -> None:
    svg = draw(solution, "normal")  # type: ignore[operator]
    assert "http" not in svg
    assert "metadata" not in svg
    assert re.search(r"\b20\d\d-\d\d", svg) is None


def test_the_tilt_drawn_is_the_tilt_that_was_chosen(solution: Optimum) -> None:
    np.testing.assert_allclose(tilts_shown(solution, "optimised"), 15.0, atol=1e-9)
    np.testing.assert_allclose(tilts_shown(solution, "normal"), 45.0, atol=1e-9)


def test_a_baseline_with_locations_of_its_own_is_drawn_over_the_same_width(solution: Optimum) -> None:
    normal, few = solution.compared["normal"], np.arange(0, len(solution.toolpath), 4)
    own = replace(normal, motion=normal.motion.at(few), toolpath=solution.toolpath.at(few))
    other = replace(solution, compared={"normal": own})
    np.testing.assert_allclose(tilts_shown(other, "normal"), 45.0, atol=1e-9)
    for draw in (axis_lines, spending_lines):
        ends = [
            re.findall(r"[ML]([\d.]+)", line)[-1]
            for line in re.findall(r' d="(M[^"]+)"', draw(other, "normal"))
        ]
        assert ends[-1] == ends[-2]


def test_a_path_with_links_is_drawn(solution: Optimum) -> None:
    reference = solution.tilt.reference.copy()
    reference[100:120] = np.nan
    bounds = TiltBounds(reference, solution.tilt.low, solution.tilt.high, "normal")
    linked = replace(solution, tilt=bounds)
    assert np.isnan(tilts_shown(linked, "optimised")).sum() == 20
    assert "tilt (deg)" in words(axis_lines(linked, "normal"))


def test_speeds_of_every_axis_have_their_unit_over_time(solution: Optimum) -> None:
    units = {"X (mm/min)", "Y (mm/min)", "Z (mm/min)", "A (deg/min)", "C (deg/min)", "time (s)"}
    assert units | {"normal", "optimised"} <= set(words(speed_lines(solution, "normal")))


def test_powers_of_every_drive_and_of_all_have_their_unit_over_time(solution: Optimum) -> None:
    units = {"X (W)", "Y (W)", "Z (W)", "A (W)", "C (W)", "all (W)", "time (s)"}
    assert units | {"normal", "optimised"} <= set(words(power_lines(solution, "normal")))


def test_speed_times_time_is_the_travel_of_the_axis(solution: Optimum) -> None:
    motion = solution.motion
    np.testing.assert_allclose(motion.speeds * motion.time[:, None], motion.moves, atol=1e-9)


def test_the_area_under_the_last_band_is_the_power_integral(solution: Optimum) -> None:
    powers = drive_powers(solution, "optimised")
    assert float(powers[-1] @ solution.motion.time) == pytest.approx(solution.energy.total)
    np.testing.assert_allclose(powers[-1], move_powers(solution.machine, solution.motion).sum(axis=1))


@pytest.mark.parametrize(("share", "dotted"), [(1.2, True), (30.0, False)])
def test_a_highest_speed_is_dotted_only_where_the_motion_comes_near_it(
    solution: Optimum, share: float, dotted: bool
) -> None:
    top = np.abs(solution.motion.speeds).max(axis=0)
    axes = tuple(
        replace(a, max_speed=share * float(v)) for a, v in zip(solution.machine.axes, top, strict=True)
    )
    quick = replace(solution, machine=replace(solution.machine, axes=axes), compared={})
    assert ("#555555" in speed_lines(quick, None)) is dotted
