"""The kinematics of verification, which share no equation with `fiveaxis.model.kinematics`.

They are pinocchio's, or those of the machine's URDF (`urdf_model`) where pinocchio isn't installed: it has no
wheel for Windows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.base import Array, IntArray, inverse_transform, product
from fiveaxis.check.collision.travel import Poses
from fiveaxis.model import TOOL, Machine, link_name

if TYPE_CHECKING:
    import pinocchio


@dataclass(frozen=True, eq=False)
class ToolModel:
    """A machine for pinocchio.

    Parameters
    ----------
    model : joints from the workpiece to the tool, lengths in mm
    tool : index of the tool-tip frame
    columns : (k,), column of the axis values that each of the model's coordinates takes
    """

    model: pinocchio.Model
    tool: int
    columns: IntArray


def load_pinocchio() -> Any | None:
    """Import pinocchio; None where it isn't installed."""
    try:
        import pinocchio
    except ModuleNotFoundError as fault:
        if fault.name != "pinocchio":
            raise
        return None
    return pinocchio


def kinematics_name() -> str:
    """Name the kinematics that verify, for reports."""
    pin = load_pinocchio()
    return "own URDF forward kinematics" if pin is None else f"pinocchio {pin.__version__}"


def tool_poses(machine: Machine, positions: Array) -> tuple[Array, Array]:
    """Compute the tool poses relative to the workpiece: tips, mm, and unit vectors from tip to shank.

    Both are (n, 3), in the workpiece frame. Positions, (n, k) mm and rad, have columns in the order of
    `machine.axes`; a row with NaN gives NaN.
    """
    rows = np.asarray(positions, dtype=float)
    if (pin := load_pinocchio()) is not None:
        return _pinocchio_tool_poses(pin, build_model(machine), rows)
    from fiveaxis.check.verification.urdf_model import frames_of

    frame = frames_of(machine, rows)[TOOL]
    return frame[:, :3, 3].copy(), frame[:, :3, 2].copy()


def link_poses(machine: Machine) -> Poses:
    """Return the function that computes the poses of a machine's links.

    Returns
    -------
    Axis values, (n, k) mm and rad → link → its displacement from its pose with every axis at 0, (n, 4, 4) mm,
    workpiece frame
    """
    if (pin := load_pinocchio()) is not None:
        return _pinocchio_link_poses(pin, build_model(machine), machine.code.links)
    from fiveaxis.check.verification.urdf_model import frames_of

    links = machine.code.links
    home = frames_of(machine, np.zeros((1, len(machine.axes))))
    back = {link: inverse_transform(home[link_name(link)]) for link in links}

    def poses(positions: Array) -> Mapping[str, Array]:
        frames = frames_of(machine, positions)
        return {link: product(frames[link_name(link)], back[link]) for link in links}

    return poses


def build_model(machine: Machine) -> ToolModel:
    """Build the chain of a machine for pinocchio, which has to be installed; the workpiece is its universe.

    Every joint's frame is parallel to the machine frame at home with its origin on the axis, so placements
    are pure offsets and the joints' directions hold the geometry. Limits don't matter here.
    """
    import pinocchio as pin

    model = pin.Model()
    parent, origin = 0, np.zeros(3)
    for joint in machine.chain.joints:
        point = np.array(joint.line.point) if joint.is_rotary else origin
        placement = pin.SE3(np.eye(3), point - origin)
        kind = pin.JointModelRevoluteUnaligned if joint.is_rotary else pin.JointModelPrismaticUnaligned
        parent = model.addJoint(parent, kind(np.array(joint.line.direction)), placement, joint.letter)
        origin = point
    home = machine.chain.tool_home
    at_tool = pin.SE3(home[:3, :3].copy(), home[:3, 3] - origin)
    tool = model.addFrame(pin.Frame("tool", parent, at_tool, pin.FrameType.OP_FRAME))
    columns = [machine.column(joint.letter) for joint in machine.chain.joints]
    return ToolModel(model, tool, np.array(columns, dtype=np.int64))


def _pinocchio_tool_poses(pin: Any, built: ToolModel, positions: Array) -> tuple[Array, Array]:
    model, data = built.model, built.model.createData()
    rows = np.ascontiguousarray(positions[:, built.columns])
    tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
    # Views of the frame's pose, which every call updates: a new pose for each row takes three times as long.
    placement = data.oMf[built.tool]
    tip_now, axis_now = placement.translation, placement.rotation[:, 2]
    for i, row in enumerate(rows):
        pin.framesForwardKinematics(model, data, row)
        tip[i], axis[i] = tip_now, axis_now
    return tip, axis


def _pinocchio_link_poses(pin: Any, built: ToolModel, links: tuple[str, ...]) -> Poses:
    model, data = built.model, built.model.createData()
    pin.forwardKinematics(model, data, np.zeros(model.nq))
    home = [pose.homogeneous.copy() for pose in data.oMi]
    # At home every joint's frame is parallel to the machine frame, so the way back is a translation.
    back = inverse_transform(np.array(home))[:, None, :3, 3:]
    # Views of the joints' poses, which every call updates.
    turned, moved = [pose.rotation for pose in data.oMi], [pose.translation for pose in data.oMi]

    def poses(positions: Array) -> Mapping[str, Array]:
        rows = np.ascontiguousarray(positions[:, built.columns])
        placed = np.tile(np.eye(4), (len(links), len(rows), 1, 1))
        for i, row in enumerate(rows):
            pin.forwardKinematics(model, data, row)
            placed[:, i, :3, :3], placed[:, i, :3, 3] = turned, moved
        placed[..., :3, 3:] += product(placed[..., :3, :3], back)
        return dict(zip(links, placed, strict=True))

    return poses
