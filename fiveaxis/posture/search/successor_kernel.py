"""Loops of the search over exact postures (`successors`), compiled; `records` has what they read.

From the states of location i to those of location i + 1 (`advance`):

1. a model of second order about every state gives its successors (`candidates`): the turns of both axes by
   which two rows of the model, axis values or cosines of the lean, get the values that a move asks of them;
   of the candidates in one cell the cheapest competes on (`competes`);
2. the cheapest ones are chosen, with one of every region of both angles among them (`kept`);
3. those are solved on the chain itself, held to all bounds, and priced (`solved`).

In names: i is a location and the step that begins there, j a state of it, a an axis, b a bound on the lean;
``i & 1`` is the layer of its states.
States lie in arrays that are read by index: in compiled loops a view of an array costs as much as the
arithmetic on it. All loops that the two compiled functions share are in this file, because numba compiles a
function anew when its own file has changed, and no other.
"""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import Array, IntArray, compiled, innermost
from fiveaxis.model import TURN
from fiveaxis.posture.search.records import (
    BESIDE_PATH,
    BREACH_PRICE,
    DIRECTION,
    END,
    EXCESS_PRICE,
    FARTHEST,
    KEY,
    LARGEST,
    LEAST,
    MOST_COURSE_PARTS,
    MOVE,
    ONTO_PATH,
    PACE,
    PARENT,
    REACH,
    REGIONS,
    ROUNDING,
    ROW,
    SHIFT,
    SLOPE,
    SLOT,
    SLOW,
    STANDING,
    START,
    THERE,
    Cells,
    Corridor,
    Found,
    Layers,
    Locations,
    Prices,
    SearchProblem,
    Space,
    Trail,
)
from fiveaxis.posture.tape import play

# Newton's method: its steps; the largest turn of one, rad; a determinant, in mm/rad, that is none; and the
# size of a step, rad, after which what is left is less than what a program's digits can say.
NEWTON_STEPS, LONGEST_TURN, LEAST_DETERMINANT, CONVERGED = 6, 1.2, 1e-6, 1e-5
# rad: a last step of that size leaves a model of second order an error that is none beside its own.
SETTLED = 1e-3
# mm, rad or cosine by which the model of a candidate may be out of bounds, and share of the margin by which
# it may cost more than the dearest state kept: both are decided exactly for those that are kept.
MODEL_ERROR, MARGIN_FACTOR = 2e-3, 1.2
# Cosine by which the lean may be out of its bounds halfway between two locations.
HALFWAY = 1e-4
# rad: width of a region of both angles, which keeps its cheapest state, whatever it costs; and their number
# in a turn.
REGION, REGIONS_PER_TURN = np.radians(5.0), 72
# 1/J: prices come in such grains, or else rounding would decide which of many that cost the same stays.
GRAINS = 1e7
# Makes numbers of cells positive.
POSITIVE = 1 << 24
# rad: a long turn is priced in parts of this size; and from no more than so many states.
COURSE_PART, MOST_COURSES = np.radians(20.0), 64


@innermost
def second_order(model: Array, row: int, turn1: float, turn2: float) -> float:
    """Evaluate a row of a model of second order (`set_model`) at turns of both axes, rad."""
    value, slope1, slope2 = model[row, 0], model[row, 1], model[row, 2]
    bend = model[row, 3] * turn1 * turn1 + 2.0 * model[row, 4] * turn1 * turn2 + model[row, 5] * turn2 * turn2
    return float(value + slope1 * turn1 + slope2 * turn2 + 0.5 * bend)


@innermost
def with_slopes(model: Array, row: int, turn1: float, turn2: float) -> tuple[float, float, float]:
    """Evaluate a row of a model of second order at turns of both axes, rad, and its derivatives there."""
    bend1 = model[row, 3] * turn1 + model[row, 4] * turn2
    bend2 = model[row, 4] * turn1 + model[row, 5] * turn2
    by1, by2 = model[row, 1] + bend1, model[row, 2] + bend2
    value = model[row, 0] + (by1 - 0.5 * bend1) * turn1 + (by2 - 0.5 * bend2) * turn2
    return value, by1, by2


