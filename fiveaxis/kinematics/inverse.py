"""Axis values for a wanted tool tip and tool axis: every branch."""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.errors import DegenerateChain
from fiveaxis.geometry import Array, rotation_matrix
from fiveaxis.kinematics.poses import linear_positions
from fiveaxis.machine import Machine

# |sin| of the angle between two directions below which they count as parallel.
PARALLEL = 1e-9
# The same for a tool axis along the first rotary axis, where that axis's angle stops mattering.
SINGULAR = 1e-12
# The Gram determinant of three directions may fall below 0 by this much through rounding alone.
GRAM_SLACK = 1e-12
BRANCHES = 2


def axis_positions(machine: Machine, tip: Array, axis: Array) -> Array:
    """Solve all axes for wanted tool tips and tool axes.

    Parameters
    ----------
    machine : two rotary and three linear axes
    tip : (n, 3), mm, workpiece frame
    axis : (n, 3), unit vectors from tip to shank, workpiece frame

    Returns
    -------
    (branches, n, k), mm and rad, columns in the order of `machine.axes`; NaN where a branch doesn't exist.
    Limits aren't applied; angles lie in (−π, π].

    Raises
    ------
    DegenerateChain
        The axes can't give every position, or the rotary axes don't give two directions of freedom.
    """
    rotary = rotary_angles(machine, axis)
    return linear_positions(machine, np.asarray(tip, dtype=float)[None], rotary)


def rotary_angles(machine: Machine, axis: Array) -> Array:
    """Solve the two rotary angles for wanted tool axes.

    With ``k1``, ``k2`` the directions of the first and second rotary axis and ``o0`` the tool axis at home,
    ``R(k1, ρ1) R(k2, ρ2) o0 = o``. The product with ``k1`` doesn't see ρ1:
    ``a cos ρ2 + b sin ρ2 + c = k1·o`` has two solutions, the branches; ρ1 follows from what lies across k1
    (Paden-Kahan subproblem 2). Where the tool axis lies along ``k1`` any ρ1 will do: it is set to 0.

    Parameters
    ----------
    axis : (n, 3), unit vectors from tip to shank, workpiece frame

    Returns
    -------
    (2, n, 2), rad, chain order, in (−π, π]; NaN where a branch doesn't exist

    Raises
    ------
    DegenerateChain
        Not two rotary axes, or two that don't give two directions of freedom.
    """
    require_orienting(machine)
    k1, k2 = _rotary_directions(machine)
    home = machine.chain.tool_home[:3, 2]
    wanted = np.asarray(axis, dtype=float)
    second = _second_angles(k1, k2, home, wanted)
    first = np.stack([_first_angles(k1, k2, home, wanted, angle) for angle in second])
    return np.stack([first, second], axis=-1)


def require_orienting(machine: Machine) -> None:
    """Check that the rotary axes lean the tool in two directions.

    Raises
    ------
    DegenerateChain
        Not two rotary axes; parallel ones; one that only spins the tool about itself.
    """
    rotaries = machine.rotaries
    if len(rotaries) != 2:
        raise DegenerateChain(
            f"machine {machine.name!r} has {len(rotaries)} rotary axes; choosing a posture needs two"
        )
    k1, k2 = _rotary_directions(machine)
    home = machine.chain.tool_home[:3, 2]
    if np.linalg.norm(np.cross(k2, home)) < PARALLEL:
        raise DegenerateChain(
            f"machine {machine.name!r}: {rotaries[1]}, the rotary axis next to the tool, only spins the tool "
            "about itself and gives no second orientation freedom"
        )
    if np.linalg.norm(np.cross(k1, k2)) < PARALLEL:
        raise DegenerateChain(f"machine {machine.name!r}: {rotaries[0]} and {rotaries[1]} are parallel")


def _rotary_directions(machine: Machine) -> tuple[Array, Array]:
    first, second = (np.array(j.line.direction) for j in machine.chain.joints if j.is_rotary)
    return first, second


def _second_angles(k1: Array, k2: Array, home: Array, wanted: Array) -> Array:
    """Solve ``a cos ρ2 + b sin ρ2 = d``, (2, n) rad, NaN where there is no solution.

    The spread of the branches about ``atan2(b, a)`` has the cosine ``d/h`` and the sine ``√(h² − d²)/h``,
    ``h² = a² + b²``. ``h² − d²`` is the Gram determinant of k1, k2 and the tool axis; written with
    ``|k1×o|²`` for ``1 − (k1·o)²`` it keeps its digits next to the singular direction, where an arc cosine
    would turn rounding into 1e-8 rad.
    """
    oblique, offset = k1 @ k2, k2 @ home
    a = k1 @ home - oblique * offset
    b = k1 @ np.cross(k2, home)
    along = wanted @ k1
    across = np.sum(np.cross(k1, wanted) ** 2, axis=1)
    gram = across - oblique**2 - offset**2 + 2.0 * oblique * offset * along
    sine = np.sqrt(np.where(gram < -GRAM_SLACK, np.nan, np.maximum(gram, 0.0)))
    spread = np.arctan2(sine, along - oblique * offset)
    middle = math.atan2(b, a)
    return _principal(np.stack([middle + spread, middle - spread]))


def _first_angles(k1: Array, k2: Array, home: Array, wanted: Array, second: Array) -> Array:
    """Solve ρ1 that turns ``R(k2, ρ2) o0`` to the wanted axis, (n,) rad."""
    turned = _turn_rows(k2, home, second)
    start = turned - np.outer(turned @ k1, k1)
    end = wanted - np.outer(wanted @ k1, k1)
    angle = np.arctan2(np.cross(start, end) @ k1, np.sum(start * end, axis=1))
    singular = np.linalg.norm(end, axis=1) < SINGULAR
    return np.where(np.isnan(second), np.nan, np.where(singular, 0.0, angle))


def _turn_rows(direction: Array, vector: Array, angles: Array) -> Array:
    """Turn one vector about one direction by many angles, (n, 3)."""
    along = direction * (direction @ vector)
    across = vector - along
    quarter = rotation_matrix(direction, math.pi / 2.0) @ across
    return along + np.outer(np.cos(angles), across) + np.outer(np.sin(angles), quarter)


def _principal(angles: Array) -> Array:
    """Bring angles into (−π, π]."""
    return math.pi - np.mod(math.pi - angles, 2.0 * math.pi)
