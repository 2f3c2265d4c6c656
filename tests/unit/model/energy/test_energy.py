"""Energy against the paper's table and the case that ships with the data."""

import numpy as np
import pytest

from fiveaxis.base import normalise
from fiveaxis.base.errors import MachineError, SettingError
from fiveaxis.lab import power_surface
from fiveaxis.model import (
    DirectionalDrive,
    Motion,
    drive_power,
    follow,
    linear_positions,
    load_machine,
    motion_energy,
    rotary_angles,
    travel_costs,
    with_powers,
)
from fiveaxis.model.energy.totals import move_energies

DEGREE = np.pi / 180.0


def test_energy_per_travel_is_that_of_equation_1(hayashi):
    """At F1000, down/up: X 2.03/2.07, Y 4.08/3.93, Z 25.7/36.7 J/mm, A 3.44/5.09, C 1.94/1.86 J/deg."""
    plus, minus = travel_costs(hayashi, np.array([1000.0, 500.0]) / 60.0)
    shown = np.array([1, 1, 1, DEGREE, DEGREE])
    np.testing.assert_allclose(plus[0] * shown, [2.07, 3.93, 36.7, 5.09, 1.86], atol=0.05)
    np.testing.assert_allclose(minus[0] * shown, [2.03, 4.08, 25.7, 3.44, 1.94], atol=0.05)
    # At F500 the linear figures double and the rotary ones stay.
    np.testing.assert_allclose(plus[1] / plus[0], [2, 2, 2, 1, 1])


def tilted_up(toolpath, degrees):
    up = np.array([0.0, 0.0, 1.0])
    across = normalise(up - toolpath.normal * (toolpath.normal @ up)[:, None])
    return np.cos(degrees * DEGREE) * toolpath.normal + np.sin(degrees * DEGREE) * across


@pytest.mark.parametrize(
    ("tilt", "total", "by_axis"),
    [
        (15, 11306, [1254, 920, 1081, 1372, 6678]),
        (30, 12643, [1254, 872, 2466, 1372, 6678]),
        (45, 14222, [1254, 765, 4153, 1372, 6678]),
        (60, 15526, [1254, 605, 5617, 1372, 6678]),
    ],
)
def test_the_vases_printed_baselines_are_reproduced(hayashi, vase, tilt, total, by_axis):
    rotary = np.unwrap(rotary_angles(hayashi, tilted_up(vase, tilt))[1], axis=0)
    energy = motion_energy(hayashi, follow(vase, hayashi, rotary))
    assert energy.travel == pytest.approx(total, abs=0.6)
    np.testing.assert_allclose(list(energy.travel_by_axis.values()), by_axis, atol=0.6)


def line_motion(end, time, feed=1000.0 / 60.0):
    n = 2
    return Motion(
        letters="XYZAC",
        positions=np.array([np.zeros(5), end]),
        feed=np.full(n, feed),
        time=np.array([0.0, time]),
        kind=np.zeros(n, dtype=np.int64),
        source=np.arange(n),
    )


def test_up_costs_more_than_down(hayashi):
    up = move_energies(hayashi, line_motion([0, 0, 1, 0, 0], 0.06))
    down = move_energies(hayashi, line_motion([0, 0, -1, 0, 0], 0.06))
    np.testing.assert_allclose(up[1], [0, 0, 612.1 * 0.06, 0, 0])
    np.testing.assert_allclose(down[1], [0, 0, 427.8 * 0.06, 0, 0])


def test_metric_and_integral_agree_on_a_move_of_one_axis_and_differ_on_two(hayashi):
    one = motion_energy(hayashi, line_motion([60.0, 0, 0, 0, 0], 3.6))
    assert one.total == pytest.approx(one.travel) == pytest.approx(34.55 * 3.6)
    # 30 mm of Z beside 60 mm of X: at a constant power the integral pays Z for the whole move.
    two = motion_energy(hayashi, line_motion([60.0, 0, 30.0, 0, 0], 3.6))
    assert two.travel == pytest.approx(34.55 * 3.6 + 612.1 * 1.8)
    assert two.total == two.most == pytest.approx((34.55 + 612.1) * 3.6)
    # With 0.5 mm Z goes at 8.3 mm/min, and none slower than 250 was measured.
    two = motion_energy(hayashi, line_motion([60.0, 0, 0.5, 0, 0], 3.6))
    assert two.total == pytest.approx(34.55 * 3.6 + 612.1 * 0.5 / (250.0 / 60.0))
    assert two.most == pytest.approx((34.55 + 612.1) * 3.6)
    assert two.band == "up to 2328 J if drives took their whole power below the slowest measured speed, too"
    assert two.base is None
    assert two.with_base is None


