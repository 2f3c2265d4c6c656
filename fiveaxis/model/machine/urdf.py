"""Writing a machine as URDF, the robot description that other kinematics and collision programs read.

Lengths are in metres and angles in radians, as URDF requires; joint values are the machine's axis values,
tool relative to workpiece, also on the table side.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from fiveaxis.base import Array, MachineError, inverse_transform, product, translation
from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.bodies import Body, Box, Cylinder, Shape
from fiveaxis.model.machine.chain import Joint
from fiveaxis.model.machine.code import BED

if TYPE_CHECKING:
    from fiveaxis.model.machine.model import Machine

WORKPIECE, TOOL = "workpiece", "tool"
ROOTS = (WORKPIECE, BED)
METRE = 1000.0  # mm
# URDF requires both ends of a range: a missing one is this far from the other, or from 0, more than any
# machine travels. An endless rotary axis isn't `continuous` either: readers keep such a joint as a point on
# the circle and lose its turn count, which is part of an axis value. A speed that isn't stated goes so far in
# a second: readers built on urdfdom (pinocchio, ROS) refuse a limit without a speed or with an infinite one,
# and planners take 0 for "can't move".
FAR_LINEAR, FAR_ROTARY = 100.0 * METRE, 1000.0 * 2.0 * math.pi
# N or N m, more than any drive has: URDF requires an effort, too.
EFFORT = 1e6
# kg and kg m2 of a moving link, which MuJoCo and other simulators refuse without: a ball of 100 mm.
MASS, INERTIA = 1.0, 0.001
DECIMALS = 15  # of metres, radians and directions; further digits are rounding that differs by platform


@dataclass(frozen=True)
class _Branching:
    """A joint in the tree: its parent and child links, and sign −1 if its axis is reversed."""

    joint: Joint
    parent: str
    child: str
    sign: float


def write_urdf(machine: Machine, root: str) -> str:
    """Describe a machine in URDF; see `Machine.to_urdf`.

    Every link's frame is parallel to the machine frame at home and lies on the line of the joint before it,
    so joints have pure offsets, and their directions are all that differs between machines.
    """
    if root not in ROOTS:
        raise MachineError(f"no URDF tree with root {root!r}; write {' or '.join(map(repr, ROOTS))}")
    chain, code, bodies = machine.chain.seen_from(machine.machine_frame), machine.code, machine.bodies
    links = code.links
    tree = _tree(chain.joints, links, len(code.table) if root == BED else 0)
    origins = _origins(links, tree, root)
    at_first, at_last = (translation(-origins[link]) for link in (links[0], links[-1]))
    placed = product(at_first, machine.setup.frame)
    robot = ElementTree.Element("robot", name=machine.name)
    robot.append(ElementTree.Comment(f" {stand_ins(machine)} "))
    ElementTree.SubElement(robot, "link", name=WORKPIECE)
    moving = {branching.child for branching in tree}
    robot.extend(_link(link, origins[link], bodies, moves=link in moving) for link in links)
    ElementTree.SubElement(robot, "link", name=TOOL)
    if root == BED:
        robot.append(_joint("setup", "fixed", links[0], WORKPIECE, placed))
    else:
        robot.append(_joint("setup", "fixed", WORKPIECE, links[0], inverse_transform(placed)))
    robot.extend(_moving(branching, machine.axis(branching.joint.letter), origins) for branching in tree)
    robot.append(_joint("tool_home", "fixed", links[-1], TOOL, product(at_last, chain.tool_home)))
    ElementTree.indent(robot)
    # Readers based on lxml refuse text whose declaration names an encoding.
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, encoding="unicode")}\n'


def stand_ins(machine: Machine) -> str:
    """Say which figures of a machine's URDF the machine doesn't state."""
    slow = [axis.letter for axis in machine.axes if axis.max_speed is None]
    open_ended = [axis.letter for axis in machine.axes if None in axis.limits.ends]
    figures = [
        *([f"velocity 100 m/s or 1000 turns/s of {', '.join(slow)}"] * bool(slow)),
        *([f"ends 100 m or 1000 turns away of {', '.join(open_ended)}"] * bool(open_ended)),
        f"effort {EFFORT:g} N or N m of every joint",
        f"{MASS:g} kg and {INERTIA:g} kg m2 of every moving link",
    ]
    return f"stand-ins for what the machine file doesn't state: {'; '.join(figures)}"


def _tree(joints: Sequence[Joint], links: Sequence[str], start: int) -> list[_Branching]:
    """Order the joints from link `start` outwards; joint j is between the links j and j + 1.

    A table axis moves the workpiece relative to the bed in the direction opposite to the axis value, which is
    that of the tool relative to the workpiece.
    """
    towards_workpiece = [_Branching(joints[j], links[j + 1], links[j], -1.0) for j in reversed(range(start))]
    towards_tool = [_Branching(joints[j], links[j], links[j + 1], 1.0) for j in range(start, len(joints))]
    return towards_workpiece + towards_tool


def _origins(links: Sequence[str], tree: Sequence[_Branching], root: str) -> dict[str, Array]:
    """Compute the origins of the links' frames: (3,) mm, machine frame, every axis at 0."""
    origins = {BED if root == BED else links[0]: np.zeros(3)}
    for branching in tree:
        joint, before = branching.joint, origins[branching.parent]
        origins[branching.child] = np.array(joint.line.point) if joint.is_rotary else before
    return origins


