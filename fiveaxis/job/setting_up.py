"""Where the workpiece stands on the table, chosen with its postures."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

from fiveaxis.collision import Surroundings
from fiveaxis.errors import Infeasible, JobError
from fiveaxis.job.box_search import search_box
from fiveaxis.job.description import SEARCHED, Job, SetupTable
from fiveaxis.job.reading import make_job
from fiveaxis.job.setup_costs import SetupCosts
from fiveaxis.job.setup_search import Search, Tried, limits_of, ranges_of
from fiveaxis.job.stages import Outcome, Progress, load_job_machine, load_job_passes, load_surroundings
from fiveaxis.job.stages import run_job as run_once
from fiveaxis.machine import Machine
from fiveaxis.nc import require_program
from fiveaxis.toolpath import Toolpath

logger = logging.getLogger(__name__)

# The best ones are run in full, until one of them is sound and cheaper than the given setup: so many that are
# sound, so many in all.
FULL_RUNS, MOST_RUNS = 3, 6
# Share of the tries that is kept for the neighbourhood of the best setup that can be kept clear.
CLEAR_SHARE = 0.25
STAGE = "setup"


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Take a job through all stages, and choose its setup first where it gives bounds for that.

    The setup is searched for on some of the path's locations: first with nothing in the way, then the
    cheapest ones again with the tool kept clear of part, stock and fixtures, and their neighbourhood. The
    best ones and the given one are run in full, and the cheapest sound one is taken. So the result is never
    dearer than the given setup, as far as that is sound itself.

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
        return run_once(job, progress)
    machine = load_job_machine(job)
    require_program(machine, job.control, job.coordinates, job.winding, job.nc)
    loaded = load_job_passes(job, progress)
    given = job.setup.model_copy(update={"search": None})
    around = load_surroundings(job) if job.keep_clear else None
    search = search_setups(job, machine, loaded[0], progress, around)

    def run(setup: SetupTable) -> Outcome | Infeasible:
        try:
            there = job.model_copy(update={"setup": setup})
            return run_once(there, progress, loaded, moved=setup != given)
        except Infeasible as fault:
            return fault

    logger.info("%d setups looked at; the given one and the cheapest are run in full", len(search.tried))
    best = run(given)
    runs = {given: best}
    sound = 0
    for tried in search.ranked[:MOST_RUNS]:
        if tried.setup == given or sound == FULL_RUNS:
            break  # what follows is dearer
        runs[tried.setup] = found = run(tried.setup)
        sound += isinstance(found, Outcome) and found.ok
        if _is_better(found, best):
            best = found
        if isinstance(best, Outcome) and best.ok and best is found:
            break
    if isinstance(best, Infeasible):
        raise best
    told = _document(search, given, best, runs)
    return replace(best, document=best.document | {"setup_search": told})


def search_setups(
    job: Job,
    machine: Machine,
    toolpath: Toolpath,
    progress: Progress | None = None,
    around: Surroundings | None = None,
) -> Search:
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

    search = Search(job, cost, costs.clear if costs.has_obstacles else None)
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


def _is_better(found: Outcome | Infeasible, best: Outcome | Infeasible) -> bool:
    """Tell whether a run beats another: one that can be followed, then a sound one, then the cheaper one."""
    if isinstance(found, Infeasible) or isinstance(best, Infeasible):
        return not isinstance(found, Infeasible)
    if found.ok != best.ok:
        return found.ok
    return _full_cost(found) < _full_cost(best)


def _full_cost(outcome: Outcome) -> float:
    energy, machine = outcome.solution.energy, outcome.solution.machine
    price = outcome.job.time_price
    return energy.total + ((machine.base_power or 0.0) if price is None else price) * energy.time


def _document(
    search: Search, given: SetupTable, best: Outcome, runs: dict[SetupTable, Outcome | Infeasible]
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
