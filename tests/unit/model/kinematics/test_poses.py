"""Poses of tools and positions of axes at the edges of what a machine reaches."""

import numpy as np
import pytest

from fiveaxis.base.errors import DegenerateChain, MachineError, ToolpathError
from fiveaxis.model import Machine, axis_positions, linear_positions, rotary_angles, tool_poses


@pytest.fixture(scope="module")
def ideal() -> Machine:
    return Machine.from_code("640123")


def test_near_the_singular_direction_the_pose_keeps_its_digits(ideal):
    tilts = 10.0 ** np.linspace(-11, -1, 60)
    positions = np.column_stack([np.ones((60, 3)), tilts, np.full(60, 0.7)])
    tip, axis = tool_poses(ideal, positions)
    for branch in axis_positions(ideal, tip, axis):
        np.testing.assert_allclose(tool_poses(ideal, branch)[1], axis, atol=1e-13)


def test_a_tool_axis_out_of_reach_is_nan_in_every_branch():
    # A nutating table: 45° about (0,1,1), then C at the table can't lean the tool beyond 90°.
    from fiveaxis.model import Axis
    from fiveaxis.model.machine.chain import Chain, Line
    from fiveaxis.model.machine.code import parse_code

    code = parse_code("650123")
    chain = Chain.from_code(code, {"B": Line((0.0, 1.0, 1.0))})
    machine = Machine("nutating", code, chain, tuple(Axis(c) for c in "XYZBC"))
    down, level = np.array([[0.0, 0.0, -1.0]]), np.array([[1.0, 0.0, 0.0]])
    assert np.isnan(rotary_angles(machine, down)).all()
    assert np.isfinite(rotary_angles(machine, level)).all()


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("401236", "C, the rotary axis next to the tool, only spins the tool"),
        ("6402", "write all of 1, 2, 3 into the code"),
    ],
)
def test_a_chain_without_enough_freedom_is_refused_with_the_reason(code, said):
    machine = Machine.from_code(code)
    with pytest.raises(DegenerateChain, match=said):
        axis_positions(machine, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


@pytest.mark.parametrize(
    ("tip", "axis", "said"),
    [
        ([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.1]], "isn't a unit vector"),
        ([[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]], "isn't a unit vector"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], "rows of three"),
        ([[0.0, 0.0]], [[0.0, 0.0, 1.0]], "rows of three"),
    ],
)
def test_an_invalid_pose_is_refused(ideal, tip, axis, said):
    with pytest.raises(ToolpathError, match=said):
        axis_positions(ideal, tip, axis)


def test_a_nan_row_has_no_posture_and_leaves_the_others_alone(ideal):
    axis = np.array([[0.0, 0.6, 0.8], [np.nan] * 3, [0.0, 0.6, 0.8]])
    found = axis_positions(ideal, np.zeros((3, 3)), axis)
    assert np.isnan(found[:, 1]).all()
    np.testing.assert_array_equal(found[:, 0], found[:, 2])


def test_lists_are_accepted_like_arrays(ideal):
    tip, axis = tool_poses(ideal, [[1, 2, 3, 0, 0]])
    assert tip.tolist() == [[1.0, 2.0, 3.0]]
    assert axis_positions(ideal, tip.tolist(), axis.tolist()).shape == (2, 1, 5)
    assert linear_positions(ideal, [[1, 2, 3]], [[0, 0]])[0].tolist() == [1.0, 2.0, 3.0, 0.0, 0.0]
    with pytest.raises(MachineError, match="has 5 axes, columns X Y Z A C"):
        tool_poses(ideal, [[1, 2, 3, 0]])
