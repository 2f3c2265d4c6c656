"""Run time of blocks on a control that plans them as LinuxCNC does: in servo cycles, with its look-ahead.

The rules are those of LinuxCNC 2.9, src/emc/tp/tp.c (tpRunCycle and what it calls).
"""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.limiting import AT_LIMIT, DWELL, FEED, OTHERS, SHORT, STOPS, Limiting
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.servo_queue import (
    EXACT,
    PARABOLIC,
    QUEUED_MOVE,
    STOP,
    TANGENT,
    Record,
    Records,
    blend_speeds,
    queue_moves,
    top_speed,
    usable_acceleration,
)
from fiveaxis.model.motion.time_law import levers
from fiveaxis.model.motion.timing import axis_bounds

# mm or rad: an axis that moves by less stands (CART_FUZZ of LinuxCNC's posemath.h).
STANDS = 1e-8
# Below these a distance, mm, a speed, mm/s, and a time, s, are none.
NO_WAY, NO_SPEED, NO_TIME = 1e-12, 1e-8, 1e-12
# s: a tangent move that takes less has one acceleration (ARC_BLEND_RAMP_FREQ = 100 Hz).
RAMP_TIME = 0.01
# What a move does in a cycle: it gains speed, runs at its highest, or loses speed.
RISING, CRUISING, FALLING = range(3)


def servo_times(
    blocks: Motion, machine: Machine, cycle: float, *, blends: bool, tolerance: float = 0.0
) -> Limiting:
    """Run blocks, one a row, through LinuxCNC's trajectory planner, from rest to rest.

    The length of a block is that of its X, Y and Z words, or of its rotary words where these stand; the speed
    along it changes by at most ``min_j A_j / |d_j|``, d the axes' steps per length. Followed exactly (G61), a
    block ends at rest, unless neither it nor the next turns a rotary axis and their directions d₁, d₂ differ
    so little that the change of speed within one cycle T needs less than a tenth of every axis's
    acceleration::

        |d₂ − d₁|_j (v / T + a) < 0.1 A_j

    Blended (G64), the next block begins while this one brakes, each with half of its acceleration; between
    two blocks of X, Y and Z alone an arc may take the corner. Blocks are taken to be read in time; that
    LinuxCNC joins nearly straight blocks under ``G64 P`` isn't followed.

    Parameters
    ----------
    blocks : in the words that the control limits; with the times at their feeds
    machine : with accelerations of all axes
    cycle : s
    blends, tolerance : whether blocks are blended, and mm that X, Y and Z may deviate then; 0 for none

    Returns
    -------
    The time of each block, by what limits its speed; a block without a move keeps its own time
    """
    bounds = axis_bounds(machine)
    linear, rotary = machine.linear_columns, machine.rotary_columns
    steps = np.where(np.abs(blocks.moves) < STANDS, 0.0, blocks.moves)
    along, turn = (np.linalg.norm(steps[:, columns], axis=1) for columns in (linear, rotary))
    length = np.where(along > 0.0, along, turn)
    moving = np.flatnonzero(length > 0.0)
    still = np.flatnonzero(length == 0.0)
    rests = np.full(len(still), DWELL)
    if not len(moving):
        return Limiting.of(blocks.letters, len(steps), still, rests, blocks.time)
    rates = np.abs(steps[moving]) / length[moving, None]
    queue = np.zeros(len(moving), QUEUED_MOVE)
    queue["block"], queue["length"], queue["whole"] = moving, length[moving], length[moving]
    queue["feed"] = length[moving] / blocks.time[moving]
    with np.errstate(divide="ignore"):
        queue["most"] = (bounds.speed / rates).min(axis=1)
        queue["acceleration"] = (bounds.acceleration / rates).min(axis=1)
    straight = np.divide(
        steps[:, linear], along[:, None], out=np.zeros((len(steps), 3)), where=along[:, None] > 0.0
    )
    straight[along == 0.0, 0] = 1.0
    queue["direction"], queue["turns"] = straight[moving], turn[moving] > 0.0
    queue["rapid"] = blocks.rapid[moving]
    queue["join"], queue["kink"] = PARABOLIC if blends else EXACT, np.inf
    limits = np.array([bounds.acceleration[linear], bounds.speed[linear]])
    with np.errstate(divide="ignore"):
        slowest, weakest = ((most / rates).argmin(axis=1) for most in (bounds.speed, bounds.acceleration))
    joined = queue_moves(queue, limits, tolerance, cycle)
    spent = run_cycles(joined, np.zeros(len(joined), STATE), tolerance, cycle)
    move = np.searchsorted(moving, joined["block"])
    pushed = len(OTHERS) + len(blocks.letters) + weakest[move]
    most = queue["most"][move]
    cruising = np.where(joined["feed"] < AT_LIMIT * most, FEED, len(OTHERS) + slowest[move])
    cruising[joined["most"] < np.minimum(AT_LIMIT * joined["feed"], most)] = SHORT
    cruising[joined["arc"]] = pushed[joined["arc"]]
    # A blend stops an axis where the path turns back.
    along = steps[joined["block"]] * levers(blocks.letters)
    back = (along[1:] * along[:-1]).sum(axis=1) < 0.0
    turned = np.append(False, back), np.append(back, False)
    rising, falling = (
        np.where(stops | backs, STOPS, pushed)
        for stops, backs in zip(touching_rest(spent, joined["join"]).T, turned, strict=True)
    )
    return Limiting.of(
        blocks.letters,
        len(steps),
        np.concatenate([still, *[joined["block"]] * 3]),
        np.concatenate([rests, rising, cruising, falling]),
        np.concatenate([blocks.time[still], *spent.T]),
    )


