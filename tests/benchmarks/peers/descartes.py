"""Descartes on a case: run by `methods.descartes` with the Python of an environment that has the wheel.

Usage: python descartes.py PROBLEM.json RESULT.json

Descartes' own sampler of turns about one axis, its numerical inverse kinematics and its edges, the squared
distance of joints, don't fit a machine tool: the lean is free as well, the inverse has a closed form, and
the cost is J/mm and J/rad in each direction. So samples and edges are ours (`ladder.py`), Descartes's is the
search. First on a grid of both rotary angles at some of the locations, as an edge takes 3 µs and there are as
many as samples squared; then on a small grid about the way found, and about the baselines, again and again,
with smaller steps once that is no cheaper by much, and at twice as many locations, until it has all.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from ladder import Search

# rad: steps of the first grid, of the finest one, and what ends a step's rounds: no cheaper than by this.
FIRST, LAST, SAME = np.radians([12.0, 8.0]), np.radians(0.05), 0.01
# Most edges of the first graph.
EDGES = 6e6
# Steps on either side of the way, at some of the locations and at all.
WIDE, NARROW = 2, 1


class NoWayError(Exception):
    """Why Descartes finds no way."""


def grid_of(search: Search) -> np.ndarray:
    """All pairs of both rotary angles, (m, 2); a whole circle once."""
    sides = []
    limits = search.limits[search.chain.columns]
    for (low, high), circle, step in zip(limits, search.circles, FIRST, strict=True):
        sides.append(np.arange(-np.pi, np.pi - 1e-9, step) if circle else np.arange(low, high + 1e-9, step))
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)


def first_way(search: Search) -> tuple[np.ndarray, np.ndarray]:
    """Some locations, and the rotary angles there, (m, 2), of the cheapest way through the grid."""
    count, grid = len(search.points), grid_of(search)
    sizes = [len(search.admitted(row, grid)[1]) for row in range(0, count, max(count // 50, 1))]
    rows = np.linspace(0, count - 1, int(np.clip(EDGES / np.mean(np.square(sizes)), 2, count))).astype(int)
    values = [search.admitted(row, grid)[0] for row in rows]
    if not all(map(len, values)):
        raise NoWayError("no sample keeps the lean and the limits somewhere")
    found = search.way(rows, values, around=True)
    if found is None:
        raise NoWayError("it finds no way through its samples: the largest turns forbid it")
    rotary = found[:, search.chain.columns]
    for axis in np.flatnonzero(search.circles):
        rotary[:, axis] = np.unwrap(rotary[:, axis])
    return rows, rotary


def about(search: Search, row: int, rotary: np.ndarray, step: np.ndarray, reach: int) -> np.ndarray:
    """Axis values of the samples about a location's angles; further away if none is admitted there."""
    while reach < 64:
        side = np.arange(-reach, reach + 1)
        offsets = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
        offsets = offsets[np.argsort(np.abs(offsets).sum(axis=1), kind="stable")]
        found, _ = search.admitted(row, rotary + offsets * step)
        if len(found):
            return found[: (2 * WIDE + 1) ** 2]
        reach *= 2
    raise NoWayError("no sample keeps the lean and the limits somewhere")


def improved(
    search: Search, rows: np.ndarray, rotary: np.ndarray, reach: int, until: float
) -> tuple[np.ndarray, float]:
    """Rotary angles at some locations, and their cost, after searches about them with ever smaller steps."""
    step, best = FIRST / 2.0, np.inf
    while step.max() > LAST and time.process_time() < until:
        samples = [about(search, row, here, step, reach) for row, here in zip(rows, rotary, strict=True)]
        found = search.way(rows, samples)
        if found is None:
            if best < np.inf or reach > WIDE:
                break
            reach += 1
            continue
        cost, rotary = search.cost(rows, found), found[:, search.chain.columns]
        if cost > (1.0 - SAME) * best:
            step = step / 2.0
        best = min(cost, best)
    return rotary, best


def coarse(search: Search, baselines: list, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Some locations, and the rotary angles there, of the cheapest way from the grid or a baseline."""
    rows, rotary = first_way(search)
    starts = [rotary, *(np.array(baseline)[rows] for baseline in baselines)]
    ways = []
    for left, start in zip(range(len(starts), 0, -1), starts, strict=True):
        now = time.process_time()
        ways.append(improved(search, rows, start, WIDE, now + (until - now) / left))
    rotary, cost = min(ways, key=lambda way: way[1])
    if not np.isfinite(cost):
        raise NoWayError("it finds no way about its samples: the largest turns forbid it")
    return rows, rotary


def solve(problem: dict) -> list[list[float]]:
    """Rotary angles of all locations, (n, 2)."""
    search, count, begun = Search(problem), len(problem["points"]), time.process_time()
    until = begun + problem["seconds"]
    rows, rotary = coarse(search, problem["starts"], begun + 0.5 * problem["seconds"])
    while len(rows) < count:
        finer = np.unique(np.linspace(0, count - 1, min(2 * len(rows), count)).astype(int))
        rotary = np.stack([np.interp(finer, rows, side) for side in rotary.T], axis=-1)
        rows = finer
        rotary, _cost = improved(search, rows, rotary, NARROW, until)
    return rotary.tolist()


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    try:
        found = solve(problem)
    except NoWayError as error:
        raise SystemExit(str(error)) from error
    Path(sys.argv[2]).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
