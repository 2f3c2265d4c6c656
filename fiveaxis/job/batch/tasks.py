"""From job files to tasks: the name of each, what a sweep sets in it, and the hash of its inputs.

A sweep, a table of lists in a job file, makes many jobs of it, with stable names.
"""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fiveaxis.base import JobError, SettingError, line_of, read_document
from fiveaxis.job.batch.record import Row, Status, row_of_fault
from fiveaxis.job.description import COMBINATIONS, COMBINE, LARGEST_SWEEP, SWEEP, Job
from fiveaxis.job.digest import digest_job
from fiveaxis.job.reading import build_job

# Most characters of a value and of a name; longer ones are cut and end in a hash.
LONGEST_VALUE = 60
LONGEST_NAME = 180
# Names of the batch's own files in the output folder, and names that no folder may have.
TAKEN = frozenset({"results.csv", "results.html", "results.jsonl", ".", ".."})
# Names of devices on Windows, whatever follows a dot; it also drops a dot or a space at the end.
RESERVED = re.compile(r"(con|prn|aux|nul|(com|lpt)[0-9¹²³])(\..*)?|.*[. ]", re.IGNORECASE)


def apply_values(values: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    """Apply a variant's values, by key of a job (``tilt``, ``setup.offset``), to the content of a job file.

    As on the command line, a cone replaces a tilt, and a tilt a cone. `JobError` for a key inside something
    that isn't a table.
    """
    made = copy.deepcopy({key: value for key, value in data.items() if key != SWEEP})
    for one, other in (("cone", "tilt"), ("tilt", "cone")):
        if one in values and other not in values:
            made.pop(other, None)
    for key, value in values.items():
        *tables, last = key.split(".")
        inner = made
        for table in tables:
            inner = inner.setdefault(table, {})
            if not isinstance(inner, dict):
                raise JobError(f"{SWEEP}.{key}: {table} is {inner!r} in the job, not a table with keys")
        inner[last] = copy.deepcopy(value)
    return made


def read_sweep(data: Mapping[str, Any], text: str, path: Path) -> dict[str, dict[str, Any]]:
    """List the jobs of a job file's ``[sweep]`` in the order of its lists, the last key varying fastest.

    Returns
    -------
    Name of each variant's folder, inside the sweep's → the values that it sets; empty without a sweep

    Raises
    ------
    JobError
        With its line: no list of values, several lists without `combine`, lists of unequal length to be
        zipped, too many jobs, two jobs of one name.
    """
    if SWEEP not in data:
        return {}
    try:
        return _expand(data[SWEEP])
    except _Fault as fault:
        line = line_of(text, fault.keys) or line_of(text, [SWEEP])
        raise JobError(str(fault), file=path, line=line) from None


class _Fault(Exception):
    """A fault of a sweep, with its key."""

    def __init__(self, message: str, *keys: str) -> None:
        self.keys = [SWEEP, *keys]
        super().__init__(message)


def _expand(table: Any) -> dict[str, dict[str, Any]]:
    if not isinstance(table, dict):
        raise _Fault(f"{SWEEP} = {table!r} must be a table: keys of a job, each with a list of values")
    lists = dict(_lists({key: value for key, value in table.items() if key != COMBINE}))
    if not lists:
        raise _Fault(f"{SWEEP} varies nothing; give keys of a job, each with a list of values")
    variants: dict[str, dict[str, Any]] = {}
    seen: set[str] = set()
    for values in _combine(lists, table.get(COMBINE)):
        name = _name(values)
        if name.casefold() in seen:
            raise _Fault(f"{SWEEP} makes two jobs of the name {name!r}; remove a value")
        seen.add(name.casefold())
        variants[name] = values
    return variants


def _lists(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Yield the lists of a sweep by dotted key; ``setup.offset = …`` is a table inside it."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _lists(value, f"{above}{key}.")
            continue
        if not isinstance(value, list) or not value:
            raise _Fault(
                f"{SWEEP}.{above}{key} = {value!r} must be a list of values, one per job (the key that "
                f"combines several lists is {COMBINE!r})",
                *f"{above}{key}".split("."),
            )
        yield f"{above}{key}", value


def _combine(lists: Mapping[str, list[Any]], combination: Any) -> Iterator[dict[str, Any]]:
    if (combination is not None or len(lists) > 1) and combination not in COMBINATIONS:
        found = "doesn't say" if combination is None else f"has {COMBINE} = {combination!r} for"
        known = f'{COMBINE} = "product" (every value with every other) or "zip" (first with first)'
        raise _Fault(f"{SWEEP} {found} how {', '.join(lists)} are combined; give {known}", COMBINE)
    lengths = {key: len(values) for key, values in lists.items()}
    counts = ", ".join(f"{key} {n}" for key, n in lengths.items())
    zipped = combination == "zip"
    if zipped and len(set(lengths.values())) > 1:
        raise _Fault(f"{SWEEP} zips lists of unequal length ({counts}); give as many values in each", COMBINE)
    count = min(lengths.values()) if zipped else math.prod(lengths.values())
    if count > LARGEST_SWEEP:
        raise _Fault(f"{SWEEP} makes {count} jobs ({counts}), more than {LARGEST_SWEEP}; remove values")
    rows = zip(*lists.values(), strict=True) if zipped else itertools.product(*lists.values())
    return (dict(zip(lists, row, strict=True)) for row in rows)


def _name(values: Mapping[str, Any]) -> str:
    """Name a variant by its values, so that its name stays when other values are added to the lists."""
    return _shorten(
        "_".join(f"{key}={_in_name(value)}" for key, value in values.items()), values, LONGEST_NAME
    )


def _in_name(value: Any) -> str:
    """Format a value so that it can be part of a folder's name on every system."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, int | float):
        text = f"{value:.12g}"
    elif isinstance(value, list):
        text = ",".join(map(_in_name, value))
    elif isinstance(value, dict):
        text = ",".join(f"{key}{_in_name(inner)}" for key, inner in value.items())
    else:
        text = str(value)
    return _shorten(re.sub(r"\.$", "_", re.sub(r"[^\w.,+-]+", "-", text)), value, LONGEST_VALUE)


def _shorten(text: str, value: Any, longest: int) -> str:
    if len(text) <= longest:
        return text
    whole = json.dumps(value, sort_keys=True, default=str).encode()
    return f"{text[: longest - 9]}-{hashlib.sha256(whole).hexdigest()[:8]}"


@dataclass(frozen=True)
class QueuedJob:
    """One job to run.

    Parameters
    ----------
    name : of the job, and of its folder inside the output folder
    file : the job file
    sweep : name of the sweep that it is a variant of, or empty
    values : what the sweep sets, by key of a job
    """

    name: str
    file: Path
    sweep: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def blank(self) -> Row:
        """A row of this task, to be filled in."""
        return Row(self.name, self.file.name, Status.BROKEN, self.sweep, dict(self.values))

    def read(self) -> tuple[Job, dict[str, Any]]:
        """Read the job, and the content of its file with the sweep's values; an error names the variant."""
        text, data = read_document(self.file, JobError)
        try:
            whole = apply_values(self.values, data)
            return build_job(whole, text, self.file), whole
        except JobError as fault:
            if not self.values:
                raise
            # The line of a key in the file isn't the line of the sweep's value for it.
            raise JobError(f"in the variant {self.name}: {fault.message}", file=self.file) from None

    def digest(self) -> str:
        """Hash the job's inputs."""
        return digest_job(*self.read())


@dataclass(frozen=True)
class Planned:
    """The tasks of some job files.

    Parameters
    ----------
    tasks : by name
    digests : hash of the inputs of each, by name
    faults : rows of jobs that can't be read
    sweeps : names of the variants of each sweep, in its order
    """

    tasks: dict[str, QueuedJob]
    digests: dict[str, str]
    faults: list[Row]
    sweeps: dict[str, list[str]]


def plan_tasks(
    files: Iterable[Path], machines: Sequence[str] = (), settings: Mapping[str, Any] | None = None
) -> Planned:
    """Read job files, and make the tasks of them and their sweeps; machines and settings as for `run_batch`.

    `SettingError` for two jobs of one name, or a name that no folder may have.
    """
    named = _named(files)
    planned = Planned({}, {}, [], {})
    for name, file in named.items():
        try:
            text, data = read_document(file, JobError)
            variants = _expand({"machine": list(machines)}) if machines else read_sweep(data, text, file)
        except Exception as fault:  # of whatever kind: it mustn't end the others
            planned.faults.append(_row_of_unreadable(QueuedJob(name, file), fault))
            continue
        more = dict(settings or {}) if machines else {}
        tasks = [
            QueuedJob(f"{name}/{variant}", file, name, values | more) for variant, values in variants.items()
        ]
        if variants:
            planned.sweeps[name] = [task.name for task in tasks]
        for task in tasks or [QueuedJob(name, file)]:
            try:
                planned.digests[task.name] = task.digest()
                planned.tasks[task.name] = task
            except Exception as fault:  # likewise
                planned.faults.append(_row_of_unreadable(task, fault))
    return planned


def _row_of_unreadable(task: QueuedJob, fault: Exception) -> Row:
    """Make the row of a task that can't be read; what Python itself can't hold or open is wrong input."""
    if isinstance(fault, RecursionError | MemoryError | OSError | ValueError):
        fault = JobError(f"can't be read: {type(fault).__name__}: {fault}; simplify it", file=task.file)
    return row_of_fault(task.blank, fault)


def _named(files: Iterable[Path]) -> dict[str, Path]:
    """Map job names, those of the files without suffix, to files; refuse names that clash."""
    found: dict[str, Path] = {}
    for file in files:
        name = file.stem
        # A name that isn't printable would change the table, or the terminal.
        taken = name.casefold() in TAKEN or RESERVED.fullmatch(name)
        if taken or name.startswith(".") or not name.isprintable():
            raise SettingError(f"a job can't be called {name!r}; rename the file", file=file)
        # File systems that ignore case would put them into one folder.
        twin = next((other for known, other in found.items() if known.casefold() == name.casefold()), None)
        if twin is not None:
            raise SettingError(
                f"is called {name!r}, and so is {twin}; rename one, or leave it out", file=file
            )
        found[name] = file.absolute()
    if not found:
        raise SettingError("no job files; name some, for example jobs/*.toml")
    return found
