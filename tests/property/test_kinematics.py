"""Laws that hold for every five-axis code."""

import itertools

import numpy as np
import pytest

from fiveaxis.kinematics import axis_positions, tool_poses
from fiveaxis.machine import Machine

ROTARIES = [("C", "A"), ("C", "B"), ("A", "B"), ("B", "A")]
DIGIT = {"A": "4", "B": "5", "C": "6"}
RNG = np.random.default_rng(3)


def orientable_codes() -> list[str]:
    """Every arrangement of X, Y, Z and two rotaries, the bed in the middle of the chain.

    Where the bed stands decides what carries what, not how the tool moves relative to the workpiece.
    """
    found = []
    for first, second in ROTARIES:
        for order in itertools.permutations("123" + DIGIT[first] + DIGIT[second]):
            if order.index(DIGIT[first]) < order.index(DIGIT[second]):
                found.append("".join(order[:2]) + "0" + "".join(order[2:]))
    return found


def test_there_are_as_many_codes_as_arrangements():
    assert len(orientable_codes()) == len(set(orientable_codes())) == 4 * 60


@pytest.mark.parametrize("code", orientable_codes())
def test_forward_after_inverse_is_the_identity(code):
    machine = Machine.from_code(code)
    # Away from the angles at which linear axes that a rotary axis separates fall into one plane.
    positions = RNG.uniform(-1, 1, (20, 5)) * [50, 50, 50, 1.2, 1.2]
    tip, axis = tool_poses(machine, positions)
    branches = axis_positions(machine, tip, axis)
    nearest = np.abs(branches - positions).max(axis=2).min(axis=0)
    assert nearest.max() < 1e-9
    for branch in branches:
        reached_tip, reached_axis = tool_poses(machine, branch)
        np.testing.assert_allclose(reached_tip, tip, atol=1e-9)
        np.testing.assert_allclose(reached_axis, axis, atol=1e-9)


@pytest.mark.parametrize("bed", range(6))
def test_the_bed_changes_nothing_in_the_kinematics(bed):
    letters = "64123"
    machine = Machine.from_code(letters[:bed] + "0" + letters[bed:])
    positions = RNG.uniform(-1, 1, (5, 5))
    reference = tool_poses(Machine.from_code("640123"), positions)
    np.testing.assert_array_equal(tool_poses(machine, positions), reference)
