"""Forward kinematics of a machine's URDF with SciPy rotations, which verify where pinocchio isn't installed.

They share no equation with `fiveaxis.model.kinematics`: all that both know of a machine is its description.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from fiveaxis.base import Array, product
from fiveaxis.model import Machine

METRE = 1000.0  # mm


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint with the link that it carries.

    Parameters
    ----------
    name, kind, parent, child : as in the file
    home : (4, 4), mm, of the child's frame in the parent's, with the joint at 0
    axis : (3,), unit vector, child's frame
    """

    name: str
    kind: str
    parent: str
    child: str
    home: Array
    axis: Array


# One machine is asked many times, and its URDF takes longer than a hundred poses.
@lru_cache(maxsize=8)
def read_joints(machine: Machine) -> tuple[UrdfJoint, ...]:
    """Read the joints of the URDF that `Machine.to_urdf` writes, each after the one that carries it."""
    return tuple(_joint(element) for element in ElementTree.fromstring(machine.to_urdf()).iterfind("joint"))


def _joint(element: ElementTree.Element) -> UrdfJoint:
    parent, child = (element.find(end).get("link") for end in ("parent", "child"))  # type: ignore[union-attr]
    home = np.eye(4)
    # About the parent's x, then its y, then its z.
    home[:3, :3] = Rotation.from_euler("xyz", _triple(element, "origin", "rpy", "0 0 0")).as_matrix()
    home[:3, 3] = METRE * _triple(element, "origin", "xyz", "0 0 0")
    axis = _triple(element, "axis", "xyz", "1 0 0")
    return UrdfJoint(element.get("name", ""), element.get("type", ""), str(parent), str(child), home, axis)


def _triple(element: ElementTree.Element, tag: str, key: str, default: str) -> Array:
    found = element.find(tag)
    return np.array((default if found is None else found.get(key, default)).split(), dtype=float)


def frames_of(machine: Machine, positions: Array) -> dict[str, Array]:
    """Compute the frame of every link of a machine's URDF in the workpiece frame, (n, 4, 4) mm.

    The positions, (n, k) mm and rad, have columns in the order of `machine.axes`.
    """
    joints, values = read_joints(machine), dict(zip(machine.letters, positions.T, strict=True))
    at = {joints[0].parent: np.tile(np.eye(4), (len(positions), 1, 1))}
    for joint in joints:
        moved = np.tile(np.eye(4), (len(positions), 1, 1))
        if joint.kind == "prismatic":
            moved[:, :3, 3] = values[joint.name][:, None] * joint.axis
        elif joint.kind == "revolute":
            moved[:, :3, :3] = Rotation.from_rotvec(values[joint.name][:, None] * joint.axis).as_matrix()
        at[joint.child] = product(at[joint.parent], joint.home, moved)
    return at
