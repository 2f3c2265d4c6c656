"""Whether a fault matters: the tool's motion by the words of a program, compared with the path.

It uses the equations of `fiveaxis.model.kinematics` and dense samples along every move, and nothing of the
verification. The path is the band between the chords of the given locations and a spline through them,
scipy's and not the planned curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from fiveaxis.base import Array, BoolArray, angle_between, normalise
from fiveaxis.model import Machine, Toolpath, linear_positions, tool_poses
from planted.words import DIRECTION, LINEAR, Text, Words

Mode = Literal["axes", "tip", "vector"]

# mm: a larger distance from the band, or from a given location, matters: twice the gouge tolerance.
ALONG_BLOCKS = 0.02
# deg: a larger overrun of the lean's bounds matters; chords of directions and rounding cause less.
LEAN = 0.3
# Samples of each move of a program, and of the spline between two locations.
PARTS, PIECES = 30, 16
# mm²: a smaller triangle is a line.
NO_AREA = 1e-12


def distances(points: Array, polyline: Array) -> Array:
    """Measure the distance of points, (m, 3), from each chord of a polyline, (n, 3): (m, n - 1), mm."""
    a, step = polyline[:-1], np.diff(polyline, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-30)
    share = np.clip(np.einsum("mnk,nk->mn", points[:, None] - a, step) / length, 0.0, 1.0)
    gaps = np.linalg.norm(points[:, None] - a - share[..., None] * step, axis=2)
    return np.asarray(gaps)


def triangle_distances(points: Array, corners: Array) -> Array:
    """Measure the distance of points, (m, 3), from triangles, (m, k, 3, 3): (m, k), mm."""
    edges = np.roll(corners, -1, axis=2) - corners
    aside = points[:, None, None] - corners
    length = np.maximum((edges**2).sum(axis=3), 1e-30)
    share = np.clip((aside * edges).sum(axis=3) / length, 0.0, 1.0)
    beside = np.linalg.norm(aside - share[..., None] * edges, axis=3).min(axis=2)
    normal = np.cross(edges[:, :, 0], edges[:, :, 1])
    area = np.linalg.norm(normal, axis=2)
    turns = (np.cross(edges, aside) * normal[:, :, None]).sum(axis=3)
    above = (turns >= 0.0).all(axis=2) & (area > NO_AREA)
    height = np.abs((aside[:, :, 0] * normal).sum(axis=2)) / np.maximum(area, NO_AREA)
    return np.where(above, height, beside)


@dataclass(frozen=True)
class Band:
    """Where the tool's centre may be in each of g moves between given locations: from the chord to a spline.

    Parameters
    ----------
    given : (g + 1, 3), mm, the locations
    cuts : (g,), whether the move cuts; other moves are chords
    """

    given: Array
    cuts: BoolArray

    @classmethod
    def of(cls, path: Toolpath) -> Band:
        rows = np.flatnonzero(~path.inserted)
        return cls(path.pivot[rows], path.cutting[rows[1:]])

    @cached_property
    def spline(self) -> Array:
        """(g, PIECES + 1, 3), mm: through each row of cuts, which must have no corner."""
        share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
        step = np.diff(self.given, axis=0)
        points = self.given[:-1, None] + share * step[:, None]
        travelled = np.append(0.0, np.cumsum(np.linalg.norm(step, axis=1)))
        for run in np.split(np.arange(len(step)), np.flatnonzero(np.diff(self.cuts)) + 1):
            if self.cuts[run[0]]:
                through = np.append(run, run[-1] + 1)
                at = travelled[run] + share * np.diff(travelled)[run]
                points[run] = CubicSpline(travelled[through], self.given[through])(at.T)
        return points

    @cached_property
    def feet(self) -> Array:
        """(g, PIECES + 1, 3), mm: the points of the chord beside those of the spline."""
        step = np.diff(self.given, axis=0)[:, None]
        aside = self.spline - self.given[:-1, None]
        share = (aside * step).sum(axis=2) / np.maximum((step**2).sum(axis=2), 1e-30)
        return np.asarray(self.given[:-1, None] + np.clip(share, 0.0, 1.0)[..., None] * step)

    @cached_property
    def triangles(self) -> Array:
        """(g, 2 * PIECES, 3, 3), mm: the strip between chord and spline."""
        top, foot = self.spline, self.feet
        one = np.stack([top[:, :-1], top[:, 1:], foot[:, :-1]], axis=2)
        other = np.stack([top[:, 1:], foot[:, 1:], foot[:, :-1]], axis=2)
        return np.concatenate([one, other], axis=1)

    def near(self, points: Array, moves: BoolArray | slice = slice(None)) -> BoolArray:
        """Check which points, (m, 3), are within `ALONG_BLOCKS` of the band, in all moves or some, (g,)."""
        chosen = np.arange(len(self.cuts))[moves]
        gaps = distances(points, self.given)[:, chosen]
        near = (gaps <= ALONG_BLOCKS).any(axis=1)
        reach = np.linalg.norm(self.spline - self.feet, axis=2).max(axis=1)[chosen]
        point, column = np.nonzero(~near[:, None] & (gaps <= ALONG_BLOCKS + reach))
        gap = triangle_distances(points[point], self.triangles[chosen[column]]).min(axis=1)
        near[point[gap <= ALONG_BLOCKS]] = True
        return near


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

    def linear_words(self, row: Array, tip: Array) -> Words:
        """Return the linear words that put the tip there, with the rotary words of a row in force."""
        if self.mode != "axes":
            return dict(zip(LINEAR, tip.tolist(), strict=True))
        rotary = row[None][:, self.machine.rotary_columns]
        solved = linear_positions(self.machine, tip[None], rotary)[0]
        return {
            a.letter: float(solved[self.machine.column(a.letter)]) * (-1.0 if a.reversed else 1.0)
            for a in self.machine.axes
            if not a.is_rotary
        }

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
class Way:
    """The tool's centre along the move that ends at a line, (m, 3), mm, and its axis, (m, 3)."""

    line: int
    is_rapid: bool
    centre: Array
    axis: Array


