"""Inner loop of the search over exact postures (`successors`), compiled.

States lie in arrays that are read by index: in compiled loops a view of an array costs as much as the
arithmetic on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fiveaxis.compiled import compiled, inner
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.posture.tape import play

# A number or an array of them.

# What a move asks of a posture, columns of `moves`: a row of the model, the shift of its value, the multiple
# of the largest turn added to it, and the end of a bound that it lies on (0 low, 1 high; -1 for none).
ROW, SHIFT, FAR, END = range(4)
# Moves of a corridor: to the path's posture, and to its spin angle with the level held.
ONTO, BESIDE = -1, -2
# Iterations of Newton's method; its largest steps, rad; a determinant, in mm/rad, that is none.
MOST, STEEP, SINGULAR = 6, 1.2, 1e-6
# rad: what is left after a step of this size is less than what a program's digits can say.
CLOSE = 1e-5
# Cosine by which the model of a candidate may be out of bounds, and share of the margin by which it may cost
# more than the dearest state kept: both are decided exactly for those that are kept.
ROUGHLY, SPARE = 2e-3, 1.2
# mm, rad or cosine: excess that is rounding.
ROUNDING = 1e-9
# Cosine by which the lean may be out of its bounds halfway between two locations.
HALFWAY = 1e-4
# J, and J per mm, rad or cosine: prices of the path of a corridor where it breaks a bound.
BROKEN, PER_EXCESS = 1e7, 1e6
# Regions of both angles that keep their cheapest state, whatever it costs: their width, rad, their number in
# a turn, and room for all of them.
WIDE, AROUND, CELLS = np.radians(5.0), 72, 128
# Makes numbers of cells positive.
OFFSET = 1 << 24
# rad: a long turn is priced in parts of this size, and in no more than so many; and from so many states.
PART, MOST_PARTS, MOST_COURSES = np.radians(20.0), 9, 64
# A state of which nothing is known moved every axis, so that nothing starts.
ALL_MOVE = (1 << 62) - 1


class Locations(NamedTuple):
    """What holds at n locations, for k axes and b bounds.

    Parameters
    ----------
    given : (n, 6), pivot, mm, and normal
    references : (n, b, 3); zero where the tool is free
    within : (n, b, 2), smallest and largest cosine; infinite where the tool is free
    low, high : (k,), mm and rad
    rotary : (2,), columns of the rotary axes
    turn : (n − 1, 2), rad, largest of each step
    singular : (3,), direction of the tool axis along which the first rotary axis turns nothing but the part
    cone : cosine of the angle to it within which that axis is bounded; above 1 for none
    held : (n − 1,), rad, its largest turn there
    """

    given: Array
    references: Array
    within: Array
    low: Array
    high: Array
    rotary: IntArray
    turn: Array
    singular: Array
    cone: float
    held: Array


class Prices(NamedTuple):
    """Prices of n − 1 steps; the first index is 0 while an axis value grows, and 1 while it falls.

    Parameters
    ----------
    standing, slope : as in `BlockCosts`
    slow, reach : (n − 1, k), 1/mm and 1/rad, inverse of its travel at the slowest and the fastest speed
    least : (n − 1, k), mm and rad, travel that counts as none
    start : (2, n − 1, k), J, of an axis that didn't move this way in the step before
    bend : (n − 1,), J/rad²
    pace, time, delay : (k,) s/mm and s/rad at the highest speed; (n − 1,) s; J/s of what takes longer
    """

    standing: Array
    slope: Array
    slow: Array
    reach: Array
    least: Array
    start: Array
    bend: Array
    pace: Array
    time: Array
    delay: float


class Corridor(NamedTuple):
    """The path that a search stays near, (n, 2) rad, and how near, (2,) rad; (0, 2) for none.

    Parameters
    ----------
    positions : (n, k), mm and rad, the path's axis values: what stands on it is counted so
    excess : (n,), mm, rad and cosine, by which it breaks a bound that holds at a location
    free : (n,), where the search may leave the path
    """

    path: Array
    positions: Array
    excess: Array
    radius: Array
    free: BoolArray


class Cells(NamedTuple):
    """Cells, of which each keeps the cheapest of its states.

    Parameters
    ----------
    level : column of the costliest linear axis
    spin : the rotary axis with the wider range, 0 or 1 in chain order
    level_step, spin_step : mm and rad
    around : cells of a turn of the spin axis; 0 for an axis with limits
    phase : rad, where cells of the spin axis begin
    """

    level: int
    spin: int
    level_step: float
    spin_step: float
    around: int
    phase: float


class Task(NamedTuple):
    """What is searched: `moves` is (m, 2, 4), see `ROW`; `slopes` and `bows` are those of `LocationTapes`."""

    slopes: tuple[IntArray, Array, int]
    bows: tuple[IntArray, Array, int]
    locations: Locations
    prices: Prices
    corridor: Corridor
    cells: Cells
    moves: Array


class Layer(NamedTuple):
    """States of one location: angles (s, 2), axis values (s, k), cost so far (s,), axes that moved (s,)."""

    rotary: Array
    positions: Array
    cost: Array
    moved: IntArray


class Found(NamedTuple):
    """Candidates for the next location, and the cells that they compete in.

    Parameters
    ----------
    cost : (m,), J
    parent, move : (m,), the state that it comes from, and how
    rotary : (m, 2), rad, by the model
    key : (m,), its cell
    table : (t,), by a hash of the cell, its candidate + 1; 0 for none
    slots : (m,), the places used in the table
    """

    cost: Array
    parent: IntArray
    move: IntArray
    rotary: Array
    key: IntArray
    table: IntArray
    slots: IntArray


@inner
def bowed(model: Array, e: int, first: float, second: float) -> float:
    """Evaluate a row of a model of second order at turns of both axes, rad."""
    bow = model[e, 3] * first * first + 2.0 * model[e, 4] * first * second + model[e, 5] * second * second
    return float(model[e, 0] + model[e, 1] * first + model[e, 2] * second + 0.5 * bow)


@inner
def met(model: Array, e: int, aim: float, o: int, other: float) -> tuple[bool, float, float]:
    """Find the turns, rad, at which two rows of a model have these values."""
    first = second = size = 0.0
    for _ in range(MOST):
        f, g = bowed(model, e, first, second) - aim, bowed(model, o, first, second) - other
        f1 = model[e, 1] + model[e, 3] * first + model[e, 4] * second
        f2 = model[e, 2] + model[e, 4] * first + model[e, 5] * second
        g1 = model[o, 1] + model[o, 3] * first + model[o, 4] * second
        g2 = model[o, 2] + model[o, 4] * first + model[o, 5] * second
        area = f1 * g2 - f2 * g1
        if not abs(area) > SINGULAR:
            return False, first, second
        step1, step2 = (g2 * f - f2 * g) / area, (f1 * g - g1 * f) / area
        size = abs(step1) + abs(step2)
        if size > STEEP:
            return False, first, second
        first, second = first - step1, second - step2
        if size < CLOSE:
            break
    return size < STEEP / 8.0, first, second


@inner
def travelled(here: Array, j: int, there: Array, up: Array, down: Array) -> None:
    """Set how far axes travel up and down, (k,) each, from state j of `here`, (s, k), to `there`, (k,)."""
    for a in range(len(there)):
        travel = there[a] - here[j, a]
        up[a], down[a] = max(travel, 0.0), max(-travel, 0.0)


@inner
def travelled_along(
    task: Task,
    layer: Layer,
    j: int,
    i: int,
    turn1: float,
    turn2: float,
    given: Array,
    values: Array,
    up: Array,
    down: Array,
) -> None:
    """Set how far axes travel up and down, (k,) each, along step i from state j, which turns far, rad.

    `given` and `values` are work space for `MOST_PARTS` parts.
    """
    locations, axes = task.locations, len(up)
    parts = int(min(max(abs(turn1), abs(turn2)) // PART + 1, MOST_PARTS))
    for p in range(parts):
        share = (p + 1.0) / parts
        given[p, 0], given[p, 1] = layer.rotary[j, 0] + share * turn1, layer.rotary[j, 1] + share * turn2
        for d in range(6):
            given[p, 2 + d] = (1.0 - share) * locations.given[i, d] + share * locations.given[i + 1, d]
    play(*task.slopes, given[:parts], values[:parts])
    travelled(layer.positions, j, values[0, :axes], up, down)
    for p in range(1, parts):
        for a in range(axes):
            travel = values[p, a] - values[p - 1, a]
            up[a], down[a] = up[a] + max(travel, 0.0), down[a] + max(-travel, 0.0)


@inner
def step_price(
    prices: Prices, i: int, before: int, up: Array, down: Array, turned: float
) -> tuple[float, int]:
    """Price step i by how far axes travel up and down, (k,) each; and say which axes move which way.

    `before` are the axes that moved in the step before; `turned`, rad², is of both rotary axes.
    """
    price, moves, late = prices.bend[i] * turned, 0, 0.0
    for a in range(len(up)):
        travel = up[a] + down[a]
        if travel <= prices.least[i, a]:
            continue
        way = 0 if up[a] > down[a] else 1
        standing, bit = prices.standing[way, i, a], 1 << (2 * a + way)
        moves |= bit
        price += prices.slope[0, i, a] * up[a] + prices.slope[1, i, a] * down[a]
        if standing > 0.0:
            price += standing * max(min(1.0, travel * prices.slow[i, a]), travel * prices.reach[i, a])
            if not before & bit:
                price += prices.start[way, i, a]
        late = max(late, prices.pace[a] * travel - prices.time[i])
    return price + prices.delay * late, moves


@compiled
def cheapest_steps(
    task: Task, layer: Layer, size: int, i: int, rotary: Array, positions: Array
) -> tuple[Array, IntArray, IntArray]:
    """Price the cheapest step i to given postures, (m, 2) rad, with axis values (m, k), however far they are.

    On a long turn linear axes travel farther than from one end to the other: it is priced along its course.
    An axis without limits turns the shorter way; the postures are put on the turn that the step leads to.

    Returns
    -------
    (m,) each: the cost there, infinite where every state would have to turn too far; the state that the step
    comes from; and the axes that it moves
    """
    locations, turn, prices, cells = task.locations, task.locations.turn, task.prices, task.cells
    spin, axes = locations.rotary[cells.spin], positions.shape[1]
    least, there, up, down = np.empty(size), np.empty(axes), np.empty(axes), np.empty(axes)
    given, values = np.empty((MOST_PARTS, 8)), np.empty((MOST_PARTS, 3 * (axes + 3)))
    cost, came, moved = (
        np.full(len(rotary), np.inf),
        np.zeros(len(rotary), np.int64),
        np.zeros(len(rotary), np.int64),
    )
    for s in range(len(rotary)):
        for j in range(size):
            turn1, turn2, turns = shorter_turns(cells, layer.rotary, j, rotary, s)
            least[j] = np.inf
            if max(abs(turn1) - turn[i, 0], abs(turn2) - turn[i, 1]) > ROUNDING:
                continue
            for a in range(axes):
                there[a] = positions[s, a]
            there[spin] -= turns
            turned = turn1 * turn1 + turn2 * turn2
            travelled(layer.positions, j, there, up, down)
            price, moves = step_price(prices, i, layer.moved[j], up, down, turned)
            price += layer.cost[j]
            if max(abs(turn1), abs(turn2)) > PART:
                least[j] = price
            elif price < cost[s]:
                cost[s], came[s], moved[s] = price, j, moves
        for _ in range(MOST_COURSES):
            j = int(np.argmin(least))
            # The price from end to end is the least that a course can cost.
            if not least[j] < cost[s]:
                break
            least[j] = np.inf
            turn1, turn2, turns = shorter_turns(cells, layer.rotary, j, rotary, s)
            travelled_along(task, layer, j, i, turn1, turn2, given, values, up, down)
            turned = turn1 * turn1 + turn2 * turn2
            price, moves = step_price(prices, i, layer.moved[j], up, down, turned)
            if layer.cost[j] + price < cost[s]:
                cost[s], came[s], moved[s] = layer.cost[j] + price, j, moves
        if cost[s] < np.inf:
            turns = shorter_turns(cells, layer.rotary, came[s], rotary, s)[2]
            rotary[s, cells.spin] -= turns
            positions[s, spin] -= turns
    return cost, came, moved


@inner
def shorter_turns(cells: Cells, here: Array, j: int, there: Array, s: int) -> tuple[float, float, float]:
    """Find the turns of both axes from posture j to posture s; and the whole turns left out of the second."""
    turn1, turn2, turns = there[s, 0] - here[j, 0], there[s, 1] - here[j, 1], 0.0
    if cells.around:
        turns = TURN * np.round((turn1 if cells.spin == 0 else turn2) / TURN)
        turn1, turn2 = (turn1 - turns, turn2) if cells.spin == 0 else (turn1, turn2 - turns)
    return turn1, turn2, turns


@inner
def turned_within(locations: Locations, bows: Array, j: int, i: int, turn1: float, turn2: float) -> float:
    """Compute by how much a move from state j turns the first axis too far within the cone, rad."""
    over = abs(turn1) - locations.held[i]
    if over <= 0.0:
        return 0.0
    axes = len(locations.low)
    for share in (0.0, 0.5, 1.0):
        first, second, cosine = share * turn1, share * turn2, 0.0
        for c in range(3):
            along = 0.0
            for d in range(6):
                weight = 1.0
                if d == 1:
                    weight = first
                elif d == 2:
                    weight = second
                elif d == 3:
                    weight = 0.5 * first * first
                elif d == 4:
                    weight = first * second
                elif d == 5:
                    weight = 0.5 * second * second
                along += weight * bows[j, d * (axes + 3) + axes + c]
            cosine += locations.singular[c] * along
        if abs(cosine) > locations.cone:
            return over
    return 0.0


@inner
def competes(found: Found, count: int, key: int, cost: float) -> int:
    """Look up the candidate that a cheaper one of its cell replaces; `count` for a new one, −1 for none."""
    mask = len(found.table) - 1
    slot = (key * 0x2545F4914F6CDD1D >> 20) & mask
    while found.table[slot]:
        at = found.table[slot] - 1
        if found.key[at] == key:
            return at if cost < found.cost[at] else -1
        slot = (slot + 1) & mask
    found.table[slot] = count + 1
    found.slots[count] = slot
    return count


@inner
def cell(cells: Cells, level: float, spin: float) -> int:
    """Return the number of the cell of a level, mm, and a spin angle, rad."""
    number = int(np.floor((spin - cells.phase) / cells.spin_step))
    if cells.around:
        number %= cells.around
    return ((int(np.floor(level / cells.level_step)) + OFFSET) << 31) + number + OFFSET


@inner
def region(cells: Cells, first: float, second: float) -> int:
    """Return the number of the wide cell of two angles, rad, below `CELLS`²."""
    spin, other = (first, second) if cells.spin == 0 else (second, first)
    turns = int(np.floor((spin - cells.phase) / WIDE))
    return turns % AROUND * CELLS + int(np.floor(other / WIDE)) % CELLS


@inner
def asked(locations: Locations, moves: Array, i: int) -> Array:
    """Compute what moves ask of their rows at location i + 1, (m, 2); NaN where there is none.

    Where a move isn't to the end of a bound it is what is added to the state's own value.
    """
    values = np.empty((len(moves), 2))
    for v in range(len(moves)):
        for which in range(2):
            row, end = int(moves[v, which, ROW]), int(moves[v, which, END])
            if end >= 0:
                value = locations.within[i + 1, row - len(locations.low), end]
                values[v, which] = value if np.isfinite(value) else np.nan
                continue
            values[v, which] = moves[v, which, SHIFT]
            if moves[v, which, FAR] != 0.0:
                turn = locations.turn[i, 0 if row == locations.rotary[0] else 1]
                values[v, which] += moves[v, which, FAR] * turn if np.isfinite(turn) else np.nan
    return values


@inner
def aimed(positions: Array, j: int, row: int, value: float) -> float:
    """Compute what is asked of a row from state j of axis values, (s, k): an axis starts from its own."""
    return value + positions[j, row] if row < positions.shape[1] else value


@inner
def keep_held(layer: Layer, j: int, moves: Array, v: int, there: Array) -> None:
    """Give axes that a move holds exactly the values that they have."""
    for which in range(2):
        if moves[v, which, END] < 0.0 and moves[v, which, SHIFT] == 0.0 and moves[v, which, FAR] == 0.0:
            row = int(moves[v, which, ROW])
            there[row] = layer.positions[j, row]


@inner
def candidates(task: Task, layer: Layer, size: int, bows: Array, i: int, margin: float, found: Found) -> int:
    """Find candidates for location i + 1 by a model of second order about every state; return their number.

    Parameters
    ----------
    layer, size : the states of location i, and their number
    bows : (s, 6 (k + 3)), the quantities of location i + 1 at their angles, with both derivatives
    margin : J, by which a candidate may cost more than the cheapest
    """
    locations, prices, corridor, cells, moves = (
        task.locations,
        task.prices,
        task.corridor,
        task.cells,
        task.moves,
    )
    axes, bounds = len(locations.low), locations.references.shape[1]
    rows, count, least = axes + 3, 0, np.inf
    model = np.empty((axes + 2 * bounds, 6))
    there, up, down = np.empty(axes), np.empty(axes), np.empty(axes)
    directions = np.empty((2 * bounds, 3))
    for b in range(bounds):
        for c in range(3):
            directions[b, c] = locations.references[i + 1, b, c]
            # Halfway to the location.
            directions[bounds + b, c] = locations.references[i, b, c] + locations.references[i + 1, b, c]
        square = 0.0
        for c in range(3):
            square += directions[bounds + b, c] ** 2
        for c in range(3):
            directions[bounds + b, c] /= math.sqrt(max(square, ROUNDING))
    # How far a row of the model can go: an angle as far as it may turn, a cosine as both angles together.
    farthest = np.full(axes + bounds, np.inf)
    for r in range(2):
        most = locations.turn[i, r] + ROUNDING
        farthest[locations.rotary[r]] = min(most, 2.0 * corridor.radius[r])
    for b in range(bounds):
        farthest[axes + b] = farthest[locations.rotary[0]] + farthest[locations.rotary[1]]
    first_column, second_column = locations.rotary
    near, aims = len(corridor.path) > 0, asked(locations, moves, i)
    onlys = near and not corridor.free[i + 1]
    for j in range(size):
        if layer.cost[j] > least + margin:
            continue
        for d in range(6):
            for a in range(axes):
                model[a, d] = bows[j, d * rows + a]
            for b in range(2 * bounds):
                at = d * rows + axes
                model[axes + b, d] = (
                    directions[b, 0] * bows[j, at]
                    + directions[b, 1] * bows[j, at + 1]
                    + directions[b, 2] * bows[j, at + 2]
                )
        for v in range(BESIDE if near else 0, 0 if onlys else len(moves)):
            if onlys and v != ONTO:
                continue
            if v < 0:
                turn1 = corridor.path[i + 1, 0] - layer.rotary[j, 0]
                turn2 = corridor.path[i + 1, 1] - layer.rotary[j, 1]
                if v == BESIDE:
                    spun = first_column if cells.spin == 0 else second_column
                    aim = corridor.path[i + 1, cells.spin]
                    sound, turn1, turn2 = met(model, cells.level, layer.positions[j, cells.level], spun, aim)
                    if not sound:
                        continue
            else:
                e, o = int(moves[v, 0, ROW]), int(moves[v, 1, ROW])
                aim, other = (
                    aimed(layer.positions, j, e, aims[v, 0]),
                    aimed(layer.positions, j, o, aims[v, 1]),
                )
                # Most moves are too far: that is seen before they are solved.
                if not abs(model[e, 0] - aim) <= farthest[e] or not abs(model[o, 0] - other) <= farthest[o]:
                    continue
                sound, turn1, turn2 = met(model, e, aim, o, other)
                if not sound:
                    continue
            angle1, angle2 = layer.rotary[j, 0] + turn1, layer.rotary[j, 1] + turn2
            over = max(abs(turn1) - locations.turn[i, 0], abs(turn2) - locations.turn[i, 1])
            if locations.cone <= 1.0:
                over = max(over, turned_within(locations, bows, j, i, turn1, turn2))
            if v == ONTO:
                over = max(over, corridor.excess[i + 1])
            elif over > ROUNDING:
                continue
            if near and v != ONTO:
                if abs(angle1 - corridor.path[i + 1, 0]) > corridor.radius[0]:
                    continue
                if abs(angle2 - corridor.path[i + 1, 1]) > corridor.radius[1]:
                    continue
            sound = True
            for a in range(axes):
                there[a] = corridor.positions[i + 1, a] if v == ONTO else bowed(model, a, turn1, turn2)
                if there[a] < locations.low[a] - ROUGHLY or there[a] > locations.high[a] + ROUGHLY:
                    sound = False
            for b in range(bounds):
                cosine = bowed(model, axes + b, turn1, turn2)
                if (
                    cosine < locations.within[i + 1, b, 0] - ROUGHLY
                    or cosine > locations.within[i + 1, b, 1] + ROUGHLY
                ):
                    sound = False
                # Halfway, the tool may be over a hole that the bound leaves.
                cosine = bowed(model, axes + bounds + b, 0.5 * turn1, 0.5 * turn2)
                low = max(locations.within[i, b, 0], locations.within[i + 1, b, 0])
                high = min(locations.within[i, b, 1], locations.within[i + 1, b, 1])
                sound = sound and low - HALFWAY <= cosine <= high + HALFWAY
            if not sound and v != ONTO:
                continue
            if v >= 0:
                keep_held(layer, j, moves, v, there)
            turned = turn1 * turn1 + turn2 * turn2
            travelled(layer.positions, j, there, up, down)
            price, _ = step_price(prices, i, layer.moved[j], up, down, turned)
            cost = layer.cost[j] + price
            if over > ROUNDING:
                cost += BROKEN + PER_EXCESS * over
            if v != ONTO and cost > least + margin:
                continue
            key = cell(cells, there[cells.level], angle1 if cells.spin == 0 else angle2)
            if cells.spin == 0:
                rising = model[cells.level, 2] + model[cells.level, 4] * turn1 + model[cells.level, 5] * turn2
            else:
                rising = model[cells.level, 1] + model[cells.level, 3] * turn1 + model[cells.level, 4] * turn2
            key = 2 * key + (1 if rising > 0.0 else 0)
            if v == ONTO:
                key = -1
            at = competes(found, count, key, cost)
            if at < 0:
                continue
            if at == count:
                count += 1
            found.cost[at] = cost
            found.parent[at], found.move[at], found.key[at] = j, v, key
            found.rotary[at, 0], found.rotary[at, 1] = angle1, angle2
            least = min(least, cost)
    return count


@inner
def kept(
    cells: Cells, found: Found, count: int, most: int, wide: IntArray, used: IntArray, keep: IntArray
) -> int:
    """Choose candidates: the path's own, the cheapest of every wide cell of both angles, then the cheapest.

    Parameters
    ----------
    wide, used : (CELLS²,) each, the first 0, for the candidates of the cells and the cells that have any
    keep : (most,), the candidates chosen

    Returns
    -------
    Their number
    """
    if count <= most:
        for at in range(count):
            keep[at] = at
        return count
    stays = np.zeros(count, np.bool_)
    size = regions = 0
    for at in range(count):
        number = region(cells, found.rotary[at, 0], found.rotary[at, 1])
        best = wide[number] - 1
        if best < 0:
            used[regions] = number
            regions += 1
        if best < 0 or found.cost[at] < found.cost[best]:
            wide[number] = at + 1
        if found.move[at] == ONTO:
            stays[at], size = True, 1
    for which in range(regions):
        at = wide[used[which]] - 1
        wide[used[which]] = 0
        if size < most // 2 and not stays[at]:
            stays[at] = True
            size += 1
    rest = np.full(count, np.inf)
    for at in range(count):
        if not stays[at]:
            rest[at] = found.cost[at]
    cut = smallest(rest, most - size - 1)
    size = 0
    for at in range(count):
        if stays[at]:
            keep[size] = at
            size += 1
    for at in range(count):
        if not stays[at] and found.cost[at] <= cut and size < most:
            keep[size] = at
            size += 1
    return size


@inner
def smallest(values: Array, rank: int) -> float:
    """Return the value of a rank, 0 for the smallest; the values are put in another order.

    Hoare's selection. For `np.partition` numba would compile sorts, and errors with their texts.
    """
    low, high = 0, len(values) - 1
    while low < high:
        pivot, i, j = values[(low + high) // 2], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return float(values[rank])


@inner
def solved(
    task: Task,
    layer: Layer,
    found: Found,
    keep: IntArray,
    i: int,
    bows: Array,
    then: Layer,
    parents: IntArray,
) -> int:
    """Solve the candidates that were chosen exactly, and fill in the states of location i + 1; their number.

    Newton's method on the chain itself; the last step is linear, and of at most `CLOSE`.
    """
    locations, prices, cells, moves = task.locations, task.prices, task.cells, task.moves
    corridor, count = task.corridor, len(keep)
    axes, bounds = len(locations.low), locations.references.shape[1]
    rows, size = axes + 3, 0
    given, values = np.empty((count, 8)), np.empty((count, 3 * rows))
    unsolved = np.empty(count, np.int64)
    for n in range(count):
        unsolved[n] = n
        given[n, 0], given[n, 1] = found.rotary[keep[n], 0], found.rotary[keep[n], 1]
        for d in range(6):
            given[n, 2 + d] = locations.given[i + 1, d]
    there, up, down = np.empty(axes), np.empty(axes), np.empty(axes)
    course, along_it = np.empty((MOST_PARTS, 8)), np.empty((MOST_PARTS, 3 * rows))
    left, aims = count, asked(locations, moves, i)
    for _ in range(MOST):
        play(*task.slopes, given[:left], values[:left])
        again = 0
        for n in range(left):
            at = keep[unsolved[n]]
            j, v = found.parent[at], found.move[at]
            first = second = 0.0
            if v != ONTO:
                if v == BESIDE:
                    e, o = cells.level, locations.rotary[cells.spin]
                    aim, other = layer.positions[j, e], corridor.path[i + 1, cells.spin]
                else:
                    e, o = int(moves[v, 0, ROW]), int(moves[v, 1, ROW])
                    aim = aimed(layer.positions, j, e, aims[v, 0])
                    other = aimed(layer.positions, j, o, aims[v, 1])
                f, f1, f2 = residual(locations.references, i + 1, e, aim, values, n)
                g, g1, g2 = residual(locations.references, i + 1, o, other, values, n)
                area = f1 * g2 - f2 * g1
                if not abs(area) > SINGULAR:
                    continue
                first, second = -(g2 * f - f2 * g) / area, -(f1 * g - g1 * f) / area
                if abs(first) + abs(second) > STEEP:
                    continue
                if abs(first) + abs(second) > CLOSE:
                    unsolved[again] = unsolved[n]
                    given[again, 0], given[again, 1] = given[n, 0] + first, given[n, 1] + second
                    again += 1
                    continue
            angle1, angle2 = given[n, 0] + first, given[n, 1] + second
            turn1, turn2 = angle1 - layer.rotary[j, 0], angle2 - layer.rotary[j, 1]
            over = max(abs(turn1) - locations.turn[i, 0], abs(turn2) - locations.turn[i, 1])
            if locations.cone <= 1.0:
                over = max(over, turned_within(locations, bows, j, i, turn1, turn2))
            for a in range(axes):
                there[a] = values[n, a] + values[n, rows + a] * first + values[n, 2 * rows + a] * second
                if v != ONTO:
                    over = max(over, there[a] - locations.high[a], locations.low[a] - there[a])
            if v == ONTO:
                over = max(over, corridor.excess[i + 1])
            for b in range(0 if v == ONTO else bounds):
                cosine = 0.0
                for c in range(3):
                    at_axis = axes + c
                    along = values[n, at_axis] + values[n, rows + at_axis] * first
                    along += values[n, 2 * rows + at_axis] * second
                    cosine += locations.references[i + 1, b, c] * along
                over = max(over, locations.within[i + 1, b, 0] - cosine)
                over = max(over, cosine - locations.within[i + 1, b, 1])
            if over > ROUNDING and v != ONTO:
                continue
            if v >= 0:
                keep_held(layer, j, moves, v, there)
            elif v == BESIDE:
                there[cells.level] = layer.positions[j, cells.level]
            turned = turn1 * turn1 + turn2 * turn2
            if max(abs(turn1), abs(turn2)) > PART:
                travelled_along(task, layer, j, i, turn1, turn2, course, along_it, up, down)
            else:
                travelled(layer.positions, j, there, up, down)
            price, moved = step_price(prices, i, layer.moved[j], up, down, turned)
            if over > ROUNDING:
                price += BROKEN + PER_EXCESS * over
            then.rotary[size, 0], then.rotary[size, 1] = angle1, angle2
            then.cost[size], then.moved[size] = layer.cost[j] + price, moved
            for a in range(axes):
                then.positions[size, a] = there[a]
            parents[size] = j
            size += 1
        left = again
        if not left:
            break
    return size


@inner
def residual(
    references: Array, i: int, row: int, aim: float, values: Array, n: int
) -> tuple[float, float, float]:
    """Compute what a row of the model lacks of what is asked of it at location i, and its slopes."""
    rows = values.shape[1] // 3
    axes = rows - 3
    if row < axes:
        return values[n, row] - aim, values[n, rows + row], values[n, 2 * rows + row]
    value, slope1, slope2 = -aim, 0.0, 0.0
    for c in range(3):
        along = references[i, row - axes, c]
        value += along * values[n, axes + c]
        slope1 += along * values[n, rows + axes + c]
        slope2 += along * values[n, 2 * rows + axes + c]
    return value, slope1, slope2


class Trail(NamedTuple):
    """All states kept, and work space: those of location i are rows ``begin[i]`` to ``begin[i + 1]``.

    Parameters
    ----------
    states, parents : (t, 2) rad, and (t,), row of the state that each comes from
    begin : (n + 1,)
    layers : states of the last two locations; those of location i are in ``layers[i % 2]``
    found, wide, used, keep, origin : see `candidates`, `kept` and `solved`
    given, bows : inputs and values of the model of second order
    """

    states: Array
    parents: IntArray
    begin: IntArray
    layers: tuple[Layer, Layer]
    found: Found
    wide: IntArray
    used: IntArray
    keep: IntArray
    origin: IntArray
    given: Array
    bows: Array


def trail_of(task: Task, first: Array, start: Array, most: int) -> Trail:
    """Make room for a search over the `most` best states of each location.

    Parameters
    ----------
    first, start : (s, 2) rad and (s, k), postures of the first location, and their axis values
    """
    n, axes, size = len(task.locations.given), len(task.locations.low), len(first)
    room = max(most, size)
    here, then = (
        Layer(np.empty((room, 2)), np.empty((room, axes)), np.empty(room), np.empty(room, np.int64))
        for _ in range(2)
    )
    here.rotary[:size], here.positions[:size], here.cost[:size], here.moved[:size] = (
        first,
        start,
        0.0,
        ALL_MOVE,
    )
    states, begin = np.empty((size + (n - 1) * most, 2)), np.zeros(n + 1, np.int64)
    states[:size], begin[1] = first, size
    many = room * (len(task.moves) + 2)
    places = 1 << int(2 * many).bit_length()
    found = Found(
        np.empty(many),
        np.empty(many, np.int64),
        np.empty(many, np.int64),
        np.empty((many, 2)),
        np.empty(many, np.int64),
        np.zeros(places, np.int64),
        np.empty(many, np.int64),
    )
    return Trail(
        states,
        np.empty(len(states), np.int32),
        begin,
        (here, then),
        found,
        np.zeros(CELLS * CELLS, np.int64),
        np.empty(CELLS * CELLS, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty((room, 8)),
        np.empty((room, 6 * (axes + 3))),
    )


@compiled
def advance(task: Task, trail: Trail, begin: int, end: int, most: int, margin: float) -> tuple[int, float]:
    """Search on from location `begin`, whose states are known, to location `end`.

    Parameters
    ----------
    most : states that each location keeps
    margin : J, by which a candidate may cost more than the cheapest one; infinite at first

    Returns
    -------
    The last location that has states, and the margin there
    """
    locations, found = task.locations, trail.found
    for i in range(begin, end):
        here, then = trail.layers[i % 2], trail.layers[(i + 1) % 2]
        size = trail.begin[i + 1] - trail.begin[i]
        for j in range(size):
            trail.given[j, 0], trail.given[j, 1] = here.rotary[j, 0], here.rotary[j, 1]
            for d in range(6):
                trail.given[j, 2 + d] = locations.given[i + 1, d]
        play(*task.bows, trail.given[:size], trail.bows[:size])
        count = candidates(task, here, size, trail.bows, i, margin, found)
        chosen = kept(task.cells, found, count, most, trail.wide, trail.used, trail.keep)
        size = solved(task, here, found, trail.keep[:chosen], i, trail.bows, then, trail.origin)
        for at in range(count):
            found.table[found.slots[at]] = 0
        if not size:
            return i, margin
        least, dearest = np.inf, -np.inf
        for j in range(size):
            least, dearest = min(least, then.cost[j]), max(dearest, then.cost[j])
        margin = SPARE * (dearest - least) if chosen == most else np.inf
        at = trail.begin[i + 1]
        for j in range(size):
            trail.states[at + j, 0], trail.states[at + j, 1] = then.rotary[j, 0], then.rotary[j, 1]
            trail.parents[at + j] = trail.begin[i] + trail.origin[j]
        trail.begin[i + 2] = at + size
    return end, margin


def keep_only(trail: Trail, i: int, stays: BoolArray) -> None:
    """Keep some of the states of location i, the last one; (s,)."""
    begin, size = int(trail.begin[i]), int(np.count_nonzero(stays))
    rows = begin + np.flatnonzero(stays)
    for column in (trail.states, trail.parents):
        column[begin : begin + size] = column[rows]
    for column in trail.layers[i % 2]:
        column[:size] = column[: len(stays)][stays]
    trail.begin[i + 1] = begin + size


def traced(trail: Trail, n: int) -> Array:
    """Trace the cheapest path back, (n, 2) rad."""
    size = int(trail.begin[n] - trail.begin[n - 1])
    at = int(trail.begin[n - 1]) + int(np.argmin(trail.layers[(n - 1) % 2].cost[:size]))
    path = np.empty((n, 2))
    for i in range(n - 1, -1, -1):
        path[i], at = trail.states[at], int(trail.parents[at])
    return path
