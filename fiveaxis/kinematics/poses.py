"""Forward kinematics and the linear axes for given rotary angles, on arrays."""

from __future__ import annotations

import numpy as np

from fiveaxis.errors import DegenerateChain, MachineError
from fiveaxis.geometry import Array
from fiveaxis.kinematics.equations import (
    Cosines,
    Vector,
    cosines_of,
    leaning_tip,
    linear_axes,
    linear_determinant,
    tool_axis,
    tool_tip,
)
from fiveaxis.machine import Chain, Machine
from fiveaxis.machine.chain import FLAT, why_not_positioning
from fiveaxis.toolpath import Zone


def tool_poses(machine: Machine, positions: Array) -> tuple[Array, Array]:
    """Compute tool tip and tool axis in the workpiece frame for given axis values.

    Parameters
    ----------
    positions : (n, k), mm and rad, columns in the order of `machine.axes`

    Returns
    -------
    tip : (n, 3), mm, workpiece frame
    axis : (n, 3), unit vectors from tip to shank, workpiece frame

    References
    ----------
    Hayashi et al. (2018), Eqs. (2) and (3).
    """
    rows = np.asarray(positions, dtype=float)
    if rows.shape[-1:] != (len(machine.letters),):
        raise MachineError(
            f"axis values {rows.shape}: machine {machine.name!r} has {len(machine.letters)} axes, columns "
            f"{' '.join(machine.letters)}"
        )
    values = dict(zip(machine.letters, rows.T, strict=True))
    cosines = cosines_of({c: values[c] for c in machine.rotaries}, np)
    linear = {c: values[c] for c in machine.chain.linears}
    shape = rows.shape[:-1]
    tip = tool_tip(machine.chain, cosines, linear)
    return _stack(tip, shape), _stack(tool_axis(machine.chain, cosines), shape)


def tool_axes(machine: Machine, rotary: Array) -> Array:
    """Compute the tool axis for given rotary angles.

    Parameters
    ----------
    rotary : (..., r), rad, chain order (from the workpiece to the tool)

    Returns
    -------
    (..., 3), unit vectors from tip to shank, workpiece frame
    """
    angles = np.asarray(rotary, dtype=float)
    return _stack(tool_axis(machine.chain, _cosines(machine, angles)), angles.shape[:-1])


def linear_positions(machine: Machine, tip: Array, rotary: Array) -> Array:
    """Solve the linear axes for given rotary angles.

    The rotary angles fix the tool's orientation; the remaining three equations are linear in the linear axes
    (form-shaping Eq. 5, with the chain's offsets).

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

    References
    ----------
    Hayashi et al. (2018), Eqs. (2)-(5).
    """
    require_positioning(machine)
    tip, rotary = np.asarray(tip, dtype=float), np.asarray(rotary, dtype=float)
    cosines = _cosines(machine, rotary)
    values = _linear_values(machine.chain, cosines, _vector(tip))
    values |= {c: rotary[..., i] for i, c in enumerate(machine.rotaries)}
    shape = np.broadcast_shapes(tip.shape[:-1], rotary.shape[:-1])
    return _stack([values[a.letter] for a in machine.axes], shape)


def positions_about(
    machine: Machine, pivot: Array, rotary: Array, zone: Zone, normal: Array | None = None
) -> tuple[Array, Array]:
    """Solve the linear axes for a tool that leans about its contact.

    Parameters
    ----------
    pivot : (..., 3), mm, workpiece frame; fixed while the tool leans, e.g. a ball's centre
    rotary : (..., 2), rad, chain order; broadcast against `pivot`
    zone : the arc of the cutter's profile whose centre is the pivot
    normal : (..., 3), unit vectors out of the material; zero where unknown, and not needed for a ball

    Returns
    -------
    positions : (..., k), mm and rad, columns in the order of `machine.axes`; NaN as in `linear_positions`
    axis : (..., 3), unit vectors, workpiece frame
    """
    cosines = _cosines(machine, rotary)
    shape = np.broadcast_shapes(pivot.shape[:-1], rotary.shape[:-1])
    axis = tool_axis(machine.chain, cosines)
    given = np.zeros(3) if normal is None else normal
    with np.errstate(divide="ignore", invalid="ignore"):
        tip = leaning_tip(_vector(pivot), axis, zone.height, zone.offset, _vector(given))
        values = _linear_values(machine.chain, cosines, tip)
    values |= {c: rotary[..., i] for i, c in enumerate(machine.rotaries)}
    return _stack([values[a.letter] for a in machine.axes], shape), _stack(axis, shape)


def require_positioning(machine: Machine) -> None:
    """Check that the linear axes reach every position.

    Raises
    ------
    DegenerateChain
        Fewer than three linear axes, or three whose directions lie in a plane at home.
    """
    reason = why_not_positioning(machine.chain)
    if reason is not None:
        raise DegenerateChain(f"machine {machine.name!r}: {reason}")


def _linear_values(chain: Chain, cosines: Cosines, tip: Vector) -> dict[str, Array]:
    """Solve the linear axes, NaN where their directions lie in one plane."""
    if chain.linears_adjoin:
        return linear_axes(chain, cosines, tip)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = linear_axes(chain, cosines, tip)
    flat = np.abs(linear_determinant(chain, cosines)) < FLAT
    return {letter: np.where(flat, np.nan, value) for letter, value in values.items()}


def _cosines(machine: Machine, rotary: Array) -> Cosines:
    return cosines_of({c: rotary[..., i] for i, c in enumerate(machine.rotaries)}, np)


def _vector(columns: Array) -> Vector:
    return columns[..., 0], columns[..., 1], columns[..., 2]


def _stack(columns: Vector | list[Array], shape: tuple[int, ...]) -> Array:
    """Stack scalars along the last dimension; constants are broadcast."""
    stacked = np.empty((*shape, len(columns)))
    for i, column in enumerate(columns):
        stacked[..., i] = column
    return stacked
