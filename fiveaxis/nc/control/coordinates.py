"""Frames of a program's coordinates: work offset, shifted and tilted planes, TCP."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fiveaxis.base import Array, SettingError, product
from fiveaxis.model import Machine, linear_positions, tool_axes, tool_poses
from fiveaxis.nc.control.axis_track import Counting, Values, axis_values
from fiveaxis.nc.languages.block import Plane

# X, Y and Z, mm; None where the program hasn't given them yet.
Point = list[float | None]

# Largest component across Z of a tool that is along it.
SAME_DIRECTION = 1e-9


class WorkOffsets:
    """Machine positions of the zeros of G54, G55 and so on, in the control's own sign.

    Parameters
    ----------
    given : axis letter -> mm or deg, of the program's only work offset; or word and letter (``G55X``,
        ``G54.1P3Z``) of one among several; None if unknown
    machine : the machine of these axes

    Raises
    ------
    SettingError
        A number that isn't finite.
    MachineError
        A letter that isn't an axis of the machine.
    """

    def __init__(self, given: Mapping[str, float] | None, machine: Machine) -> None:
        self.machine = machine
        self.by_name: dict[str, dict[int, float]] = {}
        for key, value in ({} if given is None else given).items():
            name = "".join(key.split()).upper()
            offset, letter = name[:-1], name[-1:]
            if not math.isfinite(value):
                raise SettingError(f"zero of {key} is {value:g}; give a finite number, mm or deg")
            self.by_name.setdefault(offset, {})[machine.column(letter)] = float(value)
        self.given = given is not None

    def knows(self, name: str) -> bool:
        """Whether the caller has given this work offset by its name."""
        return "".join(name.split()) in self.by_name

    def of(self, name: str) -> list[float] | None:
        """Return the zero of a work offset, (k,) mm and deg; None if unknown."""
        if not self.given:
            return None
        values = self.by_name.get("", {}) | self.by_name.get(name, {})
        return [values.get(column, 0.0) for column in range(len(self.machine.axes))]


class Coordinates:
    """Conversion of words to axis positions, or to the tip on the workpiece.

    In a rotated plane the words are tip positions, as under TCP: the plane lies on the workpiece, and the
    control moves the tip in it.

    Parameters
    ----------
    machine : the machine of the axes
    offsets : zeros of G54 and so on
    contained : mm, tool length that the axis words contain, by the head; None where it says nothing

    Notes
    -----
    What Z counts from is decided here, for all that read a program (`length`). Rows of axis words are
    positions of the machine's axes with its tool, whoever adds the tool's length to the words.
    """

    def __init__(self, machine: Machine, offsets: WorkOffsets, contained: float | None = None) -> None:
        self.machine, self.work_offsets = machine, offsets
        # A machine whose tool nobody stated has its tip where the gauge point is.
        self.contained = 0.0 if machine.has_tool_length or contained is None else contained
        self.bare = machine.with_tool_length(0.0)
        self.compensated = False
        self.work_offset = "G54"
        self.tip_control = False
        self.plane = Plane()
        columns = {a.letter: i for i, a in enumerate(machine.axes)}
        self.xyz = [columns[c] for c in "XYZ" if c in columns]
        # mm and deg, shifts by G92.
        self.shifts = [0.0] * len(machine.axes)
        self.signs = [-1.0 if a.reversed else 1.0 for a in machine.axes]
        self.update()

    @property
    def of_tip(self) -> bool:
        """Whether X, Y and Z are tip positions."""
        return self.tip_control or not self.plane.is_unturned

    @property
    def zero(self) -> list[float] | None:
        """(k,), mm and deg, machine position of the zero in force; None if unknown."""
        return self.work_offsets.of(self.work_offset)

    @property
    def length(self) -> float:
        """Length, mm, that lies between the words of Z and where Z is, tool relative to workpiece.

        The control adds the tool's length (G43), wherever the tool points; words that contain it are Z's own.
        Tips are tips.
        """
        return 0.0 if self.of_tip else self.machine.tool_length if self.compensated else -self.contained

    def update(self) -> None:
        """Recompute the shifts of words after a change.

        `offsets`, (k,), are added to the words of each axis; `total` is the frame of a rotated plane.
        """
        zero = self.zero
        base_offsets = [0.0] * len(self.machine.axes) if zero is None else list(zero)
        self.offsets = [p + r for p, r in zip(base_offsets, self.shifts, strict=True)]
        if "Z" in self.machine.letters:
            column = self.machine.column("Z")
            self.offsets[column] += self.signs[column] * self.length
        base = Plane()
        if self.of_tip:
            base = self._base(zero).then(Plane(np.array([self.shifts[c] for c in self.xyz] or [0.0] * 3)))
        self.total = base.then(self.plane)
        self.turned = not self.total.is_unturned
        for i, column in enumerate(self.xyz):
            shift = float(self.total.origin[i])
            self.offsets[column] = shift if self.of_tip else self.offsets[column] + shift

    def shift(self, column: int, now: float, word: float) -> None:
        """Shift an axis so that its position `now`, mm or deg, becomes `word` (G92)."""
        self.shifts[column] += now - self.offsets[column] - word
        self.update()

    def _base(self, zero: list[float] | None) -> Plane:
        """Return the frame of the work offset on the workpiece; the workpiece frame if it is unknown."""
        if zero is None:
            return Plane()
        home, _ = tool_poses(self.bare, axis_values(self.machine, zero, Counting.AXES))
        return Plane(home[0], self.machine.machine_frame[:3, :3])

    def to_tip(self, local: Point) -> Point:
        """Convert X, Y, Z of a rotated plane to the tip; unknown if one of them is."""
        if None in local:
            return [None] * 3
        point = product(self.total.rotation, np.array(local, dtype=float)) + self.total.origin
        return [float(c) for c in point]

    def to_local(self, values: Values) -> Point:
        """Convert a row to X, Y, Z as words in the frame in force, mm."""
        point = [values[c] for c in self.xyz]
        if not self.turned:
            return [None if p is None else p - self.offsets[c] for p, c in zip(point, self.xyz, strict=True)]
        if None in point:
            return [None] * 3
        local = product(self.total.rotation.T, np.array(point, dtype=float) - self.total.origin)
        return [float(c) for c in local]

    def from_local(self, points: Array) -> Array:
        """Convert X, Y, Z in the frame in force, (n, 3) mm, to the X, Y, Z of rows."""
        if self.turned:
            return product(points, self.total.rotation.T) + self.total.origin
        return points + np.array([self.offsets[c] for c in self.xyz])

    def _is_upright(self, values: Values) -> bool:
        """Whether every rotary axis is at 0 and the tool along Z, so that work offset and workpiece agree."""
        rotary = self.machine.rotary_columns
        if any(values[c] is None or values[c] != 0.0 for c in rotary) or not self.plane.is_unturned:
            return False
        axis = tool_axes(self.machine, np.zeros((1, len(rotary))))[0]
        return bool(np.allclose(axis, (0.0, 0.0, 1.0), atol=SAME_DIRECTION))

    def exchange(self, values: Values, *, to_tip: bool) -> Values:
        """Convert a row from axis positions to the tip, or back.

        If the zero or an axis is unknown, X, Y and Z become unknown, except X and Y of an upright tool.
        """
        new = list(values)
        known = self.zero is not None and None not in values
        point: Point = [None] * 3
        if self.zero is None and self._is_upright(values):
            # Words of the tip and of the axes are the same there, but for the tool's length.
            point = [values[self.xyz[0]], values[self.xyz[1]], None] if len(self.xyz) == 3 else point
        elif known and to_tip:
            tip, _ = tool_poses(self.machine, axis_values(self.machine, values, Counting.AXES))
            point = [float(c) for c in tip[0]]
        elif known:
            row = axis_values(self.machine, values, Counting.TIP)
            found = linear_positions(self.machine, row[:, self.xyz], row[:, self.machine.rotary_columns])
            point = [float(found[0, c] * self.signs[c]) for c in self.xyz]
        for column, value in zip(self.xyz, point, strict=False):
            new[column] = value
        return new
