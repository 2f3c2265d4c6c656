"""From job files to tasks: what each is called, what it sets, and what it is made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fiveaxis.batch.inputs import digest_job
from fiveaxis.batch.record import Row, Status, row_of_fault
from fiveaxis.batch.sweep import Variant, read_sweep
from fiveaxis.errors import FiveAxisError, JobError, SettingError
from fiveaxis.job import Job, build_job
from fiveaxis.settings import read_document

# Names that the batch itself gives to files in the output folder, or that no folder may have.
TAKEN = frozenset({"results.csv", "results.jsonl", ".", ".."})


@dataclass(frozen=True)
class Task:
    """One job to run.

    Parameters
    ----------
    name : of the job, and of its folder inside the output folder
    file : the job file
    sweep : name of the sweep that it is a variant of, else empty
    values : what the sweep sets, by key of a job
    """

    name: str
    file: Path
    sweep: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def blank(self) -> Row:
        """A row about this task that says nothing yet."""
        return Row(self.name, self.file.name, Status.BROKEN, self.sweep, dict(self.values))

    def load(self) -> tuple[Job, str]:
        """Read the job, and hash what it is made from.

        Raises
        ------
        FiveAxisError
            As `read_job`; of a variant, with its name.
        """
        text, data = read_document(self.file, JobError)
        try:
            whole = Variant(self.name, self.values).applied_to(data)
            job = build_job(whole, text, self.file)
            return job, digest_job(job, whole)
        except JobError as fault:
            if not self.values:
                raise
            # The file's own line of a key isn't where a sweep's value for it stands.
            raise JobError(f"in the variant {self.name}: {fault.message}", file=self.file) from None


@dataclass(frozen=True)
class Planned:
    """What job files ask for.

    Parameters
    ----------
    tasks : by name
    digests : hash of what each is made from, by name
    faults : rows of what can't be read
    sweeps : names of the variants of each sweep, in its order
    """

    tasks: dict[str, Task]
    digests: dict[str, str]
    faults: list[Row]
    sweeps: dict[str, list[str]]


def plan_tasks(files: Iterable[Path]) -> Planned:
    """Read job files, and make the tasks that they and their sweeps ask for.

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
        except FiveAxisError as fault:
            planned.faults.append(row_of_fault(Task(name, file).blank, fault))
            continue
        tasks = [Task(f"{name}/{v.name}", file, name, dict(v.values)) for v in variants]
        if variants:
            planned.sweeps[name] = [task.name for task in tasks]
        for task in tasks or [Task(name, file)]:
            _add(planned, task)
    return planned


def _add(planned: Planned, task: Task) -> None:
    try:
        planned.digests[task.name] = task.load()[1]
        planned.tasks[task.name] = task
    except FiveAxisError as fault:
        planned.faults.append(row_of_fault(task.blank, fault))


def _named(files: Iterable[Path]) -> dict[str, Path]:
    """Give each job file's name, that of the file without its suffix, and refuse names that clash."""
    found: dict[str, Path] = {}
    for file in files:
        name = file.stem
        if name.casefold() in TAKEN or name.startswith("."):
            raise SettingError(f"a job can't be called {name!r}; rename the file", file=file)
        # Systems whose file names don't tell capitals apart would have them share a folder.
        twin = next((other for known, other in found.items() if known.casefold() == name.casefold()), None)
        if twin is not None:
            raise SettingError(
                f"is called {name!r}, and so is {twin}; rename one, or leave it out", file=file
            )
        found[name] = file.absolute()
    if not found:
        raise SettingError("no job files; name some, for example jobs/*.toml")
    return found
