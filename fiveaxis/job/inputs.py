"""List every file that a job is made from, by its use: for reports, and to recognise a job."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fiveaxis.errors import SettingError
from fiveaxis.job.description import TOOL_FILE, Job
from fiveaxis.machine import load_machine
from fiveaxis.machine.bodies import MeshShape
from fiveaxis.machine.files import find_machine
from fiveaxis.nc import find_dialect
from fiveaxis.report import describe_input
from fiveaxis.settings import read_document


def describe_inputs(job: Job) -> list[dict[str, Any]]:
    """Describe all files of a job by name, hash and size, each once, with its uses.

    Raises
    ------
    InputError
        A file can't be read.
    """
    uses: dict[Path, list[str]] = {}
    for use, path in input_files(job):
        uses.setdefault(path, []).append(use)
    return [describe_input(path) | {"used_as": ", ".join(names)} for path, names in uses.items()]


def input_files(job: Job) -> Iterator[tuple[str, Path]]:
    """Yield use and path of the files that a job names, and of those that these name.

    Raises
    ------
    MachineError, SettingError
        A machine, or a control table, that can't be read.
    """
    if job.file is not None:
        yield "job", job.file
    files = {"input": job.input, "part": job.part, "stock": job.stock}
    files |= {f"fixture.{i}": fixture.file for i, fixture in enumerate(job.fixture)}
    if job.tool is not None and job.tool.lower().endswith(TOOL_FILE):
        files["tool"] = Path(job.tool)
    yield from ((use, path) for use, path in files.items() if path is not None)
    if job.control.lower().endswith(TOOL_FILE):
        find_dialect(job.control)  # refuses tables that are based on each other
        yield from (("control", path) for path in _tables(Path(job.control)))
    machines = {"machine": job.machine, "drives": job.drives, "program.machine": job.program.machine}
    for use, name in machines.items():
        if name is not None:
            yield from ((f"{use}.{inner}", path) for inner, path in _machine_files(name))


def _tables(path: Path) -> Iterator[Path]:
    """Yield a control table, and those that it is based on."""
    yield path
    based_on = read_document(path, SettingError)[1].get("based_on", "")
    if str(based_on).lower().endswith(TOOL_FILE):
        yield from _tables(path.parent / based_on)


def _machine_files(name: str) -> Iterator[tuple[str, Path]]:
    """Yield a machine's file and the meshes of its bodies."""
    yield "file", find_machine(name)
    for number, body in enumerate(load_machine(name).bodies):
        if isinstance(body.shape, MeshShape):
            yield f"body.{number}", Path(body.shape.file)