@innermost
def turns_to(model: Array, row1: int, aim1: float, row2: int, aim2: float) -> tuple[bool, float, float]:
    """Find the turns, rad, at which two rows of a model have these values, by Newton's method."""
    turn1 = turn2 = size = 0.0
    f, f1, f2 = model[row1, 0] - aim1, model[row1, 1], model[row1, 2]
    g, g1, g2 = model[row2, 0] - aim2, model[row2, 1], model[row2, 2]
    for _ in range(NEWTON_STEPS):
        determinant = f1 * g2 - f2 * g1
        if not abs(determinant) > LEAST_DETERMINANT:
            return False, turn1, turn2
        step1, step2 = (g2 * f - f2 * g) / determinant, (f1 * g - g1 * f) / determinant
        size = abs(step1) + abs(step2)
        if size > LONGEST_TURN:
            return False, turn1, turn2
        turn1, turn2 = turn1 - step1, turn2 - step2
        if size < SETTLED:
            break
        f, f1, f2 = with_slopes(model, row1, turn1, turn2)
        g, g1, g2 = with_slopes(model, row2, turn1, turn2)
        f, g = f - aim1, g - aim2
    return size < LONGEST_TURN / 8.0, turn1, turn2


@innermost
def travelled(positions: Array, i: int, j: int, axes: Array) -> None:
    """Set how far axes travel up and down from state j to where they are in step i, see `THERE`."""
    for a in range(len(axes)):
        travel = axes[a, THERE] - positions[i & 1, j, a]
        axes[a, 0], axes[a, 1] = max(travel, 0.0), max(-travel, 0.0)