# Where a move is.
STATE = np.dtype(
    [
        ("gone", np.float64),  # distance done
        ("speed", np.float64),
        ("step", np.float64),  # s, of the coming step: a cycle, or the part of one that is left
        ("begun", np.bool_),
        ("ramps", np.bool_),  # whether it has one acceleration
        ("braking", np.bool_),  # whether it slows down as late as possible
        ("blending", np.bool_),  # whether the next move has begun
        ("split", np.bool_),  # whether it ends within the coming cycle
        ("end_speed", np.float64),  # at a tangent end
        ("done", np.bool_),
        ("doing", np.int64),  # RISING, CRUISING or FALLING, in the last step
    ]
)


@compiled
def limited(value: float, most: float) -> float:
    """Return a value within ±most."""
    return min(max(value, -most), most)


@compiled
def trapezoid(move: Record, state: Record) -> tuple[float, float]:
    """Acceleration of the coming step, and the highest speed from which the end can still be met.

    After a step of length T that is the speed v from which braking with a ends at the final speed v_f
    (tpCalculateTrapezoidalAccel)::

        v = −a T / 2 + √(v_f² + a (2 s − v₀ T) + (a T / 2)²)
    """
    acceleration, left = usable_acceleration(move), move.length - state.gone
    half = 0.5 * acceleration * state.step
    under = move.final**2 + acceleration * (2.0 * left - state.speed * state.step) + half**2
    reachable = -half + (math.sqrt(under) if under > half**2 else 0.0)
    wanted = limited(reachable, top_speed(move))
    return limited((wanted - state.speed) / max(state.step, NO_TIME), acceleration), reachable


@compiled
def ramp(move: Record, state: Record) -> float:
    """Acceleration that meets the final speed at the end of the move (tpCalculateRampAccel)."""
    mean = 0.5 * (state.speed + move.final)
    time = max((move.length - state.gone) / mean, 1e-16) if mean > NO_SPEED else 1e-16
    return limited((move.final - state.speed) / time, usable_acceleration(move))


@compiled
def step_on(move: Record, state: Record, cycle: float) -> None:
    """Let a move go on by one step (tpUpdateCycle)."""
    if state.ramps and move.join == TANGENT and move.final >= NO_SPEED:
        acceleration, wanted = ramp(move, state), move.final
    else:
        acceleration, wanted = trapezoid(move, state)
    speed = state.speed + acceleration * state.step
    if speed < 0.0:
        speed = 0.0
        if move.length - state.gone < state.speed * state.step:
            state.gone = move.length
    else:
        state.gone = min(state.gone + 0.5 * (speed + state.speed) * state.step, move.length)
    state.speed = speed
    state.doing = RISING if acceleration >= 0.0 else FALLING
    if speed >= AT_LIMIT * top_speed(move):
        state.doing = CRUISING
    state.braking = abs(wanted - speed) < NO_SPEED and acceleration < 0.0
    look_for_end(move, state, cycle)


