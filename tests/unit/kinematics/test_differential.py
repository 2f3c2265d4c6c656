"""Derivatives against finite differences and pinocchio, conditions against closed forms."""

import numpy as np
import pinocchio
import pytest

from fiveaxis.kinematics import jacobian, tool_poses
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
