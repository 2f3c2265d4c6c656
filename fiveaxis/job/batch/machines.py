"""One job on several machines: where on each, which is cheapest, which is quickest, and how surely."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fiveaxis.base import (
    Costs,
    JobError,
    SettingError,
    keywords_of,
    options_of,
    read_document,
    write_atomically,
)
from fiveaxis.job.batch.ledger import own_folder
from fiveaxis.job.batch.machine_page import write_machines
from fiveaxis.job.batch.record import ORDER, Listener, Row, Status
from fiveaxis.job.batch.run import Batch, run_batch
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.lab import Factors
from fiveaxis.model import READERS, load_machine, machine_names

REPORT, JOB = "report.json", "job.toml"
# How many setups are tried on each machine where the job doesn't say.
TRIES = 12
# Share by which the time of a program on a machine that states its accelerations is known
# (docs/pages/checks.md); without accelerations it isn't known how surely.
TIME_KNOWN = 0.006
ALL = "all"
# A range of a candidate, lowest and highest; None where it can't run the job.
Span = Callable[["Candidate"], tuple[float, float] | None]


@dataclass(frozen=True)
class Candidate:
    """A job on one machine, with the part where it is cheapest there.

    Parameters
    ----------
    row : of the batch; its message says why the machine can't
    figures : further ones by name, with units; None where the program was kept back, or the machine doesn't
        state what they depend on
    widths : J, by axis, between the ends of the band of its estimated power
    factors : prices of energy and of the machine's time
    """

    row: Row
    figures: Mapping[str, Any]
    widths: Mapping[str, float] = field(default_factory=dict)
    factors: Factors = field(default_factory=Factors)

    @property
    def machine(self) -> str:
        """Its name, or its file without folder."""
        return _name_of(str(self.row.values["machine"]))

    @property
    def can(self) -> bool:
        """Whether its program was released."""
        return self.row.status is Status.FINE

    @property
    def energy(self) -> tuple[float, float] | None:
        """Least and most energy of the feed drives, J."""
        least, most = self.row.energy_least, self.row.energy_most
        return None if least is None or most is None or not self.can else (least, most)

    @property
    def with_base(self) -> tuple[float, float] | None:
        """Least and most energy with base power, J; open at the top where the machine states none."""
        if self.energy is None or self.time is None or not self.row.time:
            return None
        if self.row.base is None:
            return self.energy[0], math.inf
        power, (least, most) = self.row.base / self.row.time, self.time
        top = math.inf if math.isinf(most) else self.energy[1] + power * most
        return self.energy[0] + power * least, top

    @property
    def time(self) -> tuple[float, float] | None:
        """Shortest and longest run time, s; open at the top where the machine states no accelerations."""
        if self.row.time is None or not self.can:
            return None
        if self.figures.get("time_basis") != "accelerations":
            return self.row.time, math.inf
        return self.row.time * (1.0 - TIME_KNOWN), self.row.time * (1.0 + TIME_KNOWN)

    @property
    def cost(self) -> tuple[float, float] | None:
        """Least and most cost; open at the top where the energy or the time that has a price is."""
        if self.with_base is None or self.time is None or self.figures.get("cost") is None:
            return None
        others = self.figures["all_J"] - (self.row.energy or 0.0) - (self.row.base or 0.0)
        ends = zip(self.with_base, self.time, strict=True)
        low, high = (self.factors.cost(joules + others, seconds) for joules, seconds in ends)
        return None if low is None or high is None else (low, high)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        row, energy = self.row, self.energy
        given = {"machine": self.machine, "status": str(row.status), "reason": row.message}
        span = None if energy is None else list(energy)
        # JSON has no infinity: an open end is null.
        cost = self.cost and [end if math.isfinite(end) else None for end in self.cost]
        known = {"energy_J": row.energy, "energy_range_J": span, "time_s": row.time, "cost_range": cost}
        return given | known | {**self.figures, "power_band_J": dict(self.widths)}


@dataclass(frozen=True)
class MachineComparison:
    """A job on several machines.

    Parameters
    ----------
    job : its name
    candidates : those that can by energy, then the others
    batch : that ran them, with its pages
    files : page and picture of the comparison
    """

    job: str
    candidates: tuple[Candidate, ...]
    batch: Batch
    files: tuple[Path, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 where a machine can, else that of the best row."""
        return min((c.row.status for c in self.candidates), key=ORDER.index).exit_code

    @property
    def claims(self) -> tuple[str, ...]:
        """Which machine is cheapest, without and with base power, and which is quickest, or what to measure.

        A machine that doesn't state its base power may take any: unknown is never zero.
        """
        return tuple(dict.fromkeys(self._claims.values()))

    @property
    def _claims(self) -> dict[str, str]:
        axis, base, speed = _measure_axis, _measure_base, _state_accelerations
        claims = {
            "cheapest": self._claim("cheapest for the feed drives", "J", lambda c: c.energy, axis),
            "cheapest_with_base": self._claim("cheapest with base power", "J", lambda c: c.with_base, base),
            "quickest": self._claim("quickest", "s", lambda c: c.time, speed),
        }
        for currency in {c.factors.currency for c in self.candidates if c.cost is not None}:
            spent = self._claim("cheapest in money", currency, lambda c: c.cost, _settle_cost, ".3g")
            claims["least_cost"] = spent
        return claims

    def contenders(self, span: Span) -> tuple[Candidate, ...]:
        """Return the machines that may have the least of a range; one where that is known."""
        found = sorted((s, k) for k, c in enumerate(self.candidates) if (s := span(c)) is not None)
        top = min((most for (_, most), _ in found), default=0.0)
        return tuple(self.candidates[k] for (least, _), k in found if least <= top)

    def _claim(
        self,
        what: str,
        unit: str,
        span: Span,
        remedy: Callable[[Sequence[Candidate]], str],
        form: str = ".0f",
    ) -> str:
        ranges = {c.machine: s for c in self.candidates if (s := span(c)) is not None}
        if not ranges:
            return f"No machine has a released program, so none is {what}."
        best, *close = self.contenders(span)
        if len(ranges) == 1:
            return f"Only {best.machine} has a released program."
        low, high = ranges.pop(best.machine)
        if not close:
            second = min(ranges, key=lambda name: ranges[name])
            return (
                f"{best.machine} is {what}: {low:{form}} to {high:{form}} {unit}, and the next one, "
                f"{second}, takes at least {ranges[second][0]:{form}} {unit}."
            )
        return (
            f"Which is {what} isn't known: the range of {best.machine}, from {low:{form}} {unit} on, "
            f"overlaps {'that' if len(close) == 1 else 'those'} of {', '.join(c.machine for c in close)}; "
            f"to decide, {remedy([best, *close])}."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data for JSON."""
        rows = [candidate.as_dict() for candidate in self.candidates]
        return {"job": self.job, "machines": rows, **self._claims}


def _measure_axis(rivals: Sequence[Candidate]) -> str:
    """Name the axis whose power contributes most to an overlap."""
    widths = {(axis, c.machine): width for c in rivals for axis, width in c.widths.items()}
    if not widths:
        return "time both programs by their logs: the words of a program can be read in two ways"
    (axis, machine), width = max(widths.items(), key=lambda item: item[1])
    share = 100.0 * width / sum(widths.values())
    return (
        f"measure the power of {axis} on {machine} first (fiveaxis calibrate): its band spans {width:.0f} J, "
        f"{share:.0f} % of what isn't known"
    )


def _measure_base(rivals: Sequence[Candidate]) -> str:
    """Name the machines whose base power or accelerations aren't known; else the axis that counts most."""
    silent = [c.machine for c in rivals if c.row.base is None]
    if silent:
        return f"measure the base power of {', '.join(silent)} and state it (base_power)"
    # As long as a time is open, so is the energy over it.
    return _state_accelerations(rivals) if _untimed(rivals) else _measure_axis(rivals)


def _settle_cost(rivals: Sequence[Candidate]) -> str:
    """Name the machines whose time isn't known, else what counts for energies."""
    timed = _untimed(rivals) and rivals[0].factors.hour
    return _state_accelerations(rivals) if timed else _measure_base(rivals)


def _state_accelerations(rivals: Sequence[Candidate]) -> str:
    """Name the machines that don't state their accelerations."""
    if silent := _untimed(rivals):
        return f"state max_acceleration of the axes of {', '.join(silent)}"
    return "run both programs: their times differ by less than they are known to"


def _untimed(rivals: Sequence[Candidate]) -> list[str]:
    return [c.machine for c in rivals if c.time is not None and math.isinf(c.time[1])]


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparing(Costs):
    """All that `compare` takes as keywords."""

    as_placed: bool = False
    scheduler: str | None = None
    workers: int | None = None
    job_timeout: float | None = None
    tell: Listener | None = None


@keywords_of(Comparing)
def compare(
    job: str | Path, machines: Sequence[str | Path], folder: str | Path, options: Comparing
) -> MachineComparison:
    """Run a job on several machines, each with a place and postures of its own, and compare their programs.

    The place of the part and its turn about the table's axis are searched on every machine: within the job's
    ranges for the setup, or else about the place that the job gives, or where the machine reaches the path. A
    machine that can't is a row with the reason. A winner is named only where its range doesn't overlap the
    next one's. The folder of each machine has a `JOB` with its machine and place.

    Parameters
    ----------
    job : job file; its own machine counts only if it is among `machines`
    machines : names of the library, files, or ``all`` for the library
    folder : for a folder per machine, the page of the comparison, and the pages of `run_batch`
    as_placed : whether the part stays where the job has it, or where it is placed without a search
    scheduler, workers, job_timeout, tell : as for `run_batch`; a machine whose search is stopped is a row

    Raises
    ------
    SettingError
        Fewer than two machines, or two of one name; as `run_batch`.
    MachineError
        A machine that doesn't exist or can't be read: nothing is run.
    """
    names = list(dict.fromkeys(_named(machines)))
    if len(names) < 2:
        raise SettingError(f"machines: {', '.join(names) or 'none'}; name at least two, or all")
    _require_names(names)
    for name in names:
        load_machine(name)
    data = read_document(Path(job), JobError)[1]
    priced = _factors(data.get("factors"), options)
    searched = isinstance(data.get("setup"), dict) and "search" in data["setup"]
    settings: dict[str, Any] = {}
    if options.as_placed and searched:
        settings = {"setup.search": None}
    elif not options.as_placed and not searched:
        settings = {"setup.search": {"auto": True, "tries": TRIES}}
    batch = run_batch(
        [job],
        folder,
        machines=names,
        settings=settings,
        scheduler=options.scheduler,
        workers=options.workers,
        job_timeout=options.job_timeout,
        tell=options.tell,
    )
    found = (_candidate(row, Path(job).absolute(), batch.folder, priced) for row in batch.rows)
    candidates = sorted(found, key=lambda c: (c.energy is None, c.energy or (0.0, 0.0), c.machine))
    done = MachineComparison(Path(job).stem, tuple(candidates), batch)
    return replace(done, files=write_machines(done.job, done.candidates, done.claims, batch.folder))


def _named(machines: Sequence[str | Path]) -> Iterator[str]:
    """Yield names of the library, and absolute paths of files: a job's are relative to its own folder."""
    for machine in map(str, machines):
        if machine == ALL:
            yield from machine_names()
        else:
            file = Path(machine)
            yield str(file.absolute()) if file.suffix in READERS and file.is_file() else machine


def _require_names(machines: Sequence[str]) -> None:
    """Refuse two machines of one name, which rows and folders couldn't tell apart."""
    seen: dict[str, str] = {}
    for machine in machines:
        twin = seen.setdefault(_name_of(machine), machine)
        if twin != machine:
            raise SettingError(
                f"machines: {twin} and {machine} are both called {_name_of(machine)!r}; rename a file, or "
                "leave one out"
            )


def _name_of(machine: str) -> str:
    return Path(machine).stem if Path(machine).suffix in READERS else machine


def _factors(table: Any, given: Costs) -> Factors:
    """Take the prices that are given, and the others from the job."""
    own = table if isinstance(table, dict) else {}
    both = [(name, getattr(given, name), own.get(name)) for name in options_of(Costs)]
    taken = {name: told if said is None else said for name, said, told in both}
    return Factors(**{name: value for name, value in taken.items() if value is not None})


def _candidate(row: Row, job: Path, folder: Path, factors: Factors) -> Candidate:
    """Read what a machine's report says, and write its job; no figures where there is no report."""
    own = own_folder(folder, row.name)
    if row.energy is None or not (own / REPORT).is_file():
        return Candidate(row, {})
    report = json.loads((own / REPORT).read_text(encoding="utf-8"))
    figures, widths = _figures(report, factors)
    if row.status is Status.FINE and "place" in figures:
        _write_job(QueuedJob(row.name, job, row.sweep, row.values), figures["place"], own / JOB)
    return Candidate(row, figures, widths, factors)


def _figures(report: Mapping[str, Any], factors: Factors) -> tuple[dict[str, Any], dict[str, float]]:
    energy, budget, machine = report["energy"], report["budget"] or {}, report["machine"]
    turns = {c: rate["speed_deg_s"] for c, rate in report["rates"].get("optimised", {}).items()}
    margins = {c: use for c, use in report["axes"].items() if use["margin"] is not None}
    nearest = min(margins, key=lambda c: margins[c]["margin"], default=None)
    spent = budget.get("total", energy["with_base"] or energy["total"])
    figures = {
        "place": {"offset": machine["setup"]["offset"], "rotation": machine["setup"]["rotation_deg"]},
        "with_base_J": energy["with_base"],
        "time_basis": report["program"]["run_time"]["basis"],
        "largest_rotary_deg_s": max(turns.values(), default=None),
        "fastest_axis": max(turns, key=lambda c: turns[c], default=None),
        "margin": None if nearest is None else margins[nearest]["margin"],
        "margin_unit": None if nearest is None else margins[nearest]["unit"],
        "margin_axis": nearest,
        "all_J": spent,
        "cost": factors.cost(spent, energy["time"]),
        "currency": factors.currency,
        "co2_kg": factors.emission(spent),
        **{f"travel_{letter}_J": joules for letter, joules in energy["travel_by_axis"].items()},
        **{f"travel_{letter}_{use['unit']}": use["travel"] for letter, use in report["axes"].items()},
    }
    bands, joules = machine["bands"], energy["by_axis"]
    return figures, {c: joules[c] * (high - low) for c, (low, high) in bands.items()}


def _write_job(task: QueuedJob, place: Mapping[str, Any], file: Path) -> None:
    """Write a job with the machine and the place of the part, for ``fiveaxis optimise``."""
    import tomli_w

    data = task.read()[0].model_dump(mode="json", exclude_unset=True, exclude_none=True)
    setup = {key: value for key, value in data.get("setup", {}).items() if key != "search"}
    write_atomically(file, tomli_w.dumps(data | {"setup": setup | dict(place)}))
