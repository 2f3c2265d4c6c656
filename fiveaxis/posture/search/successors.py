"""The cheapest path over exact postures, from location to location: which axes stand, globally.

A linear drive draws its whole power while it moves at all, so energy hangs on which axes *stand*, and for how
long. Postures of a grid never make two axes stand. Here a state is an exact posture, and its successors at
the next location are solved from it: hold two axes exactly (Y and Z, X and Z, C and Z, …), hold one and let
another take a step, slide along a bound of the tool's lean with one axis held, or turn as far as allowed
(`_moves`). Every step costs what the program's block costs (`BlockCosts`), and so that axes don't start for
nothing, each start and reversal a little more. Of the states in one cell of level and spin angle the cheapest
stays, where it is; and of all those the cheapest of every region, then the cheapest.

A search looks everywhere, or in a corridor about a known path, which then is among the states throughout: the
result is never dearer than it, and where the path breaks a bound, it is left as soon as possible.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fiveaxis.energy import BlockCosts
from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between, arccos
from fiveaxis.kinematics.windings import TURN
from fiveaxis.motion import standing_speeds
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.lattice import spin_angles
from fiveaxis.posture.search.successor_kernel import Cells, Corridor, Locations, Prices, Tapes, Task, search
from fiveaxis.posture.terms import location_tapes
from fiveaxis.toolpath import divided_rows

# Share of the largest turn that a move takes which turns as far as allowed.
FULL = 1.0 - 1e-4
# rad by which states stay inside the bounds on the lean: between them the tool leans a little otherwise.
INSIDE = np.radians(0.01)
# Price of travel that a drive's constant power has paid already, as a share of that power.
TIE = 1e-3
# First states per cell and direction, and to each side of a path.
FINER, AROUND = 2, 12
# Locations of a search everywhere lie no more than so many apart, and the normal turns no farther, rad.
STRIDE, LARGEST_TURN = 8, np.radians(10.0)
# rad: a move in which it turns farther is divided first; and a path of few locations into so many parts.
FAR_TURN, MOST_PARTS = np.radians(4.0), 2
# A search with fewer states a location isn't one; with more in all it would take too much memory.
FEWEST, MOST = 8, 8_000_000


@dataclass(frozen=True)
class Grain:
    """How finely a search looks.

    Parameters
    ----------
    level, spin : mm and rad, cells of the costliest linear axis and of the rotary axis with the wider range
    states : most of each location
    radius : rad, that the axis with the smaller range may be away from a known path, the other twice as far
    start : s, of the power of a moving axis that its start or reversal costs
    rows : about the fewest locations of a search everywhere
    """

    level: float
    spin: float
    states: int
    radius: float = np.inf
    start: float = 0.02
    rows: int = 250


def cheapest_path(
    problem: Problem,
    costs: BlockCosts,
    grain: Grain,
    known: Array | None = None,
    free: BoolArray | None = None,
) -> Array | None:
    """Find the cheapest path by the price of blocks.

    Parameters
    ----------
    problem : bounds, limits and largest turns of n locations
    costs : of its n − 1 steps
    known : (n, 2), rad, chain order, a path to stay near (`Grain.radius`); None for a search everywhere
    free : (n,), where the search may leave the known path; everywhere by default

    Returns
    -------
    (n, 2), rad; None where the search found no sequence of postures
    """
    n, machine = len(problem), problem.machine
    linear, rotary = machine.linear_columns, machine.rotary_columns
    spin = int(np.argmax(machine.high[rotary] - machine.low[rotary]))
    level = linear[int(np.argmax(costs.standing[..., linear].sum(axis=(0, 1))))]
    endless = not np.isfinite(machine.high[rotary[spin]] - machine.low[rotary[spin]])
    around = round(TURN / grain.spin) if endless else 0
    cells = Cells(level, spin, grain.level, TURN / around if around else grain.spin, around)
    locations = _locations(problem)
    if known is None:
        path, radius, free = np.empty((0, 2)), np.full(2, np.inf), np.ones(n, dtype=bool)
    else:
        path = np.ascontiguousarray(known)
        radius = grain.radius * np.where(np.arange(2) == spin, 2.0, 1.0)
        free = np.ones(n, dtype=bool) if free is None else free
    first = _first_states(problem, locations, cells, path, radius, bool(free[0]))
    if not len(first):
        return None
    tapes = location_tapes(machine, problem.zone)
    states = max(min(grain.states, MOST // n), FEWEST)
    task = Task(
        Tapes(*tapes.slopes.parts, *tapes.bows.parts),
        locations,
        _prices(problem, costs, grain.start),
        _corridor(problem, path, radius, free),
        cells,
        _moves(problem, cells),
    )
    start = problem.positions(np.zeros(len(first), dtype=np.int64), first)
    found, _, reached = search(task, first, start, states)
    # A held axis keeps its angle to the last digit.
    return np.clip(found, machine.low[rotary], machine.high[rotary]) if reached == n else None


def path_anywhere(problem: Problem, costs: BlockCosts, grain: Grain) -> Array | None:
    """Search the whole range of postures on some of the locations; straight lines lie between them.

    Returns
    -------
    (n, 2), rad, a path to search near; between the locations searched it may break bounds. None where no
    sequence of postures was found
    """
    rows, every = _sparse(problem, grain.rows), np.arange(len(problem))
    found = cheapest_path(problem.thinned(rows), costs.thinned(rows), grain)
    if found is None:
        return None
    return np.stack([np.interp(every, rows, angle) for angle in found.T], axis=1)


def turning_rows(problem: Problem, least: int = 0) -> Array:
    """Divide moves in which the direction of the lean turns far; fractional indices of locations.

    Where a path has at most half as many locations as `least`, every move is divided.
    """
    few = np.clip(least // len(problem), 1, MOST_PARTS)
    parts = np.maximum(np.ceil(_turning(problem) / FAR_TURN), few).astype(np.int64)
    return divided_rows(parts)


def _turning(problem: Problem) -> Array:
    """Compute how far the direction of the lean turns in each move, (n − 1,) rad; 0 in links."""
    reference = problem.bounds[0].reference
    return np.nan_to_num(angle_between(reference[1:], reference[:-1]))


def _sparse(problem: Problem, least: int) -> IntArray:
    """Select locations between which the direction of the lean turns little; both ends of every link."""
    turned = _turning(problem)
    ends = np.diff(problem.bound_rows.astype(np.int8)) != 0
    stride = int(np.clip(len(problem) // least, 1, STRIDE))
    rows, since = [0], 0.0
    for row in range(1, len(problem)):
        if row - 1 > rows[-1] and (row - rows[-1] > stride or since + turned[row - 1] > LARGEST_TURN):
            rows.append(row - 1)
            since = 0.0
        since += turned[row - 1]
        if ends[row - 1]:
            rows += [row - 1, row]
            since = 0.0
    return np.unique([*rows, len(problem) - 1])


def _corridor(problem: Problem, path: Array, radius: Array, free: BoolArray) -> Corridor:
    if not len(path):
        return Corridor(path, path, np.empty(0), radius, free)
    # The path may lie on a bound, `INSIDE` which other states stay.
    positions, excess = problem.placed(slice(None), path)
    return Corridor(path, positions, np.maximum(excess, problem.limit_excess(positions)), radius, free)


def _locations(problem: Problem) -> Locations:
    machine, n = problem.machine, len(problem)
    references = np.stack([bound.reference for bound in problem.bounds], axis=1)
    tied = np.isfinite(references).all(axis=2, keepdims=True)
    ends = np.array([_inside(*bound.cosines) for bound in problem.bounds])
    turn = np.where(problem.strict[:, None], problem.max_turn, np.inf)
    return Locations(
        np.hstack([problem.pivot, problem.normal]),
        np.where(tied, references, 0.0),
        np.where(tied, np.broadcast_to(ends, (n, *ends.shape)), [-np.inf, np.inf]),
        machine.low,
        machine.high,
        np.array(machine.rotary_columns, dtype=np.int64),
        np.ascontiguousarray(turn),
    )


def _inside(low: float, high: float) -> tuple[float, float]:
    """Move the ends of a range of cosines `INSIDE`, where they bind at all and leave so much."""
    least = -np.inf if low <= -1.0 else np.cos(float(arccos(low)) - INSIDE)
    most = np.inf if high >= 1.0 else np.cos(float(arccos(high)) + INSIDE)
    return (least, most) if least < most else (low, high)


def _prices(problem: Problem, costs: BlockCosts, start: float) -> Prices:
    machine, time = problem.machine, problem.least_time
    pace = 1.0 / problem.top_speed
    power = np.divide(
        costs.standing, time[:, None], out=np.zeros_like(costs.standing), where=time[:, None] > 0.0
    )
    tie = np.divide(costs.standing, costs.step, out=np.zeros_like(costs.standing), where=costs.step > 0.0)
    return Prices(
        costs.standing,
        costs.slope + TIE * tie,
        costs.reach,
        standing_speeds(machine) * time[:, None],
        start * power,
        problem.bend_price,
        pace,
        time,
        problem.time_price,
    )


def _moves(problem: Problem, cells: Cells) -> Array:
    """List the moves, (m, 2, 4): what each asks of two rows of the model (`successor_kernel.ROW`)."""
    machine, axes = problem.machine, len(problem.machine.axes)
    linear, rotary, level = machine.linear_columns, machine.rotary_columns, cells.level
    spin = rotary[cells.spin]
    hold = {column: (column, 0.0, 0.0, -1.0) for column in range(axes)}
    pairs = [*combinations(linear, 2), *((level, r) for r in rotary), tuple(rotary)]
    moves = [(hold[a], hold[b]) for a, b in pairs]
    moves += [(hold[level], (spin, way * cells.spin_step, 0.0, -1.0)) for way in (-1.0, 1.0)]
    for number in range(len(problem.bounds)):
        ends = [(axes + number, 0.0, 0.0, end) for end in (0.0, 1.0)]
        moves += [(hold[a], end) for a in (*linear, spin) for end in ends]
    if np.isfinite(problem.max_turn[problem.strict]).any():
        far = [(r, 0.0, way * FULL, -1.0) for r in rotary for way in (-1.0, 1.0)]
        moves += [(turn, hold[held]) for turn in far for held in (level, *rotary) if held != turn[0]]
    return np.array(moves)


def _first_states(
    problem: Problem, locations: Locations, cells: Cells, path: Array, radius: Array, free: bool
) -> Array:
    """List admissible postures of the first location, (s, 2) rad: a path's own, and one of every cell."""
    if len(path) and not free:
        return path[:1]
    if len(path):
        steps = [path[0, r] + radius[r] * np.linspace(-1.0, 1.0, 2 * AROUND + 1) for r in range(2)]
    else:
        step = cells.spin_step / FINER
        steps = [spin_angles(problem, r, step)[0] for r in range(2)]
    rotary = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
    positions, excess = problem.placed(np.zeros(len(rotary), dtype=np.int64), rotary)
    sound = (excess <= 0.0) & (problem.limit_excess(positions) <= 0.0)
    rotary, positions = rotary[sound], positions[sound]
    cell = np.stack([positions[:, cells.level] / cells.level_step, rotary[:, cells.spin] / cells.spin_step])
    _, one = np.unique(np.floor(cell), axis=1, return_index=True)
    return np.concatenate([path[:1], rotary[np.sort(one)]])
