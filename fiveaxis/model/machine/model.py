"""The machine: structure, axes, powers, setup of the workpiece and tool length."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    CodeError,
    MachineError,
    ShownAsTable,
    Table,
    inverse_transform,
    product,
)
from fiveaxis.model.machine.axes import Axis, LocationError
from fiveaxis.model.machine.bodies import Body
from fiveaxis.model.machine.chain import Chain, Triple
from fiveaxis.model.machine.code import AXIS_ORDER, DIGITS, FormShapingCode, parse_code
from fiveaxis.model.machine.drives import FrictionDrive, WeightDrive, opposite
from fiveaxis.model.machine.posing import Posing
from fiveaxis.model.machine.provenance import Provenance, Size
from fiveaxis.model.machine.setup import Load, Setup
from fiveaxis.model.machine.urdf import write_urdf

# What `Machine.from_code` states of a rotary axis's line.
MEETING = "point (0, 0, 0)"
MADE_FROM_CODE = "the axes meet in zero: the machine is made from its code alone"
# mm: shorter and longer ones are in another unit.
TOOL_LENGTHS = (1.0, 2000.0)


@dataclass(frozen=True, eq=False)
class Machine(Posing, ShownAsTable):
    """A machine tool.

    Parameters
    ----------
    name : short name
    code : form-shaping code
    chain : joints with their lines, and the tool at home, in the workpiece frame
    axes : sorted X Y Z A B C, the order of the columns of axis values
    base_power : W, drawn whenever the machine is on; None where unknown
    provenance : origin of every figure
    bodies : shapes of the links, machine frame, every axis at 0
    setup : workpiece frame in the machine frame; included in `chain`
    tool_length : mm, from the spindle's gauge point to the tip; included in `chain`
    has_tool_length : whether somebody stated it; else it counts as 0 where that does no harm
    load : of the table
    vertical : (3,), unit vector upwards, machine frame
    spindle_idle : W, W/(rad/s), W/(rad/s)²: power of the turning spindle without a cut, beyond the base power
    auxiliary : W/W, 1/W: the spindle drive's load loss
    clamped : held axes (`holding`), each with its value in mm or rad
    size : what is known of the machine's size, for estimates
    control : of programs that name none, as `fiveaxis.nc.find_dialect` takes it; empty where nobody states it
    """

    name: str
    code: FormShapingCode
    chain: Chain
    axes: tuple[Axis, ...]
    base_power: float | None = None
    description: str = ""
    provenance: tuple[Provenance, ...] = field(default=())
    bodies: tuple[Body, ...] = field(default=())
    setup: Setup = field(default=Setup())
    tool_length: float = 0.0
    has_tool_length: bool = False
    load: Load = field(default=Load())
    vertical: Triple = (0.0, 0.0, 1.0)
    clamped: tuple[tuple[Axis, float], ...] = ()
    spindle_idle: Triple | None = None
    auxiliary: tuple[float, float] | None = None
    size: Size = field(default=Size())
    control: str = ""

    @classmethod
    def from_code(cls, code: str) -> Machine:
        """Make a machine without limits or powers from its form-shaping code; its axes meet in zero.

        `CodeError` if that isn't a form-shaping code.
        """
        if not isinstance(code, str):
            raise CodeError(str(code), "is a number; write the digits in quotes, leading zeros count")
        parsed = parse_code(code)
        letters = sorted(parsed.letters, key=AXIS_ORDER.index)
        chain = Chain.from_code(parsed)
        figures = [f"{c} line" for c in chain.rotaries]
        figures += ["spindle"] * any(letter in "ABC" for letter in parsed.head)
        origins = tuple(Provenance(figure, MEETING, "", True, MADE_FROM_CODE) for figure in figures)
        return cls(code, parsed, chain, tuple(Axis(c) for c in letters), provenance=origins)

    def __repr__(self) -> str:
        origin = "estimated" if self.bands else "known" if self.has_powers else "not known"
        return f"<Machine {self.name}: code {self.code}, axes {' '.join(self.letters)}, powers {origin}>"

    def _table(self) -> Table:
        heads = ("axis", "carries", "limits", "highest speed", "drive")
        return heads, [
            (
                axis.letter,
                "workpiece" if axis.letter in self.code.table else "tool",
                axis.range_text,
                "unknown" if axis.max_speed is None else f"{axis.shown(axis.max_speed):g} {axis.unit}/s",
                "unknown" if axis.drive is None else type(axis.drive).__name__,
            )
            for axis in self.axes
        ]

    @property
    def length_is_along_z(self) -> bool:
        """Whether a longer tool shifts Z only: no rotary axis carries it, and it points along Z.

        Only then may a control compensate the tool length by itself.
        """
        along = [j.line.direction for j in self.chain.joints if j.letter == "Z"]
        upright = bool(along) and float(product(along[0], self.chain.tool_home[:3, 2])) > 1.0 - 1e-12
        return upright and not any(letter in "ABC" for letter in self.code.head)

    @cached_property
    def letters(self) -> str:
        """Axis letters in column order, e.g. ``XYZAC``."""
        return "".join(a.letter for a in self.axes)

    @cached_property
    def rotaries(self) -> tuple[str, ...]:
        """Letters of the rotary axes in chain order, from the workpiece to the tool."""
        return self.chain.rotaries

    @cached_property
    def rotary_columns(self) -> list[int]:
        """Columns of the rotary axes, in chain order."""
        return [self.column(c) for c in self.rotaries]

    @cached_property
    def is_rotary(self) -> BoolArray:
        """(k,), which axes are rotary."""
        return np.array([a.is_rotary for a in self.axes], dtype=bool)

    @cached_property
    def is_endless(self) -> BoolArray:
        """(k,), which axes are rotary and have no limits."""
        return self.is_rotary & ~np.isfinite(self.high - self.low)

    @cached_property
    def linear_columns(self) -> list[int]:
        """Columns of the linear axes, in column order."""
        return [i for i, a in enumerate(self.axes) if not a.is_rotary]

    def column(self, letter: str) -> int:
        """Find the column of an axis letter in arrays of axis values."""
        if len(letter) != 1 or letter not in self.letters:
            raise MachineError(
                f"machine {self.name!r} has no axis {letter!r}; it has {', '.join(self.letters)}"
            )
        return self.letters.index(letter)

    def axis(self, letter: str) -> Axis:
        """Find an axis by its letter."""
        return self.axes[self.column(letter)]

    @cached_property
    def low(self) -> Array:
        """(k,), mm and rad, lower limits."""
        return np.array([a.limits.low for a in self.axes])

    @cached_property
    def high(self) -> Array:
        """(k,), mm and rad, upper limits."""
        return np.array([a.limits.high for a in self.axes])

    def limit_excess(self, positions: Array) -> Array:
        """Compute how far axis values, (…, k), are beyond their limits, mm and rad; negative inside."""
        return np.maximum(positions - self.high, self.low - positions)

    @property
    def has_powers(self) -> bool:
        """Whether every axis has a drive with known power."""
        return all(a.drive is not None for a in self.axes)

    def shown(self, positions: Array) -> Array:
        """Convert axis values, (…, k), from mm and rad to mm and degrees."""
        return positions * np.where(self.is_rotary, 180.0 / np.pi, 1.0)

    @property
    def machine_frame(self) -> Array:
        """(4, 4), mm, the machine frame in the workpiece frame, every axis at 0."""
        return inverse_transform(self.setup.frame)

    def with_setup(self, offset: Triple = (0.0, 0.0, 0.0), rotation_deg: Triple = (0.0, 0.0, 0.0)) -> Machine:
        """Return this machine with another setup of the workpiece.

        Parameters
        ----------
        offset : (3,), mm, workpiece zero in the machine frame, every axis at 0 (the work offset)
        rotation_deg : (3,), deg, of the part on the table: about the machine's X, then Y, then Z

        Raises
        ------
        MachineError
            A number isn't finite.
        """
        setup = Setup.at(offset, rotation_deg)
        # The chain is in the present workpiece frame; the new frame is W₀⁻¹ W in it.
        return replace(
            self, setup=setup, chain=self.chain.seen_from(product(self.machine_frame, setup.frame))
        )

    def with_tool_length(self, length: float) -> Machine:
        """Return this machine with a tool of another length, mm from the spindle's gauge point to the tip.

        Raises
        ------
        MachineError
            The length is negative or isn't finite, or no tool has it: it is in another unit.
        """
        if not (math.isfinite(length) and length >= 0.0):
            raise MachineError(f"tool length is {length:g} mm; it must be 0 or more")
        low, high = TOOL_LENGTHS
        if length and not low <= length <= high:
            raise MachineError(f"tool length is {length:g} mm; tools have {low:g} to {high:g} mm: write mm")
        chain = self.chain.with_tool_length(length - self.tool_length)
        return replace(self, tool_length=length, has_tool_length=True, chain=chain)

    def with_control(self, control: str | Path | None) -> Machine:
        """Return this machine for programs of a control, by name or by its table's path; None for its own."""
        return self if control is None else replace(self, control=str(control))

    def with_load(self, mass: float, centre: Triple = (0.0, 0.0, 0.0)) -> Machine:
        """Return this machine with another load on the table, kg: workpiece, vice, fixture.

        Its centre of mass, (3,) mm, is in the machine frame with every axis at 0.

        Raises
        ------
        MachineError
            The mass is negative, or a number isn't finite.
        """
        return replace(self, load=Load(mass, centre))

    def holding(self, letter: str, value: float) -> Machine:
        """Return the machine of the other axes, with one axis clamped at a value, mm or rad.

        Raises
        ------
        MachineError
            The machine has no such axis, or the value isn't finite.
        """
        axis = self.axis(letter)
        if not math.isfinite(value):
            raise MachineError(f"axis {letter} can't be held at {value}; write a finite number of mm or rad")
        digit = DIGITS[letter]
        return replace(
            self,
            code=parse_code(self.code.text.replace(digit, "")),
            chain=self.chain.holding(letter, value),
            axes=tuple(a for a in self.axes if a.letter != letter),
            clamped=(*self.clamped, (axis, value)),
            bodies=(),  # those of the clamped axis's link would have to join its neighbour's
        )

    def with_location_errors(self, errors: Mapping[str, LocationError]) -> Machine:
        """Return this machine with measured location errors, in place of those it has.

        The errors are small constant displacements of whole axes (ISO 230-7 location errors); the inverse
        kinematics accounts for them exactly.

        Parameters
        ----------
        errors : by axis letter; an axis that isn't named keeps its own

        Raises
        ------
        MachineError
            The machine has no such axis, or has a clamped one; a tilt turns about the axis itself.
        """
        if self.clamped and errors:
            raise MachineError(
                "location errors are stated with every axis at 0; set them before clamping one"
            )
        axes = tuple(replace(a, location_error=errors.get(a.letter, a.location_error)) for a in self.axes)
        for letter in errors:
            self.column(letter)
        # Errors and the lines that they displace are in the machine frame.
        chain = self.chain.seen_from(self.machine_frame)
        joints = []
        for joint in chain.joints:
            line, old = joint.line, self.axis(joint.letter).location_error
            if joint.letter in errors:
                nominal = line if old is None else line.displaced(old, -1.0)
                line = nominal.displaced(errors[joint.letter])
            joints.append(replace(joint, line=line))
        moved = replace(chain, joints=tuple(joints)).seen_from(self.setup.frame)
        replaced = {f"{letter} location_error" for letter in errors}
        kept = tuple(p for p in self.provenance if p.figure not in replaced)
        return replace(self, axes=axes, chain=moved, provenance=kept)

    @cached_property
    def roles(self) -> dict[str, str]:
        """Letter of each axis by its role: ``vertical`` (the steepest), ``horizontal 1``, ``rotary 1``.

        Horizontal axes are in the order of their letters, rotary ones in chain order, from the workpiece.
        """
        steep = sorted(self.steepness, key=lambda letter: -abs(self.steepness[letter]))
        level = sorted(steep[1:], key=AXIS_ORDER.index)
        letters = {f"rotary {i}": letter for i, letter in enumerate(self.rotaries, start=1)}
        letters |= {f"horizontal {i}": letter for i, letter in enumerate(level, start=1)}
        return letters | ({"vertical": steep[0]} if steep else {})

    @cached_property
    def steepness(self) -> dict[str, float]:
        """Upward component of each linear axis's direction."""
        up = product(self.machine_frame[:3, :3], np.array(self.vertical))
        joints = [joint for joint in self.chain.joints if not joint.is_rotary]
        return {joint.letter: float(product(joint.line.direction, up)) for joint in joints}

    @cached_property
    def lifts(self) -> dict[str, float]:
        """How far what each linear axis carries rises while the axis value grows, mm per mm, at home.

        Axis values are tool relative to workpiece: a table goes down while the value of its vertical axis
        grows.
        """
        sides = {letter: -1.0 if letter in self.code.table else 1.0 for letter in self.steepness}
        return {letter: sides[letter] * steep for letter, steep in self.steepness.items()}

    @property
    def bands(self) -> dict[str, tuple[float, float]]:
        """Bands of estimated drives by axis letter: shares of the power, lowest and highest."""
        known = {p.figure: p.band for p in self.provenance if p.band is not None}
        return {c: known[f"{c} drive"] for c in self.letters if f"{c} drive" in known}

    def with_drives_of(self, other: Machine, letters: Mapping[str, str] | None = None) -> Machine:
        """Return this machine with the drives of another one, axis by axis of the same role.

        For a machine whose powers haven't been measured: a comparison of postures then rests on the other
        machine's figures, and the provenance says so.

        Parameters
        ----------
        other : with the powers
        letters : axis of the other machine by own letter; by default those of the same role (`roles`)

        Raises
        ------
        MachineError
            The other machine lacks an axis, or its power.
        """
        chosen = {c: other.roles.get(role) for role, c in self.roles.items()} | dict(letters or {})
        for letter in letters or {}:
            self.column(letter)
        origins = {p.figure: p for p in other.provenance}
        axes, borrowed = [], []
        for axis in self.axes:
            source = chosen[axis.letter]
            if source is None or other.axis(source).drive is None:
                role = next(role for role, c in self.roles.items() if c == axis.letter)
                lacks = f"has no {role} axis" if source is None else f"has no power of {source}"
                raise MachineError(
                    f"machine {other.name!r} {lacks}, so {axis.letter} of {self.name!r} can't have its "
                    f"drive; say which to take (--drives {other.name}:{axis.letter}={other.letters[-1]}), or "
                    "leave --drives out: missing powers are then estimated"
                )
            axes.append(_borrowing(axis, other.axis(source), self, other))
            for figure in ("drive", "moved_mass"):
                p = origins.get(f"{source} {figure}")
                if p is not None and getattr(axes[-1], figure) is not getattr(axis, figure):
                    lender = f"{source} of {other.name}"
                    named = replace(p, figure=f"{axis.letter} {figure}", source="", assumed=True)
                    borrowed.append(replace(named, note=f"taken from {lender}: {p.origin}", borrowed=lender))
        figures = {p.figure for p in borrowed}
        kept = tuple(p for p in self.provenance if p.figure not in figures)
        return replace(self, axes=tuple(axes), provenance=(*kept, *borrowed))

    def to_urdf(self, root: str = "workpiece") -> str:
        """Describe this machine in URDF, for pinocchio, ROS and others: metres and radians.

        Joints are named after the axes and their values are the axis values, whatever the root. Links are
        ``workpiece``, ``bed``, ``tool`` (the tool tip) and, named after the axis that carries them,
        ``link_C`` and so on, with their bodies as visual and collision geometry.

        Parameters
        ----------
        root : ``workpiece`` makes one branch from there to the tool, so the placement of ``tool`` is the
            tool's frame in the workpiece; ``bed`` makes the physical tree, with a branch to the workpiece and
            one to the tool

        Returns
        -------
        XML text, the same bytes each time

        Raises
        ------
        MachineError
            The root is another one.

        Notes
        -----
        URDF requires both ends of a range: a missing one is 100 m or 1000 turns from the other, or from 0.
        This holds for an endless rotary axis too: a ``continuous`` joint would lose its turn count. A highest
        speed that isn't stated is 100 m/s or 1000 turns/s, every effort 1e6 N or N m, and every moving link
        has 1 kg, as simulators refuse one without. A comment in the file lists these stand-ins.
        Meshes are file URIs with %20 for a space, which pinocchio doesn't read: for pinocchio, keep them in
        folders without spaces.
        """
        return write_urdf(self, root)


def _borrowing(axis: Axis, source: Axis, machine: Machine, other: Machine) -> Axis:
    """Give an axis another one's drive and, if that needs one, its mass."""
    drive, mass = source.drive, axis.moved_mass
    rises = machine.lifts.get(axis.letter, 0.0) * other.lifts.get(source.letter, 0.0)
    # Growing values may lift on one machine and lower on the other.
    if drive is not None and rises < 0.0:
        drive = opposite(drive)
    if isinstance(drive, WeightDrive | FrictionDrive) and mass is None:
        mass = source.moved_mass
    return replace(axis, drive=drive, moved_mass=mass)
