"""Where the workpiece stands on the table, chosen with its postures."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.errors import Infeasible, JobError
from fiveaxis.findings import Finding, Severity, group_findings
from fiveaxis.geometry import Array
from fiveaxis.job.box_search import search_box
from fiveaxis.job.description import SEARCHED, Job, SetupTable
from fiveaxis.job.loading import Progress, load_job_machine, load_job_passes, load_surroundings
from fiveaxis.job.reading import make_job
from fiveaxis.job.setup_costs import SetupCosts
from fiveaxis.job.setup_search import SetupTrials, Tried, limits_of, ranges_of
from fiveaxis.job.stages import Outcome, run_stages
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine
from fiveaxis.nc import require_program
from fiveaxis.posture.baselines import NoBaseline, follow_axes
from fiveaxis.toolpath import Toolpath

logger = logging.getLogger(__name__)

# The best ones are run in full, until one of them is sound and cheaper than the given setup: so many that are
# sound, so many in all.
FULL_RUNS, MOST_RUNS = 3, 6
# Share of the tries that is kept for the neighbourhood of the best setup that can be kept clear.
CLEAR_SHARE = 0.25
STAGE = "setup"
# Share of the cost that a setup has to save at least: to move a part on the table is work, too.
LEAST_SAVING = 0.005


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Take a job through all stages, and choose its setup first where it gives bounds for that.

    The setup is searched for on some of the path's locations: first with nothing in the way, then the
    cheapest ones again with the tool kept clear of part, stock and fixtures, and their neighbourhood. The
    best ones and the given one are run in full. A sound one is taken that saves more against the given one,
    in the program's cost, than can be chance (`LEAST_SAVING`, or what the given one gains from the other's
    postures); else the given one stays, and a finding says so.

    Parameters
    ----------
    job : what to do
    progress : called with a stage's name, steps done and steps in all

    Raises
    ------
    FiveAxisError
        Wrong input, or no admissible posture in any setup (`Infeasible`).
    """
    if job.setup.search is None:
        return run_stages(job, progress)
    machine = load_job_machine(job)
    require_program(machine, job.control, job.coordinates, job.winding, job.nc)
    loaded = load_job_passes(job, progress)
    given = job.setup.model_copy(update={"search": None})
    around = load_surroundings(job) if job.keep_clear else None
    search = search_setups(job, machine, loaded[0], progress, around)

    def run(setup: SetupTable, start: Array | None = None) -> Outcome | Infeasible:
        try:
            there = job.model_copy(update={"setup": setup})
            return run_stages(there, progress, loaded, moved=setup != given, start=start)
        except Infeasible as fault:
            return fault

    logger.info("%d setups looked at; the given one and the cheapest are run in full", len(search.tried))
    choice = _Choice(job, given, run)
    for tried in search.ranked[:MOST_RUNS]:
        if tried.setup == given or choice.sound == FULL_RUNS:
            break  # what follows is dearer
        if choice.takes(tried.setup):
            break
    best = choice.best
    if isinstance(best, Infeasible):
        raise best
    told = _document(search, given, best, choice.runs) | {"least_saving": choice.least_saving}
    return _with_finding(replace(best, document=best.document | {"setup_search": told}), choice)


class _Choice:
    """The choice between the given setup and others, each run in full.

    A search ends in one of several valleys, and not in the same one for another setup: part of what a setup
    seems to save is chance. So the given setup is run once more from the postures that the other one found,
    and what that gains tells how far costs of this job can be told apart at all.

    Parameters
    ----------
    job : with the setup as given
    given : that setup
    run : runs a setup in full, from a start where there is one
    """

    def __init__(self, job: Job, given: SetupTable, run: Callable[..., Outcome | Infeasible]) -> None:
        self.job, self.given, self._run = job, given, run
        self.best = run(given)
        self.runs = {given: self.best}
        self.sound, self.noise = 0, 0.0
        self.doubtful: tuple[SetupTable, float] | None = None

    @property
    def least_saving(self) -> float:
        """Share of the cost that another setup has to save."""
        return max(LEAST_SAVING, self.noise)

    def takes(self, setup: SetupTable) -> bool:
        """Run a setup, take it where it is better than what there is; tell whether it is sound and taken."""
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
        """Take a cheaper setup only if it stays so when what there is starts from its postures."""
        at = best.job.setup
        start = _carried(found, best)
        again = None if start is None else self._run(at, start)
        if isinstance(again, Outcome) and again.ok >= best.ok and _saving(again, best) > 0.0:
            self.noise = max(self.noise, _saving(again, best))
            self.best = self.runs[at] = best = again
        saved = _saving(found, best)
        if saved > self.least_saving:
            self.best, self.doubtful = found, None
        elif self.doubtful is None or saved > self.doubtful[1]:
            self.doubtful = setup, saved


def _carried(found: Outcome, given: Outcome) -> Array | None:
    """Give one setup's postures, (n, 2) rad, as a start for another; None where they don't fit."""
    solution, machine = found.solution, given.solution.machine
    path = solution.toolpath if solution.unwrapped is None else solution.unwrapped.toolpath
    own = solution.motion.positions[:, solution.machine.rotary_columns]
    rotary = own if solution.unwrapped is None else solution.unwrapped.rotary
    if found.job.free_start:
        return None
    given_rows = np.flatnonzero(~path.inserted)
    try:
        return follow_axes(path.at(given_rows), machine, tool_axes(solution.machine, rotary[given_rows]))
    except NoBaseline:
        return None


