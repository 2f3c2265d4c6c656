"""Parsing of LinuxCNC's configuration files: sections and keys of an ini, and values set by HAL commands."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from fiveaxis.base import MachineError, is_file, read_content

MAX_DEPTH = 16  # of #INCLUDE, as in LinuxCNC
TRUE, FALSE = ("1", "true", "yes"), ("0", "false", "no")
# Why `Configuration.find` passes over an entry.
UNFOUND = "LinuxCNC 2.9 reads capitals as written, and of sections with one name the first alone"
ARROWS = ("=>", "<=", "<=>")  # decoration in a `net` command


@dataclass(frozen=True)
class Entry:
    """A value, after ``=`` or set by a HAL command, and where it stands.

    Parameters
    ----------
    name : as it is found in the file: ``[AXIS_X] MIN_LIMIT``, ``sets :y-offset 20``
    line : from 1
    """

    value: str
    name: str
    file: Path
    line: int

    def fault(self, message: str) -> MachineError:
        """Make an error about this entry."""
        return MachineError(message, file=self.file, line=self.line)

    def number(self) -> float:
        """Read the value as a number, which a comment may follow; `MachineError` if it isn't finite."""
        text = re.split(r"\s[#;]", self.value)[0].strip()
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.fault(f"{self.name}: {text!r} must be a finite number")
        return value

    def flag(self) -> bool:
        """Read the value as a bit; `MachineError` if it is neither true nor false."""
        if self.value.lower() not in TRUE + FALSE:
            raise self.fault(f"{self.name}: {self.value!r} must be 0 or 1")
        return self.value.lower() in TRUE


@dataclass(frozen=True)
class Configuration:
    """An ini: its entries by section and key, in the file's order."""

    file: Path
    entries: tuple[tuple[str, str, Entry], ...]

    def all(self, section: str, key: str) -> list[Entry]:
        """List the entries of a key that may be repeated."""
        return [entry for s, k, entry in self.entries if (s, k) == (section, key)]

    def find(self, section: str, key: str) -> Entry | None:
        """Find the entry of a key: the first, as in LinuxCNC."""
        return next(iter(self.all(section, key)), None)

    def passed_over(self, section: str, *keys: str) -> list[Entry]:
        """List the entries that look like a section's keys and that LinuxCNC doesn't find there."""
        alike = ((s, k, e) for s, k, e in self.entries if s.strip("# ").upper() == section)
        return [e for s, k, e in alike if k.upper() in keys and (s != section or k not in keys)]

    def need(self, section: str, key: str, example: str) -> Entry:
        """Find the entry of a required key; `MachineError` if it is missing."""
        found = self.find(section, key)
        if found is None:
            unfound = self.passed_over(section, key)
            near = f" (line {unfound[0].line} isn't found: {UNFOUND})" if unfound else ""
            raise MachineError(
                f"has no [{section}] {key}{near}, for example {example}; write it, as in configurations of "
                "LinuxCNC 2.8 or later",
                file=self.file,
            )
        return found


@dataclass(frozen=True)
class Hal:
    """Values set by HAL commands before the control runs.

    Parameters
    ----------
    pins : pin -> the ``setp`` that sets its value
    signals : signal -> the ``sets`` that sets its value
    nets : pin -> the ``net`` that connects it; the entry's value is the signal
    unread : the configuration's own HAL files that weren't read and might set more
    """

    pins: dict[str, Entry] = field(default_factory=dict)
    signals: dict[str, Entry] = field(default_factory=dict)
    nets: dict[str, Entry] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)

    def find(self, pin: str) -> Entry | None:
        """Find the entry that sets a pin's value; None if the pin keeps its module's default.

        `MachineError` if it is connected to a signal that no command sets: its value exists only while the
        control runs.
        """
        net = self.nets.get(pin)
        if net is None:
            return self.pins.get(pin)
        if net.value not in self.signals:
            raise net.fault(
                f"{pin} takes its value from the signal {net.value} while the control runs; in a copy of the "
                f"configuration, replace this by the value that it has: setp {pin} VALUE"
            )
        return self.signals[net.value]


def read_configuration(path: Path) -> Configuration:
    """Read an ini with the files it includes; `MachineError` for a line that isn't understood."""
    return Configuration(path, tuple(_entries(path)))


