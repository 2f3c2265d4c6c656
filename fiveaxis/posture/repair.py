"""From a path that a mask refuses in places to one that it admits everywhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, normalise
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.budget import DEGREE, Search
from fiveaxis.posture.lattice import Lattice, choose_coordinates
from fiveaxis.posture.mask import Known, Mask, clean_path, pinned, stored
from fiveaxis.posture.portfolio import WIDER, Portfolio
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.refine import refine, refine_windows
from fiveaxis.posture.search import refill, thin
from fiveaxis.posture.solution import Baseline, Stage
from fiveaxis.toolpath import TiltBounds, Toolpath

# Locations to each side of a refused one that may move with it, and how many more in each further round.
MARGIN, GROWTH = 6, 4
# From this share of refused locations on the whole path is searched again.
MOST_PATCHED = 0.2
# A lattice in a window has about this many rows; between them the path is filled in.
WINDOW_ROWS = 120
# A path of no more than so many locations is searched as a whole without leaving any out, at last.
MOST_ROWS = 400
STEP, LEVELS = 4.0 * DEGREE, 36
# Rounds of refining a clean path, and how often cuts are added in each before it is left as it is.
ROUNDS, MOST_CUTS = 6, 5
HALVINGS = 6
# Postures asked about round a posture on the edge of the mask, at this distance (rad).
PROBES, PROBE = 8, 1.0 * DEGREE
# A round that saves a smaller share of the cost is the last.
WORTHWHILE = 1e-3
# Postures of a location that are asked about before it is said to have none.
SAMPLES = 400


@dataclass(eq=False)
class Repair:
    """The repair of a path, and of what it is made of.

    Parameters
    ----------
    run : the portfolio that found the path; gives the problem, the budget and takes the stages
    mask : what the path has to please
    """

    run: Portfolio
    mask: Mask

    def repaired(self, start: Array, toolpath: Toolpath, compared: Mapping[str, Baseline]) -> Array:
        """Change a path, (n, 2) rad, until the mask admits all of it, and refine what comes out.

        Where a baseline that the mask admits costs less than the repaired path, it is refined instead.

        Raises
        ------
        Infeasible
            No such path was found; each refused location is listed.
        """
        problem = self.run.problem
        every, path = np.arange(len(problem)), start
        for margin, rows in self._rounds():
            clean = self.mask.admits(every, path)
            if clean.all():
                break
            scattered = clean.mean() < 1.0 - MOST_PATCHED
            windows = [(0, len(problem) - 1)] if scattered else _windows(~clean, margin)
            for first, last in windows:
                found = self._patch(first, last, path, rows)
                if found is not None:
                    path = np.concatenate([path[:first], found, path[last + 1 :]])
        else:
            refused = np.flatnonzero(~self.mask.admits(every, path))
            if len(refused) and not compared:
                raise self._infeasible(refused, toolpath)
            path = path if not len(refused) else next(iter(self._rotary(compared)))
        path = min([path, *self._rotary(compared)], key=problem.priced)
        before = problem.cost(problem.positions(slice(None), path))
        path = self._polished(path)
        after = problem.cost(problem.positions(slice(None), path))
        asked = f"{self.mask.asked} postures asked in {self.mask.calls} calls"
        self.run.stages.append(Stage("repair for the mask", asked, self.mask.asked, before, after))
        return path

    def _rotary(self, compared: Mapping[str, Baseline]) -> list[Array]:
        return [b.motion.positions[:, self.run.problem.machine.rotary_columns] for b in compared.values()]

    def _rounds(self) -> Iterator[tuple[int, int]]:
        """Give the margin of the windows and the rows of their lattices: farther, then all, then densely."""
        margin, count = MARGIN, len(self.run.problem)
        while margin < count:
            yield margin, WINDOW_ROWS
            margin *= GROWTH
        yield count, WINDOW_ROWS
        if count <= MOST_ROWS:
            yield count, count

    def _patch(self, first: int, last: int, path: Array, most: int) -> Array | None:
        """Find a clean way through a window, (m, 2) rad, that joins the path at its ends."""
        part = self.run.problem.between(first, last)
        if len(part) == 1:
            return self._alone(part, first)
        # The ends of the whole path are free.
        ends = {0: first, len(part) - 1: last}
        held = {row: path[at] for row, at in ends.items() if 0 < at < len(path) - 1}
        stride = -(-len(part) // most)
        rows = thin(part, stride)
        sparse, coordinates = part.thinned(rows), choose_coordinates(part)
        search = Search(stride, STEP, LEVELS)
        at_ends = {int(np.searchsorted(rows, row)): posture for row, posture in held.items()}
        known = Known(self.mask, first + rows, sparse)
        for forbidden, wider in product((True, False), WIDER):
            # Turning too far is a last resort of the whole path: a wider window may go round.
            if not forbidden and held:
                break
            lattice = stored(self.run.lattice(sparse, search, coordinates, wider, 0.0), len(rows))
            lattice = replace(pinned(lattice, sparse, at_ends), turns_forbidden=forbidden)
            found = clean_path(lattice, known)
            if found is not None:
                if stride > 1:
                    found = self._filled(part, first, rows, found, held)
                return _joined(found[:, part.machine.rotary_columns], held)
        return None

    def _alone(self, part: Problem, row: int) -> Array | None:
        """Find a clean posture of a path of one location."""
        states, price = self._samples(part, 0)
        states = states[np.isfinite(price)]
        clean = self.mask.admits(np.full(len(states), row), states)
        return states[clean][:1] if clean.any() else None

    def _filled(
        self, part: Problem, first: int, rows: IntArray, path: Array, held: dict[int, Array]
    ) -> Array:
        """Extend a way to all locations of its window through clean states."""

        def find(problem: Problem, lattice: Lattice) -> Array | None:
            known = Known(self.mask, np.arange(first, first + len(problem)), problem)
            return clean_path(pinned(stored(lattice, len(problem)), problem, held), known)

        return refill(part, choose_coordinates(part), rows, path, self.run.budget.widths, find)

    def _polished(self, path: Array) -> Array:
        """Refine a clean path, cutting off what the mask refuses, as long as that is worth it."""
        problem = self.run.problem
        if len(problem) == 1:
            return path
        for _ in range(ROUNDS):
            before = problem.cost(problem.positions(slice(None), path))
            sound = problem.violation(path) <= ALLOWED
            found = self._refined(path)
            if found is None:
                break
            path = found
            if sound and problem.cost(problem.positions(slice(None), path)) > (1.0 - WORTHWHILE) * before:
                break
        return path

    def _refined(self, path: Array) -> Array | None:
        """Refine once, with as many cuts as it takes for the mask to admit the outcome."""
        problem, budget, every = self.run.problem, self.run.budget, np.arange(len(path))
        cuts: list[TiltBounds] = []
        for _ in range(MOST_CUTS):
            bounded = replace(problem, bounds=(*problem.bounds, *cuts))
            if len(path) <= budget.whole:
                found = refine(bounded, path, iterations=budget.iterations, barrier=budget.barrier).rotary
            else:
                found = refine_windows(
                    bounded,
                    path,
                    size=budget.window,
                    iterations=budget.window_iterations,
                    barrier=budget.barrier,
                ).rotary
            clean = self.mask.admits(every, found)
            if clean.all():
                return found
            cuts.append(self._cut(path, found, np.flatnonzero(~clean)))
        # Between cuts that don't help, the clean way is taken where the refined one is refused.
        mixed = np.where(clean[:, None], found, path)
        return mixed if problem.violation(mixed) <= ALLOWED else None

    def _cut(self, clean: Array, refused: Array, rows: IntArray) -> TiltBounds:
        """Bound the tool axis of some locations by a plane between a clean posture and a refused one."""
        low, high = np.zeros(len(rows)), np.ones(len(rows))
        way = refused[rows] - clean[rows]
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            is_clean = self.mask.admits(rows, clean[rows] + middle[:, None] * way)
            low, high = np.where(is_clean, middle, low), np.where(is_clean, high, middle)
        inside = self._inwards(rows, clean[rows] + low[:, None] * way)
        # A plane that the clean posture itself lies beyond would cut off what is known to be good.
        inside[np.sum(inside * tool_axes(self.run.problem.machine, clean[rows]), axis=1) < 0.0] = np.nan
        reference = np.full_like(self.run.problem.pivot, np.nan)
        reference[rows] = inside
        return TiltBounds(reference, 0.0, np.pi / 2.0, "inside of the mask")

    def _inwards(self, rows: IntArray, edge: Array) -> Array:
        """Find the direction across the tool axis, (m, 3), in which the mask admits, at its edge.

        The mask is asked at some postures round it; the direction is the fit of its answers by a plane.
        """
        machine = self.run.problem.machine
        turn = np.arange(PROBES) * TURN / PROBES
        round_it = PROBE * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        tried = edge[:, None] + round_it
        clean = self.mask.admits(np.repeat(rows, PROBES), tried.reshape(-1, 2)).reshape(len(rows), PROBES)
        axis = tool_axes(machine, edge)
        moved = tool_axes(machine, tried.reshape(-1, 2)).reshape(len(rows), PROBES, 3) - axis[:, None]
        fitted = np.einsum("mij,mj->mi", np.linalg.pinv(moved, rcond=1e-3), np.where(clean, 1.0, -1.0))
        fitted -= axis * np.sum(fitted * axis, axis=1, keepdims=True)
        known = np.linalg.norm(fitted, axis=1) > 1e-9
        return normalise(np.where(known[:, None], fitted, np.nan))

    def _samples(self, part: Problem, row: int) -> tuple[Array, Array]:
        """Give some postures of a location, (s, 2) rad, and their price."""
        search = Search(1, STEP, LEVELS)
        lattice = self.run.lattice(part, search, choose_coordinates(part), 1, 0.0)
        positions, price = lattice.states(np.array([row]))
        states = positions[0][..., part.machine.rotary_columns].reshape(-1, 2)
        return states, price.ravel()

    def _infeasible(self, rows: IntArray, toolpath: Toolpath) -> Infeasible:
        findings = []
        problem = self.run.problem
        for row in rows:
            states, price = self._samples(problem.between(int(row), int(row)), 0)
            states = states[np.isfinite(price)]
            states = states[np.unique(np.linspace(0, len(states) - 1, SAMPLES).astype(np.int64))]
            clean = self.mask.admits(np.full(len(states), row), states)
            if clean.any():
                text = "the mask admits postures here, but none was found that joins its neighbours'"
            else:
                text = f"the mask refuses each of the {len(states)} admissible postures that were tried"
            findings.append(
                Finding(
                    Severity.ERROR,
                    "no-posture",
                    f"{text}; widen the tilt range, allow larger turns (--max-turn) or change what the mask "
                    "stands for",
                    toolpath.place(int(row)),
                )
            )
        share = f"{len(findings)} of {len(problem)} locations"
        return Infeasible(f"{share} have no posture in sequence that the mask admits", findings)


def _joined(found: Array, held: dict[int, Array]) -> Array | None:
    """Bring a way onto the turn of the path that it joins; None where its ends are on different turns."""
    for row, posture in held.items():
        turns = np.round((posture - found[row]) / TURN)
        if row == min(held):
            found = found + TURN * turns
        elif turns.any():
            return None
    return found


def _windows(dirty: BoolArray, margin: int) -> list[tuple[int, int]]:
    """Give first and last location of every stretch of refused ones with a margin, overlaps joined."""
    near = np.convolve(dirty, np.ones(2 * margin + 1), mode="full")[margin : margin + len(dirty)] > 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[0], near.astype(np.int8), [0]])))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]


def without_refused(
    compared: Mapping[str, Baseline], missing: Mapping[str, str], machine: Machine, mask: Mask
) -> tuple[dict[str, Baseline], dict[str, str]]:
    """Move baselines that a mask refuses somewhere to those that are missing, with the reason."""
    kept, reasons = dict(compared), dict(missing)
    for name, baseline in compared.items():
        rotary = baseline.motion.positions[:, machine.rotary_columns]
        refused = np.flatnonzero(~mask.admits(np.arange(len(rotary)), rotary))
        if len(refused):
            reasons[name] = f"the mask refuses {len(refused)} locations, first location {refused[0]}"
            del kept[name]
    return kept, reasons


def never_dearer(problem: Problem, rotary: Array, compared: Mapping[str, Baseline]) -> Array:
    """Give the path, (n, 2) rad, or the baseline that is sound and costs less."""
    columns = problem.machine.rotary_columns
    paths = [rotary, *(b.motion.positions[:, columns] for b in compared.values())]
    sound = [path for path in paths if problem.violation(path) <= ALLOWED] or paths[:1]
    return min(sound, key=lambda path: problem.cost(problem.positions(slice(None), path)))
