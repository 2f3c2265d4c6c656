"""Axis values and rotary angles for a given tool tip and tool axis: every branch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    DegenerateChain,
    ToolpathError,
    angle_between,
    arctan2,
    cross,
    perpendicular,
    product,
)
from fiveaxis.model.kinematics.poses import linear_positions, require_positioning, tool_axes
from fiveaxis.model.machine.chain import PARALLEL, Chain, directions, spare_axes, why_not_orienting
from fiveaxis.model.machine.model import Machine

# A tool axis has two degrees of freedom; further rotary axes are redundant.
ORIENTING = 2
# Tolerance on the squared length of a unit vector: twice the error of six decimals in a file.
UNIT_LENGTH = 1e-5
# |sin| of the angle between tool axis and first rotary axis below which that axis's angle has no effect.
SINGULAR = 1e-12
# Rounding error of a Gram determinant of three directions below 0.
GRAM_SLACK = 1e-12
# rad, tolerance on the tool axis of a machine that can't orient it freely: twice the error of six decimals.
AXIS_TOLERANCE = 1e-6

Held = Mapping[str, float]


def axis_positions(machine: Machine, tip: Array, axis: Array, *, held: Held | None = None) -> Array:
    """Solve all axes for given tool tips and tool axes, as `Machine.inverse`.

    Axes are held whose angle is arbitrary: the first rotary axis where the tool lies along it, a rotary axis
    that only spins the tool or the part, and the redundant one of three rotary axes (the one that `held`
    names, else `redundant_axis`). There are two branches with two or three rotary axes, one with fewer; tool
    axes that fewer can't reach within `AXIS_TOLERANCE` are NaN.

    Raises
    ------
    DegenerateChain
        The linear axes don't reach every position, or two rotary axes don't lean the tool in two directions.
    MachineError
        `held` names an axis that the machine doesn't have.
    ToolpathError
        Tips and tool axes aren't rows of three, or a tool axis isn't a unit vector; NaN rows are accepted.
    """
    require_positioning(machine)
    for letter in held or ():
        machine.column(letter)
    if len(machine.rotaries) > ORIENTING:
        return _around_redundant(machine, tip, axis, held or {})
    wanted = np.asarray(axis, dtype=float)
    points = np.asarray(tip, dtype=float)
    _require_rows(points, wanted)
    rotary = rotary_angles(machine, wanted, held=held)
    positions = linear_positions(machine, points[None], rotary)
    missing: BoolArray = np.any(np.isnan(positions), axis=-1)
    if len(machine.rotaries) < ORIENTING:
        reached = tool_axes(machine, rotary)
        missing |= ~(angle_between(reached, np.broadcast_to(wanted, reached.shape)) <= AXIS_TOLERANCE)
    positions[missing] = np.nan
    return positions


def _require_rows(tip: Array, axis: Array) -> None:
    if tip.ndim != 2 or tip.shape[1] != 3 or axis.shape != tip.shape:
        raise ToolpathError(f"tips {tip.shape} and tool axes {axis.shape} must both be rows of three, (n, 3)")
    off = np.abs(np.einsum("ij,ij->i", axis, axis) - 1.0)
    if (off > UNIT_LENGTH).any():
        row = int(np.nanargmax(off))
        raise ToolpathError(f"location {row}: the tool axis {axis[row]} isn't a unit vector; normalise it")


def redundant_axis(machine: Machine) -> str:
    """Return the letter of the redundant one of three rotary axes: the nearest to the tool that can be held.

    `DegenerateChain` if no two of the rotary axes lean the tool in two directions.
    """
    spare = spare_axes(machine.chain)
    if spare:
        return spare[0]
    raise DegenerateChain(
        f"machine {machine.name!r}: no two of {', '.join(machine.rotaries)} lean the tool in two directions"
    )


def _around_redundant(machine: Machine, tip: Array, axis: Array, held: Held) -> Array:
    """Solve the other axes with the redundant one held."""
    named = [c for c in held if c in spare_axes(machine.chain)]
    spare = named[0] if named else redundant_axis(machine)
    value = held.get(spare, 0.0)
    rest = {letter: angle for letter, angle in held.items() if letter != spare}
    found = axis_positions(machine.holding(spare, value), tip, axis, held=rest)
    column = machine.column(spare)
    positions = np.insert(found, column, value, axis=-1)
    positions[np.isnan(found).any(axis=-1)] = np.nan
    return positions


def rotary_angles(machine: Machine, axis: Array, *, held: Held | None = None) -> Array:
    """Solve the rotary angles for given tool axes.

    With ``k1``, ``k2`` the directions of the first and second rotary axis and ``o0`` the tool axis at home,
    ``R(k1, ρ1) R(k2, ρ2) o0 = o``. The product with ``k1`` is independent of ρ1:
    ``a cos ρ2 + b sin ρ2 + c = k1·o`` has two solutions, the branches; ρ1 follows from the components
    perpendicular to k1 (Paden-Kahan subproblem 2). With one rotary axis only tool axes on its cone have a
    solution, with none only the machine's one tool axis (`AXIS_TOLERANCE`).

    Parameters
    ----------
    machine : at most two rotary axes
    axis : (..., 3), unit vectors from tip to shank, workpiece frame
    held : rad by letter, 0 by default: angle of the first rotary axis where the tool axis lies along it, as
        any angle is a solution there

    Returns
    -------
    (branches, ..., r), rad, chain order, in (−π, π] except for held angles; NaN where a branch doesn't exist.
    At the edge of the reachable tool axes the two branches coincide and both are returned.

    Raises
    ------
    DegenerateChain
        Two rotary axes that don't lean the tool in two directions, or more than two.
    """
    wanted = np.asarray(axis, dtype=float)
    rest = held or {}
    if len(machine.rotaries) == 0:
        return np.empty((1, *wanted.shape[:-1], 0))
    if len(machine.rotaries) == 1:
        return _one_angle(machine, wanted, rest.get(machine.rotaries[0], 0.0))[None, ..., None]
    require_orienting(machine)
    return _two_angles(machine, wanted, rest.get(machine.rotaries[0], 0.0))


def require_orienting(machine: Machine) -> None:
    """Raise `DegenerateChain` unless there are two rotary axes and they lean the tool in two directions."""
    reason = why_not_orienting(machine.chain)
    if reason is not None:
        raise DegenerateChain(f"machine {machine.name!r}: {reason}")


def _one_angle(machine: Machine, wanted: Array, held: float) -> Array:
    """Solve ``R(k, ρ) o0 = o``, (...,) rad."""
    (k,) = directions(machine.chain, rotary=True)
    home = machine.chain.tool_home[:3, 2]
    if np.linalg.norm(cross(k, home), axis=-1) < PARALLEL:
        return np.full(wanted.shape[:-1], held)
    start, end = home - product(home, k) * k, wanted - product(wanted, k)[..., None] * k
    return arctan2(product(cross(start, end), k), product(end, start))


def second_coefficients(k1: Array, k2: Array, home: Array) -> tuple[float, float, float]:
    """Compute a, b, c of ``k1·o = a cos ρ2 + b sin ρ2 + c``."""
    oblique, offset = float(product(k1, k2)), float(product(k2, home))
    return (
        float(product(k1, home)) - oblique * offset,
        float(product(k1, cross(k2, home))),
        oblique * offset,
    )


@lru_cache
def _two_turns(chain: Chain) -> tuple[Array, Array, Array, tuple[float, ...], tuple[Array, Array]]:
    """Compute what of two rotary axes doesn't depend on the tool axis.

    k1, e1, e2 are unit vectors, (3,): the first rotary axis, and two perpendicular to it and to each other.
    Then k1·k2, k2·o0, and a, b, c of `second_coefficients`; and (3,) each, the coefficients of 1, cos ρ2 and
    sin ρ2 in the components of R(k2, ρ2) o0 along e1 and e2.
    """
    k1, k2 = directions(chain, rotary=True)
    home = chain.tool_home[:3, 2]
    e1 = perpendicular(k1)
    e2 = cross(k1, e1)
    offset = product(k2, home)
    fixed = k2 * offset
    turned = np.stack([fixed, home - fixed, cross(k2, home)])
    second = float(product(k1, k2)), float(offset), *second_coefficients(k1, k2, home)
    return k1, e1, e2, second, (product(turned, e1), product(turned, e2))


def _two_angles(machine: Machine, wanted: Array, held: float) -> Array:
    """Solve ``R(k1, ρ1) R(k2, ρ2) o0 = o``, (2, ..., 2) rad, NaN where there is no solution.

    With components along k1 and along two directions e1, e2 perpendicular to it, ρ1 is a difference of two
    angles in that plane, and no vectors are needed per location.

    With ``d = k1·o − c`` and ``h² = a² + b²``, the spread of the branches of ρ2 about ``atan2(b, a)`` has the
    cosine ``d/h`` and the sine ``√(h² − d²)/h``. ``h² − d²`` is the Gram determinant of k1, k2 and the tool
    axis. Written with the squared component ``across`` k1 for ``1 − (k1·o)²`` it keeps its digits near the
    singular direction, where an arc cosine would turn rounding into 1e-8 rad.
    """
    k1, e1, e2, (oblique, offset, a, b, c), start = _two_turns(machine.chain)
    end_x, end_y, along = product(wanted, e1), product(wanted, e2), product(wanted, k1)
    across = end_x**2 + end_y**2
    gram = across - oblique**2 - offset**2 + 2.0 * oblique * offset * along
    spread = arctan2(np.sqrt(np.where(gram < -GRAM_SLACK, np.nan, np.maximum(gram, 0.0))), along - c)
    middle = math.atan2(b, a)
    second = _principal(np.stack([middle + spread, middle - spread]))
    cosine, sine = np.cos(second), np.sin(second)
    start_x, start_y = (still + cosine * level + sine * quarter for still, level, quarter in start)
    first = _principal(arctan2(end_y, end_x) - arctan2(start_y, start_x))
    first = np.where((across < SINGULAR**2) & ~np.isnan(second), held, first)
    return np.stack([first, second], axis=-1)


def _principal(angles: Array) -> Array:
    """Reduce angles to (−π, π]."""
    return math.pi - np.mod(math.pi - angles, 2.0 * math.pi)
