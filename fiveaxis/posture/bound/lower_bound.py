"""What no posture can avoid: a certified lower bound of the travel metric, without any search.

At each location only some values of an axis are possible over all admissible postures. A sequence that must
visit these sets one after the other has a least cost, which is found exactly; the sum over the axes is less
than any path can cost. The sets are enclosed from outside by interval arithmetic over cells of the rotary
angles (mean value form), so nothing that is possible is left out, and the bound is one for whatever way the
path was found. Both rotary axes are taken together, each linear axis alone: what a linear axis would save
may cost another one dearly, which is why the bound may lie far below the optimum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import travel_costs
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.posture.bound.cells import HUGE, Cells, cut_cells
from fiveaxis.posture.bound.visiting import least_travel, visit_cells
from fiveaxis.toolpath import TiltBounds, Toolpath

# rad, width of a cell.
CELL = np.radians(3.0)
# Locations looked at: one in so many, but at least and at most about these. What lies between adds little
# where a path is short; a long one takes so long to solve that the bound is looked for more closely.
ONE_IN, FEWEST_ROWS, MOST_ROWS = 4, 900, 4000
# Places of a linear axis between which its least travel is found: bounds are rounded outwards to these.
PLACES = 4000
# A bound is widened by this to cover rounding (mm, rad, 1).
ROUNDING = 1e-9


@dataclass(frozen=True)
class LowerBound:
    """The least that any admissible path costs, J of the travel metric.

    Parameters
    ----------
    linear : by axis letter, each on its own
    rotary : of both rotary axes together
    rows : locations that were looked at
    """

    linear: dict[str, float]
    rotary: float
    rows: int

    @property
    def total(self) -> float:
        """Least cost of all axes, J."""
        return self.rotary + sum(self.linear.values())

    def gap(self, cost: float) -> float:
        """Give the share of a cost that the bound leaves open: 0 is proven to be the optimum."""
        return 1.0 - self.total / cost if cost > 0.0 else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {"total": self.total, "linear": dict(self.linear), "rotary": self.rotary, "rows": self.rows}


def bound_travel(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, *, cell: float = CELL) -> LowerBound:
    """Bound the travel metric of every path that keeps the tilt range and the axis limits from below.

    Largest rotary steps aren't considered; they only make paths dearer. An axis with more than a turn to go
    is taken as one without limits.

    Parameters
    ----------
    toolpath, machine, tilt : the problem
    cell : rad, width of the cells; smaller ones give a higher bound

    Returns
    -------
    The bound; its figures are infinite where some location has no admissible posture.
    """
    count = len(toolpath)
    stride = -(-count // min(max(count // ONE_IN, FEWEST_ROWS), MOST_ROWS))
    rows = np.unique(np.append(np.arange(0, count, stride), count - 1))
    prices = travel_costs(machine, toolpath.feed, toolpath.rapid)
    plus, minus = (_least_between(costs[1:], rows) for costs in prices)
    cells = cut_cells(machine, toolpath.zone, cell)
    at = toolpath.at(rows)
    bounds = [bound.at(rows) for bound in tilt.all]
    columns = machine.rotary_columns
    step = np.array([side.step for side in cells.sides])
    limits = (
        np.maximum(machine.low[machine.linear_columns], -HUGE) - ROUNDING,
        np.minimum(machine.high[machine.linear_columns], HUGE) + ROUNDING,
    )
    cosines = _admitted_cosines(cells, bounds)
    # The matrices have four columns: threads of the BLAS would only wait for each other.
    with threadpool_limits(limits=1):
        rotary, low, high = visit_cells(
            cells, at, bounds, cosines, limits, step * plus[:, columns], step * minus[:, columns]
        )
    linear = {
        machine.letters[column]: _axis_bound(low[:, i], high[:, i], plus[:, column], minus[:, column])
        for i, column in enumerate(machine.linear_columns)
    }
    return LowerBound(linear, rotary, len(rows))


def _least_between(costs: Array, rows: IntArray) -> Array:
    """Give the least cost of travel, (m − 1, k), on the way between chosen rows: all of it is paid there."""
    return np.minimum.reduceat(costs, rows[:-1], axis=0) if len(rows) > 1 else costs


def _admitted_cosines(cells: Cells, bounds: list[TiltBounds]) -> tuple[Array, Array]:
    """Give the cosines in a cell's middle with which a posture in it may keep a bound, (b, c) each."""
    low = [np.cos(np.minimum(bound.high + cells.swing, np.pi)) - ROUNDING for bound in bounds]
    high = [np.cos(np.maximum(bound.low - cells.swing, 0.0)) + ROUNDING for bound in bounds]
    return np.array(low), np.array(high)


def _axis_bound(low: Array, high: Array, plus: Array, minus: Array) -> float:
    """Find the least cost of an axis that visits ranges, (m,) mm each, one after the other."""
    bound: BoolArray = (low > -HUGE) & (high < HUGE)
    if not bound.any():
        return 0.0
    if (low > high).any():
        return float("inf")
    least, most = low[bound].min(), high[bound].max()
    step = max((most - least) / PLACES, ROUNDING)
    first = np.where(bound, np.floor((low - least) / step), 0).astype(np.int64)
    last = np.where(bound, np.ceil((high - least) / step), PLACES).astype(np.int64)
    return least_travel(np.maximum(first, 0), np.minimum(last, PLACES), step * plus, step * minus)