@compiled
def look_for_end(move: Record, state: Record, cycle: float) -> None:
    """Mark a move that ends now, or within the coming cycle (tpCheckEndCondition)."""
    state.step = cycle
    left = move.length - state.gone
    rests = move.join in (STOP, EXACT)
    if left <= NO_WAY:
        state.gone, state.split, state.step, state.end_speed = move.length, True, 0.0, state.speed
        state.done = rests
        return
    mean = 0.5 * (state.speed + move.final)
    if rests or (mean <= NO_SPEED and left > mean * cycle):
        return
    time = max(left / mean, 0.5 * NO_TIME) if mean > NO_SPEED else 0.5 * NO_TIME
    final, most, acceleration = move.final, usable_acceleration(move), (move.final - state.speed) / time
    if abs(acceleration) > most:
        acceleration = limited(acceleration, most)
        under = (state.speed / acceleration) ** 2 + 2.0 * left / acceleration
        if under < 0.0:
            return
        root = math.sqrt(under) if under >= NO_TIME**2 else 0.0
        time = -state.speed / acceleration + (root if acceleration > 0.0 else -root)
        final = state.speed + time * acceleration
    if time < NO_TIME:
        state.gone, time = move.length, 0.0
    if time < cycle:
        state.split, state.step, state.end_speed = True, time, final


@compiled
def begin(move: Record, state: Record) -> None:
    """Prepare a move that comes to the front of the queue (tpActivateSegment)."""
    if state.begun:
        return
    state.begun = True
    mean = state.speed + min(move.final, top_speed(move))
    if move.join == TANGENT and not move.rapid and mean > 0.0:
        state.ramps = 2.0 * (move.length - state.gone) / mean < RAMP_TIME


@compiled
def finish(queue: Records, states: Records, place: int, cycle: float) -> float:
    """End a move within a cycle, and let the next one go on in the rest of it (tpHandleSplitCycle).

    Returned is the part of the cycle that belongs to the next move, s.
    """
    move, state = queue[place], states[place]
    part = state.step
    state.done = True
    if place + 1 == len(queue):
        return 0.0
    following = states[place + 1]
    if move.join == TANGENT:
        following.step, following.speed = cycle - part, state.end_speed
    step_on(queue[place + 1], following, cycle)
    return float(cycle - part)


@compiled
def run_cycles(queue: Records, states: Records, tolerance: float, cycle: float) -> Array:
    """Run all moves from rest to rest.

    Parameters
    ----------
    queue, states : (m,) of `QUEUED_MOVE`, joined by `queue_moves`, and of `STATE`, zeros
    tolerance, cycle : mm of blends, 0 for none; s

    Returns
    -------
    (m, 3), s, in which each move is RISING, CRUISING and FALLING; a cycle in which one move ends and the next
    begins is shared out between them
    """
    times = np.zeros((len(queue), 3))
    for place in range(len(queue)):
        states[place].step = cycle
    for place in range(len(queue)):
        move, state = queue[place], states[place]
        overlaps = move.join == PARABOLIC and place + 1 < len(queue)
        blend = blend_speeds(move, queue[place + 1], tolerance, 1.0)[0] if overlaps else 0.0
        while not state.done:
            begin(move, state)
            if state.split:
                rest = finish(queue, states, place, cycle)
                times[place, state.doing] += cycle - rest
                if place + 1 < len(queue):
                    times[place + 1, states[place + 1].doing] += rest
                continue
            state.step = cycle
            step_on(move, state, cycle)
            times[place, state.doing] += cycle
            if overlaps and not state.done:
                state.blending = state.blending or (state.braking and state.speed < blend)
                if state.blending:
                    step_on(queue[place + 1], states[place + 1], cycle)
    return times


@compiled
def touching_rest(spent: Array, join: IntArray) -> BoolArray:
    """Find the moves that gain speed from a standstill, and those that lose it towards one; (m, 2).

    `spent`, (m, 3), is of `run_cycles`; `join`, (m,), is how each ends.
    """
    count = len(join)
    rest = np.ones((count, 2), np.bool_)
    for place in range(1, count):
        stops, before = join[place - 1] in (STOP, EXACT), spent[place - 1]
        goes_on = rest[place - 1, 0] and join[place - 1] == TANGENT
        rest[place, 0] = stops or (goes_on and before[CRUISING] == 0.0 and before[FALLING] == 0.0)
    for place in range(count - 2, -1, -1):
        stops, after = join[place] in (STOP, EXACT), spent[place + 1]
        goes_on = rest[place + 1, 1] and join[place] == TANGENT
        rest[place, 1] = stops or (goes_on and after[CRUISING] == 0.0 and after[RISING] == 0.0)
    return rest
