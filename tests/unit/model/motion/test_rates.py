"""Peak speeds and accelerations of the rotary axes."""

import numpy as np
import pytest

from fiveaxis.model import Motion, MoveKind, axis_uses, load_machine, peak_rates


def motion(c, time, kind=None):
    n = len(c)
    positions = np.zeros((n, 5))
    positions[:, 4] = np.radians(c)
    kinds = np.full(n, MoveKind.CUT) if kind is None else np.array(kind)
    return Motion("XYZAC", positions, np.ones(n), np.array(time, dtype=float), kinds, np.arange(1, n + 1))


def test_the_peaks_are_those_of_the_moves():
    rates = peak_rates(load_machine("hayashi-640123"), motion([0, 2, 6, 6, 5], [0, 1, 1, 0.5, 1]))
    assert np.degrees(rates["C"].speed) == pytest.approx(4.0)
    assert rates["C"].fastest == 2
    # From 4 deg/s to a standstill within the mean of 1 s and 0.5 s.
    assert np.degrees(rates["C"].acceleration) == pytest.approx(4.0 / 0.75)
    assert rates["C"].most_sudden == 3
    assert (rates["A"].speed, rates["A"].fastest, rates["A"].most_sudden) == (0.0, None, None)


def test_links_have_a_speed_but_no_acceleration():
    kinds = [MoveKind.CUT, MoveKind.LINK, MoveKind.CUT]
    rates = peak_rates(load_machine("hayashi-640123"), motion([0, 90, 90], [0, 1, 1], kinds))
    assert np.degrees(rates["C"].speed) == pytest.approx(90.0)
    assert rates["C"].acceleration == 0.0


def test_travel_and_the_margin_to_the_nearest_limit_are_told_by_axis():
    machine = load_machine("hayashi-640123")
    there = motion([0, 2, 6, 6, 5], [0, 1, 1, 0.5, 1])
    uses = axis_uses(machine, there)
    positions = machine.shown(there.positions)
    for k, axis in enumerate(machine.axes):
        ends = axis.shown(axis.limits.low), axis.shown(axis.limits.high)
        least = min(positions[:, k].min() - ends[0], ends[1] - positions[:, k].max())
        assert uses[axis.letter]["margin"] == pytest.approx(least)
        assert uses[axis.letter]["travel"] == pytest.approx(np.abs(np.diff(positions[:, k])).sum())
    assert {letter: use["unit"] for letter, use in uses.items()}["C"] == "deg"
    # The program also goes where the path doesn't: its travel is the path's, its margin the program's.
    beyond, a = there.positions.copy(), machine.column("A")
    beyond[0, a] = machine.low[a] + np.radians(0.125)
    far = axis_uses(machine, there, beyond)
    assert far["A"]["margin"] == pytest.approx(0.125)
    assert far["C"]["travel"] == uses["C"]["travel"]
