"""Forward kinematics and the linear axes for given rotary angles, on arrays; links and the tip's slopes."""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import Array, DegenerateChain, MachineError, product
from fiveaxis.model.machine.chain import why_not_positioning
from fiveaxis.model.machine.model import Machine


def tool_poses(machine: Machine, positions: Array) -> tuple[Array, Array]:
    """Compute tool tip and tool axis in the workpiece frame for given axis values, as `Machine.forward`.

    They are those of Hayashi et al. (2018), Eqs. (2) and (3).
    """
    rows = np.asarray(positions, dtype=float)
    if rows.shape[-1:] != (len(machine.letters),):
        raise MachineError(
            f"axis values {rows.shape}: machine {machine.name!r} has {len(machine.letters)} axes, columns "
            f"{' '.join(machine.letters)}"
        )
    return _poses(machine, [machine.column(joint.letter) for joint in machine.chain.joints], rows)


def tool_axes(machine: Machine, rotary: Array) -> Array:
    """Compute the tool axis, (..., 3), workpiece frame, for rotary angles, (..., r) rad in chain order."""
    rotaries = machine.rotaries
    columns = [rotaries.index(j.letter) if j.is_rotary else -1 for j in machine.chain.joints]
    # A copy lets go of the tips.
    return _poses(machine, columns, np.asarray(rotary, dtype=float))[1].copy()


def linear_positions(machine: Machine, tip: Array, rotary: Array) -> Array:
    """Solve the linear axes for given rotary angles.

    The rotary angles fix the tool's orientation; the remaining three equations are linear in the linear axes
    (Hayashi et al. 2018, Eqs. 2-5, with the chain's offsets).

    Parameters
    ----------
    tip : (..., 3), mm, workpiece frame
    rotary : (..., r), rad, chain order; broadcast against `tip`

    Returns
    -------
    (..., k), mm and rad, columns in the order of `machine.axes`; the linear axes are NaN where a rotary axis
    between them turns their directions into one plane

    Raises
    ------
    DegenerateChain
        The three linear directions don't span space in any posture.
    """
    require_positioning(machine)
    tip, rotary = np.asarray(tip, dtype=float), np.asarray(rotary, dtype=float)
    from fiveaxis.model.kinematics.loops import linear_values

    shape = np.broadcast_shapes(tip.shape[:-1], rotary.shape[:-1])
    tip, rotary = (_rows(np.broadcast_to(columns, (*shape, columns.shape[-1]))) for columns in (tip, rotary))
    positions = np.empty((len(tip), len(machine.axes)))
    positions[:, machine.rotary_columns] = rotary
    linear = [machine.column(letter) for letter in machine.chain.linears]
    positions[:, linear] = linear_values(*machine.chain.figures, tip, rotary)
    return positions.reshape(*shape, len(machine.axes))


def require_positioning(machine: Machine) -> None:
    """Raise `DegenerateChain` unless the linear axes reach every position."""
    reason = why_not_positioning(machine.chain)
    if reason is not None:
        raise DegenerateChain(f"machine {machine.name!r}: {reason}")


def _poses(machine: Machine, columns: list[int], values: Array) -> tuple[Array, Array]:
    """Compute tips and tool axes, (..., 3) each, for values, (..., k), of the joints with a column."""
    from fiveaxis.model.kinematics.loops import poses

    tip, axis = poses(*machine.chain.figures, np.array(columns, dtype=np.int64), _rows(values))
    return tip.reshape(*values.shape[:-1], 3), axis.reshape(*values.shape[:-1], 3)


def _rows(columns: Array) -> Array:
    """Return columns, (..., k), as rows, (n, k), in the one layout that the loops are compiled for."""
    shape = math.prod(columns.shape[:-1]), columns.shape[-1]
    return np.require(columns.reshape(shape), requirements=["C", "W"])


def link_poses(machine: Machine, positions: Array) -> dict[str, Array]:
    """Compute each link's displacement, (n, 4, 4) mm, from home (every axis 0), in the workpiece frame.

    Links and joints alternate from workpiece to tool, so the j-th link has moved by ``E_1 … E_j``: the link
    that carries the workpiece not at all, the bed by all table joints. In the workpiece frame a body is at
    ``link_poses[body.link] @ machine.machine_frame @ body.shape.frame``. Links, in this order, are ``bed``
    and the letter of the axis that carries the link, the next one towards the bed. The last one times
    `machine.chain.tool_home` is the tool's frame.
    """
    values = np.asarray(positions, dtype=float)
    pose = np.broadcast_to(np.eye(4), (len(values), 4, 4))
    links = machine.code.links
    poses = {links[0]: pose}
    for link, joint in zip(links[1:], machine.chain.joints, strict=True):
        pose = product(pose, joint.motions(values[:, machine.column(joint.letter)]))
        poses[link] = pose
    return poses


def tip_slopes(machine: Machine, positions: Array) -> Array:
    """Differentiate the tool tip with respect to the axis values, (n, 3, k) mm per mm or rad.

    In the workpiece frame a linear axis moves the tip along its direction, and a rotary axis turns it about
    its line: ``∂r/∂q = k × (r − p)``.
    """
    values = np.asarray(positions, dtype=float)
    tip, _axis = tool_poses(machine, values)
    slopes = np.zeros((len(values), 3, values.shape[1]))
    # The link before a joint carries the joint's line.
    for pose, joint in zip(link_poses(machine, values).values(), machine.chain.joints, strict=False):
        direction = product(pose[:, :3, :3], np.array(joint.line.direction))
        if joint.is_rotary:
            point = product(pose[:, :3, :3], np.array(joint.line.point)) + pose[:, :3, 3]
            direction = np.cross(direction, tip - point)
        slopes[:, :, machine.column(joint.letter)] = direction
    return slopes
