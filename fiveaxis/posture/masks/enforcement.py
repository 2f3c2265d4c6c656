"""Turning a path that a mask refuses at some locations into one that it admits everywhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.masks.clearance import Clearance
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.posture.masks.replanning import Reach, Replanning
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Stage
from fiveaxis.posture.strategy.portfolio import WIDTHS, Portfolio
from fiveaxis.toolpath import Toolpath

# Locations to each side of a refused one that may move with it, and the factor of each further round.
MARGIN, GROWTH = 6, 4
# First margins on a long path, and the stride of the locations searched there: between locations as close as
# its own the steps of a lattice are too large for a steady path.
WIDE, STRIDE = (24, 60), 4
# Above this share of refused locations the whole path is searched again instead of replanned.
MOST_REPLANNED = 0.03
# Above this share of extra cost over the path without the mask, a replanned path is searched again.
DEARER = 5e-3
# Largest margin of a replanned path that will be searched again too.
FARTHEST = 100
# Above this share of refused locations the window is the whole path.
MOST_REFUSED = 0.2
# Approximate rows of a window's lattice; between them the path is filled in.
WINDOW_ROWS = 120
# A path up to this many locations is replanned first, however much of it is refused; finally it is searched
# as a whole at every location.
MOST_ROWS = 400
# Postures queried at a location before it is reported to have none.
SAMPLES = 400


class Refused(Infeasible):
    """There are locations at which the mask refuses every posture: no other turns would help."""


@dataclass(eq=False)
class Enforcement:
    """Makes a path satisfy a mask, by local replanning, a new search or a baseline.

    Parameters
    ----------
    run : the portfolio that found the path, with its problem and effort; its stages are extended
    mask : to satisfy
    refused : locations at which the last path that couldn't be replanned is refused
    """

    run: Portfolio
    mask: Mask
    refused: IntArray = field(init=False, default_factory=lambda: np.empty(0, dtype=np.int64))

    def enforced(self, start: Array, toolpath: Toolpath, compared: Mapping[str, Baseline]) -> Array:
        """Change a refined path, (n, 2) rad, until the mask admits all of it, and refine the result.

        Where the mask refuses a few locations, the path is replanned around them; where it refuses many, the
        whole path is searched again among roughly admitted postures. An admitted baseline that costs less is
        refined instead.

        Raises
        ------
        Infeasible
            No such path was found; each refused location is listed (`Refused` if one has no posture at all).
        """
        problem = self.run.problem
        # A mask knows nothing of angles that the machine doesn't have.
        machine, rotary = problem.machine, problem.machine.rotary_columns
        start = np.clip(start, machine.low[rotary], machine.high[rotary])
        admitted = self.mask.admits(np.arange(len(problem)), start)
        before = problem.path_cost(start)
        # An admitted path is refined already.
        path = start if admitted.all() else self._cheapest(start, admitted, _paths(problem, compared))
        if path is None:
            raise self._infeasible(self.refused, start, toolpath)
        queries = f"{self.mask.queried} postures queried in {self.mask.calls} calls"
        stage = Stage("enforce the mask", queries, self.mask.queried, before, problem.path_cost(path))
        self.run.stages.append(stage)
        return path

    def _cheapest(self, start: Array, admitted: BoolArray, others: list[Array]) -> Array | None:
        """Find the cheapest admitted path.

        Parameters
        ----------
        admitted : (n,), where the mask admits the start
        others : paths of baselines, refined only if they cost less than what was found
        """
        found: list[Array | None] = []
        short = len(start) <= MOST_ROWS
        if short or admitted.mean() >= 1.0 - MOST_REPLANNED:
            found.append(self._refined(self._replanned(start, most=None if short else FARTHEST)))
        good = (1.0 + DEARER) * self.run.problem.priced(start)
        if not any(path is not None and self.run.problem.priced(path) <= good for path in found):
            found.append(self._searched())
        if not short and all(path is None for path in found):
            found.append(self._refined(self._replanned(start)))
        paths = [path for path in (*found, *others) if path is not None]
        best = min(paths, key=self.run.problem.priced, default=None)
        return self._refined(best) if any(best is other for other in others) else best

    def _searched(self) -> Array | None:
        """Search the whole path among roughly admitted postures, replan and refine the result."""
        run = replace(self._confined, stages=[])
        try:
            path = run.best_path({})
        except Infeasible:
            return None
        finally:
            self.run.stages.extend(run.stages)
        replanned = self._replanned(path, most=FARTHEST)
        # The search refines its path.
        return replanned if replanned is path else self._refined(replanned)

    @cached_property
    def _clear(self) -> Clearance:
        """What the mask admits, exactly and roughly."""
        return Clearance.of(self.mask, self.run.problem)

    @cached_property
    def _confined(self) -> Portfolio:
        """The portfolio that avoids refused postures."""
        return replace(self.run, stages=[], clear=self._clear)

    def _replanned(self, start: Array, most: int | None = None) -> Array | None:
        """Replan a path locally where the mask refuses it or it breaks a bound; None if that fails.

        Parameters
        ----------
        most : widest margin of the windows; None for up to the whole path
        """
        path = self._windows.replanned(start, self._reaches(most))
        self.refused = np.flatnonzero(~self.mask.admits(np.arange(len(path)), path))
        return None if len(self.refused) else path

    @cached_property
    def _windows(self) -> Replanning:
        """The search of windows within the mask."""
        return Replanning(self.run.problem, self.run.lattice, WIDTHS, self._clear)

    def _reaches(self, most: int | None) -> Iterator[Reach]:
        """List wider and wider windows around refused locations.

        On a long path sparse ones come first. The last is the whole path, then searched at every location.
        """
        margin, count = MARGIN, len(self.run.problem)
        whole = MOST_REFUSED if most is None else 1.0
        if count > MOST_ROWS:
            yield from (Reach(reach, WINDOW_ROWS, STRIDE, whole) for reach in WIDE)
        while margin < (count if most is None else most):
            yield Reach(margin, WINDOW_ROWS, whole=whole)
            margin *= GROWTH
        if most is None:
            yield Reach(count, WINDOW_ROWS, whole=whole)
            if count <= MOST_ROWS:
                yield Reach(count, count, whole=whole)

    def _refined(self, path: Array | None) -> Array | None:
        """Refine an admitted path within the mask."""
        if path is None:
            return None
        run = replace(self._confined, stages=[])
        refined = run.refined_from("admitted path", path)
        self.run.stages.extend(run.stages)
        return refined

    def _infeasible(self, rows: IntArray, start: Array, toolpath: Toolpath) -> Infeasible:
        """Say of each refused location whether the mask admits a posture there."""
        findings, kind = [], Infeasible
        for row in rows:
            # Samples may miss a narrow tilt range; the path before the mask has a posture in it.
            states = np.vstack([start[row], self._windows.samples(int(row))])
            states = states[np.unique(np.linspace(0, len(states) - 1, SAMPLES).astype(np.int64))]
            if self.mask.admits(np.full(len(states), row), states).any():
                text = "the mask admits postures here, but none was found within reach of its neighbours"
            else:
                kind = Refused
                text = f"the mask refuses each of the admissible postures that were tried ({len(states)})"
            findings.append(
                Finding(
                    Severity.ERROR,
                    "no-posture",
                    f"{text}; widen the tilt range, allow larger turns (--max-turn) or change what the mask "
                    "stands for",
                    toolpath.place(int(row)),
                )
            )
        share = f"{len(findings)} of {len(self.run.problem)} locations"
        return kind(f"{share} have no posture in sequence that the mask admits", findings)


def or_cheaper_baseline(problem: Problem, rotary: Array, compared: Mapping[str, Baseline]) -> Array:
    """Return the cheapest of a path, (n, 2) rad, and the baselines among those that keep all bounds."""
    paths = [rotary, *_paths(problem, compared)]
    sound = [path for path in paths if problem.violation(path) <= ALLOWED] or paths[:1]
    return min(sound, key=problem.path_cost)


def _paths(problem: Problem, compared: Mapping[str, Baseline]) -> list[Array]:
    """List the rotary angles of baselines, (n, 2) rad each."""
    return [b.motion.positions[:, problem.machine.rotary_columns] for b in compared.values()]