def _moving(branching: _Branching, axis: Axis, origins: Mapping[str, Array]) -> ElementTree.Element:
    parent, child = branching.parent, branching.child
    kind = "revolute" if axis.is_rotary else "prismatic"
    element = _joint(axis.letter, kind, parent, child, translation(origins[child] - origins[parent]))
    direction = branching.sign * np.array(branching.joint.line.direction)
    ElementTree.SubElement(element, "axis", xyz=_numbers(direction))
    ElementTree.SubElement(element, "limit", _limit(axis))
    return element


def _limit(axis: Axis) -> dict[str, str]:
    """Return the attributes of a joint's limit; what is unknown has a stand-in."""
    scale, far = (1.0, FAR_ROTARY) if axis.is_rotary else (METRE, FAR_LINEAR)
    low, high = axis.limits.ends
    lower = (high or 0.0) - far if low is None else low
    upper = (low or 0.0) + far if high is None else high
    speed = far if axis.max_speed is None else axis.max_speed
    figures = {"lower": lower / scale, "upper": upper / scale, "effort": EFFORT, "velocity": speed / scale}
    return {name: _number(figure) for name, figure in figures.items()}


def _link(link: str, origin: Array, bodies: Sequence[Body], *, moves: bool) -> ElementTree.Element:
    element = ElementTree.Element("link", name=link_name(link))
    if moves:
        inertial = ElementTree.SubElement(element, "inertial")
        ElementTree.SubElement(inertial, "mass", value=_number(MASS))
        pairs = combinations_with_replacement("xyz", 2)
        moments = {f"i{a}{b}": _number(INERTIA * (a == b)) for a, b in pairs}
        ElementTree.SubElement(inertial, "inertia", moments)
    for body in bodies:
        if body.link == link:
            element.extend(_body(kind, body, origin) for kind in ("visual", "collision"))
    return element


def _body(kind: str, body: Body, origin: Array) -> ElementTree.Element:
    element = ElementTree.Element(kind)
    element.append(_origin(product(translation(-origin), body.shape.frame)))
    ElementTree.SubElement(element, "geometry").append(_geometry(body.shape))
    return element


def _geometry(shape: Shape) -> ElementTree.Element:
    if isinstance(shape, Box):
        return ElementTree.Element("box", size=_numbers(np.array(shape.size) / METRE))
    if isinstance(shape, Cylinder):
        radius, length = _number(shape.radius / METRE), _number(shape.height / METRE)
        return ElementTree.Element("cylinder", radius=radius, length=length)
    scale = _numbers(np.full(3, shape.scale / METRE))
    return ElementTree.Element("mesh", filename=shape.file.resolve().as_uri(), scale=scale)


def _joint(name: str, kind: str, parent: str, child: str, placed: Array) -> ElementTree.Element:
    """Make a joint element; `placed` is the child's frame in the parent's, (4, 4) mm, at the value 0."""
    element = ElementTree.Element("joint", name=name, type=kind)
    element.append(_origin(placed))
    ElementTree.SubElement(element, "parent", link=link_name(parent))
    ElementTree.SubElement(element, "child", link=link_name(child))
    return element


def link_name(link: str) -> str:
    """Name a link; the axis's letter itself is the joint's name."""
    return link if link in (WORKPIECE, BED, TOOL) else f"link_{link}"


def _origin(frame: Array) -> ElementTree.Element:
    xyz, rpy = _numbers(frame[:3, 3] / METRE), _numbers(roll_pitch_yaw(frame[:3, :3]))
    return ElementTree.Element("origin", xyz=xyz, rpy=rpy)


def roll_pitch_yaw(rotation: Array) -> Array:
    """Split a rotation, (3, 3), into ``Rz(yaw) Ry(pitch) Rx(roll)``, (3,) rad.

    Pitch and roll are computed after the yaw is undone, so they fit whatever yaw was found: near a pitch of
    90°, where yaw and roll turn about the same axis, the product still keeps all digits.
    """
    # Without rounding, noise around 0 would determine the yaw at a pitch of 90°.
    matrix = rotation.round(DECIMALS) + 0.0
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    cosine, sine = math.cos(yaw), math.sin(yaw)
    across = cosine * matrix[0] + sine * matrix[1]
    upright = cosine * matrix[1] - sine * matrix[0]
    pitch = math.atan2(-matrix[2, 0], across[0])
    roll = math.atan2(-upright[2], upright[1])
    return np.array([roll, pitch, yaw])


def _numbers(values: Array) -> str:
    return " ".join(_number(float(v)) for v in values)


def _number(value: float) -> str:
    # Adding 0 turns −0 into 0.
    return repr(round(value, DECIMALS) + 0.0).removesuffix(".0")
