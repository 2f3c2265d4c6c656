"""The cheapest path over exact postures, from location to location, globally.

A drive draws its whole constant power between its slowest and its fastest measured speed, and outside of them
in proportion to speed: two axes at measured speeds cost more than one that goes for both, so there are many
local optima. Postures of a grid hold no axes. Here a state is an exact posture, and its successors at
the next location are solved from it: hold two axes exactly (Y and Z, X and Z, C and Z, …), hold one and let
another take a step, slide along a bound of the tool's lean with one axis held, or turn as far as allowed
(`_moves`). Every step costs what the program's block costs (`BlockCosts`), and so that axes don't start for
nothing, each start and reversal a little more. Of the states in one cell of level and spin angle the cheapest
stays, where it is; and of all those the cheapest of every region, then the cheapest.

A search looks everywhere, or in a corridor about a known path, which then is among the states throughout: the
result is never dearer than it, and where the path breaks a bound, it is left as soon as possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    IntArray,
    Steps,
    angle_between,
    arccos,
    every_pair,
    normalise,
    perpendicular,
    uncounted,
)
from fiveaxis.model import (
    TURN,
    BlockCosts,
    StepTable,
    divided_rows,
    into_limits,
    one_turn_from,
    per_step,
    rotary_angles,
    singular_direction,
    standing_speeds,
)
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.records import (
    BREACH_PRICE,
    ROUNDING,
    Cells,
    Corridor,
    Locations,
    Prices,
    SearchProblem,
    Trail,
    keep_only,
    traced,
    trail_of,
)
from fiveaxis.posture.search.successor_kernel import advance, cheapest_steps
from fiveaxis.posture.terms import location_tapes

# A rotary axis with no more turns than this is searched over its whole range, including its ends.
MOST_TURNS = 2
# mm: a rotary axis has cells as wide as the linear ones' at this distance from its centre.
LEVER = 100.0
# Share of the largest turn that a move takes which turns as far as allowed.
FULL = 1.0 - 1e-4
# rad by which states stay inside the bounds on the lean: between them the tool leans a little otherwise.
INSIDE = np.radians(0.01)
# Of a drive's constant power: s that a start or reversal of its axis costs; share of it that travel costs
# which it has paid already.
START, TIE = 0.005, 1e-3
# rad, between sampled postures; rings through a range of the lean.
SAMPLED, RINGS = np.radians(3.0), 3
# Divisors of cells where none of the larger ones lead through.
FINER = (3.0, 9.0)
# First states per cell and direction, and to each side of a path; where the first one lies in its cell.
PER_CELL, AROUND, BESIDE_END = 3, 12, 1.0 / 8.0
# Locations of a search everywhere lie no more than so many apart, and the normal turns no farther, rad.
STRIDE, LARGEST_TURN = 8, np.radians(10.0)
# rad: a move in which it turns farther is divided first; and a path of few locations into so many parts.
FAR_TURN, MOST_PARTS = np.radians(4.0), 2
# Cuts are divided that are so many times as long as usual, and into how many parts at most.
LONG, MOST_OF_LONG = 3.0, 16
# rad by which a move stays out of the cone in which it would turn too far.
BESIDE_CONE = np.radians(0.05)
# rad: after a turn that is no larger, a mask is queried at its end alone.
SMALL_TURN = np.radians(0.5)
# rad: postures no farther apart are one.
SAME = 1e-9
# 1/mm and 1/rad: inverse travel where there is none.
FULL_SPEED = 1e12
# Length of a direction across the first rotary axis, or mm of a move, that has an azimuth.
WITH_AZIMUTH = 1e-3
# A search with fewer states a location isn't one; with more in all it would take too much memory.
FEWEST, MOST = 8, 8_000_000
# States of one compiled call, after which progress is reported and the search can be stopped: some 0.1 s.
AT_ONCE = 20_000

# Locations to each side of a refused one, and of a tight one, at which a mask is queried, too; above that
# share of locations it is queried at all.
QUERIED_BESIDE, BESIDE_TIGHT, MOST_QUERIED = 4, 2, 0.5
# rad: a mask that refuses a posture so far from a path's is in its way.
EDGE = np.radians(1.0)
# Which postures, (m, 2) rad, a mask admits; (m,). Row 2 i is location i, row 2 i − 1 halfway to it.
Admits = Callable[[IntArray, Array], BoolArray]


@dataclass(frozen=True, eq=False)
class ConeLimit(StepTable):
    """Directions about the singular one, to an angle in rad, within which the first rotary axis is bounded.

    Turns, (n − 1,) rad, are the largest of the axis in each step there.
    """

    angle: float
    turns: Array = field(metadata=per_step())


@dataclass(frozen=True)
class Resolution:
    """How finely a search looks.

    Parameters
    ----------
    level, spin : mm and rad, cells of the costliest axis, which may be the other rotary one (`LEVER`), and of
        the rotary axis with the wider range
    states : most of each location
    radius : rad, that the axis with the smaller range may be away from a known path, the other twice as far
    rows : about the fewest locations of a search everywhere
    backwards : whether a search everywhere begins at the last location: which states look cheap on the way
        depends on where it comes from
    """

    level: float
    spin: float
    states: int
    radius: float = np.inf
    rows: int = 250
    backwards: bool = False

    @property
    def finer(self) -> tuple[Resolution, ...]:
        """What to try where a search found no sequence of postures."""
        return tuple(
            replace(self, level=self.level / by, spin=self.spin / by, states=round(1.6 * by * self.states))
            for by in FINER
        )


def cheapest_path(
    problem: Problem,
    costs: BlockCosts,
    resolution: Resolution,
    known: Array | None = None,
    free: BoolArray | None = None,
    admits: Admits | None = None,
    tight: BoolArray | None = None,
    cone_limit: ConeLimit | None = None,
    steps: Steps = uncounted,
) -> Array:
    """Find the cheapest path by the price of blocks.

    Parameters
    ----------
    problem : bounds, limits and largest turns of n locations
    costs : of its n − 1 steps
    known : (n, 2), rad, chain order, a path to stay near (`Resolution.radius`); None for a search everywhere
    free : (n,), where the search may leave the known path; everywhere by default
    admits : what a mask admits; where it refuses the known path, that counts as a broken bound. It is queried
        at the locations `tight`, (n,), and about those where the path that is found otherwise is refused, and
        at all locations only if these are many
    tight : where a mask is in the way, as far as is known; nowhere by default
    cone_limit : bounds near the singular direction
    steps : called with the locations done and their number

    Returns
    -------
    (m, 2), rad; m < n where no posture of location m was reached
    """
    free = np.ones(len(problem), dtype=bool) if known is None or free is None else free
    # Away from what is in the way, a mask would be queried at thousands of postures for nothing.
    queried = np.zeros(len(problem), dtype=bool) if tight is None else widened(tight, BESIDE_TIGHT)
    while admits is not None and np.count_nonzero(queried) <= MOST_QUERIED * len(problem):
        asked = queried & free
        found = _cheapest_path(problem, costs, resolution, known, free, admits, cone_limit, steps, asked)
        if len(found) < len(problem):
            break
        turned = np.diff(found, axis=0, prepend=found[:1])
        refused = free & ~queried & ~_admitted_ways(np.arange(len(found)), found, turned, admits)
        if not refused.any():
            return found
        queried |= widened(refused, QUERIED_BESIDE)
    return _cheapest_path(problem, costs, resolution, known, free, admits, cone_limit, steps, free)


def _cheapest_path(
    problem: Problem,
    costs: BlockCosts,
    resolution: Resolution,
    known: Array | None,
    free: BoolArray,
    admits: Admits | None,
    cone_limit: ConeLimit | None,
    steps: Steps,
    queried: BoolArray,
) -> Array:
    """Find the cheapest path with the mask queried at some of the locations, (n,); otherwise as above."""
    n, machine = len(problem), problem.machine
    linear, rotary = machine.linear_columns, machine.rotary_columns
    spin = int(np.argmax(machine.high[rotary] - machine.low[rotary]))
    # Of the axes beside the spin axis, the one for which a cell of travel costs most.
    beside = [*linear, rotary[1 - spin]]
    sizes = resolution.level / np.array([1.0] * len(linear) + [LEVER])
    dear = costs.standing[..., beside] if costs.standing.any() else costs.slope[..., beside] * sizes
    costliest = int(np.argmax(dear.sum(axis=(0, 1))))
    level, height = beside[costliest], float(sizes[costliest])
    around = round(TURN / resolution.spin) if machine.is_endless[rotary[spin]] else 0
    step, phase = (TURN / around, _phase(problem, spin)) if around else (resolution.spin, 0.0)
    # Samples begin at the phase, where rounding mustn't decide which cell is theirs.
    cells = Cells(level, spin, height, step, around, phase - BESIDE_END * step if around else 0.0)
    # Only a mask closes ways in a link: else further states would but crowd out others.
    locations = _locations(problem, cone_limit, np.nan if admits is None else step)
    if known is None:
        path, radius = np.empty((0, 2)), np.full(2, np.inf)
    else:
        path = np.ascontiguousarray(known)
        radius = np.where(np.arange(2) == spin, 2.0, 1.0) * resolution.radius
    first = _first_states(problem, locations, cells, path, radius, bool(free[0]))
    if not len(first):
        return first
    tapes = location_tapes(machine, problem.zone)
    states = max(min(resolution.states, MOST // n), FEWEST)
    corridor = _corridor(problem, path, radius, free)
    searched = SearchProblem(
        tapes.gradients.parts,
        tapes.second_derivatives.parts,
        locations,
        _prices(problem, costs),
        corridor,
        cells,
        _moves(problem, cells),
    )
    start = problem.positions(np.zeros(len(first), dtype=np.int64), first)
    trail = trail_of(searched, first, start, states)
    if len(path) and corridor.path[0, 2] > ROUNDING:
        trail.layers.cost[0, 0] = BREACH_PRICE
    reached = _searched(problem, searched, trail, states, admits, queried, steps)
    # A held axis keeps its angle to the last digit.
    return np.clip(
        traced(trail, reached) if reached else first[:0], machine.low[rotary], machine.high[rotary]
    )


def _searched(
    problem: Problem,
    searched: SearchProblem,
    trail: Trail,
    most: int,
    admits: Admits | None,
    queried: BoolArray,
    steps: Steps,
) -> int:
    """Search from the first location on, with a mask queried at some of them, (n,); how many were reached."""
    last = len(searched.locations.given) - 1
    known, margin, i = searched.corridor.path[:, :2], np.inf, 0
    # In links, axes turn as far as they like.
    stops = queried.copy() if admits else np.zeros(last + 1, dtype=bool)
    everywhere = not np.isfinite(searched.corridor.radius).any()
    linked = np.append(False, ~problem.strict & everywhere)
    stops |= linked
    interval = max(AT_ONCE // most, 1)
    stops[::interval] = True
    samples: dict[int, Array] = {}
    while True:
        if i % interval == 0:
            steps(i, last + 1)
        if admits and queried[i]:
            stays = _admitted(trail, i, admits)
            if len(known):
                # The path itself stays, at a price.
                here = trail.states[trail.begin[i] : trail.begin[i + 1]]
                own = (np.abs(here - known[i]) < SAME).all(axis=1)
                trail.layers.cost[i % 2, np.flatnonzero(own & ~stays)] += BREACH_PRICE
                stays |= own
            keep_only(trail, i, stays)
        if i == last or trail.begin[i + 1] == trail.begin[i]:
            return i + int(trail.begin[i + 1] > trail.begin[i])
        following = min(i + 1 + int(np.argmax(np.append(stops[i + 1 :], True))), last)
        reached, margin = advance(searched, trail, i, following, most, margin)
        if everywhere and (reached < following or linked[following]):
            reached, margin = min(reached + 1, following), np.inf
            if not _bridged(problem, searched, trail, reached, most, samples):
                return reached
        if reached < following and not everywhere:
            return reached + 1
        i = reached


def _bridged(
    problem: Problem, searched: SearchProblem, trail: Trail, i: int, most: int, samples: dict[int, Array]
) -> bool:
    """Add sampled postures to the states of location i: no move leads there, or from afar.

    In a link they are those of the cut that it leads to, the same all along; `samples` keeps them by row.
    """
    trail.begin[i + 1] = max(trail.begin[i + 1], trail.begin[i])
    costs = trail.layers.cost[i % 2, : trail.begin[i + 1] - trail.begin[i]]
    if len(costs) > most // 2:
        cheapest = np.zeros(len(costs), dtype=bool)
        cheapest[np.argsort(costs, kind="stable")[: most // 2]] = True  # many may cost the same
        keep_only(trail, i, cheapest)
    before, size = (int(trail.begin[k + 1] - trail.begin[k]) for k in (i - 1, i))
    layers, then = trail.layers, i % 2
    ahead = np.flatnonzero(problem.bound_rows[i:])
    row = i + int(ahead[0]) if len(ahead) else i
    if row not in samples:
        samples[row] = sampled(problem, row)
    rotary = samples[row]
    rotary = np.ascontiguousarray(rotary[:: -(-len(rotary) // (most - size)) or 1])
    positions = problem.positions(np.full(len(rotary), i), rotary)
    cost, came = np.empty(len(rotary)), np.empty((2, len(rotary)), dtype=np.int64)
    cheapest_steps(searched, layers, before, i - 1, rotary, positions, trail.space, cost, came)
    kept = np.flatnonzero(np.isfinite(cost))
    begin = int(trail.begin[i]) + size
    rows, at = slice(begin, begin + len(kept)), slice(size, size + len(kept))
    trail.states[rows], trail.parents[rows] = rotary[kept], trail.begin[i - 1] + came[0, kept]
    layers.rotary[then, at], layers.positions[then, at] = rotary[kept], positions[kept]
    layers.cost[then, at], layers.moved[then, at] = cost[kept], came[1, kept]
    trail.begin[i + 1] = begin + len(kept)
    return trail.begin[i + 1] > trail.begin[i]


def _admitted(trail: Trail, i: int, admits: Admits) -> BoolArray:
    """Find the states of location i that a mask admits, there and halfway on the way to them; (s,)."""
    states = slice(trail.begin[i], trail.begin[i + 1])
    here = trail.states[states]
    turned = here - trail.states[trail.parents[states]] if i else np.zeros_like(here)
    return _admitted_ways(np.full(len(here), i), here, turned, admits)


def _admitted_ways(rows: IntArray, rotary: Array, turned: Array, admits: Admits) -> BoolArray:
    """Find the postures, (m, 2) rad, at locations, (m,), that a mask admits, and halfway to them; (m,)."""
    far = np.flatnonzero(np.abs(turned).max(axis=1, initial=0.0) > SMALL_TURN)
    queried = np.concatenate([2 * rows, 2 * rows[far] - 1])
    admitted = admits(queried, np.concatenate([rotary, rotary[far] - turned[far] / 2.0]))
    stays, halfway = np.split(admitted, [len(rows)])
    stays[far] &= halfway
    return stays


def in_the_way(path: Array, admits: Admits) -> BoolArray:
    """Find where a mask refuses the postures of a path, (n, 2) rad, or those beside them; (n,)."""
    beside = EDGE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    tried = (path[:, None] + beside).reshape(-1, 2)
    admitted = admits(np.repeat(2 * np.arange(len(path)), len(beside)), tried)
    return np.asarray(~admitted.reshape(len(path), -1).all(axis=1))


def widened(marked: BoolArray, reach: int) -> BoolArray:
    """Mark all locations, (n,), that are at most so many away from a marked one."""
    count = np.cumsum(np.pad(marked.astype(np.int64), (reach + 1, reach)))
    return count[2 * reach + 1 :] > count[: -2 * reach - 1]


def path_anywhere(
    problem: Problem,
    costs: BlockCosts,
    resolution: Resolution,
    admits: Admits | None = None,
    tight: BoolArray | None = None,
    cone_limit: ConeLimit | None = None,
    steps: Steps = uncounted,
) -> Array:
    """Search the whole range of postures, more finely where no sequence of them is found.

    Parameters are those of `cheapest_path`. The path, (m, 2) rad, has m < n where no posture of location m,
    counted from the end where a search begins, was reached.
    """
    if resolution.backwards:
        problem, costs = problem.backwards(), costs.backwards()
        cone_limit = None if cone_limit is None else cone_limit.backwards()
        tight = None if tight is None else tight[::-1]
        given, last = admits, 2 * len(problem) - 2
        admits = None if given is None else lambda rows, rotary: given(last - rows, rotary)
    for finer in (resolution, *resolution.finer):
        found = cheapest_path(
            problem, costs, finer, admits=admits, tight=tight, cone_limit=cone_limit, steps=steps
        )
        if len(found) == len(problem):
            return _begun_near_zero(problem, found[::-1]) if resolution.backwards else found
    return found


def _begun_near_zero(problem: Problem, path: Array) -> Array:
    """Shift endless axes of a path, (n, 2) rad, by whole turns, so that it begins within half a turn of 0."""
    endless = problem.machine.is_endless[problem.machine.rotary_columns]
    return path - np.where(endless, TURN * np.round(path[0] / TURN), 0.0)


def _phase(problem: Problem, spin: int) -> float:
    """Return an angle of an endless rotary axis, rad, that turns with the part where that is on its table.

    Cells and samples that begin there make the same search for a part that is turned: it is the azimuth of
    the first direction, or else of the first move, that has one. For the axis that comes second it is 0.
    """
    about = singular_direction(problem.machine)
    across = normalise(perpendicular(about))
    directions = np.nan_to_num(problem.bounds[0].reference)
    for vectors in (directions, np.diff(problem.pivot, axis=0)) if spin == 0 else ():
        first, second = (np.sum(vectors * side, axis=1) for side in (across, np.cross(about, across)))
        has_one = np.hypot(first, second) > WITH_AZIMUTH
        if has_one.any():
            row = int(np.argmax(has_one))
            return math.atan2(second[row], first[row])
    return 0.0


def spin_angles(problem: Problem, spin: int, step: float) -> Array:
    """Sample the range of a rotary axis, (a,) rad; of one with many turns, the turn next to 0."""
    column = problem.machine.rotary_columns[spin]
    limits = problem.machine.axes[column].limits
    if limits.span <= MOST_TURNS * TURN:
        return np.linspace(limits.low, limits.high, int(np.ceil(limits.span / step)) + 1)
    low, count = one_turn_from(limits), int(np.ceil(TURN / step))
    phase = 0.0 if np.isfinite(limits.span) else _phase(problem, spin) - low
    return np.asarray(low + (phase + TURN / count * np.arange(count)) % TURN)


def turning_rows(problem: Problem, least: int = 0) -> Array:
    """Divide cuts that are long or in which the direction of the lean turns far; fractional indices.

    Where a path has at most half as many locations as `least`, every move is divided.
    """
    few = np.clip(least // len(problem), 1, MOST_PARTS)
    lengths = np.linalg.norm(np.diff(problem.pivot, axis=0), axis=1)
    usual = np.median(lengths[problem.strict]) if problem.strict.any() else 0.0
    long = np.divide(lengths, LONG * usual, out=np.ones_like(lengths), where=problem.strict & (usual > 0.0))
    parts = np.maximum(np.ceil(_turning(problem) / FAR_TURN), np.ceil(np.clip(long, few, MOST_OF_LONG)))
    return divided_rows(parts.astype(np.int64))


def _turning(problem: Problem) -> Array:
    """Compute how far the direction of the lean turns in each move, (n − 1,) rad; 0 in links."""
    reference = problem.bounds[0].reference
    return np.nan_to_num(angle_between(reference[1:], reference[:-1]))


def sparse_rows(problem: Problem, least: int) -> IntArray:
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
    near = float(radius[0]), float(radius[1])
    if not len(path):
        return Corridor(np.empty((0, 3 + len(problem.machine.axes))), near, free)
    # The path may lie on a bound, `INSIDE` which other states stay.
    positions, excess = problem.placed(slice(None), path)
    excess = np.maximum(excess, problem.limit_excess(positions))
    return Corridor(np.column_stack([path, excess, positions]), near, free)


def _locations(problem: Problem, cone_limit: ConeLimit | None, link_turn: float) -> Locations:
    machine, n = problem.machine, len(problem)
    references = np.stack([bound.reference for bound in problem.bounds], axis=1)
    tied = np.isfinite(references).all(axis=2, keepdims=True)
    ends = np.array([_inside(*bound.cosines) for bound in problem.bounds])
    cosines = np.where(tied, np.broadcast_to(ends, (n, *ends.shape)), [-np.inf, np.inf])
    turn = np.where(problem.strict[:, None], problem.max_turn, np.inf)
    within_cone = np.full(len(turn), np.inf) if cone_limit is None else cone_limit.turns
    first, second = machine.rotary_columns
    x, y, z = singular_direction(machine).tolist()
    return Locations(
        np.hstack([problem.pivot, problem.normal]),
        np.concatenate([np.where(tied, references, 0.0), cosines], axis=2),
        np.stack([machine.low, machine.high]),
        (first, second),
        np.column_stack([turn, within_cone]),
        (x, y, z),
        2.0 if cone_limit is None else float(np.cos(cone_limit.angle + BESIDE_CONE)),
        link_turn,
    )


def _inside(low: float, high: float) -> tuple[float, float]:
    """Move the ends of a range of cosines `INSIDE`, where they bind at all and leave so much."""
    least = -np.inf if low <= -1.0 else np.cos(float(arccos(low)) - INSIDE)
    most = np.inf if high >= 1.0 else np.cos(float(arccos(high)) + INSIDE)
    return (least, most) if least < most else (low, high)


def _prices(problem: Problem, costs: BlockCosts) -> Prices:
    machine, time = problem.machine, problem.least_time
    pace = 1.0 / problem.top_speed
    power = np.divide(
        costs.standing, time[:, None], out=np.zeros_like(costs.standing), where=time[:, None] > 0.0
    )
    tie = np.divide(costs.standing, costs.step, out=np.zeros_like(costs.standing), where=costs.step > 0.0)
    # By row: `records.STANDING` to `PACE`. In one order of memory, as loops are compiled for each.
    least = standing_speeds(machine) * time[:, None]
    ways = [*costs.standing, *(costs.slope + TIE * tie), *(START * power)]
    alone = [_inverse(costs.slow), _inverse(costs.measured), least, np.broadcast_to(pace, least.shape)]
    return Prices(
        np.ascontiguousarray(np.stack([*ways, *alone], axis=1)),
        np.column_stack([problem.bend_price, time]),
        problem.time_price,
    )


def _inverse(travel: Array) -> Array:
    """Invert travels, (n, k)."""
    return np.divide(1.0, travel, out=np.full(travel.shape, FULL_SPEED), where=travel > 0.0)


def _moves(problem: Problem, cells: Cells) -> Array:
    """List the moves, (m, 2, 4): what each asks of two rows of the model (`records.ROW`)."""
    machine, axes = problem.machine, len(problem.machine.axes)
    linear, rotary, level = machine.linear_columns, machine.rotary_columns, cells.level
    spin = rotary[cells.spin]
    hold = {column: (column, 0.0, 0.0, -1.0) for column in range(axes)}
    pairs = [*combinations(linear, 2), *((level, r) for r in rotary if level in linear), tuple(rotary)]
    moves = [(hold[a], hold[b]) for a, b in pairs]
    moves += [(hold[level], (spin, way * cells.spin_step, 0.0, -1.0)) for way in (-1.0, 1.0)]
    for number in range(len(problem.bounds)):
        ends = [(axes + number, 0.0, 0.0, end) for end in (0.0, 1.0)]
        moves += [(hold[a], end) for a in dict.fromkeys((*linear, level, spin)) for end in ends]
    if np.isfinite(problem.max_turn[problem.strict]).any():
        far = [(r, 0.0, way * FULL, -1.0) for r in rotary for way in (-1.0, 1.0)]
        moves += [
            (turn, hold[held]) for turn in far for held in dict.fromkeys((level, *rotary)) if held != turn[0]
        ]
    return np.array(moves)


def _first_states(
    problem: Problem, locations: Locations, cells: Cells, path: Array, radius: Array, free: bool
) -> Array:
    """List admissible postures of the first location, (s, 2) rad: a path's own, and one of every cell."""
    if len(path) and not free:
        return path[:1]
    if np.isfinite(radius).any():
        steps = [path[0, r] + radius[r] * np.linspace(-1.0, 1.0, 2 * AROUND + 1) for r in range(2)]
        rotary = _sound(problem, 0, every_pair(*steps).reshape(-1, 2))
    else:
        rotary = sampled(problem, 0, cells.spin_step / PER_CELL)
    positions = problem.positions(np.zeros(len(rotary), dtype=np.int64), rotary)
    level = np.floor(positions[:, cells.level] / cells.level_step)
    spin = np.floor((rotary[:, cells.spin] - cells.phase) / cells.spin_step)
    cell = np.stack([level, spin % cells.around if cells.around else spin])
    _, one = np.unique(cell, axis=1, return_index=True)
    return np.concatenate([path[:1], rotary[np.sort(one)]])


