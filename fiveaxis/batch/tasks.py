"""From job files to tasks: the name of each, what a sweep sets in it, and the hash of its inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from fiveaxis import __version__
from fiveaxis.batch.record import Row, Status, row_of_fault
from fiveaxis.batch.sweep import Variant, read_sweep
from fiveaxis.errors import JobError, SettingError
from fiveaxis.files import hash_input, require_file
from fiveaxis.job import Job, build_job
from fiveaxis.job.loading import input_files
from fiveaxis.machine import load_machine, machine_text
from fiveaxis.machine.files import find_machine
from fiveaxis.nc import find_dialect
from fiveaxis.settings import read_document

# Names of the batch's own files in the output folder, and names that no folder may have.
TAKEN = frozenset({"results.csv", "results.html", "results.jsonl", ".", ".."})


@dataclass(frozen=True)
class Task:
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

    def load(self) -> tuple[Job, str]:
        """Read the job, and hash its inputs.

        Raises
        ------
        FiveAxisError
            As `read_job`; for a variant, with its name.
        """
        text, data = read_document(self.file, JobError)
        try:
            whole = Variant(self.name, self.values).applied_to(data)
            job = build_job(whole, text, self.file)
            return job, digest_job(job, whole)
        except JobError as fault:
            if not self.values:
                raise
            # The line of a key in the file isn't the line of the sweep's value for it.
            raise JobError(f"in the variant {self.name}: {fault.message}", file=self.file) from None


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

    tasks: dict[str, Task]
    digests: dict[str, str]
    faults: list[Row]
    sweeps: dict[str, list[str]]


def plan_tasks(files: Iterable[Path]) -> Planned:
    """Read job files, and make the tasks of them and their sweeps.

    Raises
    ------
    SettingError
        Two jobs of one name, or a name that no folder may have.
    """
    named = _named(files)
    planned = Planned({}, {}, [], {})
    for name, file in named.items():
        try:
            text, data = read_document(file, JobError)
            variants = read_sweep(data, text, file)
        except Exception as fault:  # of whatever kind: it mustn't end the others
            planned.faults.append(_row_of_unreadable(Task(name, file), fault))
            continue
        tasks = [Task(f"{name}/{v.name}", file, name, dict(v.values)) for v in variants]
        if variants:
            planned.sweeps[name] = [task.name for task in tasks]
        for task in tasks or [Task(name, file)]:
            try:
                planned.digests[task.name] = task.load()[1]
                planned.tasks[task.name] = task
            except Exception as fault:  # likewise
                planned.faults.append(_row_of_unreadable(task, fault))
    return planned


def _row_of_unreadable(task: Task, fault: Exception) -> Row:
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
        if name.casefold() in TAKEN or name.startswith(".") or not name.isprintable():
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


def digest_job(job: Job, data: Mapping[str, Any]) -> str:
    """Hash what a job says, the content of every file that it names, and the version of this package.

    Comments, the order of keys and folders don't count: a job that moved with its files is the same.

    Parameters
    ----------
    job : with paths that can be opened
    data : the content of its file, with a sweep's values

    Returns
    -------
    SHA-256, hexadecimal

    Raises
    ------
    JobError
        A file that can't be read.
    MachineError, SettingError
        A machine, or a control table, that can't be read.
    """
    return _hash_data({"version": __version__, "job": dict(data), "files": dict(_hash_inputs(job))})


def _hash_inputs(job: Job) -> Iterator[tuple[str, str]]:
    """Hash everything that a job names, by the key that names it."""
    # The job, controls and machines are hashed by what they say, with the files that they name.
    yield from ((use, _hash_file(path)) for use, path in input_files(job) if use not in ("job", "control"))
    # A control table may be based on others; what counts is the table that results.
    yield "control", _hash_data(find_dialect(job.writing["control"]).model_dump())
    machines = {"machine": job.machine, "drives": job.drives, "program.machine": job.program.machine}
    for key, name in machines.items():
        if name is not None:
            yield f"{key}.text", _hash_text(machine_text(load_machine(name), find_machine(name).parent))


def _hash_data(data: Mapping[str, Any]) -> str:
    return _hash_text(json.dumps(data, sort_keys=True, default=_as_json))


def _as_json(value: object) -> object:
    # The order of a set differs from one process to the next.
    return sorted(map(str, value)) if isinstance(value, set | frozenset) else str(value)


def _hash_text(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _hash_file(path: Path) -> str:
    stat = require_file(path, JobError)
    return _hash_content(path, stat.st_size, stat.st_mtime_ns, stat.st_ino)


@lru_cache(1024)
def _hash_content(path: Path, *_state: int) -> str:
    """Hash a file, once as long as its size, time and inode stay: the variants of a sweep share meshes."""
    return hash_input(path, JobError)
