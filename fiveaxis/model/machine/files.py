"""Loading a `Machine` by name from the library, or from a file; writing one to a machine file."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from fiveaxis.base import (
    FigureError,
    MachineError,
    SettingError,
    UnknownMachine,
    kept_by_file,
    line_of,
    read_document,
    require_suffix,
    validate_settings,
    write_atomically,
)
from fiveaxis.model.machine.building import build_machine, machine_document, toml_text, without_defaults
from fiveaxis.model.machine.drafting import assuming
from fiveaxis.model.machine.linuxcnc import read_linuxcnc
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tables import MachineFile
from fiveaxis.model.machine.urdf_reading import read_urdf
from fiveaxis.model.machine.vericut import read_vericut


def load_machine(name: str | Path, assume: Mapping[str, str] | None = None) -> Machine:
    """Load a machine by name or from a file.

    Parameters
    ----------
    name : name of a machine in the library (`machine_names`), or the path of a machine
        file (``.toml``), a LinuxCNC configuration (``.ini``), a URDF (``.urdf``) or a Vericut machine
        (``.mch``)
    assume : figures that the file doesn't state, as answers to the questions of `fiveaxis machine new`:
        ``{"A.points": "0,0,50", "C.counts": "table"}``; every report names them

    Raises
    ------
    UnknownMachine
        There is no machine of that name; the nearest names are listed.
    MachineError
        The file can't be read or has an impossible figure; the message has file and line.
    SettingError
        An assumption about something else than a figure, or in another form.
    """
    path = find_machine(name)
    # What is kept of a file is shared: a caller who changes arrays of the machine changes his own.
    machine = replace(READERS[path.suffix.lower()](path))
    return assuming(machine, assume) if assume else machine


def take_machine(machine: Machine | str | Path) -> Machine:
    """Return a machine, loaded if it is given by its name or file; `SettingError` without either."""
    if isinstance(machine, str | Path):
        return load_machine(str(machine))
    if not isinstance(machine, Machine):
        kind = type(machine).__name__
        raise SettingError(f"machine is of type {kind}; give a Machine, or the name or file of one")
    return machine


def find_machine(name: str | Path) -> Path:
    """Find the file of a machine by its name.

    Raises
    ------
    UnknownMachine
        There is no machine of that name; the nearest names are listed.
    MachineError
        The file's suffix isn't one of a machine file.
    """
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix in READERS:
        return path
    known = {p.stem: p for p in library_files()}
    text = str(name)
    if text in known:
        return known[text]
    if suffix or len(path.parts) > 1:
        has = f"has the unknown suffix {suffix!r}" if suffix else "has no suffix"
        raise MachineError(f"{has}; a machine is read from {', '.join(READERS)}", file=path)
    raise UnknownMachine(text, difflib.get_close_matches(text, known, n=3, cutoff=0.4), sorted(known))


@kept_by_file(8)
def read_machine_file(path: Path) -> Machine:
    """Read a machine file (TOML); names of mesh files in it are relative to its folder."""
    text, data = read_document(path, MachineError)
    file = validate_settings(data, text, path, MachineFile, MachineError)
    try:
        return build_machine(file, path.parent)
    except FigureError as fault:
        raise MachineError(fault.message, file=path, line=line_of(text, fault.location)) from None


def read_foreign(path: str | Path) -> Machine:
    """Read another program's description of a machine: LinuxCNC, URDF, Vericut.

    `MachineError` if the file's suffix is none of theirs, or it can't be read.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FOREIGN:
        raise MachineError(f"is not of another program; {', '.join(FOREIGN)} can be converted", file=path)
    return FOREIGN[suffix](Path(path))


FOREIGN: dict[str, Callable[[Path], Machine]] = {
    ".ini": read_linuxcnc,
    ".urdf": read_urdf,
    ".mch": read_vericut,
}
READERS: dict[str, Callable[[Path], Machine]] = {".toml": read_machine_file, **FOREIGN}


def machine_names() -> list[str]:
    """List the machines of the library, sorted."""
    return [p.stem for p in library_files()]


def library_files() -> list[Path]:
    """List the library's files: in the installed package, or beside it in a checkout."""
    package = Path(__file__).parents[2]
    for folder in (package / "machines", package.parent / "machines"):
        if folder.is_dir():
            return sorted(folder.glob("*.toml"))
    return []


def save_machine(machine: Machine, path: str | Path) -> Path:
    """Write a machine to a ``.toml`` file, in one step, that `load_machine` reads back as the same machine.

    Setup and tool length belong to a job and aren't written; mesh files are named relative to the file if
    possible.

    Raises
    ------
    SettingError
        The file can't be written, or has another suffix.
    """
    require_suffix(path, [".toml"], "a machine file")
    return write_atomically(path, machine_text(machine, Path(path).parent))


def machine_text(machine: Machine, folder: Path | None = None) -> str:
    """Write a machine in the format of machine files: TOML in mm, deg, s, W and kg, without defaults.

    Setup and tool length belong to a job and aren't written. Mesh files are named relative to a folder;
    without one by their absolute path.
    """
    return toml_text(without_defaults(machine_document(machine, folder)))
