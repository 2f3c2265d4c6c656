"""Slower cuts where they save energy: a feed for each move of a solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.energy import move_powers
from fiveaxis.motion import follow
from fiveaxis.posture.solution import Solution, program_energy

# How many shares of the feed are tried in each move.
TRIED = 7
# Relative difference of costs that is rounding.
SAME = 1e-9


def slowed(solution: Solution, share: float, price: float) -> Solution | None:
    """Slow the cuts of a solution down where that saves energy.

    Of each move between given locations the cheapest of some feeds is taken, by the drives' power at the mean
    speeds of its parts, and by the base power where that is known. What changes of speed between moves cost,
    the energy of the program tells.

    Parameters
    ----------
    share : least one of the feed
    price : W, of time, beside the base power

    Returns
    -------
    The same postures at other feeds, with its baselines as they were; None where no cut is slower
    """
    machine, path, motion = solution.machine, solution.toolpath, solution.motion
    shares, begins = np.linspace(share, 1.0, TRIED), np.flatnonzero(~path.inserted[:-1]) + 1
    costs = []
    for tried in shares.tolist():
        lasting = motion.time / np.where(path.cutting, tried, 1.0)
        power = move_powers(machine, replace(motion, time=lasting)).sum(axis=1)
        costs.append(np.add.reduceat((power + price + (machine.base_power or 0.0)) * lasting, begins))
    # Of costs that differ by rounding the highest feed.
    cheap = np.array(costs) <= np.min(costs, axis=0) * (1.0 + SAME)
    best = shares[len(shares) - 1 - np.argmax(cheap[::-1], axis=0)]
    along = np.append(1.0, np.repeat(best, np.diff(begins, append=len(path))))
    slower = np.where(path.cutting, along, 1.0)
    if not (slower < 1.0).any():
        return None
    slow = replace(path, feed=path.feed * slower)
    rotary = motion.positions[:, machine.rotary_columns]
    driven = replace(follow(slow, machine, rotary), location=motion.location)
    return replace(
        solution,
        toolpath=slow,
        motion=driven,
        energy=program_energy(machine, slow, driven, solution.filling, solution.clock),
        compared={name: replace(b, toolpath=b.toolpath or path) for name, b in solution.compared.items()},
    )
