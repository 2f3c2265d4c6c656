"""Where the workpiece stands on the table, chosen with its postures."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.errors import Infeasible, JobError
from fiveaxis.geometry import Array
from fiveaxis.job.box_search import search_box
from fiveaxis.job.description import SEARCHED, Job, SetupSearch, SetupTable, make_job
from fiveaxis.job.stages import Outcome, Progress, load_job_machine, load_job_passes
from fiveaxis.job.stages import run_job as run_once
from fiveaxis.machine import Machine
from fiveaxis.nc import require_program
from fiveaxis.posture import optimise
from fiveaxis.toolpath import Toolpath

logger = logging.getLogger(__name__)

# A setup is looked at roughly on at most so many locations.
ROUGH_LOCATIONS = 120
# The best rough ones are run in full, until one of them is sound and cheaper than the given setup.
FULL_RUNS = 3
# A place is set up to 0.01 mm and 0.01 deg: a finer one can't be.
DIGITS = 2
STAGE = "setup"


@dataclass(frozen=True)
class Tried:
    """A setup that was looked at.

    Parameters
    ----------
    setup : where the workpiece stood
    rough : J, what the thinned path costs there, with the price of its time; None where it can't be followed
    energy : J, travel metric of the whole path; None where it wasn't run
    why : what was against it
    """

    setup: SetupTable
    rough: float | None
    energy: float | None = None
    why: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON, mm and deg."""
        place = {"offset": list(self.setup.offset), "rotation_deg": list(self.setup.rotation)}
        return {**place, "rough": self.rough, "energy": self.energy, "why": self.why}


@dataclass
class Search:
    """Setups within bounds, looked at one after the other.

    Parameters
    ----------
    job : with the bounds
    cost : J, of a setup, roughly; raises `Infeasible`
    """

    job: Job
    cost: Callable[[SetupTable], float]
    tried: dict[SetupTable, Tried] = field(default_factory=dict)

    def look(self, point: Array) -> float:
        """Tell what the setup at a point of the unit box costs, roughly; infinite where it can't be used."""
        return self.look_at(self.setup_at(point))

    def look_at(self, setup: SetupTable) -> float:
        """Tell what a setup costs, roughly."""
        if setup not in self.tried:
            try:
                self.tried[setup] = Tried(setup, self.cost(setup))
            except Infeasible as fault:
                self.tried[setup] = Tried(setup, None, why=str(fault))
            logger.debug("setup %s: %s", setup, self.tried[setup].rough)
        rough = self.tried[setup].rough
        return np.inf if rough is None else rough

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """What may be chosen, lowest and highest, mm and deg."""
        return ranges_of(self.job)

    @property
    def start(self) -> Array:
        """The given setup's place in the unit box, moved into it."""
        x, y, z = self.job.setup.offset
        given = {"x": x, "y": y, "z": z, "angle": self.job.setup.rotation[2]}
        shares = [(given[name] - low) / (high - low) for name, (low, high) in self.ranges.items()]
        return np.clip(np.array(shares), 0.0, 1.0)

    def setup_at(self, point: Array) -> SetupTable:
        """Give the setup at a point of the unit box."""
        chosen = {
            name: round(low + float(share) * (high - low), DIGITS) + 0.0
            for share, (name, (low, high)) in zip(point, self.ranges.items(), strict=True)
        }
        given = self.job.setup
        x, y, z = (chosen.get(name, old) for name, old in zip("xyz", given.offset, strict=True))
        turned = (*given.rotation[:2], chosen.get("angle", given.rotation[2]))
        return SetupTable(offset=(x, y, z), rotation=turned)

    @property
    def ranked(self) -> list[Tried]:
        """What can be used, cheapest first; of equals the one that was looked at first."""
        return sorted(
            (t for t in self.tried.values() if t.rough is not None), key=lambda tried: tried.rough or 0.0
        )


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Take a job through all stages, and choose its setup first where it gives bounds for that.

    The setup is searched for on some of the path's locations, without regard to collisions; the best ones and
    the given one are then run in full, and the cheapest sound one is taken. So the result is never dearer
    than the given setup, as far as that is sound itself.

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
    search = search_setups(job, machine, loaded[0], progress)

    def run(setup: SetupTable) -> Outcome | Infeasible:
        try:
            return run_once(job.model_copy(update={"setup": setup}), progress, loaded)
        except Infeasible as fault:
            return fault

    logger.info("%d setups looked at; the given one and the cheapest are run in full", len(search.tried))
    best = run(given)
    runs = {given: best}
    for tried in search.ranked[:FULL_RUNS]:
        if tried.setup == given:
            break  # what follows is dearer
        runs[tried.setup] = found = run(tried.setup)
        if _is_better(found, best):
            best = found
        if isinstance(best, Outcome) and best.ok and best is found:
            break
    if isinstance(best, Infeasible):
        raise best
    told = _document(search, given, best, runs)
    return replace(best, document=best.document | {"setup_search": told})


def search_setups(job: Job, machine: Machine, toolpath: Toolpath, progress: Progress | None = None) -> Search:
    """Look for cheap setups within a job's bounds, roughly.

    Parameters
    ----------
    machine : in the given setup
    toolpath : the whole path
    """
    rough = _rough_cost(job, machine, toolpath)
    limits = _limits(job)
    steps = 0

    def cost(setup: SetupTable) -> float:
        nonlocal steps
        steps += 1
        if progress is not None:
            progress(STAGE, min(steps, limits.tries), limits.tries)
        return rough(setup)

    search = Search(job, cost)
    search.look_at(job.setup.model_copy(update={"search": None}))
    search_box(search.look, search.start, limits.tries - 1)
    return search


def _rough_cost(job: Job, machine: Machine, toolpath: Toolpath) -> Callable[[SetupTable], float]:
    stride = -(-len(toolpath) // ROUGH_LOCATIONS)
    rows = np.unique(np.append(np.arange(0, len(toolpath), stride), len(toolpath) - 1))
    thinned = toolpath.at(rows)
    if not thinned.cutting.any():
        thinned = toolpath
    turn = stride * job.max_turn
    options = job.bounds | {
        "max_turn": turn if turn < 180.0 else None,
        "up_penalty": job.up_penalty,
        "time_price": job.time_price,
        "effort": "quick",
    }
    price = (machine.base_power or 0.0) if job.time_price is None else job.time_price

    def cost(setup: SetupTable) -> float:
        there = machine.with_setup(setup.offset, setup.rotation)
        energy = optimise(thinned, there, **options).energy
        return energy.total + price * energy.time

    return cost


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


def ranges_of(job: Job) -> dict[str, tuple[float, float]]:
    """Give what a job's search may choose, by name, mm and deg."""
    limits = _limits(job)
    return {name: ends for name in SEARCHED if (ends := getattr(limits, name)) is not None}


def _limits(job: Job) -> SetupSearch:
    if job.setup.search is None:
        raise JobError("setup.search is missing; give ranges of x, y, z or angle", file=job.input)
    return job.setup.search


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
        why = "" if run.ok else "verification found errors"
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
