"""What a batch tells of a job: events while it waits and runs, and its result as a row of plain data.

A row is the same for the same inputs.
"""

from __future__ import annotations

import math
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis.base import (
    AlreadyBetter,
    Cause,
    FiveAxisError,
    Infeasible,
    NoSpace,
    Severity,
    Unverified,
    count_codes,
    group_findings,
    shorten,
)

if TYPE_CHECKING:
    from fiveaxis.job.stages import Outcome

# Most findings in the row of an infeasible job; all of them are counted.
LISTED = 100


class Status(StrEnum):
    """How a job ended."""

    FINE = "fine"
    ERRORS = "errors"
    NO_POSTURE = "no posture"
    WRONG_INPUT = "wrong input"
    BROKEN = "broken"

    @property
    def exit_code(self) -> int:
        """Exit code of a command whose worst job has this status."""
        return _CODES[self]

    @property
    def is_final(self) -> bool:
        """Whether it depends on the inputs alone, so that another run would end the same."""
        return self in (Status.FINE, Status.ERRORS, Status.NO_POSTURE)


_CODES = {Status.FINE: 0, Status.ERRORS: 1, Status.NO_POSTURE: 3, Status.WRONG_INPUT: 2, Status.BROKEN: 4}
# From bad to worse.
ORDER = tuple(_CODES)


@dataclass(frozen=True)
class Row:
    """The result of one job.

    Parameters
    ----------
    name : of the job, and of its folder
    file : the job file's name
    status : how it ended
    sweep, values : the sweep that it is a variant of, and the values it sets
    message : the error, if there was one
    digest : hash of its inputs; empty where they changed meanwhile, so that the job runs again
    locations : number of cutter locations
    energy, travel, base, time : J, J, J and s: energy of the feed drives in the whole program, their travel
        metric, both without base load; base power × time, None where it isn't known
    energy_least, energy_most : J, of the energy by the bands of estimated drives
    starts, reversals : of the axes in the program's blocks
    baseline, baseline_energy, saved : the cheapest baseline, its energy in J, and the share saved; None where
        estimated powers leave open whether anything is saved
    baseline_starts, baseline_reversals : of the axes in the blocks of what it is compared with
    errors, warnings, counts : number of findings by severity and by code
    summary : findings by cause, as plain data
    findings : of an infeasible job, the first `LISTED`
    files : names of the files in its folder
    before : while its input is wrong, the row of its last run as plain data; that run's files stay
    """

    name: str
    file: str
    status: Status
    sweep: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""
    digest: str = ""
    locations: int | None = None
    energy: float | None = None
    energy_least: float | None = None
    energy_most: float | None = None
    travel: float | None = None
    base: float | None = None
    time: float | None = None
    starts: int | None = None
    reversals: int | None = None
    baseline: str = ""
    baseline_energy: float | None = None
    saved: float | None = None
    baseline_starts: int | None = None
    baseline_reversals: int | None = None
    errors: int = 0
    warnings: int = 0
    counts: Mapping[str, int] = field(default_factory=dict)
    summary: Sequence[Mapping[str, Any]] = ()
    findings: Sequence[Mapping[str, Any]] = ()
    files: Sequence[str] = ()
    before: Mapping[str, Any] | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain data for JSON."""
        lists = {name: list(getattr(self, name)) for name in ("summary", "findings", "files")}
        return asdict(self) | lists | {"status": str(self.status), "values": _plain(self.values)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Row:
        """Make a row from plain data; `TypeError` for a wrong key, `ValueError` for an unknown status."""
        row = cls(**data)
        return replace(row, status=Status(row.status))


@dataclass(frozen=True)
class Column:
    """A column of the tables of a batch: the CSV files, the JSON document and the page.

    Parameters
    ----------
    value : of a row; None where it isn't known
    heading : on the page
    digits : of its numbers on the page; None for words, and for values that are shown as they are written
    factor : of the page's unit
    signed : whether numbers above 0 have a sign on the page
    """

    value: Callable[[Row], Any]
    heading: str
    digits: int | None = None
    factor: float = 1.0
    signed: bool = False


# By name in CSV and JSON, with the unit; lists and dictionaries of a row are in the JSON lines only.
COLUMNS = {
    "job": Column(attrgetter("name"), "job"),
    "status": Column(attrgetter("status"), "state"),
    "locations": Column(attrgetter("locations"), "locations", 0),
    "energy_J": Column(attrgetter("energy"), "energy (J)", 0),
    "travel_metric_J": Column(attrgetter("travel"), "travel metric (J)", 0),
    "base_J": Column(attrgetter("base"), "base load (J)", 0),
    "time_s": Column(attrgetter("time"), "time (s)", 1),
    "starts": Column(attrgetter("starts"), "starts", 0),
    "reversals": Column(attrgetter("reversals"), "reversals", 0),
    "baseline": Column(attrgetter("baseline"), "against"),
    "baseline_J": Column(attrgetter("baseline_energy"), "energy, baseline (J)", 0),
    "saved": Column(attrgetter("saved"), "saved (%)", 1, 100.0),
    "baseline_starts": Column(attrgetter("baseline_starts"), "starts, baseline", 0),
    "baseline_reversals": Column(attrgetter("baseline_reversals"), "reversals, baseline", 0),
    "errors": Column(attrgetter("errors"), "errors", 0),
    "warnings": Column(attrgetter("warnings"), "warnings", 0),
    "file": Column(attrgetter("file"), "file"),
    "inputs_sha256": Column(attrgetter("digest"), "hash of the inputs"),
    "message": Column(attrgetter("message"), "message"),
}


def _plain(value: Any) -> Any:
    """Convert a value to plain data; dates and infinite numbers, which JSON can't hold, become text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    finite = isinstance(value, float) and math.isfinite(value)
    return value if finite or value is None or isinstance(value, str | int) else str(value)


