"""The hash of a job: what it says and all files that it names; what was found for another one isn't used."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from typing import Any

from fiveaxis import __version__
from fiveaxis.base import USUAL_CONTROL, JobError, hash_input
from fiveaxis.job.description import Job
from fiveaxis.job.loading import input_files, stated_control
from fiveaxis.model import find_machine, load_machine, machine_text
from fiveaxis.nc import find_dialect


def digest_job(job: Job, data: Mapping[str, Any] | None = None) -> str:
    """Hash what a job says, the content of every file that it names, and the version of this package.

    Comments, the order of keys and folders don't count: a job that moved with its files is the same. What it
    says is the content of its file, with a sweep's values, or else what it holds. The hash is a hexadecimal
    SHA-256; a file, machine or control table that can't be read is an error of its own.
    """
    if data is None:
        data = _unplaced(job.model_dump(), {str(path) for _, path in input_files(job)})
    return _hash_data({"version": __version__, "job": dict(data), "files": dict(_hash_inputs(job))})


def _unplaced(value: Any, files: Set[str]) -> Any:
    """Leave out where files lie: what is in them counts."""
    if isinstance(value, dict):
        return {key: _unplaced(one, files) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_unplaced(one, files) for one in value]
    return None if isinstance(value, str | Path) and str(value) in files else value


def _hash_inputs(job: Job) -> Iterator[tuple[str, str]]:
    # The job, controls and machines are hashed by what they say, with the files that they name.
    files = [(use, path) for use, path in input_files(job) if use not in ("job", "control")]
    yield from ((use, hash_input(path, JobError)) for use, path in files)
    # A control table may be based on others; what counts is the table that results.
    yield "control", _hash_data(find_dialect(stated_control(job) or USUAL_CONTROL).model_dump())
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
