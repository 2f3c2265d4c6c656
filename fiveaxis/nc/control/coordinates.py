"""What a program's coordinates count from: work offset, shifted and tilted planes, tip control."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import linear_positions, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.nc.control.axis_track import Counting, Values, axis_values
from fiveaxis.nc.control.work_offsets import WorkOffsets
from fiveaxis.nc.languages.planes import Plane

Place = list[float | None]


class Coordinates:
    """From words to places: of the axes, or of the tip on the workpiece.

    In a plane that is turned the words are the tip's place, as under tool centre point control: a plane lies
    on the workpiece, and the control leads the tip along it.

    Parameters
    ----------
    machine : whose axes they are
    offsets : the zeros of G54 and so on
    """

    def __init__(self, machine: Machine, offsets: WorkOffsets) -> None:
        self.machine, self.work_offsets = machine, offsets
        self.frame = "G54"
        self.tip_control = False
        self.plane = Plane()
        columns = {a.letter: i for i, a in enumerate(machine.axes)}
        self.xyz = [columns[c] for c in "XYZ" if c in columns]
        # deg, by which G92 shifts the words of rotary axes.
        self.renamed = [0.0] * len(machine.axes)
        self.signs = [-1.0 if a.reversed else 1.0 for a in machine.axes]
        self.settle()

    @property
    def of_tip(self) -> bool:
        """Whether words are the tip's place."""
        return self.tip_control or not self.plane.is_unturned

    @property
    def zero(self) -> list[float] | None:
        """(k,), mm and deg, machine position of the zero in force; None where nobody has said."""
        return self.work_offsets.of(self.frame)

    def settle(self) -> None:
        """Compute what a word is shifted by, after anything has changed.

        `offsets` are added to the words of each axis, (k,); `total` places a turned plane.
        """
        zero = self.zero
        placed = [0.0] * len(self.machine.axes) if zero is None else list(zero)
        self.offsets = [p + r for p, r in zip(placed, self.renamed, strict=True)]
        base = self._base(zero) if self.of_tip else Plane()
        self.total = base.then(self.plane)
        self.turned = not self.total.is_unturned
        for i, column in enumerate(self.xyz):
            shift = float(self.total.origin[i])
            self.offsets[column] = shift if self.of_tip else self.offsets[column] + shift

    def name_anew(self, column: int, now: float, word: float) -> None:
        """Let a word name the place, deg, where a rotary axis stands (G92)."""
        self.renamed[column] += now - self.offsets[column] - word
        self.settle()

    def name_back(self) -> None:
        """Let words name places as before any G92 (G92.1)."""
        self.renamed = [0.0] * len(self.machine.axes)
        self.settle()

    def _base(self, zero: list[float] | None) -> Plane:
        """Give the plane of the work offset on the workpiece; the workpiece's own where nobody has said."""
        if zero is None:
            return Plane()
        home, _ = tool_poses(self.machine, axis_values(self.machine, zero, Counting.AXES))
        return Plane(home[0], self.machine.machine_frame[:3, :3])

    def to_place(self, local: Place) -> Place:
        """Turn X, Y, Z of a turned plane, mm, into the tip's place; unknown while one of them is."""
        if None in local:
            return [None] * 3
        point = self.total.rotation @ np.array(local, dtype=float) + self.total.origin
        return [float(c) for c in point]

    def to_local(self, values: Values) -> Place:
        """Give X, Y, Z, mm, of the plane that is in force, as words would name them."""
        place = [values[c] for c in self.xyz]
        if not self.turned:
            return [None if p is None else p - self.offsets[c] for p, c in zip(place, self.xyz, strict=True)]
        if None in place:
            return [None] * 3
        point = self.total.rotation.T @ (np.array(place, dtype=float) - self.total.origin)
        return [float(c) for c in point]

    def from_local(self, points: Array) -> Array:
        """Turn X, Y, Z of the plane in force, (n, 3) mm, into what rows hold."""
        if self.turned:
            return points @ self.total.rotation.T + self.total.origin
        return points + np.array([self.offsets[c] for c in self.xyz])

    def exchange(self, values: Values, *, to_tip: bool) -> Values:
        """Carry a place over from axis positions to the tip's, or back.

        Where the zero isn't known, or an axis, X, Y and Z aren't known either: the control knows them, the
        program doesn't say.
        """
        new = list(values)
        known = self.zero is not None and None not in values
        place: Place = [None] * 3
        if known and to_tip:
            tip, _ = tool_poses(self.machine, axis_values(self.machine, values, Counting.AXES))
            place = [float(c) for c in tip[0]]
        elif known:
            row = axis_values(self.machine, values, Counting.TIP)
            found = linear_positions(self.machine, row[:, self.xyz], row[:, self.machine.rotary_columns])
            place = [float(found[0, c] * self.signs[c]) for c in self.xyz]
        for column, value in zip(self.xyz, place, strict=False):
            new[column] = value
        return new