def read_hal(configuration: Configuration) -> Hal:
    """Collect the values set by an ini's HAL commands and by its HAL files in the same folder.

    Tcl scripts and missing files are skipped: often only the ini is at hand. HAL files of LinuxCNC's library
    (``LIB:``) set nothing that is specific to one machine.
    """
    hal = Hal()
    folder = configuration.file.parent
    for key in ("HALFILE", "HALCMD", "POSTGUI_HALFILE"):  # in the order in which LinuxCNC runs them
        for entry in configuration.all("HAL", key):
            if key == "HALCMD":
                _run(entry, hal, configuration)
                continue
            name = (entry.value.split() or [""])[0]  # arguments of a script follow it
            file = folder / name
            if file.suffix == ".hal" and is_file(file):
                for line, text in _lines(file):
                    _run(Entry(text, text, file, line), hal, configuration)
            elif not name.startswith("LIB:"):
                hal.unread.append(name)
    return hal


def _entries(path: Path) -> Iterator[tuple[str, str, Entry]]:
    """List the entries of an ini's sections; the name of a section that its file has had gets a ``#``.

    `Configuration.find` then finds what LinuxCNC 2.9 does (src/libnml/inifile/inifile.cc, `IniFile::Find`):
    names in their own case, and of sections with one name the first alone.
    """
    section, seen = "", set[str]()
    for file, line, text in _flat(path):
        header = re.match(r"\[(.+?)\]", text)
        if header:
            section = f"#{header[1]}" if header[1] in seen else header[1]
            seen.add(section)
            continue
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key:
            message = f"{text!r} is neither [SECTION] nor KEY = value; begin a comment with #"
            raise MachineError(message, file=file, line=line)
        key = key.split()[0]
        yield section, key, Entry(value, f"[{section.removeprefix('#')}] {key}", file, line)


def _flat(path: Path, depth: int = 0) -> Iterator[tuple[Path, int, str]]:
    """List the lines of an ini with those of the files that it includes in their places."""
    for line, text in _lines(path, includes=True):
        included = re.match(r"#INCLUDE\s+(.+)", text)
        if included is None:
            yield path, line, text
            continue
        if depth == MAX_DEPTH:
            raise MachineError(f"#INCLUDE is nested more than {MAX_DEPTH} deep", file=path, line=line)
        yield from _flat(path.parent / included[1].strip(), depth + 1)


def _lines(path: Path, includes: bool = False) -> Iterator[tuple[int, str]]:
    r"""List the lines other than comments, with their numbers; ``\`` at the end of a line continues it."""
    text = read_content(path, error=MachineError).decode("utf-8-sig", errors="replace")
    begun, start = "", 0
    for number, line in enumerate(text.splitlines(), start=1):
        start = start if begun else number
        begun += line.strip()
        if begun.endswith("\\"):
            begun = begun[:-1].rstrip() + " "
            continue
        content, begun = begun.strip(), ""
        if content and (content[0] not in "#;" or (includes and content.startswith("#INCLUDE"))):
            yield start, content


def _run(command: Entry, hal: Hal, configuration: Configuration) -> None:
    """Record the value that a HAL command sets, or the pins that it connects; ignore other commands."""
    words = [w for w in re.split(r"\s#", command.value)[0].split() if w not in ARROWS]
    if words[:1] == ["source"]:
        hal.unread.append(" ".join(words[1:]))
    if len(words) < 3:
        return
    verb, name, *rest = words
    if verb in ("setp", "sets"):
        value = _substitute(rest[0], configuration)
        values = hal.pins if verb == "setp" else hal.signals
        values[name] = replace(command, value=value, name=" ".join(words))
    elif verb == "net":
        hal.nets.update(dict.fromkeys(rest, replace(command, value=name, name=" ".join(words))))


def _substitute(word: str, configuration: Configuration) -> str:
    """Replace ``[SECTION]KEY`` or ``[SECTION](KEY)`` by the ini's value, as HAL does."""
    found = re.fullmatch(r"\[(\w+)\]\(?(\w+)\)?", word)
    entry = None if found is None else configuration.find(found[1], found[2])
    return word if entry is None else entry.value
