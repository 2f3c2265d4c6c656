"""Inner loop of the global search, compiled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray
from fiveaxis.posture.problem import Problem


class Prices(NamedTuple):
    """Prices of the steps between n locations, for k axes.

    Parameters
    ----------
    plus, minus : (n − 1, k), J/mm and J/rad
    max_turn : (n − 1, k), rad, largest step of each axis; infinite for linear axes
    turn_price : (n − 1,), J/rad beyond it
    bend : (n − 1, k), J/rad², of a step's square; 0 for linear axes
    pace : (k,), s/mm and s/rad, at the highest speed; 0 where unknown
    least_time, time_price : (n − 1,) s, and J/s for a step that takes longer
    """

    plus: Array
    minus: Array
    max_turn: Array
    turn_price: Array
    bend: Array
    pace: Array
    least_time: Array
    time_price: float


def step_prices(problem: Problem, columns: Sequence[int]) -> Prices:
    """Collect a problem's prices of steps, with the machine's axes in the order of `columns`."""
    rotary = [columns.index(c) for c in problem.machine.rotary_columns]
    max_turn, bend = np.full(problem.plus.shape, np.inf), np.zeros(problem.plus.shape)
    max_turn[:, rotary], bend[:, rotary] = problem.max_turn, problem.bend_price[:, None]
    return Prices(
        np.ascontiguousarray(problem.plus[:, columns]),
        np.ascontiguousarray(problem.minus[:, columns]),
        max_turn,
        problem.turn_prices,
        bend,
        1.0 / problem.top_speed[columns],
        np.ascontiguousarray(problem.least_time),
        problem.time_price,
    )


@compiled
def relax_layer(
    cost: Array,
    row_least: Array,
    here: Array,
    there: Array,
    price: Array,
    spin: int,
    period: float,
    reach: tuple[int, int],
    prices: Prices,
    row: int,
    best: Array,
    back: IntArray,
) -> None:
    """Take one step of the shortest path: from every state of a layer to every state of the next.

    States form a lattice: index of the spin angle, index of the second coordinate, branch. The spin angle
    depends on its index alone. A predecessor lies within `reach` lattice steps in the first two coordinates,
    on any branch; with ``period > 0`` the first coordinate wraps around. Rows are visited from the nearest
    outwards, and a row whose cheapest state can't win any more is skipped, which prunes nearly all.

    Parameters
    ----------
    cost : (a, b, c), J, of the cheapest path to each state of the previous layer
    row_least : (a,), J, its least value for each spin index
    here, there : (a, b, c, k), mm and rad, axis values of the two layers
    price : (a, b, c), J, of each state of the next layer; infinite where forbidden
    spin : column of the spin axis
    period : rad, 0 where the axis doesn't turn without end
    prices, row : of the steps, and the row of this one
    best : (a, b, c), filled in: J
    back : (a, b, c), filled in: flat index of the predecessor, plus the layer's size times (winding + 1)
    """
    n1, n2, branches = price.shape
    size = n1 * n2 * branches
    plus, minus, max_turn, bend = prices.plus[row], prices.minus[row], prices.max_turn[row], prices.bend[row]
    pace, turn_price = prices.pace, prices.turn_price[row]
    least_time, time_price = prices.least_time[row], prices.time_price
    for i in range(n1):
        for j in range(n2):
            for b in range(branches):
                best[i, j, b] = np.inf
                if price[i, j, b] == np.inf:
                    continue
                least, winner = np.inf, -1
                for w in range(2 * reach[0] + 1):
                    source, winding = i + ((w + 1) // 2 if w % 2 else -(w // 2)), 0
                    if source < 0 or source >= n1:
                        if period == 0.0:
                            continue
                        winding = 1 if source < 0 else -1
                        source += winding * n1
                    turn = there[i, 0, 0, spin] - here[source, 0, 0, spin] + winding * period
                    turning = plus[spin] * turn if turn > 0.0 else -minus[spin] * turn
                    turning += bend[spin] * turn * turn
                    spinning = abs(turn) * pace[spin]
                    if abs(turn) > max_turn[spin]:
                        turning += turn_price * (abs(turn) - max_turn[spin])
                    if row_least[source] + turning >= least:
                        continue
                    for m in range(max(0, j - reach[1]), min(n2, j + reach[1] + 1)):
                        for d in range(branches):
                            total, slowest = cost[source, m, d] + turning, spinning
                            if total >= least:
                                continue
                            for a in range(there.shape[3]):
                                if a == spin:
                                    continue
                                step = there[i, j, b, a] - here[source, m, d, a]
                                total += plus[a] * step if step > 0.0 else -minus[a] * step
                                total += bend[a] * step * step
                                slowest = max(slowest, abs(step) * pace[a])
                                if abs(step) > max_turn[a]:
                                    total += turn_price * (abs(step) - max_turn[a])
                            if slowest > least_time:
                                total += time_price * (slowest - least_time)
                            if total < least:
                                least = total
                                winner = (winding + 1) * size + (source * n2 + m) * branches + d
                best[i, j, b] = least + price[i, j, b]
                back[i, j, b] = winner
