"""Lines of constant parameter on the faces of a model, joined across edges at which the surface goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, IntArray, angle_between
from fiveaxis.cam.mesh.cad.model import Model
from fiveaxis.cam.mesh.surface import units

# mm: ends of lines at most this far apart meet. Edges of files are off their surfaces by less.
JOIN = 0.02
# A line this near to the border of its face's parameters, as a share of them, is moved inside.
INSIDE = 1e-9

# Whether a pass may go on to a line: face, parameter that runs, value of the other.
Allowed = Callable[[int, int, float], bool]


@dataclass(frozen=True, eq=False)
class Line:
    """A curve in the parameters of a face, straight between its nodes.

    Parameters
    ----------
    face : from 0
    nodes : (m, 2), u and v
    along : the parameter that runs: 0 for u, 1 for v
    onward : 1 where the next pass lies at larger values of the other one, −1 where at smaller ones
    """

    face: int
    nodes: Array
    along: int
    onward: float = 1.0

    @property
    def value(self) -> float:
        """The parameter that stays."""
        return float(self.nodes[0, 1 - self.along])

    def at(self, stations: Array) -> Array:
        """Return u and v at stations, (n,) from 0 to 1, (n, 2)."""
        k = np.linspace(0.0, 1.0, len(self.nodes))
        return np.stack([np.interp(stations, k, column) for column in self.nodes.T], axis=1)

    def reversed(self) -> Line:
        """Return the same line in the other direction."""
        return replace(self, nodes=self.nodes[::-1])


@dataclass(frozen=True, eq=False)
class Chain:
    """Lines, each from where the one before ends; of a closed chain the first follows the last."""

    lines: Sequence[Line]
    closed: bool

    def reversed(self) -> Chain:
        """Return the same chain in the other direction."""
        return Chain([line.reversed() for line in self.lines[::-1]], self.closed)


@dataclass(frozen=True, eq=False)
class Places:
    """Places on lines, in the order of the lines.

    Parameters
    ----------
    points, normals : (n, 3), mm and unit vectors out of the material
    heading : (n, 3), mm by the parameter that runs
    across : (n, 3), mm by the parameter that stays, towards the next pass
    width : (n,), mm across the line by that parameter
    curvature, bend : (n,), 1/mm, of the surface across the line and along it, positive where it is convex
    """

    points: Array
    normals: Array
    heading: Array
    across: Array
    width: Array
    curvature: Array
    bend: Array

    @classmethod
    def on(cls, model: Model, lines: Sequence[Line], stations: Array) -> Places:
        """Evaluate the places at the same stations, (n,) from 0 to 1, of each line."""
        face, along, onward = (
            np.repeat([getattr(line, name) for line in lines], len(stations))
            for name in ("face", "along", "onward")
        )
        uv = np.concatenate([line.at(stations) for line in lines])
        values, normals, row = model.evaluate(face, uv), model.normals(face, uv), np.arange(len(uv))
        t, c = values[row, 1 + along], values[row, 2 - along]
        shift = -np.sum(c * t, axis=1) / np.maximum(np.sum(t * t, axis=1), 1e-300)
        # The directions along and across, t and c + shift t, in the parameters.
        ahead = np.eye(2)[along]
        beside = shift[:, None] * ahead + np.eye(2)[1 - along]
        width = np.linalg.norm(c + shift[:, None] * t, axis=1)
        curvature, bend = (convexity(values, normals, way) for way in (beside, ahead))
        return cls(values[:, 0], normals, t, onward[:, None] * c, width, curvature, bend)


def convexity(values: Array, normals: Array, way: Array) -> Array:
    """Compute normal curvatures, (n,) 1/mm, convex > 0: ``−II / I`` of the two fundamental forms.

    Parameters
    ----------
    values : (n, 6, 3), mm, of `Model.evaluate`
    normals : (n, 3), unit vectors out of the material
    way : (n, 2), directions in the parameters
    """
    du, dv = way.T
    bent = du**2 * values[:, 3].T + 2.0 * du * dv * values[:, 4].T + dv**2 * values[:, 5].T
    moved = du * values[:, 1].T + dv * values[:, 2].T
    return np.asarray(-np.sum(bent * normals.T, axis=0) / np.maximum(np.sum(moved**2, axis=0), 1e-300))


@dataclass(frozen=True, eq=False)
class Tracer:
    """Follows parameter lines over the faces of a model.

    Parameters
    ----------
    model : the part
    faces : those that lines may run on
    crease : rad; a line goes on across an edge where normal and heading turn by at most this
    """

    model: Model
    faces: frozenset[int]
    crease: float

    def trace(self, face: int, along: int, values: Array, allowed: Allowed) -> list[list[Chain]]:
        """Follow the lines of a face at values of its other parameter, on to its neighbours too.

        On each of them a line takes the parameter that keeps its heading. It comes to every face once at
        most, so that lines whose ends don't meet after a way around don't go on for ever. The chains of each
        value are returned, none where the line lies outside of the face.
        """
        lines = [(k, line) for k, v in enumerate(values) for line in self._lines(face, along, float(v))]
        reached = {(k, face) for k, _ in lines}
        joined: dict[int, int] = {}
        tried = 0
        while tried < len(lines):
            # The start and the end of each line, two rows for each.
            ends = Places.on(self.model, [line for _, line in lines], np.array([0.0, 1.0]))
            out = np.resize([-1.0, 1.0], len(ends.width))[:, None] * units(ends.heading)
            joined = self._join(ends, out, np.repeat([k for k, _ in lines], 2))
            loose = [row for row in range(2 * tried, 2 * len(lines)) if row not in joined]
            tried = len(lines)
            lines += self._onward(lines, ends, out, loose, reached, allowed)
        found: list[list[Chain]] = [[] for _ in values]
        for level, chain in _chains(lines, joined):
            found[level].append(chain)
        return found

    @cached_property
    def _bounds(self) -> Array:
        """(f, 2, 3), mm: boxes around the faces, wider by what ends may be apart; NaN for other faces."""
        bounds = np.full((len(self.model.faces), 2, 3), np.nan)
        rim = (JOIN + self.model.deviation) * np.array([[-1.0], [1.0]])
        for face in self.faces:
            corners = self.model.corners[self.model.owner == face].reshape(-1, 3)
            bounds[face] = np.stack([corners.min(axis=0), corners.max(axis=0)]) + rim
        return bounds

    def _lines(self, face: int, along: int, value: float, onward: float = 1.0) -> list[Line]:
        pieces = self.model.intervals(face, "v" if along else "u", value)
        turned = slice(None, None, 1 - 2 * along)
        return [
            Line(face, np.stack([x, np.full(2, value)], axis=1)[:, turned], along, onward) for x in pieces
        ]

    def _join(self, ends: Places, out: Array, level: IntArray) -> dict[int, int]:
        """Pair the ends of a level that meet and go on in the same direction, the nearest first."""
        from scipy.spatial import cKDTree

        # Those of different levels are apart in a fourth coordinate.
        places = np.column_stack([ends.points, level])
        first, second = cKDTree(places).query_pairs(JOIN, output_type="ndarray").T
        least = np.cos(self.crease)
        onward = np.sum(out[first] * out[second], axis=1) <= -least
        smooth = np.sum(ends.normals[first] * ends.normals[second], axis=1) >= least
        first, second = first[onward & smooth], second[onward & smooth]
        apart = np.linalg.norm(ends.points[first] - ends.points[second], axis=1)
        joined: dict[int, int] = {}
        for k in np.lexsort([second, first, apart]):
            a, b = int(first[k]), int(second[k])
            if a not in joined and b not in joined:
                joined |= {a: b, b: a}
        return joined

    def _onward(
        self,
        lines: Sequence[tuple[int, Line]],
        ends: Places,
        out: Array,
        loose: Sequence[int],
        reached: set[tuple[int, int]],
        allowed: Allowed,
    ) -> list[tuple[int, Line]]:
        """Find the lines of neighbouring faces on which lines go on from their loose ends."""
        pairs = [
            (row, face)
            for row in loose
            for face in self.model.neighbours[lines[row // 2][1].face]
            if face in self.faces
            and (self._bounds[face, 0] <= ends.points[row]).all()
            and (ends.points[row] <= self._bounds[face, 1]).all()
        ]
        if not pairs:
            return []
        rows, faces = np.array(pairs).T
        foot = self.model.nearest(ends.points[rows], faces)
        turn = angle_between(foot.normal, ends.normals[rows])
        values = self.model.evaluate(faces, foot.uv)
        pull = np.abs(np.einsum("nik,nk->ni", units(values[:, 1:3]), out[rows]))
        meets = (foot.distance <= JOIN) & (turn <= self.crease) & (pull.max(axis=1) >= np.cos(self.crease))
        added: list[tuple[int, Line]] = []
        for k in np.flatnonzero(meets):
            row, face, along = int(rows[k]), int(faces[k]), int(pull[k].argmax())
            low, high = np.reshape(self.model.faces[face].box, (2, 2))[1 - along]
            rim = INSIDE * (high - low)
            value = float(np.clip(foot.uv[k, 1 - along], low + rim, high - rim))
            place = lines[row // 2][0], face
            if place not in reached and allowed(face, along, value):
                reached.add(place)
                onward = 1.0 if np.sum(values[k, 2 - along] * ends.across[row]) > 0.0 else -1.0
                added += [(place[0], line) for line in self._lines(face, along, value, onward)]
        return added


def _chains(lines: Sequence[tuple[int, Line]], joined: dict[int, int]) -> Iterator[tuple[int, Chain]]:
    """Chain lines of a level from end to end; an even row is a line's start, the odd one after it its end."""
    seen: set[int] = set()
    starts = range(2 * len(lines))
    for start in [*(row for row in starts if row not in joined), *starts]:
        run: list[Line] = []
        row = start
        while row >= 0 and row // 2 not in seen:
            seen.add(row // 2)
            line = lines[row // 2][1]
            run.append(line if row % 2 == 0 else line.reversed())
            row = joined.get(row ^ 1, -1)
        if run:
            yield lines[start // 2][0], Chain(run, row == start)
