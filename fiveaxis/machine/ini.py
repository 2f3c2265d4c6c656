"""LinuxCNC's configuration files as text: sections and keys of an ini, and what its HAL commands set."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fiveaxis.errors import MachineError

MAX_DEPTH = 16  # of #INCLUDE, as in LinuxCNC
TRUE, FALSE = ("1", "true", "yes"), ("0", "false", "no")
ARROWS = ("=>", "<=", "<=>")  # decoration in a `net` command


@dataclass(frozen=True)
class Entry:
    """A value, and where it stands.

    Parameters
    ----------
    value : text after ``=``, or what a HAL command sets
    name : as people look for it: ``[AXIS_X] MIN_LIMIT``, ``sets :y-offset 20``
    file, line : counted from 1
    """

    value: str
    name: str
    file: Path
    line: int

    def fault(self, message: str) -> MachineError:
        """Make an error about this entry."""
        return MachineError(message, file=self.file, line=self.line)

    def number(self) -> float:
        """Read the value as a number; a comment may stand behind it.

        Raises
        ------
        MachineError
            Not a finite number.
        """
        text = re.split(r"\s[#;]", self.value)[0].strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.fault(f"{self.name}: {text!r} must be a finite number")
        return value

    def flag(self) -> bool:
        """Read the value as a bit.

        Raises
        ------
        MachineError
            Neither true nor false.
        """
        if self.value.lower() not in TRUE + FALSE:
            raise self.fault(f"{self.name}: {self.value!r} must be 0 or 1")
        return self.value.lower() in TRUE


@dataclass(frozen=True)
class Configuration:
    """An ini: its entries by section and key, in upper case, in the order in which they stand."""

    file: Path
    entries: tuple[tuple[str, str, Entry], ...]

    def all(self, section: str, key: str) -> list[Entry]:
        """List the entries of a key that may be repeated."""
        return [entry for s, k, entry in self.entries if (s, k) == (section, key)]

    def find(self, section: str, key: str) -> Entry | None:
        """Find the entry of a key; of several LinuxCNC takes the first."""
        return next(iter(self.all(section, key)), None)

    def need(self, section: str, key: str, example: str) -> Entry:
        """Find the entry of a key that must be there.

        Raises
        ------
        MachineError
            It isn't.
        """
        found = self.find(section, key)
        if found is None:
            raise MachineError(
                f"has no [{section}] {key} (for example {example}), as a configuration of LinuxCNC 2.8 or "
                "later has",
                file=self.file,
            )
        return found


@dataclass(frozen=True)
class Hal:
    """What HAL commands set before the control runs.

    Parameters
    ----------
    pins : pin -> the ``setp`` that gives its value
    signals : signal -> the ``sets`` that gives its value
    nets : pin -> the ``net`` that connects it; the entry's value is the signal
    unread : HAL files of the configuration's own that might set more
    """

    pins: dict[str, Entry] = field(default_factory=dict)
    signals: dict[str, Entry] = field(default_factory=dict)
    nets: dict[str, Entry] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)

    def find(self, pin: str) -> Entry | None:
        """Find what gives a pin its value; None where nothing does and it keeps its module's default.

        Raises
        ------
        MachineError
            The pin is connected to a signal that no command sets: its value exists only while the control
            runs.
        """
        net = self.nets.get(pin)
        if net is None:
            return self.pins.get(pin)
        if net.value not in self.signals:
            raise net.fault(
                f"{pin} takes its value from the signal {net.value} while the control runs; in a copy of the "
                f"configuration, write the value that it has in place of this: setp {pin} VALUE"
            )
        return self.signals[net.value]


def read_configuration(path: Path) -> Configuration:
    """Read an ini with the files it includes.

    Raises
    ------
    MachineError
        A file can't be read; a line that is neither section, key nor comment.
    """
    return Configuration(path, tuple(_entries(path)))


def read_hal(configuration: Configuration) -> Hal:
    """Collect what the HAL commands of an ini set: those of its HAL files that lie beside it, and its own.

    Tcl scripts aren't read, nor are files that aren't there: an ini is often all that one has. HAL files of
    LinuxCNC's library (``LIB:``) set nothing that belongs to one machine.
    """
    hal = Hal()
    folder = configuration.file.parent
    for key in ("HALFILE", "HALCMD", "POSTGUI_HALFILE"):  # in the order in which LinuxCNC runs them
        for entry in configuration.all("HAL", key):
            if key == "HALCMD":
                _run(entry, hal, configuration)
                continue
            name = (entry.value.split() or [""])[0]  # arguments of a script stand behind it
            file = folder / name
            if file.suffix == ".hal" and file.is_file():
                for line, text in _lines(file):
                    _run(Entry(text, text, file, line), hal, configuration)
            elif not name.startswith("LIB:"):
                hal.unread.append(name)
    return hal


def _entries(path: Path, depth: int = 0) -> Iterator[tuple[str, str, Entry]]:
    section = ""
    for line, text in _lines(path, includes=True):
        included = re.match(r"#INCLUDE\s+(.+)", text)
        header = re.match(r"\[\s*(.+?)\s*\]", text)
        if included:
            if depth == MAX_DEPTH:
                raise MachineError(f"#INCLUDE is nested more than {MAX_DEPTH} deep", file=path, line=line)
            yield from _entries(path.parent / included[1].strip(), depth + 1)
        elif header:
            section = header[1].upper()
        else:
            key, equals, value = (part.strip() for part in text.partition("="))
            if not equals or not key:
                message = f"{text!r} is neither [SECTION] nor KEY = value; begin a comment with #"
                raise MachineError(message, file=path, line=line)
            yield section, key.upper(), Entry(value, f"[{section}] {key.upper()}", path, line)


def _lines(path: Path, includes: bool = False) -> Iterator[tuple[int, str]]:
    r"""List the lines that say something, with their numbers; ``\`` at the end of a line continues it."""
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as fault:
        raise MachineError(f"can't be read: {fault.strerror or fault}", file=path) from None
    begun, start = "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        start = start if begun else number
        begun += line.strip()
        if begun.endswith("\\"):
            begun = begun[:-1].rstrip() + " "
            continue
        said, begun = begun.strip(), ""
        if said and (said[0] not in "#;" or (includes and said.startswith("#INCLUDE"))):
            yield start, said


def _run(command: Entry, hal: Hal, configuration: Configuration) -> None:
    """Take from a HAL command what it sets or connects; commands that do neither don't matter here."""
    words = [w for w in re.split(r"\s#", command.value)[0].split() if w not in ARROWS]
    if words[:1] == ["source"]:
        hal.unread.append(" ".join(words[1:]))
    if len(words) < 3:
        return
    verb, name, *rest = words
    said = " ".join(words)
    if verb in ("setp", "sets"):
        value = _substituted(rest[0], configuration)
        (hal.pins if verb == "setp" else hal.signals)[name] = Entry(value, said, command.file, command.line)
    elif verb == "net":
        hal.nets.update({pin: Entry(name, said, command.file, command.line) for pin in rest})


def _substituted(word: str, configuration: Configuration) -> str:
    """Replace ``[SECTION]KEY`` or ``[SECTION](KEY)`` by the ini's value, as HAL does."""
    found = re.fullmatch(r"\[(\w+)\]\(?(\w+)\)?", word)
    entry = None if found is None else configuration.find(found[1].upper(), found[2].upper())
    return word if entry is None else entry.value
