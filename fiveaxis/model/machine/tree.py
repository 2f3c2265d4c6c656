"""Reading the XML of simulation files, and turning their tree of links into the tables of a machine file.

A URDF and a Vericut machine both state each link's frame in that of its parent, and the line in which it
moves. The chain is the path from the workpiece to the tool; what hangs beside it is left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fiveaxis.base import MEGABYTE, Array, FigureError, MachineError, inverse_transform, product, read_input
from fiveaxis.model.machine.building import UNSETTLED, build_machine
from fiveaxis.model.machine.chain import UNIT_DIRECTION
from fiveaxis.model.machine.code import AXIS_ORDER, DIGITS
from fiveaxis.model.machine.figures import ROTARY, Table, direction_numbers, neat
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tables import MachineFile

# cos of the angle between an axis and its letter's direction below which they don't belong together.
RELATED = 0.5
# Digits of mm that are kept: rounded frames leave more.
DECIMALS = 9

# Simulation files have pictures and meshes in them.
MOST_BYTES = 20 * MEGABYTE
# km-long machines and numbers that overflow when they are squared are faults of the file.
LARGEST = 1e6

SIDES = ("workpiece", "tool")


def read_xml(path: Path, root: str) -> ElementTree.Element:
    """Read an XML file whose root element has a tag.

    `MachineError` if it can't be read, isn't XML, declares entities, or has another root element.
    """
    content = read_input(path, MOST_BYTES, MachineError)
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MachineError(
            "declares a document type or entities, which no machine needs; remove them", file=path
        )
    try:
        element = ElementTree.fromstring(content)
    except (ElementTree.ParseError, LookupError, ValueError) as fault:
        found = re.search(r"line (\d+)", str(fault))
        raise MachineError(
            f"isn't XML: {fault}", file=path, line=None if found is None else int(found[1])
        ) from None
    if element.tag != root:
        raise MachineError(f"has the root element <{element.tag}>; <{root}> is expected", file=path)
    return element


def as_number(text: str) -> float | None:
    """Read a number; None if it isn't one that a machine has."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and abs(number) <= LARGEST else None


@dataclass(frozen=True)
class Link:
    """A link, and the joint by which it hangs on its parent.

    Parameters
    ----------
    name : unique
    parent : name of the link on which it hangs; None for the root
    placed : (4, 4), mm, its frame in the parent's with every axis at 0
    axis : (3,), direction of its motion in its own frame; None where it is fixed
    rotary : whether it turns about that direction through its own origin
    letter : of the axis, where the file states one; otherwise the nearest direction's
    low, high : mm or rad; None where there is no end
    max_speed : mm/s or rad/s; None where unknown
    label : what the file calls the axis
    line : of the file; None where unknown
    """

    name: str
    parent: str | None
    placed: Array
    axis: Array | None = None
    rotary: bool = False
    letter: str | None = None
    low: float | None = None
    high: float | None = None
    max_speed: float | None = None
    label: str = ""
    line: int | None = None


@dataclass(frozen=True)
class Source:
    """What a tree was read from, and how it is to be understood.

    Parameters
    ----------
    file : the file
    workpiece, tool : links at the ends of the chain
    beds : names of the link that stands still, the first between workpiece and tool; without one it is the
        link where their branches meet
    table_motion : whether a value moves the link itself on the workpiece's side, too; otherwise it moves the
        tool relative to the workpiece on both sides
    doubt : why the sense of the table's axes is an assumption; empty where the file states it
    """

    file: Path
    workpiece: str
    tool: str
    beds: tuple[str, ...]
    table_motion: bool
    doubt: str = ""


def build_from_tree(links: Sequence[Link], source: Source, title: str) -> Machine:
    """Build the machine of a tree of links, in the frame of the workpiece's link with every axis at 0.

    `MachineError` with the file: a link hangs on none or on itself, there is no path, an axis doesn't fit its
    letter or has that of another one.
    """
    description = f"{title}: read from {source.file.name}; no powers, no masses"
    tables = {"name": source.file.stem, "description": description} | _tables(links, source)
    try:
        return build_machine(MachineFile.model_validate(tables), source.file.parent)
    except FigureError as fault:
        raise _fault(source, fault.message) from None


