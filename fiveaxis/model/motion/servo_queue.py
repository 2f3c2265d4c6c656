"""How LinuxCNC joins the moves of a program: what its look-ahead decides before a move begins.

The rules are those of LinuxCNC 2.9, src/emc/tp/tp.c (tpSetupTangent, tpChooseBestBlend, tpRunOptimization)
and blendmath.c (blendComputeParameters), with the settings that its INI file has unless others are stated.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, compiled

# How a move ends: at rest since it must; at rest since it is asked to; at speed; while the next one begins.
STOP, EXACT, TANGENT, PARABOLIC = range(4)
# Share of an axis's acceleration that a change of direction within one cycle may take (ARC_BLEND_KINK_RATIO).
KINK_SHARE = 0.1
# Moves that the look-ahead takes into account (ARC_BLEND_OPTIMIZATION_DEPTH), and fewest cycles of one in it.
DEPTH, FEWEST_CYCLES = 50, 1.02
# A line that is left between two blend arcs for fewer cycles becomes part of the arc (ARC_BLEND_GAP_CYCLES).
GAP_CYCLES = 4
# Shares of the acceleration along a blend arc, and towards its centre; of a move that a blend may take.
ALONG, ACROSS, SHARE = 0.5, math.sqrt(0.75), 0.5
# Largest deviation of a blend without a tolerance, as a share of the shorter move.
DEVIATION_SHARE = 0.25
# rad: moves that double back by less than this stop; angles below which no arc is fitted; mm of the arc.
DOUBLES_BACK, NO_ANGLE, LEAST_ARC = math.radians(2.0), 1e-6, 1e-6
# rad: half an angle between moves that is so near a right angle that the tolerance doesn't bound the speed.
NEARLY_STRAIGHT = 1e-3


# A move in the control's queue: how it ends (`join`), and what blends with its neighbours take from it.
QUEUED_MOVE = np.dtype(
    [
        ("block", np.int64),  # row of the motion that it belongs to
        ("length", np.float64),  # that the control counts: mm, or rad where only rotary axes move
        ("whole", np.float64),  # length before blends took from it
        ("feed", np.float64),  # programmed, per s
        ("most", np.float64),  # highest speed, per s
        ("acceleration", np.float64),  # highest acceleration of the axes along it, per s²
        ("direction", np.float64, 3),  # of X, Y, Z
        ("turns", np.bool_),  # whether a rotary axis moves
        ("rapid", np.bool_),
        ("arc", np.bool_),  # whether it is a blend between two lines
        ("join", np.int64),
        ("overlapped", np.bool_),  # whether the move before ends while it begins
        ("kink", np.float64),  # highest speed at a tangent end, per s
        ("eased_end", np.float64),  # share of the acceleration kept for the change of direction at its end
        ("eased_start", np.float64),
        ("final", np.float64),  # speed at its end, per s
    ]
)
# A record of `QUEUED_MOVE` or the like, and (m,) of them.
Record = Any
Records = NDArray[Any]


@compiled
def top_speed(move: Record) -> float:
    """Speed that a move strives for, per s."""
    return min(move.feed, move.most)


@compiled
def usable_acceleration(move: Record) -> float:
    """Acceleration along a move, per s²: what corners, blends and arcs leave of it."""
    kept = move.acceleration * (1.0 - max(move.eased_end, move.eased_start))
    if move.overlapped or move.join == PARABOLIC:
        kept *= 0.5
    return kept * ALONG if move.arc else kept


@compiled
def blend_speeds(first: Record, second: Record, tolerance: float, share: float) -> tuple[float, float, float]:
    """Speeds of two moves at which the second may begin while the first ends (tpComputeBlendVelocity), per s.

    They are those of the first, of the second, and of both together along the corner. Blends keep a tolerance
    in mm, 0 for none; `share` is the part of each move that is sure not to be taken by other blends.
    """
    acceleration_first, acceleration_second = usable_acceleration(first), usable_acceleration(second)
    fast_first = min(math.sqrt(acceleration_first * first.length * share), top_speed(first))
    fast_second = min(math.sqrt(acceleration_second * second.length * share), top_speed(second))
    within = min(first.length / fast_first, second.length / fast_second)
    time = min(within, max(fast_first / acceleration_first, fast_second / acceleration_second))
    speed_first = min(fast_first, time * acceleration_first)
    speed_second = min(fast_second, time * acceleration_second)
    angle = half_angle(first, second)
    if tolerance > 0.0 and math.cos(angle) > math.cos(0.5 * math.pi - NEARLY_STRAIGHT):
        held = 2.0 * math.sqrt(acceleration_first * tolerance / math.cos(angle))
        speed_first, speed_second = min(speed_first, held), min(speed_second, held)
    return speed_first, speed_second, math.sin(angle) * (speed_first + speed_second) / 2.0


@compiled
def half_angle(first: Record, second: Record) -> float:
    """Half the angle between two moves at their corner, rad: π/2 where the path goes straight on."""
    along = 0.0
    for axis in range(3):
        along += first.direction[axis] * second.direction[axis]
    return 0.5 * math.acos(min(max(-along, -1.0), 1.0))


@compiled
def in_plane(normal: Array, bounds: Array) -> float:
    """Largest vector of any direction in a plane within bounds of X, Y, Z (calculateInscribedDiameter)."""
    least = np.inf
    for axis in range(3):
        across = math.sqrt(max(1.0 - normal[axis] ** 2, 1e-12))
        least = min(least, bounds[axis] / across)
    return least


@compiled
def fit_arc(
    queue: Records, last: int, new: int, arc: int, bounds: Array, tolerance: float, cycle: float
) -> tuple[float, float]:
    """Fit a blend arc between two lines (blendInit3FromLineLine, blendComputeParameters).

    The queue has the lines at `last` and `new`, and room for the arc at `arc`; bounds are those of
    `queue_moves`. Returned is the length that the arc takes from each line, mm, and what is left of the first
    one; below 0 if none fits.
    """
    first, second, blend = queue[last], queue[new], queue[arc]
    angle = half_angle(first, second)
    if min(0.5 * math.pi - angle, angle) < NO_ANGLE:
        return -1.0, 0.0
    turn = math.pi - 2.0 * angle
    normal = np.cross(first.direction, second.direction)
    normal /= math.sqrt((normal**2).sum())
    most_acceleration = in_plane(normal, bounds[0])
    shorter = DEVIATION_SHARE * min(first.whole, second.whole)
    away = min(tolerance, shorter) if tolerance > 0.0 else shorter
    wanted = max(top_speed(first), top_speed(second))
    clipped = math.cos(min(turn, 0.49 * math.pi))
    one, two = min(first.most, second.most / clipped), min(second.most, first.most / clipped)
    base = math.sqrt(((second.direction * two - first.direction * one) ** 2).sum())
    goal = min(wanted, max(one * two * math.sin(turn) / base, in_plane(normal, bounds[1])))
    room = min(min(first.length, SHARE * first.whole), SHARE * second.length)
    room = min(room, math.cos(angle) * away / (1.0 - math.sin(angle)))
    widest = math.tan(angle) * room
    speed = min(math.sqrt(ACROSS * most_acceleration * widest), goal)
    parabolic = 0.5 * most_acceleration
    time = min(math.sqrt(2.0 * parabolic * room), speed) / parabolic
    radius = max(speed**2 / (ACROSS * most_acceleration), min(time * speed / turn, widest))
    if radius * turn < LEAST_ARC:
        return -1.0, 0.0
    taken = radius / math.tan(angle)
    blend.block, blend.length = second.block, radius * turn
    blend.feed, blend.acceleration = wanted, most_acceleration
    blend.most = min(speed, blend.length / cycle)
    blend.turns = blend.rapid = blend.overlapped = False
    blend.arc, blend.join, blend.kink = True, TANGENT, np.inf
    blend.eased_end = blend.eased_start = blend.final = 0.0
    left = first.length - taken
    # A line that the arc takes whole is part of the arc; its speed is the arc's.
    return taken, (0.0 if left / speed < GAP_CYCLES * cycle and not first.overlapped else left)


@compiled
def corner(first: Record, second: Record, bounds: Array, cycle: float) -> tuple[float, float]:
    """Speed at a corner, and the share of an axis's acceleration that the change of direction takes there.

    Both are of the worst case: one move ends at its highest speed within the cycle in which the other begins
    (tpSetupTangent). The share is infinite where the path doubles back.
    """
    speed = min(top_speed(first), top_speed(second))
    back = 0.0
    for axis in range(3):
        back += (first.direction[axis] + second.direction[axis]) ** 2
    if back < DOUBLES_BACK**2:
        return speed, np.inf
    jump, share = speed / cycle + second.acceleration, 0.0
    for axis in range(3):
        share = max(share, abs(second.direction[axis] - first.direction[axis]) * jump / bounds[0, axis])
    return speed, share


@compiled
def join_pair(queue: Records, count: int, bounds: Array, tolerance: float, cycle: float) -> int:
    """Decide how the last of the queued moves joins the new one, ``queue[count]``; one more has room.

    Returned is the new move's place: one further where a blend arc went in, the same where that took the
    last one's.
    """
    first, second = queue[count - 1], queue[count]
    if first.rapid != second.rapid:
        first.join = STOP
        return count
    if first.turns or second.turns or first.join == STOP:
        return count
    speed, share = corner(first, second, bounds, cycle)
    if share == np.inf:
        first.join = STOP
        return count
    straight = share < KINK_SHARE
    first.kink = speed if straight else speed * KINK_SHARE / share
    eased = min(share, KINK_SHARE)
    first.eased_end, second.eased_start = max(first.eased_end, eased), max(second.eased_start, eased)
    if straight:
        first.join = TANGENT
        return count
    if first.join == EXACT:
        return count
    return best_blend(queue, count, bounds, tolerance, cycle)


@compiled
def best_blend(queue: Records, count: int, bounds: Array, tolerance: float, cycle: float) -> int:
    """Choose the fastest of a blend arc, a tangent end and an overlap (tpChooseBestBlend), as `join_pair`."""
    first, second = queue[count - 1], queue[count]
    _one, _two, overlap = blend_speeds(first, second, tolerance, SHARE)
    taken, left = fit_arc(queue, count - 1, count, count + 1, bounds, tolerance, cycle)
    arc = queue[count + 1].most if taken >= 0.0 else 0.0
    if arc > max(0.5 * overlap, first.kink):
        first.kink, first.eased_end, second.eased_start = np.inf, 0.0, 0.0
        second.length -= taken
        if left == 0.0:
            # The move before the one that is taken keeps its end.
            queue[count + 1].length += first.length - taken
            queue[count - 1], queue[count] = queue[count + 1], queue[count]
            return count
        first.length, first.join = left, TANGENT
        first.most = min(first.most, left / cycle)
        queue[count + 2] = second
        queue[count] = queue[count + 1]
        queue[count + 1] = queue[count + 2]
        return count + 1
    if 0.5 * overlap >= first.kink:
        first.kink, first.eased_end, second.eased_start = np.inf, 0.0, 0.0
        first.join, second.overlapped = PARABOLIC, True
    else:
        first.join = TANGENT
    return count


@compiled
def queue_moves(moves: Records, bounds: Array, tolerance: float, cycle: float) -> Records:
    """Join all moves of a program, with blend arcs between them where the control puts some.

    Parameters
    ----------
    moves : (n,) of `QUEUED_MOVE`, none without length
    bounds : (2, 3), highest accelerations, mm/s², and speeds, mm/s, of X, Y, Z
    tolerance, cycle : mm of blends, 0 for none; s

    Returns
    -------
    (m,) of `QUEUED_MOVE`, with speeds at their ends
    """
    queue = np.zeros(2 * len(moves) + 3, moves.dtype)
    count = 0
    for move in range(len(moves)):
        queue[count] = moves[move]
        queue[count].most = min(queue[count].most, queue[count].length / cycle)
        if count:
            count = join_pair(queue, count, bounds, tolerance, cycle)
        count += 1
    queue = queue[:count]
    for place in range(1, count):
        if queue[place - 1].join == TANGENT:
            queue[place].most = min(queue[place].most, queue[place].length / (FEWEST_CYCLES * cycle))
    end_speeds(queue)
    return queue


@compiled
def end_speeds(queue: Records) -> None:
    """Set the speeds at tangent ends: what braking within the look-ahead allows (tpRunOptimization)."""
    count = len(queue)
    end = 0
    for place in range(count):
        if queue[place].join != TANGENT or place == count - 1:
            continue
        # First move behind this one that ends at rest.
        end = max(end, place + 1)
        while end < count - 1 and queue[end].join == TANGENT:
            end += 1
        last = min(end, place + DEPTH + 1)
        if last < end or end == count - 1:
            # The last move in the look-ahead may still lose half of its length to a blend.
            move = queue[last]
            speed = min(math.sqrt(usable_acceleration(move) * move.length), top_speed(move))
            speed = min(speed, min(queue[last - 1].most, queue[last - 1].kink))
            last -= 1
        else:
            speed = 0.0
        while last > place:
            move, before = queue[last], queue[last - 1]
            speed = math.sqrt(speed**2 + 2.0 * usable_acceleration(move) * move.length)
            speed = min(speed, min(move.most, min(before.most, before.kink)))
            last -= 1
        queue[place].final = min(speed, min(top_speed(queue[place]), top_speed(queue[place + 1])))
