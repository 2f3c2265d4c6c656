"""Operations on a machine, and those that it refuses."""

import math

import numpy as np
import pytest

from fiveaxis.base.errors import CodeError, MachineError
from fiveaxis.model import Machine, Motion, axis_positions, load_machine, machine_text, tool_poses
from fiveaxis.model.machine.axes import LocationError
from fiveaxis.model.machine.chain import Line
from fiveaxis.nc.program import compose_program

IDEAL = Machine.from_code("640123")


@pytest.mark.parametrize(
    ("attempt", "error", "message"),
    [
        (lambda: Machine.from_code(640123), CodeError, "is a number; write the digits in quotes"),
        (lambda: IDEAL.with_setup((1.0, 2.0)), MachineError, "write three numbers each"),
        (lambda: IDEAL.with_setup((1.0, 2.0, math.nan)), MachineError, "finite"),
        (lambda: IDEAL.with_tool_length(-1.0), MachineError, "must be 0 or more"),
        (lambda: IDEAL.with_load(-3.0), MachineError, "mass is -3 kg; it must be 0 or more"),
        (lambda: IDEAL.holding("XY", 0.0), MachineError, "has no axis 'XY'"),
        (lambda: IDEAL.holding("B", 0.0), MachineError, "has no axis 'B'; it has X, Y, Z, A, C"),
        (lambda: IDEAL.holding("A", math.nan), MachineError, "can't be held at nan"),
        (lambda: IDEAL.axis(""), MachineError, "has no axis ''"),
        (lambda: IDEAL.with_location_errors({"B": LocationError()}), MachineError, "has no axis 'B'"),
        (
            lambda: IDEAL.with_location_errors({"C": LocationError(tilt=(0.0, 0.0, 1e-3))}),
            MachineError,
            "turns about the axis itself",
        ),
        (
            lambda: IDEAL.holding("A", 0.3).with_location_errors({"C": LocationError()}),
            MachineError,
            "before clamping",
        ),
        (lambda: machine_text(IDEAL.holding("A", 0.3)), MachineError, "has A clamped"),
        (lambda: LocationError((math.nan, 0.0, 0.0)), MachineError, "finite numbers"),
        (lambda: Line((math.inf, 0.0, 0.0)), MachineError, "isn't finite"),
        (lambda: Line((0.0, 0.0, 0.0)), MachineError, "length 0"),
        (
            lambda: axis_positions(IDEAL, [[0, 0, 0]], [[0, 0, 1]], held={"B": 0.1}),
            MachineError,
            "has no axis 'B'",
        ),
    ],
)
def test_an_impossible_request_is_refused_with_the_reason(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)


def test_a_held_axis_leaves_the_machine_of_the_others():
    machine = load_machine("linuxcnc-bridgemill").with_tool_length(60.0)
    positions = np.array([[10.0, -20.0, 30.0, 0.7, -0.4], [0.0, 5.0, 9.0, 0.7, 1.9]])
    held = machine.holding("B", 0.7)
    assert held.letters == "XYZC"
    for found, expected in zip(
        tool_poses(held, positions[:, [0, 1, 2, 4]]), tool_poses(machine, positions), strict=True
    ):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_location_errors_replace_those_before_and_their_provenance():
    machine = load_machine("linuxcnc-xyzac-trt")
    first = machine.with_location_errors({"A": LocationError((0.0, 1.0, 0.0), (0.0, 1e-3, 0.0))})
    second = first.with_location_errors({"A": LocationError((0.0, 0.0, 2.0))})
    once = machine.with_location_errors({"A": LocationError((0.0, 0.0, 2.0))})
    positions = np.array([[1.0, 2.0, 3.0, 0.4, 0.5]])
    np.testing.assert_allclose(tool_poses(second, positions)[0], tool_poses(once, positions)[0], atol=1e-12)


def test_a_length_is_left_to_the_control_only_where_it_is_along_z():
    assert load_machine("linuxcnc-xyzac-trt").length_is_along_z
    assert not load_machine("linuxcnc-max5").length_is_along_z
    assert not load_machine("linuxcnc-max5").holding("B", 0.5).length_is_along_z
    assert load_machine("linuxcnc-max5").holding("B", 0.0).length_is_along_z


def test_a_program_of_a_machine_with_a_clamped_axis_puts_it_there_first():
    machine = load_machine("linuxcnc-max5").holding("B", math.radians(30.0))
    n = 2
    motion = Motion(
        letters=machine.letters,
        positions=np.array([[0.0, 0.0, -5.0, 0.0], [1.0, 0.0, -5.0, 0.1]]),
        feed=np.full(n, 10.0),
        time=np.array([0.0, 0.1]),
        kind=np.full(n, 1),
        source=np.arange(n),
    )
    lines = compose_program(motion, machine=machine).lines
    assert any("clamped: B at -30 deg" in line for line in lines)
    rapids = [line for line in lines if line.startswith("G0")]
    # This control counts B in the opposite direction.
    assert rapids[0] == "G0 B-30.000000"
    assert "G49" in lines


def test_forward_and_inverse_are_each_others_in_every_branch():
    machine = load_machine("hayashi-640123")
    positions = np.array([[1.0, 2.0, 3.0, -0.3, 0.5], [10.0, -5.0, 20.0, 0.2, -2.0]])
    tip, axis = machine.forward(positions)
    np.testing.assert_array_equal(tip, tool_poses(machine, positions)[0])
    branches = machine.inverse(tip, axis)
    assert branches.shape == (2, *positions.shape)
    assert np.isclose(branches, positions, atol=1e-9).all(axis=-1).any(axis=0).all()
    for branch in branches:
        again = machine.forward(branch)
        np.testing.assert_allclose(again[0], tip, atol=1e-9)
        np.testing.assert_allclose(again[1], axis, atol=1e-12)


def test_inverse_holds_the_axis_whose_angle_is_arbitrary():
    up = IDEAL.inverse(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), held={"C": 0.7})
    np.testing.assert_allclose(up[:, 0, IDEAL.column("C")], 0.7)