def _tables(links: Sequence[Link], source: Source) -> Table:
    known = {link.name: link for link in links}
    up, down = (_line_of(known, name, source) for name in (source.workpiece, source.tool))
    if up[-1] is not down[-1]:
        raise _fault(source, f"{source.workpiece!r} and {source.tool!r} hang on different roots; join them")
    shared = sum(one is other for one, other in zip(reversed(up), reversed(down), strict=False))
    branch, rest = up[: len(up) - shared], down[: len(down) - shared][::-1]
    # The links from the workpiece to the tool; joint i is between the links i and i + 1.
    path = [*branch, up[len(up) - shared], *rest]
    joints = [*branch, *rest]
    names = [link.name for link in path]
    bed = next((name for name in source.beds if name in names), names[len(branch)])
    to_workpiece = inverse_transform(_frame(known, source.workpiece, source))
    axes: Table = {}
    for i, link in enumerate(joints):
        if link.axis is not None:
            frame = product(to_workpiece, _frame(known, link.name, source))
            sign = -1.0 if source.table_motion and i < len(branch) else 1.0
            letter, table = _axis(link, product(sign * frame[:3, :3], link.axis), frame, source)
            if letter in axes:
                raise _fault(source, f"{link.name!r} is a second axis {letter}", link)
            axes[letter] = {"carries": "workpiece" if i < names.index(bed) else "tool"} | table
    home, standing = (product(to_workpiece, _frame(known, name, source)) for name in (source.tool, bed))
    document = _document(axes, home, standing, source)
    if bed not in source.beds:
        note = f"no link is named as the bed: {bed!r} is taken, where the branches meet"
        document["structure"] = {"source": source.file.name, "assumed": True, "note": note}
    return document


def _document(axes: Table, home: Array, bed: Array, source: Source) -> Table:
    """Put code, spindle and the upward direction before the axes, which are in the chain's order."""
    sides = {side: "".join(DIGITS[c] for c in axes if axes[c]["carries"] == side) for side in SIDES}
    cited = {"source": source.file.name}
    document: Table = {"code": "0".join(sides.values()), "structure": cited}
    document["spindle"] = {"point": _point(home), "direction": direction_numbers(home[:3, 2])} | cited
    if not np.allclose(bed[:3, 2], (0.0, 0.0, 1.0), rtol=0.0, atol=1e-9):
        note = f"z of {source.file.name}'s bed; which direction is up isn't stated"
        document["vertical"] = {"direction": direction_numbers(bed[:3, 2]), "assumed": True, "note": note}
    for letter, table in axes.items():
        if source.doubt and table["carries"] == "workpiece":
            if "limits" in table:
                table["limits"] |= {"assumed": True, "note": source.doubt}
            if letter in ROTARY:
                table["reversed"] = UNSETTLED
    return document | {"axes": {c: axes[c] for c in AXIS_ORDER if c in axes}}


def _line_of(known: Mapping[str, Link], name: str, source: Source) -> list[Link]:
    """List a link, its parent and so on to the root."""
    if name not in known:
        raise _fault(source, f"has no link {name!r}; it has {', '.join(known)}")
    line = [known[name]]
    while (parent := line[-1].parent) is not None:
        if parent not in known:
            raise _fault(source, f"{line[-1].name!r} hangs on {parent!r}, which isn't there", line[-1])
        if len(line) > len(known):
            raise _fault(source, f"{name!r} hangs on itself, by way of {parent!r}", line[-1])
        line.append(known[parent])
    return line


def _frame(known: Mapping[str, Link], name: str, source: Source) -> Array:
    """Compute a link's frame in the root's, (4, 4) mm, with every axis at 0."""
    frame = np.eye(4)
    for link in _line_of(known, name, source):
        frame = product(link.placed, frame)
    return frame


def _axis(link: Link, direction: Array, frame: Array, source: Source) -> tuple[str, Table]:
    """Make the table of an axis; one that points against its letter's direction is `reversed`."""
    letter = link.letter or _nearest(link, direction)
    along = float(product(direction, UNIT_DIRECTION[letter]))
    if (letter in "ABC") is not link.rotary or abs(along) < RELATED:
        motion = "turns" if link.rotary else "moves"
        raise _fault(
            source,
            f"{link.name!r} {motion} along {direction_numbers(direction)}, which isn't axis {letter}",
            link,
        )
    low, high = (link.low, link.high) if along > 0.0 else (_negative(link.high), _negative(link.low))
    unit = "deg" if link.rotary else "mm"
    factor = math.degrees(1.0) if link.rotary else 1.0
    cited = {"source": f"{source.file.name}, {link.label}"}
    table: Table = {"reversed": along < 0.0}
    ends = {"min": low, "max": high}
    if low is not None or high is not None or link.rotary:
        table["limits"] = (
            {k: neat(v * factor) for k, v in ends.items() if v is not None} | {"unit": unit} | cited
        )
    towards = direction_numbers(direction * math.copysign(1.0, along))
    if link.rotary:
        table["line"] = {"direction": towards, "point": _point(frame)} | cited
    elif towards != list(UNIT_DIRECTION[letter]):
        table["line"] = {"direction": towards} | cited
    if link.max_speed is not None:
        table["max_speed"] = {"value": neat(link.max_speed * factor), "unit": f"{unit}/s"} | cited
    return letter, table


def _nearest(link: Link, direction: Array) -> str:
    letters = "ABC" if link.rotary else "XYZ"
    return max(letters, key=lambda letter: abs(float(product(direction, UNIT_DIRECTION[letter]))))


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


def _point(frame: Array) -> list[float]:
    return [neat(round(float(v), DECIMALS) + 0.0) for v in frame[:3, 3]]


def _fault(source: Source, message: str, link: Link | None = None) -> MachineError:
    return MachineError(message, file=source.file, line=None if link is None else link.line)
