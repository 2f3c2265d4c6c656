"""Whether a fault matters: the tool's motion by the words of a program, compared with the path.

It uses the equations of `fiveaxis.kinematics`, dense samples along every move and distances to straight
chords, and nothing of the verification.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from fiveaxis.geometry import Array, angle_between, normalise
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath
from planted.words import DIRECTION, LINEAR, Text, Words

Mode = Literal["axes", "tip", "vector"]

# mm: a larger distance from the path, or from a location, matters: twice the gouge tolerance.
ALONG_BLOCKS = 0.02
# deg: a larger overrun of the lean's bounds matters; chords of directions and rounding cause less.
LEAN = 0.3
# Samples of each move.
PARTS = 30


def distances(points: Array, polyline: Array) -> Array:
    """Measure the distance of points, (m, 3), from each chord of a polyline, (n, 3): (m, n - 1), mm."""
    a, step = polyline[:-1], np.diff(polyline, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(np.einsum("mnk,nk->mn", points[:, None] - a, step) / length, 0.0, 1.0)
    gaps = np.linalg.norm(points[:, None] - a - share[..., None] * step, axis=2)
    return np.asarray(gaps)


@dataclass(frozen=True)
class Meaning:
    """The meaning of a mode's words: rows of numbers that are linear along a move, and their poses.

    Rows are axis values in machine order, mm and rad (axes); the tip and rotary angles (tip); the tip and the
    tool's direction (vector).
    """

    machine: Machine
    mode: Mode

    @cached_property
    def rotary_letters(self) -> list[str]:
        return [self.machine.axes[c].letter for c in self.machine.rotary_columns]

    def angles(self, state: Words) -> list[float]:
        """Return the rotary axes' values, rad, in the machine's sign."""
        signs = {a.letter: -1.0 if a.reversed else 1.0 for a in self.machine.axes}
        return [np.radians(signs[c] * state[c]) for c in self.rotary_letters]

    def direction(self, state: Words) -> Array:
        """Return the tool's direction, from its words or from the angles."""
        if "I" in state:
            return np.array([state[c] for c in DIRECTION])
        return np.asarray(self._axes(np.array([self.angles(state)]))[0])

    def row(self, state: Words) -> Array:
        linear = [state[c] for c in LINEAR]
        if self.mode == "vector":
            return np.array([*linear, *self.direction(state)])
        if self.mode == "tip":
            return np.array([*linear, *self.angles(state)])
        row = np.zeros(len(self.machine.axes))
        row[self.machine.rotary_columns] = self.angles(state)
        for axis in self.machine.axes:
            if not axis.is_rotary:
                row[self.machine.column(axis.letter)] = state[axis.letter] * (-1.0 if axis.reversed else 1.0)
        return row

    def poses(self, rows: Array) -> tuple[Array, Array]:
        """Compute tip and axis, (n, 3) each, workpiece frame."""
        if self.mode == "axes":
            return tool_poses(self.machine, rows)
        if self.mode == "tip":
            return rows[:, :3], self._axes(rows[:, 3:])
        return rows[:, :3], normalise(rows[:, 3:])

    def beyond_travel(self, rows: Array) -> bool:
        """Check whether positions are beyond an axis's travel."""
        columns = self.machine.rotary_columns
        if self.mode == "vector":
            return False
        low, high = self.machine.low, self.machine.high
        if self.mode == "tip":
            rows, low, high = rows[:, 3:], low[columns], high[columns]
        return bool(((rows > high + 1e-9) | (rows < low - 1e-9)).any())

    def _axes(self, angles: Array) -> Array:
        positions = np.zeros((len(angles), len(self.machine.axes)))
        positions[:, self.machine.rotary_columns] = angles
        return tool_poses(self.machine, positions)[1]


@dataclass(frozen=True)
class Measure:
    """The path that programs should follow, and the bounds on the tool's lean, deg."""

    meaning: Meaning
    path: Toolpath
    tilt: tuple[float, float]

    def matters(self, text: Text) -> bool:
        """Check whether a program leaves the path, misses a location, leans too far, or exceeds a limit."""
        states = [text.states[n] for n in text.cuts]
        rows = np.array([self.meaning.row(state) for state in states])
        if self.meaning.beyond_travel(rows):
            return True
        share = (np.arange(PARTS) / PARTS)[:, None]
        between = [a + share * (b - a) for a, b in pairwise(rows)]
        tip, axis = self.meaning.poses(np.concatenate([*between, rows[-1:]]))
        centre = tip + self.path.zone.height * axis
        if distances(centre, self.path.pivot).min(axis=1).max() > ALONG_BLOCKS:
            return True
        passed = distances(self.path.pivot, centre)
        if passed.min(axis=1).max() > ALONG_BLOCKS:
            return True
        lean = np.degrees(angle_between(axis[passed.argmin(axis=1)], self.path.normal))
        low, high = self.tilt
        return bool(((lean < low - LEAN) | (lean > high + LEAN)).any())
