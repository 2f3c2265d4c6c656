"""From a path that a mask refuses in places to one that it admits everywhere."""

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
from fiveaxis.posture.strategy.portfolio import Portfolio
from fiveaxis.toolpath import Toolpath

# Locations to each side of a refused one that may move with it, and how many more in each further round.
MARGIN, GROWTH = 6, 4
# On a long path windows reach so far first, and every so many-th of their locations is searched: between
# locations as close as its own a lattice has steps too large for a steady way.
WIDE, STRIDE = (24, 60), 4
# Up to this share of refused locations they are patched; from more on the whole path is searched again.
MOST_PATCHED = 0.03
# A patched path that costs more than what ignores the mask by a larger share than this is searched anew.
DEARER = 5e-3
# Patches of a path that is searched again, too, reach no farther than this.
FARTHEST = 100
# From this share of refused locations on a window isn't worth while: it is the whole path.
MOST_DIRTY = 0.2
# A lattice in a window has about this many rows; between them the path is filled in.
WINDOW_ROWS = 120
# A path of no more than so many locations is patched first, however much of it is refused; and searched as a
# whole without leaving any location out, at last.
MOST_ROWS = 400
# Postures of a location that are asked about before it is said to have none.
SAMPLES = 400


@dataclass(eq=False)
class Repair:
    """The repair of a path, and of what it is made of.

    Parameters
    ----------
    run : the portfolio that found the path; gives the problem, the effort and takes the stages
    mask : what the path has to please
    refused : locations that the last path which couldn't be mended was refused at
    """

    run: Portfolio
    mask: Mask
    refused: IntArray = field(init=False, default_factory=lambda: np.empty(0, dtype=np.int64))

    def repaired(self, start: Array, toolpath: Toolpath, compared: Mapping[str, Baseline]) -> Array:
        """Change a refined path, (n, 2) rad, until the mask admits all of it, and refine what comes out.

        Where the mask refuses a few locations, the path is patched there; where it refuses many, the whole is
        searched again off what it roughly refuses. A baseline that the mask admits and that costs less is
        refined instead.

        Raises
        ------
        Infeasible
            No such path was found; each refused location is listed.
        """
        problem = self.run.problem
        every, others = np.arange(len(problem)), self._rotary(compared)
        clean = self.mask.admits(every, start)
        before = problem.cost(problem.positions(slice(None), start))
        # What came refined and clean is as good as it gets.
        path = start if clean.all() else self._cheapest(start, clean, others)
        if path is None:
            raise self._infeasible(self.refused, toolpath)
        after = problem.cost(problem.positions(slice(None), path))
        asked = f"{self.mask.asked} postures asked in {self.mask.calls} calls"
        self.run.stages.append(Stage("repair for the mask", asked, self.mask.asked, before, after))
        return path

    def _cheapest(self, start: Array, clean: BoolArray, others: list[Array]) -> Array | None:
        """Find paths that the mask admits, the start's locations where it does being `clean`; the cheapest.

        Others, the baselines', are refined only if they cost less than what was found.
        """
        found: list[Array | None] = []
        short = len(start) <= MOST_ROWS
        if short or clean.mean() >= 1.0 - MOST_PATCHED:
            found.append(self._polished(self._patched(start, most=None if short else FARTHEST)))
        good = (1.0 + DEARER) * self.run.problem.priced(start)
        if not any(path is not None and self.run.problem.priced(path) <= good for path in found):
            found += self._searched()
        if not short and all(path is None for path in found):
            found.append(self._polished(self._patched(start)))
        paths = [path for path in (*found, *others) if path is not None]
        best = min(paths, key=self.run.problem.priced, default=None)
        return self._polished(best) if any(best is other for other in others) else best

    def _searched(self) -> list[Array | None]:
        """Search the whole path off what the mask roughly refuses, mend and refine what is found."""
        effort, answers = self.run.effort, []
        for searches in (effort.searches, *effort.others):
            run = replace(self._confined, stages=[], effort=replace(effort, searches=searches))
            try:
                path = run.best_path({})
            except Infeasible:
                continue
            finally:
                self.run.stages.extend(run.stages)
            mended = self._patched(path, most=FARTHEST)
            # What needed no mending came refined.
            answers.append(mended if mended is path else self._polished(mended))
        return answers

    @cached_property
    def _clear(self) -> Clearance:
        """What the mask admits, roughly too."""
        return Clearance.of(self.mask, self.run.problem)

    @cached_property
    def _confined(self) -> Portfolio:
        """The portfolio that keeps off what the mask refuses."""
        return replace(self.run, stages=[], clear=self._clear)

    def _patched(self, start: Array, most: int | None = None) -> Array | None:
        """Replan a path locally where the mask refuses it or it breaks a bound; None where that won't do.

        Parameters
        ----------
        most : widest margin of the windows; None for up to the whole path
        """
        path = self._plan.replanned(start, self._reaches(most))
        self.refused = np.flatnonzero(~self.mask.admits(np.arange(len(path)), path))
        return None if len(self.refused) else path

    @cached_property
    def _plan(self) -> Replanning:
        """What windows of the path are searched with."""
        return Replanning(self.run.problem, self.run.lattice, self.run.effort.widths, self._clear)

    def _rotary(self, compared: Mapping[str, Baseline]) -> list[Array]:
        return [b.motion.positions[:, self.run.problem.machine.rotary_columns] for b in compared.values()]

    def _reaches(self, most: int | None) -> Iterator[Reach]:
        """Widen the windows round what is refused, round by round.

        On a long path first such that a path may be found between the rows, then farther, then all of it,
        then densely.
        """
        margin, count = MARGIN, len(self.run.problem)
        whole = MOST_DIRTY if most is None else 1.0
        if count > MOST_ROWS:
            yield from (Reach(reach, WINDOW_ROWS, STRIDE, whole) for reach in WIDE)
        while margin < (count if most is None else most):
            yield Reach(margin, WINDOW_ROWS, whole=whole)
            margin *= GROWTH
        if most is None:
            yield Reach(count, WINDOW_ROWS, whole=whole)
            if count <= MOST_ROWS:
                yield Reach(count, count, whole=whole)

    def _polished(self, path: Array | None) -> Array | None:
        """Refine a clean path inside of the mask."""
        if path is None:
            return None
        run = replace(self._confined, stages=[])
        refined = run.refined_from("clean path", path)
        self.run.stages.extend(run.stages)
        return refined

    def _infeasible(self, rows: IntArray, toolpath: Toolpath) -> Infeasible:
        findings = []
        for row in rows:
            states, price = self._plan.samples(int(row))
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
        share = f"{len(findings)} of {len(self.run.problem)} locations"
        return Infeasible(f"{share} have no posture in sequence that the mask admits", findings)


def never_dearer(problem: Problem, rotary: Array, compared: Mapping[str, Baseline]) -> Array:
    """Give the path, (n, 2) rad, or the baseline that is sound and costs less."""
    columns = problem.machine.rotary_columns
    paths = [rotary, *(b.motion.positions[:, columns] for b in compared.values())]
    sound = [path for path in paths if problem.violation(path) <= ALLOWED] or paths[:1]
    return min(sound, key=lambda path: problem.cost(problem.positions(slice(None), path)))
