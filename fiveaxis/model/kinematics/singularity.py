"""The singular direction: the lean from it, and how the first rotary axis is held near it.

The singular direction is that of the first rotary axis (C of a C-A table): with the tool along it, that axis
only spins the part under the tool. Near it a small lean takes a large turn: ``1/sin`` of the angle to it.
Within a cone about it the first rotary axis is therefore held at its previous angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, angle_between
from fiveaxis.model.kinematics.inverse import require_orienting, second_coefficients
from fiveaxis.model.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.model.machine.chain import directions
from fiveaxis.model.machine.model import Machine


def singular_direction(machine: Machine) -> Array:
    """Return the direction of the first rotary axis, (3,) unit vector, workpiece frame.

    The opposite direction is singular too; `singular_angles` measures to the nearer one.
    """
    return np.array(next(j.line.direction for j in machine.chain.joints if j.is_rotary))


def singular_angles(machine: Machine, axis: Array) -> Array:
    """Compute the angle between tool axes, (..., 3), and the singular direction, (...) rad in [0, π/2].

    The machine has a rotary axis.
    """
    direction = np.broadcast_to(singular_direction(machine), np.shape(axis))
    angle = angle_between(direction, np.asarray(axis, dtype=float))
    return np.minimum(angle, np.pi - angle)


def hold_singular(rotary: Array, axis: Array, machine: Machine, cone: float = ON_LIMIT) -> Array:
    """Hold the first rotary angle along a path while the tool axis lies within the singular cone.

    Parameters
    ----------
    rotary, axis : (..., n, 2) rad, chain order, and (..., n, 3), workpiece frame, rows in path order
    cone : rad, half angle. Holding turns the tool axis by at most twice its angle to the singular direction,
        which is negligible by default

    Returns
    -------
    (..., n, 2), rad; rows before the first one outside the cone are unchanged
    """
    singular = singular_angles(machine, axis) < cone
    if not singular.any():
        return rotary
    kept = np.maximum.accumulate(np.where(singular, 0, np.arange(singular.shape[-1])), axis=-1)
    held = rotary.copy()
    held[..., 0] = np.take_along_axis(rotary[..., 0], np.broadcast_to(kept, rotary.shape[:-1]), axis=-1)
    return held


@dataclass(frozen=True)
class Leaning:
    """Range of the angle between the tool axis and the singular direction, that of the first rotary axis.

    Each lean has two values of the second rotary axis, one on either side of a middle: the branches.

    Parameters
    ----------
    letter : the second rotary axis
    middle : rad, its value midway between the branches
    unlimited : rad, smallest and largest lean without limits
    limited : rad, the same within the limits of the second rotary axis
    both : rad, leans at which both branches are within them: none, one or two ranges
    """

    letter: str
    middle: float
    unlimited: tuple[float, float]
    limited: tuple[float, float]
    both: tuple[tuple[float, float], ...]


def lean_range(machine: Machine) -> Leaning:
    """Compute how far a machine with two rotary axes leans the tool.

    With ``k1·o = h cos(ρ2 − middle) + c`` the lean grows with the distance of ρ2 from the middle, up to half
    a turn (`rotary_angles`). `DegenerateChain` as `require_orienting`.
    """
    require_orienting(machine)
    k1, k2 = directions(machine.chain, rotary=True)
    a, b, c = second_coefficients(k1, k2, machine.chain.tool_home[:3, 2])
    middle, height = math.atan2(b, a), math.hypot(a, b)

    def lean(spread: float) -> float:
        return math.acos(min(max(height * math.cos(spread) + c, -1.0), 1.0))

    letter = machine.rotaries[1]
    limits = machine.axis(letter).limits
    least, most = _spreads(middle, limits.low, limits.high)
    return Leaning(
        letter=letter,
        middle=middle,
        unlimited=(lean(0.0), lean(math.pi)),
        limited=(lean(least), lean(most)),
        both=tuple((lean(s), lean(e)) for s, e in _shared_spreads(middle, limits.low, limits.high)),
    )


def _spreads(middle: float, low: float, high: float) -> tuple[float, float]:
    """Return the smallest and the largest distance from the middle, up to whole turns, within limits."""
    if high - low >= TURN:
        return 0.0, math.pi
    first, last = (abs(math.remainder(end - middle, TURN)) for end in (low, high))
    through_middle = _narrower_side(middle, low, high) is not None
    through_opposite = _narrower_side(middle + math.pi, low, high) is not None
    return (0.0 if through_middle else min(first, last)), (math.pi if through_opposite else max(first, last))


def _shared_spreads(middle: float, low: float, high: float) -> list[tuple[float, float]]:
    """Return the distances from the middle, up to half a turn, that are within limits on both sides.

    They extend from the middle to its nearer limit, and from half a turn down likewise.
    """
    if high - low >= TURN:
        return [(0.0, math.pi)]
    near = _narrower_side(middle, low, high)
    far = _narrower_side(middle + math.pi, low, high)
    if near is not None and far is not None and near + far >= math.pi - ON_LIMIT:
        return [(0.0, math.pi)]
    shared = [] if near is None else [(0.0, near)]
    return shared if far is None else [*shared, (math.pi - far, math.pi)]


def _narrower_side(angle: float, low: float, high: float) -> float | None:
    """Return the distance from an angle to the nearer limit; None if no turn of it is within limits."""
    first = angle + TURN * math.ceil((low - ON_LIMIT - angle) / TURN)
    return None if first > high + ON_LIMIT else max(0.0, min(first - low, high - first))