def sampled(problem: Problem, row: int, step: float = SAMPLED) -> Array:
    """List admissible postures of a location, (s, 2) rad: a grid of both angles, and rings about references.

    Neighbours are a step apart, rad. In a narrow range of the lean the grid may have none.
    """
    tried = [every_pair(*(spin_angles(problem, r, step) for r in range(2))).reshape(-1, 2)]
    around, about = np.arange(0.0, TURN, step)[:, None], singular_direction(problem.machine)
    for bound in problem.bounds:
        reference = bound.reference[row]
        if not np.isfinite(reference).all():
            continue
        # A ring begins in the plane of the singular direction, and so turns with the part.
        upright = about - reference * np.sum(reference * about)
        has_azimuth = np.sum(upright**2) > WITH_AZIMUTH**2
        across = normalise(upright if has_azimuth else perpendicular(reference))
        side = np.cos(around) * across + np.sin(around) * np.cross(reference, across)
        inside = min(INSIDE, (bound.high - bound.low) / 2.0)
        lean = np.linspace(bound.low + inside, bound.high - inside, RINGS)[:, None, None]
        axis = (np.cos(lean) * reference + np.sin(lean) * side).reshape(-1, 3)
        rings = np.stack([r.reshape(RINGS, -1, 2) for r in rotary_angles(problem.machine, axis)], axis=1)
        rings = rings.reshape(-1, 2)
        tried.append(into_limits(problem.machine, rings[np.isfinite(rings).all(axis=1)]))
    return _sound(problem, row, np.concatenate(tried))


def _sound(problem: Problem, row: int, rotary: Array) -> Array:
    """Return those of the postures of a location, (s, 2) rad, that keep bounds and limits."""
    positions, excess = problem.placed(np.full(len(rotary), row), rotary)
    return rotary[(excess <= ROUNDING) & (problem.limit_excess(positions) <= ROUNDING)]
