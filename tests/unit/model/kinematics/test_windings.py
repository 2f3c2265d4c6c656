"""Branches and turns inside the limits."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import Limits, Machine, axis_positions, tool_poses, within_limits
from fiveaxis.model.kinematics.windings import nearest_turn, reachable_positions

RNG = np.random.default_rng(2)
TURN = 2.0 * np.pi


def with_limits(code: str, **limits: Limits) -> Machine:
    machine = Machine.from_code(code)
    return replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, a.limits)) for a in machine.axes)
    )


def rows(found: np.ndarray) -> list[tuple[float, ...]]:
    """The postures of the only location, rounded, without the missing ones."""
    return sorted(tuple(np.round(row, 7) + 0.0) for row in found[:, 0] if np.isfinite(row).all())


def test_every_turn_inside_the_limits_is_found_and_no_other():
    """Against brute force: every branch shifted by every pair of turns, then checked against the limits."""
    machine = with_limits(
        "640123", A=Limits(-2.0, 5.0), C=Limits(-7.0, 13.5), X=Limits(-60.0, 80.0), Z=Limits(-90.0, 90.0)
    )
    counts = set()
    for _ in range(40):
        position = RNG.uniform(-1.0, 1.0, (1, 5)) * [50.0, 50.0, 50.0, 2.0, 3.0]
        tip, axis = tool_poses(machine, position)
        branches = axis_positions(machine, tip, axis)
        shifts = [[0.0, 0.0, 0.0, TURN * a, TURN * c] for a in range(-4, 5) for c in range(-4, 5)]
        every = (branches[:, None] + np.array(shifts)[None, :, None]).reshape(-1, 1, 5)
        expected = rows(every[within_limits(machine, every)[:, 0]])
        found = rows(reachable_positions(machine, tip, axis))
        assert found == expected
        counts.add(len(found))
    assert len(counts) > 3


def test_an_axis_without_end_gives_one_turn():
    machine = with_limits("640123", A=Limits(-2.1, 0.5))
    tip, axis = tool_poses(machine, np.array([[1.0, 2.0, 3.0, -0.4, 50.0]]))
    found = reachable_positions(machine, tip, axis)
    assert len(found) == 2
    assert (np.abs(found[..., 4]) <= np.pi).all()


def test_near_a_posture_the_turn_next_to_it_is_taken():
    wanted = np.array([14.0, -19.5])
    for near in (wanted + 0.3, wanted - 0.3):
        found = nearest_turn(np.remainder(wanted, TURN), near, -20.0, 20.0)
        assert found == pytest.approx(wanted, abs=1e-9)


def test_a_location_beyond_the_limits_has_no_posture():
    machine = with_limits("640123", A=Limits(-0.3, 0.3))
    tip, axis = tool_poses(machine, np.array([[0.0, 0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.2, 0.0]]))
    found = reachable_positions(machine, tip, axis)
    assert np.isnan(found[:, 0]).all()
    assert np.isfinite(found[:, 1]).all(axis=1).sum() == 2


def test_without_rotary_axes_there_is_one_posture():
    tip = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    found = reachable_positions(Machine.from_code("0123"), tip, np.tile([0.0, 0.0, 1.0], (2, 1)))
    np.testing.assert_allclose(found, [tip], atol=1e-12)


def test_a_half_open_axis_takes_the_turn_next_to_its_end():
    machine = with_limits("640123", C=Limits(low=10.0))
    tip, axis = tool_poses(machine, np.array([[0.0, 0.0, 0.0, 0.5, 0.1]]))
    found = reachable_positions(machine, tip, axis)
    assert ((found[..., 4] >= 10.0) & (found[..., 4] < 10.0 + TURN)).all()


def test_a_posture_many_turns_away_takes_the_last_turn_inside_the_limits():
    for far, expected in ((1000.0, 0.1 + 6.0 * TURN), (-1000.0, 0.1 - 6.0 * TURN)):
        assert nearest_turn(np.array(0.1), np.array(far), -40.0, 40.0) == pytest.approx(expected, abs=1e-9)
