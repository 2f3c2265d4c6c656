"""By what a job is recognised: a hash of all that it is made from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from fiveaxis import __version__
from fiveaxis.errors import JobError
from fiveaxis.job import Job
from fiveaxis.job.inputs import input_files
from fiveaxis.machine import load_machine, machine_text
from fiveaxis.machine.files import find_machine
from fiveaxis.nc import find_dialect


def digest_job(job: Job, data: Mapping[str, Any]) -> str:
    """Hash what a job says, the content of every file that it names, and the version of this package.

    Comments and the order of keys don't count, nor do folders: a job that moved with its files is the same.

    Parameters
    ----------
    job : with paths that can be opened
    data : what its file says, a sweep's values laid over it

    Returns
    -------
    SHA-256, hexadecimal

    Raises
    ------
    JobError
        A file that can't be read.
    MachineError, SettingError
        A machine, or a table of a control, that can't be read.
    """
    parts = {"version": __version__, "job": dict(data), "files": dict(_parts(job))}
    return _hash_text(_told(parts))


def _parts(job: Job) -> Iterator[tuple[str, str]]:
    """Give the hash of everything that a job names, by the key that names it."""
    # The job is hashed by what it says, and so are a control and machines, which may name further files.
    yield from ((use, _hash_file(path)) for use, path in input_files(job) if use not in ("job", "control"))
    # A table of a control may be based on others: what it says in the end is what counts.
    yield "control", _hash_text(_told(find_dialect(job.control).model_dump()))
    machines = {"machine": job.machine, "drives": job.drives, "program.machine": job.program.machine}
    for key, name in machines.items():
        if name is not None:
            yield f"{key}.text", _hash_text(machine_text(load_machine(name), find_machine(name).parent))


def _told(data: Mapping[str, Any]) -> str:
    return json.dumps(data, sort_keys=True, default=_plain)


def _plain(value: object) -> object:
    # A set has no order that stays from one process to the next.
    return sorted(map(str, value)) if isinstance(value, set | frozenset) else str(value)


def _hash_text(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _hash_file(path: Path) -> str:
    try:
        stat = path.stat()
        return _hash_content(path, stat.st_size, stat.st_mtime_ns, stat.st_ino)
    except OSError as fault:
        raise JobError(f"can't be read: {fault.strerror or fault}", file=path) from None


@lru_cache(1024)
def _hash_content(path: Path, *_state: int) -> str:
    """Hash a file; once for as long as its size, time and place on the disk stay, as sweeps share meshes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