def row_of(blank: Row, outcome: Outcome, files: Sequence[Path]) -> Row:
    """Fill in a job's blank row from its outcome and the files that were written."""
    report, solution = outcome.report, outcome.report.solution
    energy, baseline = solution.energy, solution.cheapest() or ""
    least, most = solution.energy_range()
    compared = solution.baselines.get(baseline)
    return replace(
        blank,
        status=Status.FINE if outcome.gate.is_open else Status.ERRORS,
        message="" if outcome.gate.is_open else "verification found errors: no NC program was written",
        locations=report.locations,
        energy=energy.total,
        energy_least=least,
        energy_most=most,
        travel=energy.travel,
        base=energy.base,
        time=energy.time,
        starts=energy.starts,
        reversals=energy.reversals,
        baseline=baseline,
        baseline_energy=None if compared is None else compared.total,
        baseline_starts=None if compared is None else compared.starts,
        baseline_reversals=None if compared is None else compared.reversals,
        saved=None if solution.to_measure(baseline) else solution.savings().get(baseline),
        **_count_severities(report.summary),
        counts=dict(report.verdict.counts),
        files=sorted(path.name for path in files),
    )


def bounded(text: str) -> str:
    """Shorten a long message; what no file could hold becomes an escape."""
    return shorten(text).encode("utf-8", "backslashreplace").decode()


def row_of_fault(blank: Row, fault: Exception) -> Row:
    """Fill in a job's row from the error that ended it; an unexpected one is a fault of the program."""
    if not isinstance(fault, FiveAxisError):
        return replace(
            blank, status=Status.BROKEN, message=bounded(f"{type(fault).__name__}: {fault}{_where(fault)}")
        )
    if not isinstance(fault, Infeasible | Unverified):
        if isinstance(fault, AlreadyBetter):
            return replace(blank, status=Status.FINE, message=bounded(str(fault)))
        status = Status.BROKEN if isinstance(fault, NoSpace) else Status.WRONG_INPUT
        return replace(blank, status=status, message=bounded(str(fault)))
    return replace(
        blank,
        status=Status.NO_POSTURE if isinstance(fault, Infeasible) else Status.ERRORS,
        message=bounded(str(fault)),
        **_count_severities(group_findings(fault.findings)),
        counts=count_codes(fault.findings),
        findings=[found.as_dict() for found in fault.findings[:LISTED]],
    )


def _count_severities(summary: Sequence[Cause]) -> dict[str, Any]:
    def count(severity: Severity) -> int:
        return sum(cause.count for cause in summary if cause.severity is severity)

    return {
        "errors": count(Severity.ERROR),
        "warnings": count(Severity.WARNING),
        "summary": [cause.as_dict() for cause in summary],
    }


def _where(fault: Exception) -> str:
    frames = traceback.extract_tb(fault.__traceback__, limit=-1)
    return f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""


def worst(rows: Sequence[Row]) -> Status:
    """Find the worst status of some rows; without rows it is fine."""
    return max((row.status for row in rows), key=ORDER.index, default=Status.FINE)


@dataclass(frozen=True)
class Event:
    """A change in the state of a job.

    Parameters
    ----------
    name : of the job
    state : ``waiting``, ``running`` or ``done``; a job whose worker died waits again
    row : its result, when it is done
    again : whether an earlier batch had done it
    stage, share : what it does, and the share of the whole job that is done, 0 to 1
    worker, pid : where it runs: number of the worker or name of its computer, and its process
    """

    name: str
    state: str
    row: Row | None = None
    again: bool = False
    stage: str = ""
    share: float = 0.0
    worker: str = ""
    pid: int | None = None


Listener = Callable[[Event], None]


class Relay:
    """Passes events on one at a time, without progress that arrives after the end of its job."""

    def __init__(self, listener: Listener | None) -> None:
        self._listener, self._lock = listener, threading.Lock()
        self._done: set[str] = set()

    def __call__(self, event: Event) -> None:
        """Pass on an event."""
        with self._lock:
            if self._listener is None or event.name in self._done:
                return
            if event.state == "done":
                self._done.add(event.name)
            self._listener(event)
