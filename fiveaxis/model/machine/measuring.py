"""What to measure on a machine whose pivots aren't known, in words and in a drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.model.machine.model import Machine


@dataclass(frozen=True)
class Dimension:
    """A length to measure with every axis at 0: its letter in the drawing, its key in the file, its text."""

    name: str
    key: str
    text: str

    def __str__(self) -> str:
        return f"{self.name}: {self.text} ({self.key})"


def pivots_unknown(machine: Machine, *, or_assumed: bool = True) -> tuple[str, ...]:
    """List the rotary axes, in chain order, for whose lines no point is stated.

    Whether a point that is assumed, without a source, counts as not stated is `or_assumed`.
    """
    points = [p for p in machine.provenance if "point" in p.value]
    stated = {p.figure for p in points if not (or_assumed and p.assumed and not p.source)}
    return tuple(c for c in machine.rotaries if f"{c} line" not in stated)


def gauge_unknown(machine: Machine) -> bool:
    """Tell whether a rotary axis carries the tool and nobody stated where the gauge point is."""
    return bool(_on_head(machine)) and not any(p.figure == "spindle" for p in machine.provenance)


def dimensions(machine: Machine) -> tuple[Dimension, ...]:
    """List what to measure, with every axis at 0: none where every pivot is stated.

    Zero is the centre of the table's surface if a rotary axis carries the table, otherwise the gauge point.
    """
    unknown = pivots_unknown(machine)
    found = [*_table(machine, unknown), *_head(machine, unknown)] if unknown else []
    stated = any(p.figure == "spindle" for p in machine.provenance)
    if _on_table(machine) and not stated and (unknown or gauge_unknown(machine)):
        for i, letter in enumerate("XYZ"):
            to = (
                "height of the gauge point above zero"
                if letter == "Z"
                else f"the gauge point from zero, {letter}"
            )
            found.append((f"spindle.point[{i}]", to))
    return tuple(Dimension("abcdefghijkl"[n], key, text) for n, (key, text) in enumerate(found))


def zero_of(machine: Machine) -> str:
    """Say where the zero of the machine frame is chosen."""
    table = _on_table(machine)
    if not table:
        return "the spindle's gauge point"
    return (
        f"the centre of the table's surface, on {table[0]}'s line"
        if _upright(machine, table[0])
        else f"a point on {table[0]}'s line"
    )


def draw(machine: Machine) -> str:
    """Draw the chain from the side, in plain characters, with the dimensions to measure."""
    names = {d.key: d.name for d in dimensions(machine)}
    return "\n".join([*_draw_head(machine, names), "", *_draw_table(machine, names)])


def _on_table(machine: Machine) -> list[str]:
    """List the rotary axes that carry the workpiece, from the workpiece."""
    return [c for c in machine.code.table if c in "ABC"]


def _on_head(machine: Machine) -> list[str]:
    """List the rotary axes that carry the tool, from the tool."""
    return [c for c in reversed(machine.code.head) if c in "ABC"]


def _table(machine: Machine, unknown: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the coordinates of the lines of a table's axes; the first passes through zero by choice."""
    first, *further = _on_table(machine) or [""]
    for letter in further:
        for i in _across(machine, letter) if letter in unknown else ():
            height = f"height of {letter}'s line above zero, negative below"
            aside = f"{letter}'s line from {first}'s line along {'XYZ'[i]}, with its sign"
            yield f"axes.{letter}.line.point[{i}]", height if i == 2 else aside


def _head(machine: Machine, unknown: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the coordinates of the lines of a head's axes, from the gauge point."""
    for letter in _on_head(machine):
        for i in _across(machine, letter) if letter in unknown else ():
            height = f"height of {letter}'s line above the gauge point, the pivot length"
            aside = f"{letter}'s line from the spindle's axis along {'XYZ'[i]}, with its sign"
            more = f", plus spindle.point[{i}]" if _on_table(machine) else ""
            yield f"axes.{letter}.line.point[{i}]{more}", height if i == 2 else aside


def _upright(machine: Machine, letter: str) -> bool:
    return 2 not in _across(machine, letter)


def _across(machine: Machine, letter: str) -> list[int]:
    """List the coordinates that place an axis's line: all but the one along it."""
    line = next(j.line for j in machine.chain.seen_from(machine.machine_frame).joints if j.letter == letter)
    along = int(np.argmax(np.abs(line.direction)))
    return [i for i in range(3) if i != along]


def _draw_head(machine: Machine, names: dict[str, str]) -> list[str]:
    letters = _on_head(machine)
    lines = []
    for turn in reversed([c for c in letters if _upright(machine, c)]):
        lines += [f"            :             {turn}'s line{_aside(turn, names)}", "        +---:---+"]
    lines.append("        |       |         spindle")
    tilts = [c for c in letters if not _upright(machine, c)]
    for tilt in reversed(tilts):
        lines.append(f"        |   o - - - - -+- {tilt}'s line{_aside(tilt, names)}")
        lines.append(f"        |       |      {_height(tilt, names)}")
    lines.append(f"        +-------+ - - -{'+' if tilts else '-'}- gauge point{_aside('spindle', names)}")
    return lines


def _draw_table(machine: Machine, names: dict[str, str]) -> list[str]:
    letters = _on_table(machine)
    if not letters:
        return ["    ================      table"]
    lines = []
    tilts = [c for c in letters[1:] if not _upright(machine, c)]
    for tilt in reversed(tilts):
        lines.append(f"              o - - - -+- {tilt}'s line{_aside(tilt, names)}")
        lines.append(f"                       {_height(tilt, names)}")
    upright = _upright(machine, letters[0])
    surface = "the table's surface; zero is its centre" if upright else f"zero, on {letters[0]}'s line"
    lines.append(f"    ====={'===+===' if upright else '===o==='}===== -{'+' if tilts else '-'}- {surface}")
    for turn in [c for c in letters if _upright(machine, c)]:
        lines.append(f"            :             {turn}'s line{_aside(turn, names)}")
    return lines


def _height(letter: str, names: dict[str, str]) -> str:
    return next((name for key, name in names.items() if key.startswith(f"axes.{letter}.line.point[2]")), "|")


def _aside(owner: str, names: dict[str, str]) -> str:
    """Name the dimensions of an axis or the spindle that the drawing only points at."""
    start = "spindle.point" if owner == "spindle" else f"axes.{owner}.line.point"
    drawn = () if owner == "spindle" else (f"{start}[2]",)
    beside = [name for key, name in names.items() if key.startswith(start) and not key.startswith(drawn)]
    return f" ({', '.join(beside)})" if beside else ""
