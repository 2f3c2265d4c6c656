"""The power surface ``S_W = S_WL + S_WR`` over the rotary angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, SettingError, every_pair
from fiveaxis.model import Machine, linear_positions, require_orienting, travel_costs


@dataclass(frozen=True, eq=False)
class PowerSurface:
    """Energy of a move from home over a grid of rotary angles, with its two parts.

    Parameters
    ----------
    letters : the two rotary axes, chain order
    first, second : (g,), (h,), rad, the grid
    linear : (..., g, h), J, S_WL: the linear axes' part
    rotary : (..., g, h), J, S_WR: the rotary axes' part
    """

    letters: tuple[str, ...]
    first: Array
    second: Array
    linear: Array
    rotary: Array

    def __repr__(self) -> str:
        least, most = float(np.nanmin(self.total)), float(np.nanmax(self.total))
        shape = " × ".join(map(str, self.total.shape))
        return f"<PowerSurface over {' and '.join(self.letters)}: {shape} postures, {least:.4g}…{most:.4g} J>"

    @property
    def total(self) -> Array:
        """(..., g, h), J, S_W."""
        return self.linear + self.rotary


def power_surface(
    machine: Machine, tip: ArrayLike, feed_mm_min: float, grid: tuple[ArrayLike, ArrayLike]
) -> PowerSurface:
    """Compute the power surface at one cutter location or at every location of a path.

    ``S_WL = Σ W·x`` over the linear axes and ``S_WR = Σ W·φ`` over the rotary axes (Eqs. 6-8): the energy of
    a move from the axes' zero, each axis with the coefficient of its own direction. The *difference* of the
    surface between two postures is the cost of a move between them only if no axis passes zero; the travel
    metric of a motion is `move_energies`.

    Parameters
    ----------
    machine : two rotary and three linear axes with drives
    tip : (3,) or (n, 3), mm, workpiece frame; position at which the tool tip is held. Or (g, h, 3), the tip
        of each posture: where the contact is held, the tip moves while the tool leans
    feed_mm_min : programmed feed, mm/min
    grid : angles of the first and of the second rotary axis (chain order), (g,) and (h,), rad

    Returns
    -------
    (g, h) for one location, (n, g, h) for the tips of a path

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    SettingError
        The feed isn't positive, or the tip isn't finite.

    References
    ----------
    Hayashi et al. (2018), Eqs. (5)-(8).
    """
    require_orienting(machine)
    if not (np.isfinite(feed_mm_min) and feed_mm_min > 0.0):
        raise SettingError(f"feed is {feed_mm_min:g} mm/min; it must be a positive number")
    if not np.isfinite(np.asarray(tip, dtype=float)).all():
        raise SettingError("the tip has a number that isn't finite; give X, Y, Z in mm")
    first, second = (np.asarray(g, dtype=float) for g in grid)
    angles = every_pair(first, second)
    points = np.asarray(tip, dtype=float)
    points = points if points.ndim > 2 else points[..., None, None, :]
    positions = linear_positions(machine, points, angles)
    costs = posture_costs(machine, positions, feed_mm_min)
    return PowerSurface(
        letters=machine.rotaries,
        first=first,
        second=second,
        linear=costs[..., machine.linear_columns].sum(axis=-1),
        rotary=costs[..., machine.rotary_columns].sum(axis=-1),
    )


def posture_costs(machine: Machine, positions: Array, feed_mm_min: float) -> Array:
    """Compute the energy that each axis takes from its zero to a position (Eqs. 6-8).

    Parameters
    ----------
    positions : (..., k), mm and rad
    feed_mm_min : programmed feed, mm/min

    Returns
    -------
    (..., k), J
    """
    plus, minus = travel_costs(machine, np.array([feed_mm_min / 60.0]))
    return plus[0] * np.maximum(positions, 0.0) + minus[0] * np.maximum(-positions, 0.0)
