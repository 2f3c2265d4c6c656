"""The machine as a pinocchio model: forward kinematics that share no equation with `fiveaxis.kinematics`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.errors import MissingDependency
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine

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


def build_model(machine: Machine) -> ToolModel:
    """Build the chain of a machine, with the workpiece as the model's universe.

    Every joint's frame is parallel to the machine frame at home with its origin on the axis, so placements
    are pure offsets and the joints' directions hold the geometry.

    Parameters
    ----------
    machine : its `chain`; limits don't matter here

    Raises
    ------
    MissingDependency
        pinocchio isn't installed; it has no wheel for Windows.
    """
    pin = load_pinocchio()
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


def tool_poses(machine: Machine, positions: Array) -> tuple[Array, Array]:
    """Compute the tool poses relative to the workpiece, with pinocchio.

    Parameters
    ----------
    machine : the machine
    positions : (n, k), mm and rad, columns in the order of `machine.axes`; a row with NaN gives NaN

    Returns
    -------
    tip : (n, 3), mm, workpiece frame
    axis : (n, 3), unit vectors from tip to shank, workpiece frame

    Raises
    ------
    MissingDependency
        pinocchio isn't installed.
    """
    pin = load_pinocchio()
    built = build_model(machine)
    model, tool, data = built.model, built.tool, built.model.createData()
    rows = np.ascontiguousarray(np.asarray(positions, dtype=float)[:, built.columns])
    tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
    # Views of the frame's pose, which every call updates: a new pose for each row takes three times as long.
    placement = data.oMf[tool]
    tip_now, axis_now = placement.translation, placement.rotation[:, 2]
    for i, row in enumerate(rows):
        pin.framesForwardKinematics(model, data, row)
        tip[i], axis[i] = tip_now, axis_now
    return tip, axis


def load_pinocchio() -> Any:
    """Import pinocchio.

    Raises
    ------
    MissingDependency
        It isn't installed.
    """
    try:
        import pinocchio
    except ModuleNotFoundError as fault:
        if fault.name != "pinocchio":
            raise
        raise MissingDependency(
            "pinocchio",
            "verification",
            "install the wheel `pin` (Linux, macOS); on Windows use WSL",
        ) from None
    return pinocchio
