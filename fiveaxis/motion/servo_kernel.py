"""LinuxCNC's trajectory planner, servo cycle by servo cycle: how long each joined move takes.

The rules are those of LinuxCNC 2.9, src/emc/tp/tp.c (tpRunCycle and what it calls).
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array
from fiveaxis.motion.servo_queue import (
    EXACT,
    PARABOLIC,
    STOP,
    TANGENT,
    Records,
    Span,
    acceleration,
    blend_speeds,
    record_type,
    top_speed,
)

# Below these a distance, mm, a speed, mm/s, and a time, s, are none.
NO_WAY, NO_SPEED, NO_TIME = 1e-12, 1e-8, 1e-12
# s: a tangent move that takes less has one acceleration (ARC_BLEND_RAMP_FREQ = 100 Hz).
RAMP_TIME = 0.01


class State(Protocol):
    """Where a move is."""

    gone: float  # way done
    speed: float
    step: float  # s, of the coming step: a cycle, or the part of one that is left
    begun: bool
    ramps: bool  # whether it has one acceleration
    braking: bool  # whether it slows down as late as possible
    blending: bool  # whether the next move has begun
    split: bool  # whether it ends within the coming cycle
    end_speed: float  # at a tangent end
    done: bool


STATE = record_type(State)


@compiled
def limited(value: float, most: float) -> float:
    """Return a value within ±most."""
    return min(max(value, -most), most)


@compiled
def trapezoid(span: Span, state: State) -> tuple[float, float]:
    """Acceleration of the coming step, and the highest speed from which the end can still be met.

    After a step of length T that is the speed v from which braking with a ends at the final speed v_f
    (tpCalculateTrapezoidalAccel)::

        v = −a T / 2 + √(v_f² + a (2 s − v₀ T) + (a T / 2)²)
    """
    push, left = acceleration(span), span.length - state.gone
    half = 0.5 * push * state.step
    under = span.final**2 + push * (2.0 * left - state.speed * state.step) + half**2
    reachable = -half + (math.sqrt(under) if under > half**2 else 0.0)
    wanted = limited(reachable, top_speed(span))
    return limited((wanted - state.speed) / max(state.step, NO_TIME), push), reachable


@compiled
def ramp(span: Span, state: State) -> float:
    """Acceleration that meets the final speed at the end of the move (tpCalculateRampAccel)."""
    mean = 0.5 * (state.speed + span.final)
    time = max((span.length - state.gone) / mean, 1e-16) if mean > NO_SPEED else 1e-16
    return limited((span.final - state.speed) / time, acceleration(span))


@compiled
def step_on(span: Span, state: State, cycle: float) -> None:
    """Let a move go on by one step (tpUpdateCycle)."""
    if state.ramps and span.join == TANGENT and span.final >= NO_SPEED:
        push, wanted = ramp(span, state), span.final
    else:
        push, wanted = trapezoid(span, state)
    speed = state.speed + push * state.step
    if speed < 0.0:
        speed = 0.0
        if span.length - state.gone < state.speed * state.step:
            state.gone = span.length
    else:
        state.gone = min(state.gone + 0.5 * (speed + state.speed) * state.step, span.length)
    state.speed = speed
    state.braking = abs(wanted - speed) < NO_SPEED and push < 0.0
    look_for_end(span, state, cycle)


@compiled
def look_for_end(span: Span, state: State, cycle: float) -> None:
    """Mark a move that ends now, or within the coming cycle (tpCheckEndCondition)."""
    state.step = cycle
    left = span.length - state.gone
    rests = span.join in (STOP, EXACT)
    if left <= NO_WAY:
        state.gone, state.split, state.step, state.end_speed = span.length, True, 0.0, state.speed
        state.done = rests
        return
    mean = 0.5 * (state.speed + span.final)
    if rests or (mean <= NO_SPEED and left > mean * cycle):
        return
    time = max(left / mean, 0.5 * NO_TIME) if mean > NO_SPEED else 0.5 * NO_TIME
    final, most, push = span.final, acceleration(span), (span.final - state.speed) / time
    if abs(push) > most:
        push = limited(push, most)
        under = (state.speed / push) ** 2 + 2.0 * left / push
        if under < 0.0:
            return
        root = math.sqrt(under) if under >= NO_TIME**2 else 0.0
        time = -state.speed / push + (root if push > 0.0 else -root)
        final = state.speed + time * push
    if time < NO_TIME:
        state.gone, time = span.length, 0.0
    if time < cycle:
        state.split, state.step, state.end_speed = True, time, final


@compiled
def begin(span: Span, state: State) -> None:
    """Prepare a move that comes to the front of the queue (tpActivateSegment)."""
    if state.begun:
        return
    state.begun = True
    mean = state.speed + min(span.final, top_speed(span))
    if span.join == TANGENT and not span.rapid and mean > 0.0:
        state.ramps = 2.0 * (span.length - state.gone) / mean < RAMP_TIME


@compiled
def finish(spans: Records, states: Records, place: int, cycle: float) -> float:
    """End a move within a cycle, and let the next one go on in the rest of it (tpHandleSplitCycle).

    Returns
    -------
    Part of the cycle that belongs to the next move, s.
    """
    span, state = spans[place], states[place]
    part = state.step
    state.done = True
    if place + 1 == len(spans):
        return 0.0
    following = states[place + 1]
    if span.join == TANGENT:
        following.step, following.speed = cycle - part, state.end_speed
    step_on(spans[place + 1], following, cycle)
    return float(cycle - part)


@compiled
def run_cycles(spans: Records, states: Records, tolerance: float, cycle: float) -> Array:
    """Run all moves from rest to rest.

    Parameters
    ----------
    spans : (m,) of `SPAN`, joined by `queue_moves`
    states : (m,) of `STATE`, zeros
    tolerance : mm of blends; 0 for none
    cycle : s

    Returns
    -------
    times : (m,), s; a cycle in which one move ends and the next begins is shared out between them
    """
    times = np.zeros(len(spans))
    for place in range(len(spans)):
        states[place].step = cycle
    for place in range(len(spans)):
        span, state = spans[place], states[place]
        overlaps = span.join == PARABOLIC and place + 1 < len(spans)
        blend = blend_speeds(span, spans[place + 1], tolerance, 1.0)[0] if overlaps else 0.0
        while not state.done:
            begin(span, state)
            times[place] += cycle
            if state.split:
                rest = finish(spans, states, place, cycle)
                times[place] -= rest
                if place + 1 < len(spans):
                    times[place + 1] += rest
                continue
            state.step = cycle
            step_on(span, state, cycle)
            if overlaps and not state.done:
                state.blending = state.blending or (state.braking and state.speed < blend)
                if state.blending:
                    step_on(spans[place + 1], states[place + 1], cycle)
    return times
