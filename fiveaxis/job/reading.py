"""From a file or from options to a `Job`."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fiveaxis.errors import InputError, JobError
from fiveaxis.job.description import SWEEP, TOOL_FILE, FixtureFile, Job
from fiveaxis.machine import load_machine
from fiveaxis.machine.files import READERS as MACHINE_READERS
from fiveaxis.mesh import SUFFIXES as MESH_SUFFIXES
from fiveaxis.nc.formats import READERS
from fiveaxis.settings import explain, line_of, read_document, read_settings, validate_settings
from fiveaxis.toolpath import parse_tool


def read_job(path: Path, **settings: Any) -> Job:
    """Read a job file; relative paths in it are relative to the file.

    Parameters
    ----------
    path : a TOML file
    settings : as for `make_job`, in place of the file's own

    Raises
    ------
    JobError
        Missing file, not TOML, unknown key (with the nearest known one), wrong value, a name that stands for
        nothing; with its line.
    """
    text, data = read_document(path, JobError)
    if SWEEP in data:
        line = line_of(text, [SWEEP])
        raise JobError(
            "is a sweep, many jobs in one file; run it with `fiveaxis batch`", file=path, line=line
        )
    return build_job(data, text, path, **settings)


def build_job(data: dict[str, Any], text: str, path: Path, **settings: Any) -> Job:
    """Build a job from what its file says, as `read_job` does.

    Parameters
    ----------
    data, text : what the file says, and its text, in which lines are looked for
    path : the file; relative paths are relative to it
    settings : as for `make_job`, in place of the file's own

    Raises
    ------
    JobError
        As `read_job`.
    """
    job = validate_settings(data, text, path, Job, JobError)
    places: dict[str, Any] = {"input": path.parent / job.input}
    for name in ("part", "stock"):
        if getattr(job, name) is not None:
            places[name] = path.parent / getattr(job, name)
    places["fixture"] = tuple(fixture.beside(path.parent) for fixture in job.fixture)
    if job.tool is not None and job.tool.lower().endswith(TOOL_FILE):
        places["tool"] = str(path.parent / job.tool)
    if job.control.lower().endswith(TOOL_FILE):
        places["control"] = str(path.parent / job.control)
    for name in ("machine", "drives"):
        value = getattr(job, name)
        if value is not None and Path(value).suffix.lower() in MACHINE_READERS:
            places[name] = str(path.parent / value)
    written_for = job.program.machine
    if written_for is not None and Path(written_for).suffix.lower() in MACHINE_READERS:
        beside = {"machine": str(path.parent / written_for)}
        places["program"] = job.program.model_copy(update=beside)
    own = job.model_copy(update=places)
    own = own.said_by(path, f"the job file {path.name} (override)")
    _check_names(own, path, replaced=[name for name, value in settings.items() if value is not None])
    return make_job(own, **settings)


def read_fixtures(path: Path) -> dict[str, Any]:
    """Read fixtures and clearances from a file of their own, as settings for `make_job`.

    Raises
    ------
    JobError
        As `read_job`.
    """
    found = read_settings(path, FixtureFile, JobError)
    fixtures = tuple(fixture.beside(path.parent) for fixture in found.fixture)
    return {"fixture": fixtures or None, "clearance": found.clearance}


def _check_names(job: Job, file: Path, replaced: Collection[str]) -> None:
    """Look for what a job file names, so that a wrong name is reported on its line."""
    checks: dict[str, Callable[[Any], object]] = {
        "input": require_input,
        "part": require_file,
        "stock": require_file,
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
            if fault.line is not None:  # inside the file that is named
                raise
            line = line_of(file.read_text(encoding="utf-8"), [key])
            raise JobError(f"{key}: {fault}", file=file, line=line) from None


def make_job(base: Job | None = None, **settings: Any) -> Job:
    """Make a job from settings, over those of a base; settings that are None count as not given.

    Raises
    ------
    JobError
        Something is missing or out of range.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    # What nobody set stays unset: `load_job_toolpath` refuses settings that would go unused.
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
    return made.said_by(base.file, made.override_by if "override" in given else base.override_by)


def require_input(path: Path) -> None:
    """Refuse, with a `JobError`, a folder, a file of an unknown kind, and a missing file."""
    kind = path.with_suffix("") if path.suffix.lower() == ".gz" else path
    if not path.is_dir() and kind.suffix.lower() not in (*MESH_SUFFIXES, *READERS):
        raise JobError(
            f"unknown suffix {kind.suffix!r}; a mesh ({' '.join(MESH_SUFFIXES)}), a list of locations "
            f"({' '.join(READERS)}, also with .gz) or a job (.toml) is needed",
            file=path,
        )
    require_file(path)


def require_file(path: Path) -> None:
    """Refuse, with a `JobError`, what isn't a file."""
    if not path.exists():
        raise JobError("no such file", file=path)
    if path.is_dir():
        raise JobError("is a folder; name a file", file=path)
