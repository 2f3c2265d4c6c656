"""Reading a machine from a Vericut machine file (``.mch``): the text of version 6 or the XML of version 7.

The files say where each component lies and how it moves. They don't say in which order a component turned
about several axes is turned, which is refused, nor in which sense a table's axis counts, which is marked as
assumed. Rapids and accelerations aren't read: most templates keep those that the program sets by itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fiveaxis.base import Array, MachineError, kept_by_file, read_input, rotation_matrix
from fiveaxis.model.machine.chain import UNIT_DIRECTION
from fiveaxis.model.machine.figures import LINEAR_UNITS
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tree import MOST_BYTES, Link, Source, as_number, build_from_tree, read_xml

UNITS = {"millimeter": LINEAR_UNITS["mm"], "inch": LINEAR_UNITS["inch"]}
# Components of which the part hangs on the first that is there.
PARTS = ("stock", "fixture", "attach", "design")
# Of components that move, in text and in XML -> whether they turn.
MOVING = {"translation": False, "rotation": True, "linear": False, "rotary": True}
TURNS = 1000.0  # deg: limits of an angle beyond this say that there is no stop
DOUBT = (
    "the numbers are in the file, the sense isn't: taken as tool relative to workpiece, as the limits of "
    "published templates show; test each table axis on the machine before relying on its sign"
)


@dataclass(frozen=True)
class _Component:
    """A component as the file states it: lengths in its unit, angles in degrees."""

    name: str
    kind: str
    parent: str
    position: str
    rotation: str
    axis: str
    register: str
    low: str
    high: str
    unlimited: bool
    line: int | None


@kept_by_file(8)
def read_vericut(path: str | Path) -> Machine:
    """Read a machine from a Vericut machine file.

    The machine frame is that of the component on which the part is clamped, with every axis at 0. Bodies
    aren't read: they are in files of their own, beside the template.

    Raises
    ------
    MachineError
        The file can't be read, lacks a component for the part, the tool or the base, turns a component about
        several axes, or has an axis without a letter; the message has the file and, of a text, the line.
    """
    path = Path(path)
    content = read_input(path, MOST_BYTES, MachineError)
    if content.lstrip().startswith(b"<"):
        machine = read_xml(path, "VcMachine")
        unit, components = machine.get("Unit", ""), list(_of_xml(machine))
    else:
        text = content.decode("utf-8", errors="replace")
        if not text.startswith("CGTech Machine"):
            raise MachineError("is no Vericut machine: neither its XML nor its text", file=path)
        found = re.search(r"^UNITS\s+(\w+)", text, re.MULTILINE)
        unit, components = "" if found is None else found[1], list(_of_text(text))
    if unit.lower() not in UNITS:
        raise MachineError(f"has the unit {unit!r}; {' or '.join(UNITS)} is expected", file=path)
    links = [_link(component, UNITS[unit.lower()], path) for component in components]
    kinds: dict[str, str] = {}
    for component in components:
        kinds.setdefault(component.kind, component.name)
    part = next((kinds[kind] for kind in PARTS if kind in kinds), None)
    if part is None or "tool" not in kinds or "base" not in kinds:
        raise MachineError("lacks a component of type Base, Tool, or Stock, Fixture or Attach", file=path)
    names = [link.name for link in links]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MachineError(f"has two components {twice!r}", file=path)
    source = Source(path, part, kinds["tool"], (kinds["base"],), table_motion=False, doubt=DOUBT)
    return build_from_tree(links, source, "Vericut machine")


def _of_xml(machine: ElementTree.Element) -> Iterator[_Component]:
    for element in machine.iter("Component"):
        link, record = element.find("Link"), element.find("Link/TlRecord")
        stated: Mapping[str, str] = {} if record is None else record.attrib
        yield _Component(
            name=element.get("Name", ""),
            kind=element.get("Type", "").lower(),
            parent=(element.findtext("Attach") or "").strip(),
            position=_joined(element.find("Position"), "XYZ"),
            rotation=_joined(element.find("Rotation"), "IJK"),
            axis="" if link is None else link.get("Axis", ""),
            register="" if link is None else link.get("Register", ""),
            low=stated.get("TlMin", ""),
            high=stated.get("TlMax", ""),
            unlimited=stated.get("TlIgnore", "off") == "on",
            line=None,
        )


def _joined(element: ElementTree.Element | None, keys: str) -> str:
    return "0,0,0" if element is None else ",".join(element.get(key, "0") for key in keys)


def _of_text(text: str) -> Iterator[_Component]:
    """Split the text into components; what is nested in one, its shapes, has frames of its own."""
    lines = text.splitlines()
    starts = [i for i, line in enumerate(lines) if re.match(r"\s*(?:PRE60_)?COMPONENT\b", line)]
    for start, end in pairwise([*starts, len(lines)]):
        own = "\n".join(lines[start:end]).partition("ASSEMBLY")[0]
        frame = r"ORIGIN\s*\(([^)]*)\)\s*ROTATION\s*\(([^)]*)\)"
        yield _Component(
            name=_word(r'COMPONENT\s+"([^"]*)"', own),
            kind=_word(r'COMPTYPE\s+"([^"]*)"', own).lower(),
            parent=_word(r'CONNECT\s+"([^"]*)"', own),
            position=_word(frame, own) or "0,0,0",
            rotation=_word(frame, own, 2) or "0,0,0",
            axis=_word(r"\bAXIS\s+(\w+)", own),
            register=_word(r'REGISTER\s+"([^"]*)"', own),
            # Version 6.0 and later ones.
            low=_word(r"\b(?:MIN_LIMIT|TL_MIN)\s+(\S+)", own),
            high=_word(r"\b(?:MAX_LIMIT|TL_MAX)\s+(\S+)", own),
            unlimited=_word(r"\b(?:IGNORE_LIMIT|TL_IGNORE)\s+(\w+)", own) == "TRUE",
            line=start + 1,
        )


def _word(pattern: str, text: str, group: int = 1) -> str:
    found = re.search(pattern, text)
    return "" if found is None else found[group]


def _link(component: _Component, unit: float, path: Path) -> Link:
    link = Link(component.name, component.parent or None, _placed(component, unit, path), line=component.line)
    if component.kind not in MOVING:
        return link
    rotary = MOVING[component.kind]
    axis, register = component.axis.upper(), component.register.upper()
    if axis not in UNIT_DIRECTION or axis not in "XYZ":
        raise _fault(component, f"moves along {component.axis!r}; X, Y or Z is expected", path)
    if register not in (tuple("ABC") if rotary else tuple("XYZ")):
        kinds = "A, B or C" if rotary else "X, Y or Z"
        raise _fault(component, f"has the register {component.register!r}; {kinds} is expected", path)
    low, high = _ends(component, rotary, unit, path)
    direction = np.array(UNIT_DIRECTION[axis])
    label = f"component {component.name}"
    return replace(link, axis=direction, rotary=rotary, letter=register, low=low, high=high, label=label)


def _ends(component: _Component, rotary: bool, unit: float, path: Path) -> tuple[float | None, float | None]:
    """Return the limits, mm or rad; None for those that are no stop."""
    if component.unlimited or not (component.low and component.high):
        return None, None
    low, high = (as_number(text) for text in (component.low, component.high))
    if low is None or high is None:
        raise _fault(component, f"has the limits {component.low} … {component.high}, not two numbers", path)
    if low == high == 0.0 or (rotary and high - low > 2.0 * TURNS):
        return None, None
    if low >= high:
        raise _fault(component, f"has the limits {low:g} … {high:g}; exchange them", path)
    factor = math.radians(1.0) if rotary else unit
    return low * factor, high * factor


def _placed(component: _Component, unit: float, path: Path) -> Array:
    frame = np.eye(4)
    position, angles = (_triple(component, text, path) for text in (component.position, component.rotation))
    if np.count_nonzero(angles) > 1:
        shown = ", ".join(f"{v:g}" for v in angles)
        message = f"is turned by ({shown}) deg; in which order isn't stated, so only one angle is read"
        raise _fault(component, message, path)
    frame[:3, 3] = unit * position
    for axis, angle in zip(np.eye(3), angles, strict=True):
        if angle:
            frame[:3, :3] = rotation_matrix(axis, math.radians(angle))
    return frame


def _triple(component: _Component, text: str, path: Path) -> Array:
    numbers = [as_number(part) for part in text.split(",")]
    if len(numbers) != 3 or None in numbers:
        raise _fault(component, f"has the frame ({text}), not three numbers", path)
    return np.array(numbers, dtype=float)


def _fault(component: _Component, message: str, path: Path) -> MachineError:
    return MachineError(f"component {component.name!r} {message}", file=path, line=component.line)
