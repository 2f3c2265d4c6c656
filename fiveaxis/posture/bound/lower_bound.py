"""A certified lower bound of the travel metric, without any search.

Over all admissible postures of a location an axis can take only some values. The least cost of a sequence
that visits these sets in order is found exactly, and no path costs less than the sum over the axes. Interval
arithmetic over cells of the rotary angles (mean value form) encloses the sets from outside, so no possible
posture is left out, and the bound holds however a path was found. Both rotary axes are treated together, each
linear axis alone; as savings of one linear axis may be costly for another, the bound may lie far below the
optimum.
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
# One location in ONE_IN is used, but at least and at most about these numbers: more add little to the bound
# of a short path, and a long path, slow to solve anyway, affords more.
ONE_IN, FEWEST_ROWS, MOST_ROWS = 4, 900, 4000
# Values of a linear axis for which its least travel is found; ranges are rounded outwards to these.
LEVELS = 4000
# Bounds are widened by this to cover rounding (mm, rad, 1).
ROUNDING = 1e-9


@dataclass(frozen=True)
class LowerBound:
    """A lower bound of the cost of every admissible path, J of the travel metric.

    Parameters
    ----------
    linear : by axis letter, each alone
    rotary : of both rotary axes together
    rows : number of locations used
    """

    linear: dict[str, float]
    rotary: float
    rows: int

    @property
    def total(self) -> float:
        """Bound over all axes, J."""
        return self.rotary + sum(self.linear.values())

    def gap(self, cost: float) -> float:
        """Compute the share of a cost above the bound: 0 proves an optimum."""
        return 1.0 - self.total / cost if cost > 0.0 else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {"total": self.total, "linear": dict(self.linear), "rotary": self.rotary, "rows": self.rows}


def bound_travel(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, *, cell: float = CELL) -> LowerBound:
    """Bound from below the travel metric of every path that keeps the tilt range and the axis limits.

    Limits of rotary steps, which only raise the cost, aren't considered. An axis of more than a turn counts
    as unlimited.

    Parameters
    ----------
    toolpath, machine, tilt : the problem
    cell : rad, width of the cells; smaller ones give a higher bound

    Returns
    -------
    The bound; infinite if some location has no admissible posture
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
    # With matrices of four columns BLAS threads would only wait for each other.
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
    """Return the least cost per travel, (m − 1, k), of the moves between consecutive chosen rows."""
    return np.minimum.reduceat(costs, rows[:-1], axis=0) if len(rows) > 1 else costs


def _admitted_cosines(cells: Cells, bounds: list[TiltBounds]) -> tuple[Array, Array]:
    """Compute the cosines in the middle of cells for which postures in them may keep a bound, (b, c) each."""
    low = [np.cos(np.minimum(bound.high + cells.swing, np.pi)) - ROUNDING for bound in bounds]
    high = [np.cos(np.maximum(bound.low - cells.swing, 0.0)) + ROUNDING for bound in bounds]
    return np.array(low), np.array(high)


def _axis_bound(low: Array, high: Array, plus: Array, minus: Array) -> float:
    """Find the least cost of an axis that visits ranges, (m,) mm each, in order."""
    bound: BoolArray = (low > -HUGE) & (high < HUGE)
    if not bound.any():
        return 0.0
    if (low > high).any():
        return float("inf")
    least, most = low[bound].min(), high[bound].max()
    step = max((most - least) / LEVELS, ROUNDING)
    first = np.where(bound, np.floor((low - least) / step), 0).astype(np.int64)
    last = np.where(bound, np.ceil((high - least) / step), LEVELS).astype(np.int64)
    return least_travel(np.maximum(first, 0), np.minimum(last, LEVELS), step * plus, step * minus)
