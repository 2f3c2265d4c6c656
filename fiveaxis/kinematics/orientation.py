"""Rotary angles for wanted tool axes: every branch, for none, one, or two rotary axes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fiveaxis.errors import DegenerateChain
from fiveaxis.geometry import Array, BoolArray, angle_between, perpendicular
from fiveaxis.machine import Machine
from fiveaxis.machine.freedom import PARALLEL, directions, why_not_orienting

# |sin| of the angle between tool axis and first rotary axis below which that axis's angle stops mattering.
SINGULAR = 1e-12
# The Gram determinant of three directions may fall below 0 by this much through rounding alone.
GRAM_SLACK = 1e-12
# rad: how far from a wanted tool axis a machine that can't lean freely may hold the tool. A file's six
# decimals leave half of that.
AXIS_TOLERANCE = 1e-6

Held = Mapping[str, float]


def rotary_angles(machine: Machine, axis: Array, *, held: Held | None = None) -> Array:
    """Solve the rotary angles for wanted tool axes.

    With ``k1``, ``k2`` the directions of the first and second rotary axis and ``o0`` the tool axis at home,
    ``R(k1, ρ1) R(k2, ρ2) o0 = o``. The product with ``k1`` doesn't see ρ1:
    ``a cos ρ2 + b sin ρ2 + c = k1·o`` has two solutions, the branches; ρ1 follows from what lies across k1
    (Paden-Kahan subproblem 2). With one rotary axis only tool axes on its cone have a solution, with none
    only the one tool axis of the machine (`AXIS_TOLERANCE`).

    Parameters
    ----------
    machine : none, one or two rotary axes
    axis : (n, 3), unit vectors from tip to shank, workpiece frame
    held : rad by letter, 0 where not named: where the tool axis lies along the first rotary axis any angle of
        that axis will do, and it is held there

    Returns
    -------
    (branches, n, r), rad, chain order, in (−π, π] but for held angles; NaN where a branch doesn't exist.
    Where the two branches meet, at the edge of what can be reached, both are given.

    Raises
    ------
    DegenerateChain
        Two rotary axes that don't give two directions of freedom, or more than two.
    """
    wanted = np.asarray(axis, dtype=float)
    rest = {} if held is None else held
    if len(machine.rotaries) == 0:
        return np.empty((1, len(wanted), 0))
    if len(machine.rotaries) == 1:
        return _one_angle(machine, wanted, rest.get(machine.rotaries[0], 0.0))[None, :, None]
    require_orienting(machine)
    return _two_angles(machine, wanted, rest.get(machine.rotaries[0], 0.0))


def require_orienting(machine: Machine) -> None:
    """Check that the rotary axes lean the tool in two directions.

    Raises
    ------
    DegenerateChain
        Not two rotary axes; parallel ones; one that only spins the tool about itself.
    """
    reason = why_not_orienting(machine.chain)
    if reason is not None:
        raise DegenerateChain(f"machine {machine.name!r}: {reason}")


def _one_angle(machine: Machine, wanted: Array, held: float) -> Array:
    """Solve ``R(k, ρ) o0 = o``, (n,) rad."""
    (k,) = directions(machine.chain, rotary=True)
    home = machine.chain.tool_home[:3, 2]
    if np.linalg.norm(np.cross(k, home)) < PARALLEL:
        return np.full(len(wanted), held)
    start, end = home - (home @ k) * k, wanted - np.outer(wanted @ k, k)
    return np.arctan2(np.cross(start, end) @ k, end @ start)


def missed_axes(reached: Array, wanted: Array) -> BoolArray:
    """Tell which rows of tool axes, (..., n, 3), lie further than `AXIS_TOLERANCE` from the wanted ones."""
    return ~(angle_between(reached, np.broadcast_to(wanted, reached.shape)) <= AXIS_TOLERANCE)


def second_coefficients(k1: Array, k2: Array, home: Array) -> tuple[float, float, float]:
    """Give a, b, c of ``k1·o = a cos ρ2 + b sin ρ2 + c``."""
    oblique, offset = float(k1 @ k2), float(k2 @ home)
    return float(k1 @ home) - oblique * offset, float(k1 @ np.cross(k2, home)), oblique * offset


def _two_angles(machine: Machine, wanted: Array, held: float) -> Array:
    """Solve ``R(k1, ρ1) R(k2, ρ2) o0 = o``, (2, n, 2) rad, NaN where there is no solution.

    Everything is measured along k1 and along two directions e1, e2 across it, so that ρ1 is a difference of
    two angles in that plane and no vectors are needed per location.
    """
    k1, k2 = directions(machine.chain, rotary=True)
    home = machine.chain.tool_home[:3, 2]
    e1 = perpendicular(k1)
    e2 = np.cross(k1, e1)
    end_x, end_y, along = wanted @ e1, wanted @ e2, wanted @ k1
    across = end_x**2 + end_y**2
    second = _second_angles(k1, k2, home, along, across)
    cosine, sine = np.cos(second), np.sin(second)
    fixed, quarter = k2 * (k2 @ home), np.cross(k2, home)
    start_x, start_y = (fixed @ e + cosine * ((home - fixed) @ e) + sine * (quarter @ e) for e in (e1, e2))
    first = _principal(np.arctan2(end_y, end_x) - np.arctan2(start_y, start_x))
    first = np.where((across < SINGULAR**2) & ~np.isnan(second), held, first)
    return np.stack([first, second], axis=-1)


def _second_angles(k1: Array, k2: Array, home: Array, along: Array, across: Array) -> Array:
    """Solve ``a cos ρ2 + b sin ρ2 = d``, (2, n) rad, NaN where there is no solution.

    The spread of the branches about ``atan2(b, a)`` has the cosine ``d/h`` and the sine ``√(h² − d²)/h``,
    ``h² = a² + b²``. ``h² − d²`` is the Gram determinant of k1, k2 and the tool axis; written with the
    squared part ``across`` k1 for ``1 − (k1·o)²`` it keeps its digits next to the singular direction, where
    an arc cosine would turn rounding into 1e-8 rad.
    """
    oblique, offset = k1 @ k2, k2 @ home
    a, b, c = second_coefficients(k1, k2, home)
    gram = across - oblique**2 - offset**2 + 2.0 * oblique * offset * along
    sine = np.sqrt(np.where(gram < -GRAM_SLACK, np.nan, np.maximum(gram, 0.0)))
    spread = np.arctan2(sine, along - c)
    middle = math.atan2(b, a)
    return _principal(np.stack([middle + spread, middle - spread]))


def _principal(angles: Array) -> Array:
    """Bring angles into (−π, π]."""
    return math.pi - np.mod(math.pi - angles, 2.0 * math.pi)
