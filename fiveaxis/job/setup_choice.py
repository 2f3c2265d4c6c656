"""Run a job; where it gives ranges for the setup, choose the setup together with the postures."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from itertools import count

import numpy as np

from fiveaxis.base import (
    CHOOSING,
    UNKEPT,
    Array,
    Checkpoint,
    Finding,
    Infeasible,
    NoBaseline,
    Progress,
    Severity,
    unheard,
    within,
)
from fiveaxis.job.description import Job, SetupTable
from fiveaxis.job.placement import advised
from fiveaxis.job.setup_search import SetupTrials, search_setups
from fiveaxis.job.solution import add_findings
from fiveaxis.job.stages import Outcome, run_stages
from fiveaxis.job.task import JobTask, resolve
from fiveaxis.model import tool_axes
from fiveaxis.posture import follow_axes
from fiveaxis.show import SetupSearched, TriedSetup

logger = logging.getLogger(__name__)

# The cheapest setups are run in full until one of them has no errors and is cheaper than the given setup: at
# most so many without errors, and so many in all.
FULL_RUNS, MOST_RUNS = 3, 6
# Least share of the cost that another setup has to save: moving a part on the table is work, too.
LEAST_SAVING = 0.005


def run_job(job: Job, progress: Progress = unheard, checkpoint: Checkpoint = UNKEPT) -> Outcome:
    """Take a job through all stages, and choose its setup first where it gives ranges for that.

    The setup is searched for on some of the path's locations: first without obstacles, then the cheapest ones
    again with the tool kept clear of part, stock and fixtures, and their neighbourhood. The best ones and the
    given one are run in full. A setup without errors is chosen if it saves more of the program's cost,
    against the given one, than can be chance (`LEAST_SAVING`, or what the given setup gains when it starts
    from the other's postures); else the given setup stays, and a finding says so.

    Raises
    ------
    FiveAxisError
        Wrong input, or no admissible posture in any setup (`Infeasible`).
    """
    return run_task(resolve(job, progress), progress, checkpoint)


def run_task(task: JobTask, progress: Progress = unheard, checkpoint: Checkpoint = UNKEPT) -> Outcome:
    """Take a resolved job through all further stages, as `run_job` does."""
    job = task.job
    if job.setup.search is None:
        try:
            return run_stages(task, progress, checkpoint=checkpoint)
        except Infeasible as fault:
            raise advised(fault, job, task.machine, task.toolpath, task.obstacles) from None
    given = job.setup.model_copy(update={"search": None})
    trials = search_setups(task, job.setup.search, progress)
    numbers = count(1)

    def run(setup: SetupTable, start: Array | None = None) -> Outcome | Infeasible:
        number = next(numbers)
        of_run = within(progress, f"setup in full, run {number}", number - 1, MOST_RUNS, CHOOSING)
        try:
            return run_stages(task.at(setup), of_run, start=start, checkpoint=checkpoint)
        except Infeasible as fault:
            return fault

    logger.info("%d setups tried; the given one and the cheapest are run in full", len(trials.tried))
    choice = _Choice(given, run)
    for setup in trials.ranked[:MOST_RUNS]:
        if setup == given or choice.sound == FULL_RUNS:
            break  # the rest is more costly
        if choice.takes(setup):
            break
    best = choice.best
    if isinstance(best, Infeasible):
        raise best
    figures = _figures(trials, choice, best)
    kept = choice.explain_kept()
    solution = best.solution if kept is None else add_findings(best.solution, kept)
    return replace(best, solution=solution, setup_search=figures)


class _Choice:
    """The choice between the given setup and others, each run in full, optionally from start postures.

    A search ends in one of several local optima, and not in the same one for another setup: part of what a
    setup seems to save is chance. So the given setup is run once more from the postures that the other one
    found; what it gains by that shows how precisely costs of this job can be compared.
    """

    def __init__(self, given: SetupTable, run: Callable[..., Outcome | Infeasible]) -> None:
        self.given, self._run = given, run
        self.best = run(given)
        self.runs = {given: self.best}
        self.sound, self.noise = 0, 0.0
        self.doubtful: tuple[SetupTable, float] | None = None

    @property
    def least_saving(self) -> float:
        """Share of the cost that another setup has to save."""
        return max(LEAST_SAVING, self.noise)

    def takes(self, setup: SetupTable) -> bool:
        """Run a setup and take it if it is better; return whether it is taken and has no errors."""
        self.runs[setup] = found = self._run(setup)
        if isinstance(found, Infeasible):
            return False
        self.sound += found.ok
        best = self.best
        if isinstance(best, Infeasible) or found.ok > best.ok:
            self.best, self.doubtful = found, None
        elif found.ok == best.ok and _saving(found, best) > 0.0:
            self._compare(setup, found, best)
        return self.best is found and found.ok

    def _compare(self, setup: SetupTable, found: Outcome, best: Outcome) -> None:
        """Take a cheaper setup only if it stays cheaper when the best so far starts from its postures."""
        at = best.job.setup
        start = _start_from(found, best)
        again = None if start is None else self._run(at, start)
        if isinstance(again, Outcome) and again.ok >= best.ok and _saving(again, best) > 0.0:
            self.noise = max(self.noise, _saving(again, best))
            self.best = self.runs[at] = best = again
        saved = _saving(found, best)
        if saved > self.least_saving:
            self.best, self.doubtful = found, None
        elif self.doubtful is None or saved > self.doubtful[1]:
            self.doubtful = setup, saved

    def explain_kept(self) -> Finding | None:
        """Report that the given setup stays although another one looked cheaper; None where that isn't so."""
        best = self.best
        if self.doubtful is None or isinstance(best, Infeasible) or best.job.setup != self.given:
            return None
        setup, saved = self.doubtful
        values = f"offset {list(setup.offset)} mm, rotation {list(setup.rotation)} deg"
        seems = f"seems to save {100.0 * saved:.2f} %" if saved > 0.0 else "saves nothing"
        return Finding(
            Severity.NOTE,
            "setup-kept",
            f"the given setup stays: {values} {seems} once the given one starts from the same postures, and "
            f"savings below {100.0 * self.least_saving:.2f} % can't be told from chance here",
            best.solution.toolpath.place(0),
            value=saved,
        )


def _start_from(found: Outcome, given: Outcome) -> Array | None:
    """Convert one setup's postures, (n, 2) rad, to a start for another; None where they don't fit."""
    solution, machine = found.solution, given.solution.machine
    path = solution.toolpath if solution.unwrapped is None else solution.unwrapped.toolpath
    own = solution.motion.positions[:, solution.machine.rotary_columns]
    rotary = own if solution.unwrapped is None else solution.unwrapped.rotary
    given_rows = np.flatnonzero(~path.inserted)
    try:
        return follow_axes(path.at(given_rows), machine, tool_axes(solution.machine, rotary[given_rows]))
    except NoBaseline:
        return None


def _saving(found: Outcome, other: Outcome) -> float:
    cost = _full_cost(other)
    return 1.0 - _full_cost(found) / cost if cost > 0.0 else 0.0


def _full_cost(outcome: Outcome) -> float:
    """Compute what the program costs, J, with the price of its time."""
    energy, machine = outcome.solution.energy, outcome.solution.machine
    price = outcome.job.search.time_price
    return energy.total + ((machine.base_power or 0.0) if price is None else price) * energy.time


def _figures(trials: SetupTrials, choice: _Choice, best: Outcome) -> SetupSearched:
    def with_run(setup: SetupTable) -> TriedSetup:
        tried, run = trials.tried[setup], choice.runs.get(setup)
        if isinstance(run, Outcome):
            why = tried.why if run.ok else "verification found errors"
            return replace(tried, energy=run.solution.energy.total, why=why)
        return tried if run is None else replace(tried, why=str(run))

    before, after = with_run(choice.given), with_run(best.job.setup)
    saved = None
    if before.energy and after.energy is not None:
        saved = 1.0 - after.energy / before.energy
    order = sorted(trials.tried, key=trials.try_freely)
    return SetupSearched(
        ranges=trials.search.ranges,
        given=before,
        chosen=after,
        saved=saved,
        tried=tuple(map(with_run, order)),
        least_saving=choice.least_saving,
        keeps_clear=trials.clear is not None,
    )
