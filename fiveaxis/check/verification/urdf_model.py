"""Forward kinematics of a machine's URDF with unit quaternions, which verify where pinocchio isn't installed.

They share no equation with `fiveaxis.model.kinematics`: all that both know of a machine is its description.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from fiveaxis.base import Array

METRE = 1000.0  # mm


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint with the link that it carries.

    Parameters
    ----------
    name, kind, parent, child : as in the file
    offset : (3,), mm, of the child's origin in the parent
    turn : (4,), unit quaternion (w, x, y, z), of the child's frame in the parent's
    axis : (3,), unit vector, child's frame
    """

    name: str
    kind: str
    parent: str
    child: str
    offset: Array
    turn: Array
    axis: Array


def read_joints(text: str) -> tuple[UrdfJoint, ...]:
    """Read the joints of a URDF that `Machine.to_urdf` has written, each after the one that carries it."""
    return tuple(_joint(element) for element in ElementTree.fromstring(text).iterfind("joint"))


def _joint(element: ElementTree.Element) -> UrdfJoint:
    parent, child = (element.find(end).get("link") for end in ("parent", "child"))  # type: ignore[union-attr]
    xyz, rpy = (_triple(element, "origin", key, "0 0 0") for key in ("xyz", "rpy"))
    # About the parent's x, then its y, then its z.
    roll, pitch, yaw = (turn_about(np.eye(3)[i], rpy[i : i + 1])[0] for i in range(3))
    return UrdfJoint(
        name=element.get("name", ""),
        kind=element.get("type", ""),
        parent=str(parent),
        child=str(child),
        offset=METRE * xyz,
        turn=quaternion_product(yaw, quaternion_product(pitch, roll)),
        axis=_triple(element, "axis", "xyz", "1 0 0"),
    )


def _triple(element: ElementTree.Element, tag: str, key: str, default: str) -> Array:
    found = element.find(tag)
    return np.array((default if found is None else found.get(key, default)).split(), dtype=float)


def quaternion_product(p: Array, q: Array) -> Array:
    """Multiply unit quaternions, (..., 4) each: the turn q, then p."""
    w = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    xyz = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([w, xyz], axis=-1)


def turn_about(axis: Array, angle: Array) -> Array:
    """Return the quaternions, (n, 4), of turns about a unit vector by angles, (n,) rad."""
    half = angle[:, None] / 2.0
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=1)


def turn_vector(q: Array, v: Array) -> Array:
    """Turn a vector, (3,), by unit quaternions, (n, 4)."""
    twice = 2.0 * np.cross(q[:, 1:], v)
    return v + q[:, :1] * twice + np.cross(q[:, 1:], twice)


def frames_of(joints: Sequence[UrdfJoint], values: Mapping[str, Array]) -> dict[str, Array]:
    """Compute the frame of every link in the root link.

    Parameters
    ----------
    joints : each after the one that carries it
    values : joint that moves → (n,) rad or mm

    Returns
    -------
    Link → (n, 4, 4), mm
    """
    n = len(next(iter(values.values())))
    at = {joints[0].parent: (np.zeros((n, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))}
    for joint in joints:
        origin, turn = at[joint.parent]
        origin, turn = origin + turn_vector(turn, joint.offset), quaternion_product(turn, joint.turn)
        if joint.kind == "prismatic":
            origin = origin + values[joint.name][:, None] * turn_vector(turn, joint.axis)
        elif joint.kind == "revolute":
            turn = quaternion_product(turn, turn_about(joint.axis, values[joint.name]))
        at[joint.child] = origin, turn
    frames = np.tile(np.eye(4), (len(at), n, 1, 1))
    for frame, (origin, turn) in zip(frames, at.values(), strict=True):
        frame[:, :3, :3] = np.stack([turn_vector(turn, axis) for axis in np.eye(3)], axis=2)
        frame[:, :3, 3] = origin
    return dict(zip(at, frames, strict=True))
