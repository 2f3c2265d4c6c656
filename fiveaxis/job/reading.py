"""Make a `Job` from a file or from options."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fiveaxis.base import (
    MESH_SUFFIXES,
    InputError,
    JobError,
    explain,
    line_of,
    read_document,
    read_settings,
    require_file,
    validate_settings,
)
from fiveaxis.check import names_file
from fiveaxis.job.description import SWEEP, TOOL_FILE, FixtureFile, Job
from fiveaxis.model import READERS as MACHINE_READERS
from fiveaxis.model import load_machine, parse_tool
from fiveaxis.nc import SUFFIXES, holds_path, suffix_of


def read_job(path: Path, **settings: Any) -> Job:
    """Read a job file; its relative paths are relative to the file.

    Parameters
    ----------
    path : a TOML file
    settings : as for `make_job`, in place of the file's own

    Raises
    ------
    JobError
        Missing file, not TOML, unknown key (with the nearest known one), wrong value, a file or name that
        doesn't exist; with its line.
    """
    text, data = read_document(path, JobError)
    if SWEEP in data:
        line = line_of(text, [SWEEP])
        raise JobError(
            "is a sweep, many jobs in one file; run it with `fiveaxis batch`", file=path, line=line
        )
    return build_job(data, text, path, **settings)


def build_job(data: dict[str, Any], text: str, path: Path, **settings: Any) -> Job:
    """Build a job from a file's content, whose text has the lines of errors, as `read_job` does."""
    if {"code", "axes"} <= data.keys() and "input" not in data:
        raise JobError("is a machine file, and a job is needed here; give it as --machine", file=path)
    job = validate_settings(data, text, path, Job, JobError)
    files: dict[str, Any] = {"input": path.parent / job.input}
    for name in ("part", "stock"):
        value = getattr(job, name)
        if value is not None and names_file(value):
            files[name] = path.parent / value
    files["fixture"] = tuple(fixture.beside(path.parent) for fixture in job.fixture)
    for name in ("tool", "control"):
        value = getattr(job, name)
        if value is not None and value.lower().endswith(TOOL_FILE):
            files[name] = str(path.parent / value)
    for name in ("machine", "drives"):
        value = getattr(job, name)
        if value is not None and Path(value).suffix.lower() in MACHINE_READERS:
            files[name] = str(path.parent / value)
    written_for = job.program.machine
    if written_for is not None and Path(written_for).suffix.lower() in MACHINE_READERS:
        beside = {"machine": str(path.parent / written_for)}
        files["program"] = job.program.model_copy(update=beside)
    own = job.model_copy(update=files).with_origin(path, f"the job file {path.name} (override)")
    _check_names(own, text, path, replaced=[name for name, value in settings.items() if value is not None])
    return make_job(own, **settings)


def read_fixtures(path: Path) -> dict[str, Any]:
    """Read fixtures and clearances from a separate file, as settings for `make_job`; errors as `read_job`."""
    found = read_settings(path, FixtureFile, JobError)
    fixtures = tuple(fixture.beside(path.parent) for fixture in found.fixture)
    return {"fixture": fixtures or None, "clearance": found.clearance}


def _check_names(job: Job, text: str, file: Path, replaced: Collection[str]) -> None:
    checks: dict[str, Callable[[Any], object]] = {
        "input": require_input,
        "part": partial(require_file, error=JobError),
        "stock": lambda stock: require_file(stock, JobError) if names_file(stock) else None,
        "machine": load_machine,
        "drives": load_machine,
        "tool": parse_tool,
    }
    for key, check in checks.items():
        value = getattr(job, key)
        if value is None or key in replaced:
            continue
        try:
            check(value)
        except InputError as fault:
            if fault.line is not None:  # a fault inside the named file
                raise
            line = line_of(text, [key])
            raise JobError(f"{key}: {fault}", file=file, line=line) from None


def make_job(base: Job | None = None, **settings: Any) -> Job:
    """Make a job from settings, over those of a base job; None counts as not given.

    `JobError` where something is missing or out of range.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    if base is not None and not given:
        return base
    # Fields that aren't given stay unset: `load_job_toolpath` refuses settings that the input doesn't use.
    values = {} if base is None else base.model_dump(exclude_unset=True)
    for name in ("plan", "program", "setup", "nc"):
        table = {key: value for key, value in given.pop(name, {}).items() if value is not None}
        if table:
            values[name] = values.get(name, {}) | table
    # One bound replaces the other: a job's tilt doesn't survive a cone from the command line.
    if "cone" in given:
        values.pop("tilt", None)
    elif "tilt" in given:
        values.pop("cone", None)
    try:
        made = Job.model_validate(values | given)
    except ValidationError as fault:
        raise JobError(explain(fault, Job)) from None
    if base is None:
        return made
    return made.with_origin(base.file, made.override_by if "override" in given else base.override_by)


def require_input(path: Path) -> None:
    """Raise `JobError` unless a path is a file of a known kind; a suffix that isn't known may hold one."""
    require_file(path, JobError)
    suffix = suffix_of(str(path))
    if suffix not in (*MESH_SUFFIXES, *SUFFIXES) and not holds_path(path):
        lacking = f"unknown suffix {suffix!r}" if suffix else "has no suffix, which says what it is"
        raise JobError(
            f"{lacking}; a mesh ({' '.join(MESH_SUFFIXES)}), a list of locations "
            f"({' '.join(SUFFIXES)}, also with .gz) or a job (.toml) is needed",
            file=path,
        )