@dataclass(frozen=True)
class Measure:
    """The path that programs should follow, and the bounds on the tool's lean, deg."""

    meaning: Meaning
    path: Toolpath
    tilt: tuple[float, float]

    @cached_property
    def band(self) -> Band:
        return Band.of(self.path)

    def ways(self, text: Text) -> list[Way]:
        """Sample the moves from location to location of the path, from start to end."""
        share = np.linspace(0.0, 1.0, PARTS + 1)[:, None]
        found = []
        rows = [self.meaning.row(text.states[line]) for line in text.moves]
        for line, a, b in zip(text.moves[1:], rows[:-1], rows[1:], strict=True):
            tip, axis = self.meaning.poses(a + share * (b - a))
            found.append(Way(line, text.is_rapid(line), tip + self.path.zone.height * axis, axis))
        return found

    def matters(self, text: Text) -> bool:
        """Check whether cuts leave the path, miss a location, lean too far, or an axis exceeds a limit."""
        if self.meaning.beyond_travel(np.array([self.meaning.row(text.states[i]) for i in text.moves])):
            return True
        return self.strays([way for way in self.ways(text) if not way.is_rapid])

    def strays(self, ways: list[Way]) -> bool:
        """Check whether cuts leave the band, miss a given location, or lean too far beside any location."""
        cut = self.path.cutting
        centre = np.concatenate([way.centre for way in ways])
        axis = np.concatenate([way.axis for way in ways])
        if not self.band.near(centre).all():
            return True
        passed = distances(self.path.pivot[cut], centre)
        if passed.min(axis=1)[~self.path.inserted[cut]].max() > ALONG_BLOCKS:
            return True
        lean = np.degrees(angle_between(axis[passed.argmin(axis=1)], self.path.normal[cut]))
        low, high = self.tilt
        return bool(((lean < low - LEAN) | (lean > high + LEAN)).any())

    def touching(self, text: Text) -> list[int]:
        """Find the lines whose move touches material after its start: it lies or ends on a cut."""
        return [way.line for way in self.ways(text) if self._touches(way.centre[1:])]

    def cutting(self, text: Text) -> list[int]:
        """Find the lines whose move cuts."""
        return self.cutting_of(self.ways(text))

    def cutting_of(self, ways: list[Way]) -> list[int]:
        """Find the lines whose move cuts: its middle lies on a cut of the path."""
        return [way.line for way in ways if self._touches(way.centre[len(way.centre) // 2][None])]

    def touches_in_rapid(self, text: Text) -> bool:
        """Check whether a rapid move touches material."""
        return any(text.is_rapid(line) for line in self.touching(text))

    def _touches(self, centre: Array) -> bool:
        return bool(self.band.near(centre, self.band.cuts).any())
