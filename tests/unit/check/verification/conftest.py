"""A correct motion to plant faults in."""

import numpy as np
import pytest

from fiveaxis.base import normalise
from fiveaxis.model import Machine, Motion, Tool, Toolpath, follow, rotary_angles

TILT = np.radians(30.0)
BRANCH = 1


def lean_up(normals: np.ndarray, angle: float) -> np.ndarray:
    """Turn normals towards +z."""
    up = np.array([0.0, 0.0, 1.0])
    across = normalise(up - (normals @ up)[:, None] * normals)
    return normals * np.cos(angle) + across * np.sin(angle)


def motion_along(path: Toolpath, machine: Machine, angle: float = TILT) -> Motion:
    rotary = rotary_angles(machine, lean_up(path.normal, angle))[BRANCH]
    return follow(path, machine, np.unwrap(rotary, axis=0))


@pytest.fixture(scope="session")
def ring() -> Toolpath:
    """One turn around an overhanging cone: 240 contacts, 40 mm off the axis, normals 20 deg below level."""
    angle = np.linspace(0.0, 2.0 * np.pi, 240)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    down = np.radians(20.0)
    normals = np.cos(down) * around - np.sin(down) * np.array([0.0, 0.0, 1.0])
    return Toolpath.from_contacts(40.0 * around, normals, Tool.ball(10.0), name="ring")


@pytest.fixture(scope="session")
def good(ring, hayashi) -> Motion:
    return motion_along(ring, hayashi)