def _with_finding(outcome: Outcome, choice: _Choice) -> Outcome:
    """Say that the given setup was kept although another one looked cheaper."""
    if choice.doubtful is None or outcome.job.setup != choice.given:
        return outcome
    setup, saved = choice.doubtful
    place = f"offset {list(setup.offset)} mm, rotation {list(setup.rotation)} deg"
    seems = f"seems to save {100.0 * saved:.2f} %" if saved > 0.0 else "saves nothing"
    finding = Finding(
        Severity.NOTE,
        "setup-kept",
        f"the given setup stays: {place} {seems} once the given one starts from the same postures, and less "
        f"than {100.0 * choice.least_saving:.2f} % can't be told from chance here",
        outcome.solution.toolpath.place(0),
        value=saved,
    )
    path = outcome.solution.toolpath
    solution = replace(outcome.solution, toolpath=replace(path, findings=(*path.findings, finding)))
    document = outcome.document | {
        "findings": [*outcome.document["findings"], finding.as_dict()],
        "summary": [*outcome.document["summary"], *(c.as_dict() for c in group_findings([finding]))],
    }
    return replace(outcome, solution=solution, document=document)


def search_setups(
    job: Job,
    machine: Machine,
    toolpath: Toolpath,
    progress: Progress | None = None,
    around: Surroundings | None = None,
) -> SetupTrials:
    """Look for cheap setups within a job's bounds, roughly.

    Parameters
    ----------
    machine : in the given setup
    toolpath : the whole path
    around : what the tool keeps clear of; None where it needn't
    """
    costs, limits = SetupCosts(job, machine, toolpath, around), limits_of(job)
    steps = 0

    def cost(setup: SetupTable) -> float:
        nonlocal steps
        steps += 1
        if progress is not None:
            progress(STAGE, min(steps, limits.tries), limits.tries)
        return costs.free(setup)

    search = SetupTrials(job, cost, costs.clear if costs.has_obstacles else None)
    given = job.setup.model_copy(update={"search": None})
    search.look_at(given)
    kept = 0 if search.clear is None else int(CLEAR_SHARE * limits.tries)
    search_box(search.look, search.point_of(given), limits.tries - 1 - kept)
    if search.clear is not None:
        search.find_clear(kept)
    return search


def choose_search(job: Job, text: str) -> Job:
    """Set what `--setup` says: ranges, or names of what the job has ranges for.

    Parameters
    ----------
    text : ``x=-50:50,angle=-180:180``, mm and deg, or ``x,angle``

    Raises
    ------
    JobError
        Another form, an unknown name, a name that has no range.
    """
    has = {} if job.setup.search is None else ranges_of(job)
    chosen: dict[str, tuple[float, float]] = {}
    for part in text.split(","):
        name, given, ends = (piece.strip() for piece in part.partition("="))
        if name not in SEARCHED:
            raise JobError(f"--setup: {name!r} is unknown; known: {', '.join(SEARCHED)}")
        if not given and name not in has:
            raise JobError(f"--setup: {name} has no range; give {name}=LOW:HIGH, or setup.search in the job")
        try:
            low, high = (float(end) for end in ends.split(":")) if given else has[name]
        except ValueError:
            raise JobError(f"--setup: {part.strip()!r} isn't of the form {name}=LOW:HIGH") from None
        chosen[name] = (low, high)
    search: dict[str, Any] = {"tries": job.setup.search.tries} if job.setup.search is not None else {}
    return make_job(job, setup={"search": search | chosen})


def _saving(found: Outcome, other: Outcome) -> float:
    """Give the share that one outcome's program saves against another's."""
    cost = _full_cost(other)
    return 1.0 - _full_cost(found) / cost if cost > 0.0 else 0.0


def _full_cost(outcome: Outcome) -> float:
    """Give what the delivered program costs, J, with the price of its time."""
    energy, machine = outcome.solution.energy, outcome.solution.machine
    price = outcome.job.time_price
    return energy.total + ((machine.base_power or 0.0) if price is None else price) * energy.time


def _document(
    search: SetupTrials, given: SetupTable, best: Outcome, runs: dict[SetupTable, Outcome | Infeasible]
) -> dict[str, Any]:
    def told(setup: SetupTable) -> Tried:
        tried, run = search.tried[setup], runs.get(setup)
        if run is None:
            return tried
        if isinstance(run, Infeasible):
            return replace(tried, why=str(run))
        why = tried.why if run.ok else "verification found errors"
        return replace(tried, energy=run.solution.energy.total, why=why)

    before, after = told(given), told(best.job.setup)
    saved = None
    if before.energy and after.energy is not None:
        saved = 1.0 - after.energy / before.energy
    order = sorted(search.tried.values(), key=lambda t: (t.rough is None, t.rough))
    return {
        "ranges": {name: list(ends) for name, ends in search.ranges.items()},
        "given": before.as_dict(),
        "chosen": after.as_dict(),
        "saved": saved,
        "tried": [told(t.setup).as_dict() for t in order],
    }