def test_power_of_a_proportional_drive_grows_with_its_speed():
    drive = DirectionalDrive(3.0, 2.0, proportional=True)
    np.testing.assert_allclose(drive_power(drive, np.array([2.0, -2.0, 0.0])), [6.0, 4.0, 0.0])
    np.testing.assert_allclose(drive_power(DirectionalDrive(3.0, 2.0), np.array([2.0, -2.0, 0.0])), [3, 2, 0])


def test_the_power_surface_is_the_sum_over_the_axes_of_equation_5(hayashi):
    tip = np.array([20.0, -7.0, 31.0])
    c, a = np.radians([0.0, 40.0, 200.0]), np.radians([-60.0, 0.0, 20.0])
    surface = power_surface(hayashi, tip, 1000.0, (c, a))
    assert surface.letters == ("C", "A")
    assert surface.total.shape == (3, 3)
    plus, minus = {"X": 34.55, "Y": 65.57, "Z": 612.1}, {"X": 33.87, "Y": 68.07, "Z": 427.8}
    for i, j in np.ndindex(3, 3):
        xyz = linear_positions(hayashi, tip, np.array([c[i], a[j]]))[:3]
        linear = sum(abs(v) * 0.06 * (plus if v > 0 else minus)[k] for k, v in zip("XYZ", xyz, strict=True))
        rotary = np.degrees(c[i]) * 60 * 3.093e-2 + abs(np.degrees(a[j])) * 60 * (
            8.483e-2 if a[j] > 0 else 5.736e-2
        )
        assert surface.linear[i, j] == pytest.approx(linear)
        assert surface.rotary[i, j] == pytest.approx(rotary)


def test_the_surface_over_a_path_is_that_of_its_locations(hayashi):
    tips = np.array([[20.0, -7.0, 31.0], [1.0, 2.0, 3.0]])
    grid = (np.radians([0.0, 90.0]), np.radians([-30.0, 0.0, 30.0]))
    path = power_surface(hayashi, tips, 1000.0, grid)
    assert path.linear.shape == (2, 2, 3)
    np.testing.assert_array_equal(path.total[1], power_surface(hayashi, tips[1], 1000.0, grid).total)


def test_a_machine_without_powers_says_what_to_do(trunnion):
    with pytest.raises(MachineError, match=r"no power for axis X, Y, Z, A, C; add \[axes.X.drive\]"):
        travel_costs(trunnion, np.array([1.0]))


@pytest.mark.parametrize("feed", [0.0, -1.0, np.inf, np.nan])
def test_a_surface_needs_a_feed_and_a_place(hayashi, feed):
    with pytest.raises(SettingError, match="must be a positive number"):
        power_surface(hayashi, np.zeros(3), feed, ([0.0], [0.0]))
    with pytest.raises(SettingError, match="isn't finite"):
        power_surface(hayashi, [0.0, np.nan, 0.0], 1000.0, ([0.0], [0.0]))


def test_a_turn_against_gravity_costs_the_same_in_one_block_and_in_many():
    machine = with_powers(load_machine("umc-750")).with_load(100.0, (80.0, 0.0, 120.0))

    def energy(blocks: int) -> float:
        positions = np.zeros((blocks + 1, 5))
        positions[:, machine.column("B")] = np.radians(np.linspace(-5.0, 45.0, blocks + 1))
        time, still = np.append(0.0, np.full(blocks, 20.0 / blocks)), np.zeros(blocks + 1, dtype=np.int64)
        return motion_energy(
            machine, Motion(machine.letters, positions, np.ones(blocks + 1), time, still, still)
        ).total

    assert energy(1) == pytest.approx(energy(200), rel=1e-4)
