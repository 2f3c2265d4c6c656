"""The singular direction, and the axis that is held there."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.errors import DegenerateChain
from fiveaxis.kinematics import (
    axis_positions,
    hold_singular,
    redundant_axis,
    rotary_angles,
    singular_angles,
    singular_direction,
    tool_axes,
)
from fiveaxis.machine import Machine, load_machine

IDEAL = Machine.from_code("640123")


def test_the_singular_direction_is_the_first_rotary_axis_as_the_workpiece_sees_it():
    np.testing.assert_allclose(singular_direction(IDEAL), [0.0, 0.0, 1.0])
    turned = IDEAL.with_setup((1.0, 2.0, 3.0), (90.0, 0.0, 0.0))
    np.testing.assert_allclose(singular_direction(turned), [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(singular_direction(load_machine("linuxcnc-max5")), [0.0, 0.0, 1.0])


def test_the_angle_is_measured_to_the_nearer_end():
    tilt = np.radians([0.0, 30.0, 90.0, 150.0, 180.0])
    axis = np.column_stack([np.sin(tilt), np.zeros(5), np.cos(tilt)])
    np.testing.assert_allclose(
        np.degrees(singular_angles(IDEAL, axis)), [0.0, 30.0, 90.0, 30.0, 0.0], atol=1e-12
    )


def test_inside_the_cone_the_first_axis_keeps_its_angle():
    tilt = np.radians([20.0, 0.4, 0.2, 0.4, 20.0])
    turn = np.radians([0.0, 40.0, 100.0, 160.0, 200.0])
    axis = tool_axes(IDEAL, np.column_stack([turn, tilt]))
    rotary = rotary_angles(IDEAL, axis)
    cone = np.radians(0.5)
    held = hold_singular(rotary, axis, IDEAL, cone)
    np.testing.assert_array_equal(held[:, [0, 4]], rotary[:, [0, 4]])
    np.testing.assert_array_equal(held[:, 1:4, 0], np.repeat(rotary[:, :1, 0], 3, axis=1))
    reached = tool_axes(IDEAL, held[0])
    miss = np.arccos(np.clip(np.sum(reached * axis, axis=1), -1.0, 1.0))
    assert miss.max() < 2.0 * cone
    np.testing.assert_array_equal(hold_singular(rotary, axis, IDEAL), rotary)


def test_along_the_singular_direction_the_named_angle_is_held():
    up = np.array([[0.0, 0.0, 1.0]])
    assert axis_positions(IDEAL, np.zeros((1, 3)), up)[0, 0].tolist() == [0.0] * 5
    held = axis_positions(IDEAL, np.array([[10.0, 0.0, 0.0]]), up, held={"C": np.pi / 2.0})
    np.testing.assert_allclose(held[0, 0], [0.0, -10.0, 0.0, 0.0, np.pi / 2.0], atol=1e-12)


def test_of_three_rotary_axes_the_one_nearest_the_tool_that_can_be_spared_is_held():
    assert redundant_axis(Machine.from_code("6401235")) == "B"
    assert redundant_axis(Machine.from_code("0123546")) == "C"  # next to the tool it only spins it
    assert redundant_axis(Machine.from_code("4061235")) == "C"  # and so it would with B held


def test_three_axes_that_lean_one_way_only_are_refused():
    machine = Machine.from_code("6401235")
    joints = tuple(
        replace(j, line=replace(j.line, direction=(1.0, 0.0, 0.0))) if j.is_rotary else j
        for j in machine.chain.joints
    )
    parallel = replace(machine, chain=replace(machine.chain, joints=joints))
    with pytest.raises(DegenerateChain, match="no two of C, A, B lean the tool"):
        axis_positions(parallel, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
