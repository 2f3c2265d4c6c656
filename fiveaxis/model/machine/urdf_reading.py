"""Reading a machine from URDF, as `fiveaxis urdf` or another program writes it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fiveaxis.base import Array, MachineError, kept_by_file, product, rotation_matrix
from fiveaxis.model.machine.code import LETTERS
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tree import Link, Source, as_number, build_from_tree, read_xml
from fiveaxis.model.machine.urdf import FAR_LINEAR, FAR_ROTARY, METRE, TOOL, WORKPIECE

MOVING = {"prismatic": False, "revolute": True, "continuous": True}
# Names of the link that stands still, in the order in which they are looked for.
BEDS = ("bed", "base", "base_link", "world")
LIMIT = ("lower", "upper", "velocity")


@kept_by_file(8)
def read_urdf(path: str | Path) -> Machine:
    """Read a machine from URDF.

    The links ``workpiece`` and ``tool`` are the ends of the chain; the tool lies along −z of its link, whose
    origin is the spindle's gauge point. The bed is ``bed``, ``base``, ``base_link`` or ``world``, or else the
    link where the branches meet. A joint named X, Y, Z, A, B or C is that axis, any other one the axis that
    lies nearest; one that moves against its letter's direction is `reversed`. The machine frame is that of
    ``workpiece``. Masses and shapes aren't read.

    Raises
    ------
    MachineError
        The file can't be read, or has no such chain; the message has the file.
    """
    path = Path(path)
    robot = read_xml(path, "robot")
    links = {
        name: Link(name, None, np.eye(4)) for name in (e.get("name", "") for e in robot.iterfind("link"))
    }
    for element in robot.iterfind("joint"):
        link = _joint(element, path)
        if link.name not in links or link.parent not in links:
            raise MachineError(f"{_name(element)} is between links that aren't all there", file=path)
        if links[link.name].parent is not None:
            raise MachineError(f"link {link.name!r} is the child of two joints", file=path)
        links[link.name] = link
    for end in (WORKPIECE, TOOL):
        if end not in links:
            raise MachineError(
                f"has no link {end!r}; name the link that carries the part 'workpiece', and the one whose "
                "origin is the spindle's gauge point, with z from tip to shank, 'tool'",
                file=path,
            )
    source = Source(path, WORKPIECE, TOOL, BEDS, table_motion=True)
    return build_from_tree(list(links.values()), source, robot.get("name") or path.stem)


def _joint(element: ElementTree.Element, path: Path) -> Link:
    """Make the link that a joint carries."""
    name, kind = element.get("name", ""), element.get("type", "")
    parent, child = (_end(element, end, path) for end in ("parent", "child"))
    link = Link(child, parent, _placed(element.find("origin"), element, path))
    if kind == "fixed":
        return link
    if kind not in MOVING:
        known = ", ".join(("fixed", *MOVING))
        raise MachineError(f"{_name(element)} is of type {kind!r}; axes are {known}", file=path)
    rotary, unit = MOVING[kind], 1.0 if MOVING[kind] else METRE
    along = element.find("axis")
    axis = np.array((1.0, 0.0, 0.0)) if along is None else _triple(along, "xyz", element, path)
    if not np.linalg.norm(axis, axis=-1) > 0.0:
        raise MachineError(f"the axis of {_name(element)} has length 0", file=path)
    limit = element.find("limit")
    figures = {} if limit is None else {key: _number(limit, key, element, path) * unit for key in LIMIT}
    low, high = (figures.get(end, 0.0) for end in ("lower", "upper"))
    if low > high:
        raise MachineError(
            f"{_name(element)}: lower {low:g} is above upper {high:g}; exchange them", file=path
        )
    far = (FAR_ROTARY if rotary else FAR_LINEAR) / 2.0
    stated = kind != "continuous" and low < high
    return replace(
        link,
        axis=axis / np.linalg.norm(axis, axis=-1),
        rotary=rotary,
        label=f"joint {name}",
        letter=name if name in LETTERS.values() else None,
        low=low if stated and low > -far else None,
        high=high if stated and high < far else None,
        max_speed=figures["velocity"] if 0.0 < figures.get("velocity", 0.0) < far else None,
    )


def _placed(origin: ElementTree.Element | None, joint: ElementTree.Element, path: Path) -> Array:
    """Return a frame of URDF: ``Rz(yaw) Ry(pitch) Rx(roll)`` at xyz."""
    frame = np.eye(4)
    if origin is not None:
        roll, pitch, yaw = (float(v) for v in _triple(origin, "rpy", joint, path))
        turns = (((0.0, 0.0, 1.0), yaw), ((0.0, 1.0, 0.0), pitch), ((1.0, 0.0, 0.0), roll))
        for direction, angle in turns:
            frame[:3, :3] = product(frame[:3, :3], rotation_matrix(direction, angle))
        frame[:3, 3] = METRE * _triple(origin, "xyz", joint, path)
    return frame


def _end(joint: ElementTree.Element, end: str, path: Path) -> str:
    element = joint.find(end)
    if element is None or not element.get("link"):
        raise MachineError(f"{_name(joint)} has no {end}", file=path)
    return element.get("link", "")


def _triple(element: ElementTree.Element, key: str, joint: ElementTree.Element, path: Path) -> Array:
    texts = element.get(key, "0 0 0").split()
    numbers = [as_number(text) for text in texts]
    if len(numbers) != 3 or None in numbers:
        raise MachineError(f"{_name(joint)}: {key} = {element.get(key)!r} isn't three numbers", file=path)
    return np.array(numbers, dtype=float)


def _number(element: ElementTree.Element, key: str, joint: ElementTree.Element, path: Path) -> float:
    number = as_number(element.get(key, "0"))
    if number is None:
        raise MachineError(f"{_name(joint)}: {key} = {element.get(key)!r} isn't a number", file=path)
    return number


def _name(joint: ElementTree.Element) -> str:
    return f"joint {joint.get('name')!r}"