@innermost
def travelled_along(
    problem: SearchProblem, layers: Layers, j: int, i: int, turn1: float, turn2: float, space: Space
) -> None:
    """Set how far axes travel up and down along step i from state j, which turns far, rad."""
    locations, given, values = problem.locations, space.given, space.values
    axes, now, begin = space.axes, i & 1, len(given) - MOST_COURSE_PARTS
    parts = int(min(max(abs(turn1), abs(turn2)) // COURSE_PART + 1, MOST_COURSE_PARTS))
    for p in range(parts):
        share = (p + 1.0) / parts
        given[begin + p, 0] = layers.rotary[now, j, 0] + share * turn1
        given[begin + p, 1] = layers.rotary[now, j, 1] + share * turn2
        for d in range(6):
            there = share * locations.given[i + 1, d]
            given[begin + p, 2 + d] = (1.0 - share) * locations.given[i, d] + there
    play(*problem.first_order, given[begin : begin + parts], values[begin : begin + parts])
    for a in range(len(axes)):
        before, axes[a, 0], axes[a, 1] = layers.positions[now, j, a], 0.0, 0.0
        for p in range(parts):
            travel = values[begin + p, a] - before
            axes[a, 0], axes[a, 1] = axes[a, 0] + max(travel, 0.0), axes[a, 1] + max(-travel, 0.0)
            before = values[begin + p, a]


@innermost
def travelled_far(
    problem: SearchProblem, layers: Layers, j: int, i: int, turn1: float, turn2: float, space: Space
) -> None:
    """Set how far axes travel up and down in step i from state j, however far it turns, rad."""
    if max(abs(turn1), abs(turn2)) > COURSE_PART:
        travelled_along(problem, layers, j, i, turn1, turn2, space)
    else:
        travelled(layers.positions, i, j, space.axes)


@innermost
def step_price(prices: Prices, i: int, before: int, axes: Array, turned: float) -> tuple[float, int]:
    """Price step i by how far axes travel up and down, (k, 3); and say which axes move which way.

    `before` are the axes that moved in the step before; `turned`, rad², is of both rotary axes.
    """
    price, moves, late, axis = prices.step[i, 0] * turned, 0, 0.0, prices.axis
    for a in range(len(axes)):
        travel, back = axes[a, 0] + axes[a, 1], min(axes[a, 0], axes[a, 1])
        if travel <= axis[i, LEAST, a]:
            continue
        way = 0 if axes[a, 0] > axes[a, 1] else 1
        standing, bit = axis[i, STANDING + way, a], 1 << (2 * a + way)
        moves |= bit
        price += axis[i, SLOPE, a] * axes[a, 0] + axis[i, SLOPE + 1, a] * axes[a, 1]
        if standing > 0.0 or back > axis[i, LEAST, a]:
            if not before & bit:
                price += axis[i, START + way, a]
            if back > axis[i, LEAST, a]:
                # Along a long turn it went both ways: which one more may be rounding.
                other = 1 << (2 * a + 1 - way)
                moves |= other
                standing += (axis[i, STANDING + 1 - way, a] - standing) * back / travel
                if not before & other:
                    price += axis[i, START + 1 - way, a]
            price += standing * max(min(1.0, travel * axis[i, SLOW, a]), travel * axis[i, REACH, a])
        late = max(late, axis[i, PACE, a] * travel - prices.step[i, 1])
    return float(np.rint((price + prices.delay * late) * GRAINS) / GRAINS), moves


@compiled
def cheapest_steps(
    problem: SearchProblem,
    layers: Layers,
    size: int,
    i: int,
    rotary: Array,
    positions: Array,
    space: Space,
    cost: Array,
    came: IntArray,
) -> None:
    """Price the cheapest step i to given postures, (m, 2) rad, with axis values (m, k), however far they are.

    On a long turn linear axes travel farther than from one end to the other: it is priced along its course.
    An axis without limits turns the shorter way; the postures are put on the turn that the step leads to.
    Filled in are the cost there, (m,), infinite where every state would have to turn too far; and, (2, m),
    the state that the step comes from, and the axes that it moves.
    """
    least = np.empty(size)
    for s in range(len(rotary)):
        cheapest_step(problem, layers, i, rotary, positions, space, least, s, cost, came)


@innermost
def cheapest_step(
    problem: SearchProblem,
    layers: Layers,
    i: int,
    rotary: Array,
    positions: Array,
    space: Space,
    least: Array,
    s: int,
    cost: Array,
    came: IntArray,
) -> None:
    """Price the cheapest step i to posture s of those given; `least`, (size,), is of the states' prices."""
    turn, prices, cells = problem.locations.turn, problem.prices, problem.cells
    axes, spin, now = space.axes, problem.locations.rotary[cells.spin], i & 1
    cost[s], came[0, s], came[1, s] = np.inf, 0, 0
    for j in range(len(least)):
        turn1, turn2, turns = shorter_turns(cells, layers.rotary, i, j, rotary, s)
        least[j] = np.inf
        if max(abs(turn1) - turn[i, 0], abs(turn2) - turn[i, 1]) > ROUNDING:
            continue
        for a in range(len(axes)):
            axes[a, THERE] = positions[s, a]
        axes[spin, THERE] -= turns
        turned = turn1 * turn1 + turn2 * turn2
        travelled(layers.positions, i, j, axes)
        price, moves = step_price(prices, i, layers.moved[now, j], axes, turned)
        price += layers.cost[now, j]
        if max(abs(turn1), abs(turn2)) > COURSE_PART:
            least[j] = price
        elif price < cost[s]:
            cost[s], came[0, s], came[1, s] = price, j, moves
    for _ in range(MOST_COURSES):
        j = 0
        for other in range(1, len(least)):
            if least[other] < least[j]:
                j = other
        # The price from end to end is the least that a course can cost.
        if not least[j] < cost[s]:
            break
        least[j] = np.inf
        turn1, turn2, turns = shorter_turns(cells, layers.rotary, i, j, rotary, s)
        travelled_along(problem, layers, j, i, turn1, turn2, space)
        turned = turn1 * turn1 + turn2 * turn2
        price, moves = step_price(prices, i, layers.moved[now, j], axes, turned)
        if layers.cost[now, j] + price < cost[s]:
            cost[s], came[0, s], came[1, s] = layers.cost[now, j] + price, j, moves
    if cost[s] < np.inf:
        turns = shorter_turns(cells, layers.rotary, i, came[0, s], rotary, s)[2]
        rotary[s, cells.spin] -= turns
        positions[s, spin] -= turns


@innermost
def shorter_turns(
    cells: Cells, here: Array, i: int, j: int, there: Array, s: int
) -> tuple[float, float, float]:
    """Find the turns of both axes from state j to posture s; and the whole turns left out of the second."""
    turn1, turn2, turns = there[s, 0] - here[i & 1, j, 0], there[s, 1] - here[i & 1, j, 1], 0.0
    if cells.around:
        turns = TURN * np.rint((turn1 if cells.spin == 0 else turn2) / TURN)
        turn1, turn2 = (turn1 - turns, turn2) if cells.spin == 0 else (turn1, turn2 - turns)
    return turn1, turn2, turns


@innermost
def turned_within_cone(
    locations: Locations, quantities: Array, j: int, i: int, turn1: float, turn2: float
) -> float:
    """Compute by how much a move from state j turns the first axis too far within the cone, rad."""
    over = abs(turn1) - locations.turn[i, 2]
    if over <= 0.0:
        return 0.0
    rows = locations.limits.shape[1] + 3
    for share in (0.0, 0.5, 1.0):
        first, second, cosine = share * turn1, share * turn2, 0.0
        for c in range(3):
            at = rows - 3 + c
            along = (
                quantities[j, at] + first * quantities[j, rows + at] + second * quantities[j, 2 * rows + at]
            )
            along += 0.5 * first * first * quantities[j, 3 * rows + at]
            along += first * second * quantities[j, 4 * rows + at]
            along += 0.5 * second * second * quantities[j, 5 * rows + at]
            cosine += locations.singular[c] * along
        if abs(cosine) > locations.cone:
            return over
    return 0.0


@innermost
def competes(found: Found, count: int, key: int, cost: float) -> int:
    """Look up the candidate that a cheaper one of its cell replaces; `count` for a new one, −1 for none."""
    mask = len(found.table) - 1
    slot = (key * 0x2545F4914F6CDD1D >> 20) & mask
    while found.table[slot]:
        at = found.table[slot] - 1
        if found.numbers[at, KEY] == key:
            return at if cost < found.cost[at] else -1
        slot = (slot + 1) & mask
    found.table[slot] = count + 1
    found.numbers[count, SLOT] = slot
    return count


@innermost
def cell(cells: Cells, level: float, spin: float) -> int:
    """Return the number of the cell of a level, mm, and a spin angle, rad."""
    number = int(np.floor((spin - cells.phase) / cells.spin_step))
    if cells.around:
        number %= cells.around
    return ((int(np.floor(level / cells.level_step)) + POSITIVE) << 31) + number + POSITIVE


@innermost
def region(cells: Cells, first: float, second: float) -> int:
    """Return the number of the wide cell of two angles, rad, below `REGIONS`²."""
    spin, other = (first, second) if cells.spin == 0 else (second, first)
    turns = int(np.floor((spin - cells.phase) / REGION))
    return turns % REGIONS_PER_TURN * REGIONS + int(np.rint(other / REGION)) % REGIONS


@innermost
def targets_of_rows(locations: Locations, moves: Array, i: int, values: Array) -> None:
    """Set what moves ask of their rows at location i + 1, (m, 2); NaN where there is none.

    Where a move isn't to the end of a bound it is what is added to the state's own value.
    """
    for move in range(len(moves)):
        for which in range(2):
            row, end = int(moves[move, which, ROW]), int(moves[move, which, END])
            if end >= 0:
                value = locations.bounds[i + 1, row - locations.limits.shape[1], 3 + end]
                values[move, which] = value if np.isfinite(value) else np.nan
                continue
            values[move, which] = moves[move, which, SHIFT]
            if moves[move, which, LARGEST] != 0.0:
                turn = locations.turn[i, 0 if row == locations.rotary[0] else 1]
                turn = turn if np.isfinite(turn) else locations.link_turn
                values[move, which] += moves[move, which, LARGEST] * turn


@innermost
def aim_of(positions: Array, i: int, j: int, row: int, target: float) -> float:
    """Compute the value that a row shall have after step i from state j: axes start from theirs."""
    return target + positions[i & 1, j, row] if row < positions.shape[2] else target


@innermost
def keep_held(positions: Array, i: int, j: int, moves: Array, move: int, axes: Array) -> None:
    """Give axes that a move holds exactly the values that they have."""
    for which in range(2):
        asks = moves[move, which, END] >= 0.0 or moves[move, which, SHIFT] != 0.0
        if not asks and moves[move, which, LARGEST] == 0.0:
            row = int(moves[move, which, ROW])
            axes[row, THERE] = positions[i & 1, j, row]


@innermost
def turned_too_far(
    locations: Locations, quantities: Array, j: int, i: int, turn1: float, turn2: float
) -> float:
    """Compute by how much step i from state j turns an axis too far, rad; at most 0 where it doesn't."""
    over = max(abs(turn1) - locations.turn[i, 0], abs(turn2) - locations.turn[i, 1])
    if locations.cone <= 1.0:
        over = max(over, turned_within_cone(locations, quantities, j, i, turn1, turn2))
    return over


@innermost
def set_bounds(locations: Locations, corridor: Corridor, i: int, model: Array) -> None:
    """Set what `model` has of step i: directions that leans are measured from, and how far rows may go.

    Leans are of location i + 1, and halfway to it; with how far, rad and cosines, both turns together count.
    """
    axes, bounds = locations.limits.shape[1], locations.bounds.shape[1]
    for a in range(axes):
        model[a, FARTHEST] = np.inf
    both = 0.0
    for r in range(2):
        turn = min(locations.turn[i, r] + ROUNDING, 2.0 * corridor.radius[r])
        model[locations.rotary[r], FARTHEST] = turn
        both += turn
    for b in range(bounds):
        there, halfway, square = axes + b, axes + bounds + b, 0.0
        model[there, FARTHEST] = both
        for c in range(3):
            direction = locations.bounds[i + 1, b, c]
            model[there, DIRECTION + c] = direction
            direction += locations.bounds[i, b, c]
            model[halfway, DIRECTION + c] = direction
            square += direction**2
        for c in range(3):
            model[halfway, DIRECTION + c] /= math.sqrt(max(square, ROUNDING))


@innermost
def set_model(model: Array, quantities: Array, j: int, axes: int) -> None:
    """Set the model about state j: rows of axis values, then of cosines with the directions of bounds.

    Columns are a value, its derivatives by both angles, and its second ones (11, 12, 22).
    """
    for d in range(6):
        at = d * (axes + 3)
        for a in range(axes):
            model[a, d] = quantities[j, at + a]
        at += axes
        for b in range(axes, len(model)):
            model[b, d] = (
                model[b, DIRECTION] * quantities[j, at]
                + model[b, DIRECTION + 1] * quantities[j, at + 1]
                + model[b, DIRECTION + 2] * quantities[j, at + 2]
            )


@innermost
def leans_soundly(locations: Locations, model: Array, i: int, turn1: float, turn2: float) -> bool:
    """Check by the model that the tool's lean keeps its bounds at location i + 1 and halfway to it."""
    axes, bounds = locations.limits.shape[1], locations.bounds.shape[1]
    for b in range(bounds):
        low, high = locations.bounds[i + 1, b, 3], locations.bounds[i + 1, b, 4]
        cosine = second_order(model, axes + b, turn1, turn2)
        if cosine < low - MODEL_ERROR or cosine > high + MODEL_ERROR:
            return False
        # Halfway, the tool may be over a hole that the bound leaves.
        cosine = second_order(model, axes + bounds + b, 0.5 * turn1, 0.5 * turn2)
        low, high = max(locations.bounds[i, b, 3], low), min(locations.bounds[i, b, 4], high)
        if not low - HALFWAY <= cosine <= high + HALFWAY:
            return False
    return True


@innermost
def cell_of(cells: Cells, model: Array, level: float, spin: float, turn1: float, turn2: float) -> int:
    """Return the number of a candidate's cell: where level and spin are, and whether the level rises.

    That is with the other angle: two postures of one level and spin angle differ by it.
    """
    slope, by_first, by_second = (2, 4, 5) if cells.spin == 0 else (1, 3, 4)
    rising = model[cells.level, slope] + model[cells.level, by_first] * turn1
    rising += model[cells.level, by_second] * turn2
    return 2 * cell(cells, level, spin) + (1 if rising > 0.0 else 0)


@innermost
def aims_of(
    problem: SearchProblem, positions: Array, targets: Array, i: int, j: int, move: int
) -> tuple[int, float, int, float]:
    """Return the two rows of the model that a move from state j sets at location i + 1, with their values."""
    if move == BESIDE_PATH:
        spin, level = problem.cells.spin, problem.cells.level
        beside = problem.corridor.path[i + 1, spin]
        return level, positions[i & 1, j, level], problem.locations.rotary[spin], beside
    row1, row2 = int(problem.moves[move, 0, ROW]), int(problem.moves[move, 1, ROW])
    aim1 = aim_of(positions, i, j, row1, targets[move, 0])
    return row1, aim1, row2, aim_of(positions, i, j, row2, targets[move, 1])


@innermost
def is_beside(corridor: Corridor, i: int, angle1: float, angle2: float) -> bool:
    """Whether angles are within the corridor at a location; everywhere, where there is none."""
    return len(corridor.path) == 0 or not (
        abs(angle1 - corridor.path[i, 0]) > corridor.radius[0]
        or abs(angle2 - corridor.path[i, 1]) > corridor.radius[1]
    )


@innermost
def stays_within(locations: Locations, model: Array, i: int, turn1: float, turn2: float, axes: Array) -> bool:
    """Set the axes at location i + 1, and check that they and the tool's lean keep their bounds."""
    sound, limits = True, locations.limits
    for a in range(len(axes)):
        there = second_order(model, a, turn1, turn2)
        axes[a, THERE] = there
        if there < limits[0, a] - MODEL_ERROR or there > limits[1, a] + MODEL_ERROR:
            sound = False
    return sound and leans_soundly(locations, model, i, turn1, turn2)


@innermost
def candidates(
    problem: SearchProblem, layers: Layers, size: int, i: int, margin: float, space: Space, found: Found
) -> int:
    """Find candidates for location i + 1 by a model of second order about every state; return their number.

    The space has the quantities of location i + 1 at the angles of the states, with both derivatives. A
    candidate may cost more than the cheapest by a margin, J.
    """
    locations, prices, moves = problem.locations, problem.prices, problem.moves
    corridor, cells, now = problem.corridor, problem.cells, i & 1
    model, targets, quantities = space.model, space.targets, space.quantities
    axes, count, least = space.axes, 0, np.inf
    set_bounds(locations, corridor, i, model)
    targets_of_rows(locations, moves, i, targets)
    near = len(corridor.path) > 0
    only_path = near and not corridor.free[i + 1]
    first_move = (ONTO_PATH if only_path else BESIDE_PATH) if near else 0
    for j in range(size):
        before = layers.cost[now, j]
        if before > least + margin:
            continue
        set_model(model, quantities, j, len(axes))
        for move in range(first_move, 0 if only_path else len(moves)):
            if move == ONTO_PATH:
                turn1 = corridor.path[i + 1, 0] - layers.rotary[now, j, 0]
                turn2 = corridor.path[i + 1, 1] - layers.rotary[now, j, 1]
            else:
                row1, aim1, row2, aim2 = aims_of(problem, layers.positions, targets, i, j, move)
                # Most moves are too far: that is seen before they are solved.
                if move != BESIDE_PATH and not (
                    abs(model[row1, 0] - aim1) <= model[row1, FARTHEST]
                    and abs(model[row2, 0] - aim2) <= model[row2, FARTHEST]
                ):
                    continue
                sound, turn1, turn2 = turns_to(model, row1, aim1, row2, aim2)
                if not sound:
                    continue
            over = turned_too_far(locations, quantities, j, i, turn1, turn2)
            angle1, angle2 = layers.rotary[now, j, 0] + turn1, layers.rotary[now, j, 1] + turn2
            if move == ONTO_PATH:
                over = max(over, corridor.path[i + 1, 2])
                for a in range(len(axes)):
                    axes[a, THERE] = corridor.path[i + 1, 3 + a]
            else:
                if over > ROUNDING or not is_beside(corridor, i + 1, angle1, angle2):
                    continue
                if not stays_within(locations, model, i, turn1, turn2, axes):
                    continue
                if move >= 0:
                    keep_held(layers.positions, i, j, moves, move, axes)
            if move == ONTO_PATH:
                travelled_far(problem, layers, j, i, turn1, turn2, space)
            else:
                travelled(layers.positions, i, j, axes)
            turned = turn1 * turn1 + turn2 * turn2
            cost = before + step_price(prices, i, layers.moved[now, j], axes, turned)[0]
            if over > ROUNDING:
                cost += BREACH_PRICE + EXCESS_PRICE * over
            key = -1
            if move != ONTO_PATH:
                if cost > least + margin:
                    continue
                spin = angle1 if cells.spin == 0 else angle2
                key = cell_of(cells, model, axes[cells.level, THERE], spin, turn1, turn2)
            at = competes(found, count, key, cost)
            if at < 0:
                continue
            count = max(count, at + 1)
            found.numbers[at, PARENT], found.numbers[at, MOVE], found.numbers[at, KEY] = j, move, key
            found.cost[at], found.rotary[at, 0], found.rotary[at, 1] = cost, angle1, angle2
            least = min(least, cost)
    return count


@innermost
def kept(cells: Cells, found: Found, count: int, most: int, regions: IntArray, chosen: IntArray) -> int:
    """Choose candidates: the path's own, the cheapest of every wide cell of both angles, then the cheapest.

    Return their number; `chosen` has them, see `Trail`.
    """
    if count <= most:
        for at in range(count):
            chosen[0, at] = at
        return count
    rest, stays = found.rest, found.stays
    size = used = 0
    for at in range(count):
        number = region(cells, found.rotary[at, 0], found.rotary[at, 1])
        best = regions[0, number] - 1
        if best < 0:
            regions[1, used] = number
            used += 1
        if best < 0 or found.cost[at] < found.cost[best]:
            regions[0, number] = at + 1
        stays[at] = False
        if found.numbers[at, MOVE] == ONTO_PATH:
            stays[at], size = True, 1
    for which in range(used):
        number = regions[1, which]
        at = regions[0, number] - 1
        regions[0, number] = 0
        if size < most // 2 and not stays[at]:
            stays[at] = True
            size += 1
    for at in range(count):
        rest[at] = np.inf if stays[at] else found.cost[at]
    cut = value_of_rank(rest, count, most - size - 1)
    size = 0
    for tier in range(3):
        for at in range(count):
            own = 0 if stays[at] else 1 if found.cost[at] < cut else 2 if found.cost[at] == cut else 3
            if own == tier and size < most:
                chosen[0, size] = at
                size += 1
    return size


@innermost
def value_of_rank(values: Array, count: int, rank: int) -> float:
    """Return the value of a rank, 0 for the smallest, of the first ones; they are put in another order.

    Hoare's selection. For `np.partition` numba would compile sorts, and errors with their texts.
    """
    low, high = 0, count - 1
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


@innermost
def linear(values: Array, n: int, column: int, first: float, second: float) -> float:
    """Evaluate a quantity of row n, (3 (k + 3),) with its derivatives by both angles, at small turns, rad."""
    rows = values.shape[1] // 3
    slope1, slope2 = values[n, rows + column], values[n, 2 * rows + column]
    return float(values[n, column] + slope1 * first + slope2 * second)


@innermost
def residual(
    bounds: Array, i: int, row: int, aim: float, values: Array, n: int
) -> tuple[float, float, float]:
    """Compute what a row of the model lacks of what is asked of it at location i, and its derivatives."""
    rows = values.shape[1] // 3
    axes = rows - 3
    if row < axes:
        return values[n, row] - aim, values[n, rows + row], values[n, 2 * rows + row]
    value, slope1, slope2 = -aim, 0.0, 0.0
    for c in range(3):
        along = bounds[i, row - axes, c]
        value += along * values[n, axes + c]
        slope1 += along * values[n, rows + axes + c]
        slope2 += along * values[n, 2 * rows + axes + c]
    return value, slope1, slope2


@innermost
def lean_excess(locations: Locations, i: int, values: Array, n: int, first: float, second: float) -> float:
    """Compute by how much the cosine of the tool's lean at location i is out of a bound; below 0 for none."""
    axes, over, bounds = locations.limits.shape[1], -np.inf, locations.bounds
    for b in range(bounds.shape[1]):
        cosine = 0.0
        for c in range(3):
            cosine += bounds[i, b, c] * linear(values, n, axes + c, first, second)
        over = max(over, bounds[i, b, 3] - cosine, cosine - bounds[i, b, 4])
    return over


@innermost
def newton_turn(
    problem: SearchProblem, positions: Array, i: int, j: int, move: int, space: Space, n: int
) -> tuple[bool, float, float]:
    """Take a Newton step towards what a move aims at: whether it is sound, and both turns, rad."""
    bounds, values = problem.locations.bounds, space.values
    row1, aim1, row2, aim2 = aims_of(problem, positions, space.targets, i, j, move)
    f, f1, f2 = residual(bounds, i + 1, row1, aim1, values, n)
    g, g1, g2 = residual(bounds, i + 1, row2, aim2, values, n)
    determinant = f1 * g2 - f2 * g1
    if not abs(determinant) > LEAST_DETERMINANT:
        return False, 0.0, 0.0
    first, second = -(g2 * f - f2 * g) / determinant, -(f1 * g - g1 * f) / determinant
    return not abs(first) + abs(second) > LONGEST_TURN, first, second


@innermost
def solved(
    problem: SearchProblem, layers: Layers, found: Found, chosen: IntArray, left: int, i: int, space: Space
) -> int:
    """Solve the candidates that were chosen exactly, and fill in the states of location i + 1; their number.

    Newton's method on the chain itself; the last step is linear, and of at most `CONVERGED`. Afterwards the
    candidates chosen are of no use. The space has the targets that they were found by.
    """
    locations, corridor, cells = problem.locations, problem.corridor, problem.cells
    given, values, axes = space.given, space.values, space.axes
    limits, moves, size = locations.limits, problem.moves, 0
    now, then = i & 1, 1 - (i & 1)
    for n in range(left):
        given[n, 0], given[n, 1] = found.rotary[chosen[0, n], 0], found.rotary[chosen[0, n], 1]
        for d in range(6):
            given[n, 2 + d] = locations.given[i + 1, d]
    for _ in range(NEWTON_STEPS):
        play(*problem.first_order, given[:left], values[:left])
        again = 0
        for n in range(left):
            j, move = found.numbers[chosen[0, n], PARENT], found.numbers[chosen[0, n], MOVE]
            first = second = 0.0
            if move != ONTO_PATH:
                sound, first, second = newton_turn(problem, layers.positions, i, j, move, space, n)
                if not sound:
                    continue
                if abs(first) + abs(second) > CONVERGED:
                    chosen[0, again] = chosen[0, n]
                    given[again, 0], given[again, 1] = given[n, 0] + first, given[n, 1] + second
                    again += 1
                    continue
            angle1, angle2 = given[n, 0] + first, given[n, 1] + second
            turn1, turn2 = angle1 - layers.rotary[now, j, 0], angle2 - layers.rotary[now, j, 1]
            over = turned_too_far(locations, space.quantities, j, i, turn1, turn2)
            for a in range(len(axes)):
                axes[a, THERE] = linear(values, n, a, first, second)
            if move == ONTO_PATH:
                over = max(over, corridor.path[i + 1, 2])
            else:
                for a in range(len(axes)):
                    over = max(over, axes[a, THERE] - limits[1, a], limits[0, a] - axes[a, THERE])
                over = max(over, lean_excess(locations, i + 1, values, n, first, second))
                if over > ROUNDING:
                    continue
            if move >= 0:
                keep_held(layers.positions, i, j, moves, move, axes)
            elif move == BESIDE_PATH:
                axes[cells.level, THERE] = layers.positions[now, j, cells.level]
            travelled_far(problem, layers, j, i, turn1, turn2, space)
            turned = turn1 * turn1 + turn2 * turn2
            price, moved = step_price(problem.prices, i, layers.moved[now, j], axes, turned)
            if over > ROUNDING:
                price += BREACH_PRICE + EXCESS_PRICE * over
            layers.rotary[then, size, 0], layers.rotary[then, size, 1] = angle1, angle2
            layers.cost[then, size], layers.moved[then, size] = layers.cost[now, j] + price, moved
            for a in range(len(axes)):
                layers.positions[then, size, a] = axes[a, THERE]
            chosen[1, size] = j
            size += 1
        left = again
        if not left:
            break
    return size


@compiled
def advance(
    problem: SearchProblem, trail: Trail, begin: int, end: int, most: int, margin: float
) -> tuple[int, float]:
    """Search on from location `begin`, whose states are known, to location `end`.

    Parameters
    ----------
    most : states that each location keeps
    margin : J, by which a candidate may cost more than the cheapest one; infinite at first

    Returns
    -------
    The last location that has states, and the margin there
    """
    found, space, layers = trail.found, trail.space, trail.layers
    given, begins, chosen = space.given, trail.begin, trail.chosen
    for i in range(begin, end):
        size, then = begins[i + 1] - begins[i], (i + 1) & 1
        for j in range(size):
            given[j, 0], given[j, 1] = layers.rotary[i & 1, j, 0], layers.rotary[i & 1, j, 1]
            for d in range(6):
                given[j, 2 + d] = problem.locations.given[i + 1, d]
        play(*problem.second_order, given[:size], space.quantities[:size])
        count = candidates(problem, layers, size, i, margin, space, found)
        left = kept(problem.cells, found, count, most, trail.regions, chosen)
        size = solved(problem, layers, found, chosen, left, i, space)
        for at in range(count):
            found.table[found.numbers[at, SLOT]] = 0
        if not size:
            return i, margin
        least, dearest, at = np.inf, -np.inf, begins[i + 1]
        for j in range(size):
            least, dearest = min(least, layers.cost[then, j]), max(dearest, layers.cost[then, j])
            trail.states[at + j, 0] = layers.rotary[then, j, 0]
            trail.states[at + j, 1] = layers.rotary[then, j, 1]
            trail.parents[at + j] = begins[i] + chosen[1, j]
        margin = MARGIN_FACTOR * (dearest - least) if left == most else np.inf
        begins[i + 2] = at + size
    return end, margin
