"""Fairing: postures moved by a fraction of a degree, so that the rotary axes run smoothly.

A search and an optimum by prices of single moves leave axes that speed up and brake from block to block,
within what the price resolves. Where the control's clock is known, that costs time and energy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model import TURN, rotary_angles, tool_axes
from fiveaxis.posture.local.kernel import solve_band
from fiveaxis.posture.problem import ALLOWED, Problem

# Weight of a location that stays: an end, and one beside a move that doesn't cut.
STAYS = 1e6
# Halvings of the logarithm of the price of third differences, and its range.
HALVINGS, LEAST, MOST = 20, -6.0, 8.0
# Locations over which smoother postures begin beside a move that may not turn farther.
GRADUALLY = 10.0
# rad: how far inside of a bound on the lean a posture is put back.
INSIDE = 1e-6


def faired(problem: Problem, rotary: Array, farthest: float) -> Array:
    """Smooth a path's postures, (n, 2) rad, and put the tool back into the bounds on its lean.

    Minimised are squared distances from the postures, and squared third differences at the highest price that
    moves no rotary axis by more than `farthest`, rad (Whittaker 1923). A short path is returned as it is.
    """
    if len(rotary) < 4:
        return rotary
    weight = np.ones(len(rotary))
    air = ~problem.strict
    weight[[0, -1]] = weight[:-1][air] = weight[1:][air] = STAYS
    low, high, best = LEAST, MOST, rotary
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found = _smoothed(rotary, weight, 10.0**middle)
        if np.abs(found - rotary).max() <= farthest:
            low, best = middle, found
        else:
            high = middle
    return _put_back(problem, best)


def within_turns(problem: Problem, rotary: Array, smoother: Array) -> Array:
    """Go from a path's postures to smoother ones, (n, 2) rad, but not where moves would turn too far."""
    share, row = np.ones(len(rotary)), np.arange(len(rotary))
    while True:
        found = rotary + share[:, None] * (smoother - rotary)
        step = int(np.argmax(excess := problem.turn_excess(found)))
        if excess[step] <= ALLOWED or share[step] + share[step + 1] == 0.0:
            return found
        share = np.minimum(share, np.maximum(np.abs(row - step - 0.5) - 0.5, 0.0) / GRADUALLY)


def _smoothed(values: Array, weight: Array, price: float) -> Array:
    """Solve ``(W + λ DᵀD) y = W x`` with third differences D; (n, 2)."""
    n, difference = len(values), np.array([-1.0, 3.0, -3.0, 1.0])
    band, found = np.zeros((n, 4)), np.empty_like(values)
    band[:, 0] = weight
    for k in range(4):
        for i in range(k, 4):
            band[i : n - 3 + i, k] += price * difference[i] * difference[i - k]
    for column, wanted in enumerate(values.T):
        solved, free = np.empty(n), np.ones(n, dtype=bool)
        solve_band(band, -weight * wanted, free, 0.0, solved)
        found[:, column] = solved
    return found


def _put_back(problem: Problem, rotary: Array) -> Array:
    """Turn tool axes that lean too little or too much to the nearest lean that is admitted."""
    first, *others = problem.bounds
    bounds = replace(first, beside=tuple(others))
    axis = bounds.draw_in(tool_axes(problem.machine, rotary), INSIDE)
    found = rotary_angles(problem.machine, axis)
    found += TURN * np.round((rotary - found) / TURN)
    far = np.abs(found - rotary).max(axis=-1)
    nearest = np.where(np.isnan(far), np.inf, far).argmin(axis=0)
    back = found[nearest, np.arange(len(rotary))]
    return np.where(np.isfinite(back), back, rotary)
