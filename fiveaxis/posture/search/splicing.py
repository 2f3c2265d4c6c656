"""One path of the best parts of several."""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model import TURN, BlockCosts
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.successor_kernel import COURSE_PART


def spliced(problem: Problem, costs: BlockCosts, paths: list[Array]) -> Array:
    """Take at every location the posture of any path, so that all steps together cost least; (n, 2) rad.

    Paths are (n, 2) rad. By the price of blocks, of time beyond the feed's and of what is broken, none of
    them costs less. An axis without limits turns the shorter way from one path to another, so its angles may
    be whole turns away from those given. No step from one to another turns far: linear axes would travel
    farther along its course than from end to end, which is what is priced.
    """
    machine, rotary, count = problem.machine, np.stack(paths, axis=1), len(paths)
    positions, excess = problem.placed(slice(None), rotary)
    steps = np.empty((len(problem) - 1, count, count))
    for here, there in np.ndindex(count, count):
        moves = positions[1:, there] - positions[:-1, here]
        moves -= np.where(machine.is_endless, TURN * np.rint(moves / TURN), 0.0)
        far = np.abs(moves[:, machine.rotary_columns]).max(axis=1) > COURSE_PART
        steps[:, here, there] = np.where(far & (here != there), np.inf, _step_prices(problem, costs, moves))
    cost, *at = np.nan_to_num(problem.place_prices(positions, excess), nan=np.inf, posinf=np.inf)
    came, own = np.zeros((len(problem), count), dtype=np.int64), np.arange(count)
    for i, step in enumerate(np.nan_to_num(steps, nan=np.inf, posinf=np.inf)):
        reached = cost[:, None] + step
        came[i + 1] = np.argmin(reached, axis=0)
        cost = reached[came[i + 1], own] + at[i]
    chosen = np.full(len(problem), np.argmin(cost))
    for i in range(len(problem) - 1, 0, -1):
        chosen[i - 1] = came[i, chosen[i]]
    found = rotary[np.arange(len(problem)), chosen]
    return np.where(machine.is_endless[machine.rotary_columns], np.unwrap(found, axis=0), found)


def _step_prices(problem: Problem, costs: BlockCosts, moves: Array) -> Array:
    """Price steps by the moves of all axes, (n − 1, k) mm and rad; (n − 1,) J."""
    plus, minus = costs.near(np.abs(moves), 0.0)
    late = np.max(np.abs(moves) / problem.top_speed, axis=1) - problem.least_time
    spent = np.sum(plus * np.maximum(moves, 0.0) + minus * np.maximum(-moves, 0.0), axis=1)
    turned = problem.turn_prices(moves[:, problem.machine.rotary_columns])
    return spent + problem.time_price * np.maximum(late, 0.0) + turned
