"""The singular direction, the axis that is held there, and leans against a sweep of the second axis."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import DegenerateChain
from fiveaxis.model import (
    Limits,
    Machine,
    axis_positions,
    hold_singular,
    lean_range,
    load_machine,
    machine_names,
    rotary_angles,
    singular_angles,
    singular_direction,
    tool_axes,
)
from fiveaxis.model.kinematics.inverse import redundant_axis
from fiveaxis.model.kinematics.windings import reachable_positions
from fiveaxis.model.machine.chain import Chain, Line

IDEAL = Machine.from_code("640123")
RNG = np.random.default_rng(12)
FIVE_AXIS = [n for n in machine_names() if len(load_machine(n).rotaries) == 2]


def test_the_singular_direction_is_the_first_rotary_axis_in_the_workpiece_frame():
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


def test_lists_of_tool_axes_are_solved_as_each_of_them_alone():
    tilt, turn = np.radians([[20.0, 0.2, 0.4], [0.3, 0.2, 30.0]]), RNG.uniform(-3.0, 3.0, (2, 3))
    axes = tool_axes(IDEAL, np.stack([turn, tilt], axis=-1))
    cone = np.radians(0.5)
    together = hold_singular(rotary_angles(IDEAL, axes), axes, IDEAL, cone)
    alone = [hold_singular(rotary_angles(IDEAL, axis), axis, IDEAL, cone) for axis in axes]
    np.testing.assert_array_equal(together, np.stack(alone, axis=1))


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


def test_three_axes_that_lean_in_one_direction_only_are_refused():
    machine = Machine.from_code("6401235")
    joints = tuple(
        replace(j, line=replace(j.line, direction=(1.0, 0.0, 0.0))) if j.is_rotary else j
        for j in machine.chain.joints
    )
    parallel = replace(machine, chain=replace(machine.chain, joints=joints))
    with pytest.raises(DegenerateChain, match="no two of C, A, B lean the tool"):
        axis_positions(parallel, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def leans(machine: Machine, second: np.ndarray) -> np.ndarray:
    rotary = np.column_stack([np.zeros_like(second), second])
    return np.arccos(np.clip(tool_axes(machine, rotary) @ singular_direction(machine), -1.0, 1.0))


def limited(machine: Machine, low: float, high: float) -> Machine:
    """Limit the second rotary axis, and no other."""
    limits = {machine.rotaries[1]: Limits(low, high)}
    return replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, Limits())) for a in machine.axes)
    )


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_the_lean_within_limits_is_what_a_sweep_finds(name):
    machine = load_machine(name)
    for low, width in zip(RNG.uniform(-7.0, 7.0, 30), RNG.uniform(0.1, 7.0, 30), strict=True):
        within = limited(machine, low, low + width)
        swept = leans(within, np.linspace(low, low + width, 2001))
        found = lean_range(within)
        np.testing.assert_allclose(found.limited, (swept.min(), swept.max()), atol=5e-3)
        assert found.unlimited[0] <= found.limited[0] + 1e-12
        assert found.limited[1] <= found.unlimited[1] + 1e-12


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_where_both_branches_are_within_limits_is_what_the_inverse_finds(name):
    machine, seen = load_machine(name), set()
    for low, width in zip(RNG.uniform(-4.0, 1.0, 30), RNG.uniform(0.5, 6.0, 30), strict=True):
        within = limited(machine, low, low + width)
        both = lean_range(within).both
        second = np.linspace(low, low + width, 60)
        axis = tool_axes(within, np.column_stack([np.zeros_like(second), second]))
        found = reachable_positions(within, np.zeros_like(axis), axis)
        column = within.column(within.rotaries[1])
        for lean, angles in zip(leans(within, second), found[..., column].T, strict=True):
            different = len(np.unique(np.round(np.mod(angles[np.isfinite(angles)], 2.0 * np.pi), 6)))
            if all(abs(lean - end) > 0.02 for ends in both for end in ends):
                assert (different == 2) == any(least < lean < most for least, most in both)
                seen.add(len(both))
    assert {0, 1} <= seen


def test_a_nutating_table_at_45_degrees_leans_up_to_90():
    code = Machine.from_code("650123")
    machine = replace(code, chain=Chain.from_code(code.code, {"B": Line((0.0, 1.0, 1.0))}))
    found = lean_range(machine)
    np.testing.assert_allclose(np.degrees(found.unlimited), (0.0, 90.0), atol=1e-5)
