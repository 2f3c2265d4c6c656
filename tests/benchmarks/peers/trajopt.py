"""TrajOpt on a case: run by `methods.trajopt` with the Python of an environment that has the wheel.

Usage: python trajopt.py PROBLEM.json RESULT.json

The solver is TrajOpt's trust region over quadratic problems, those by OSQP; `stretch.py` has the terms. It
starts from the baselines at some of the locations, and takes more and more of them. Where that ends with no
or much dearer postures, as bounds between the locations weren't seen, it starts from what Descartes finds, as
tesseract's own pipelines do; then narrow windows keep a place where the trust region gets small from holding
up the whole path.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import descartes
import numpy as np
from stretch import Stretch

# Every so many locations, one after the other, and the moves that count as short there, rad. What comes out
# is the next valley only, so there are other tries as long as there is time.
LEVELS = (
    ((30, 0.04), (8, 0.002), (1, 2e-4)),
    ((8, 0.02), (1, 2e-4)),
    ((16, 0.02), (4, 1e-3), (1, 2e-4)),
)
# Fewer locations than that aren't thinned out.
FEW = 40
# rad: short moves after Descartes, and of another try; the shortest ones, and from round to round.
AFTER, AGAIN, SHORTEST, SHORTER = 5e-4, 5e-4, 1e-5, 0.6
# Locations solved at once on either way, and how many of them again with the next ones.
WINDOW, NARROW, OVERLAP = 4000, 150, 50
# rad, and part of the cost: a round that moves nothing by more, or is cheaper by less, was the last one.
SAME, CHEAPER = 1e-4, 1e-4
# Parts of the time for the first way, and of what is left for Descartes.
FIRST, SECOND = 0.15, 0.8
# The second way isn't gone where all locations cost no more than this times what the fewest do.
ENOUGH = 1.1

Way = tuple[np.ndarray, float]


def swept(stretch: Stretch, rotary: np.ndarray, short: float, window: int) -> np.ndarray:
    """Angles after one pass of windows over the path, each between held ends."""
    rotary, count = rotary.copy(), len(rotary)
    for first in range(0, max(count - OVERLAP, 1), window - OVERLAP):
        rows = slice(first, min(first + window, count))
        held = (first > 0, rows.stop < count)
        rotary[rows] = stretch.part(rows).solved(rotary[rows], short, held)
    return rotary


def settled(stretch: Stretch, rotary: np.ndarray, short: float, window: int, until: float) -> Way:
    """Cheapest angles within all bounds, of rounds with ever shorter moves; their cost, inf if none are."""
    best, least, last = rotary, stretch.cost(rotary) if stretch.keeps(rotary) else np.inf, np.inf
    while time.process_time() < until:
        found = swept(stretch, rotary, short, window)
        cost, moved, rotary = stretch.cost(found), np.abs(found - rotary).max(), found
        if cost < least and stretch.keeps(rotary):
            best, least = rotary, cost
        if short <= SHORTEST and (moved < SAME or abs(last - cost) < CHEAPER * cost):
            break
        last, short = cost, max(short * SHORTER, SHORTEST)
    return (best if np.isfinite(least) else rotary), least


def between(count: int, rows: np.ndarray, rotary: np.ndarray) -> np.ndarray:
    """Angles at all locations, (count, 2), between those at some."""
    return np.stack([np.interp(np.arange(count), rows, side) for side in rotary.T], axis=1)


def by_levels(problem: dict, levels: tuple, until: float) -> tuple[Way, float]:
    """Angles at all locations, and their cost, from the baselines; and the cost at the fewest locations."""
    count = len(problem["points"])
    tries = [np.array(start) for start in problem["starts"]]
    costs = []
    for every, short in levels:
        if every > 1 and every * FEW > count:
            continue
        rows = np.unique(np.append(np.arange(0, count, every), count - 1))
        stretch = Stretch(problem, rows)
        # The first level that isn't left out has all moves to make.
        short = levels[0][1] if len(tries) > 1 else short
        ways = [settled(stretch, start[rows], short, WINDOW, until) for start in tries]
        rotary, least = min(ways, key=lambda way: way[1])
        tries = [between(count, rows, rotary)]
        costs.append(least)
    return (tries[0], costs[-1]), costs[0]


def by_descartes(problem: dict, until: float) -> Way:
    """Angles at all locations, and their cost, from Descartes's."""
    seconds = SECOND * (until - time.process_time())
    try:
        rotary = np.array(descartes.solve(problem | {"seconds": seconds}))
    except descartes.NoWayError:
        return np.array(problem["starts"][0]), np.inf
    return settled(Stretch(problem, np.arange(len(rotary))), rotary, AFTER, NARROW, until)


def solve(problem: dict) -> list[list[float]]:
    """Rotary angles of all locations, (n, 2)."""
    begun, seconds = time.process_time(), problem["seconds"]
    way, few = by_levels(problem, LEVELS[0], begun + FIRST * seconds)
    if way[1] < ENOUGH * few:
        others = [by_levels(problem, levels, begun + seconds)[0] for levels in LEVELS[1:]]
    else:
        others = [by_descartes(problem, begun + seconds)]
    rotary, least = min([*others, way], key=lambda way: way[1])
    whole = Stretch(problem, np.arange(len(rotary)))
    while time.process_time() < begun + seconds:
        found, cost = settled(whole, rotary, AGAIN, NARROW, begun + seconds)
        if not cost < (1.0 - CHEAPER) * least:
            break
        rotary, least = found, cost
    return rotary.tolist()


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    Path(sys.argv[2]).write_text(json.dumps(solve(problem)), encoding="utf-8")


if __name__ == "__main__":
    main()
