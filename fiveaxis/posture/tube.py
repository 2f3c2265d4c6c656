"""The cheapest path through a narrow tube around one that is nearly right."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN, one_turn_from
from fiveaxis.posture.lattice import Coordinates
from fiveaxis.posture.problem import VIOLATION_PRICE, Problem
from fiveaxis.posture.tube_kernel import LINEAR, tube_path
from fiveaxis.posture.waves import Waves, has_waves, waves_of


def problem_waves(problem: Problem) -> Waves | None:
    """Work out the waves of a problem's locations; None where its chain or cutter has none."""
    if not has_waves(problem.machine, problem.zone) or len(problem.machine.axes) != LINEAR + 2:
        return None
    return waves_of(problem.machine, problem.pivot, problem.zone, problem.bounds)


def path_through_tube(
    problem: Problem,
    coordinates: Coordinates,
    strands: Array,
    second: Array,
    width: tuple[float, float],
    count: int,
    waves: Waves,
) -> Array:
    """Find the cheapest path through the states of `tube_lattice`, as `shortest_path` would.

    Parameters
    ----------
    strands, second, width, count : as for `tube_lattice`
    waves : of the problem (`problem_waves`)

    Returns
    -------
    (n, k), mm and rad
    """
    machine = problem.machine
    columns = [*machine.linear_columns, *machine.rotary_columns]
    limits = machine.axes[machine.rotary_columns[coordinates.other]].limits
    found = tube_path(
        waves.linear,
        waves.cosines,
        np.array([bound.cosines for bound in problem.bounds]),
        np.stack([machine.low[columns], machine.high[columns]]),
        coordinates.spin,
        -1 if coordinates.level is None else columns.index(coordinates.level),
        limits.low if limits.high - limits.low < TURN else one_turn_from(limits),
        np.ascontiguousarray(strands),
        np.ascontiguousarray(second),
        np.array(width),
        VIOLATION_PRICE,
        count,
        np.ascontiguousarray(problem.plus[:, columns]),
        np.ascontiguousarray(problem.minus[:, columns]),
        np.ascontiguousarray(problem.max_turn),
        problem.turn_prices,
        np.ascontiguousarray(problem.bend_price),
        1.0 / problem.top_speed[columns],
        np.ascontiguousarray(problem.least_time),
        problem.time_price,
    )
    path = np.empty_like(found)
    path[:, columns] = found
    return path
