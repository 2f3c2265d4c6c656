"""Derivatives against finite differences and pinocchio, conditions against closed forms."""

import numpy as np
import pinocchio
import pytest

from fiveaxis.kinematics import jacobian, orientation_condition, positioning_condition, tool_poses
from fiveaxis.machine import Machine, load_machine
from fiveaxis.verification import build_model

RNG = np.random.default_rng(1)
NAMES = ["linuxcnc-xyzac-trt", "dmu50ev", "linuxcnc-bridgemill", "linuxcnc-max5"]


def machine_of(name: str) -> Machine:
    return load_machine(name).with_setup((10.0, -4.0, 30.0), (5.0, 10.0, -40.0)).with_tool_length(60.0)


def random_positions(n: int) -> np.ndarray:
    return RNG.uniform(-1.0, 1.0, (n, 5)) * [100.0, 100.0, 100.0, 1.3, 1.3]


@pytest.mark.parametrize("name", NAMES)
def test_the_jacobian_is_that_of_finite_differences(name):
    machine, positions, h = machine_of(name), random_positions(10), 1e-6
    found = jacobian(machine, positions)
    for column, step in enumerate(h * np.eye(5)):
        ends = [tool_poses(machine, positions + sign * step) for sign in (1.0, -1.0)]
        for part, plus, minus in zip((found.tip, found.axis), *ends, strict=True):
            np.testing.assert_allclose(part[:, :, column], (plus - minus) / (2.0 * h), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_the_jacobian_of_the_tip_is_pinocchios(name):
    machine, positions = machine_of(name), random_positions(5)
    built = build_model(machine)
    data = built.model.createData()
    for row, expected in zip(positions, jacobian(machine, positions).tip, strict=True):
        found = pinocchio.computeFrameJacobian(
            built.model, data, row[built.columns], built.tool, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        np.testing.assert_allclose(found[:3], expected[:, built.columns], atol=1e-10)


def test_the_orientation_condition_of_a_c_a_table_is_one_over_sine_a():
    a = np.array([0.01, 0.3, 1.0, np.pi / 2.0, -1.2])
    positions = np.column_stack([np.ones((5, 3)), a, np.full(5, 2.0)])
    found = orientation_condition(Machine.from_code("640123"), positions)
    np.testing.assert_allclose(found, 1.0 / np.abs(np.sin(a)), rtol=1e-12)


def test_at_the_singular_direction_the_condition_is_infinite():
    assert np.isinf(orientation_condition(Machine.from_code("640123"), np.zeros((1, 5)))).all()
    assert np.isinf(orientation_condition(Machine.from_code("40123"), np.ones((1, 4)))).all()


def test_linear_axes_that_stand_together_are_always_well_conditioned():
    np.testing.assert_allclose(positioning_condition(Machine.from_code("640123"), random_positions(20)), 1.0)


def test_a_rotary_axis_between_linear_ones_turns_them_into_one_plane():
    """Y, A, X, Z: at A = 90° both Y and Z move the tool along y."""
    machine = Machine.from_code("2413" + "05")
    upright = np.array([[0.0, 0.0, 0.0, 0.0, 0.3]])
    lying = np.array([[0.0, 0.0, 0.0, np.pi / 2.0, 0.3]])
    np.testing.assert_allclose(positioning_condition(machine, upright), 1.0)
    assert positioning_condition(machine, lying)[0] > 1e15
