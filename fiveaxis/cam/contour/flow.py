"""Passes along the parameters of a model's faces, as far apart as the ridges between them allow.

A face S(u, v) is cut along lines of constant u or v. Between two lines a distance dv apart a place of the
surface is ``w dv`` wide, with ``w = |t × S_v|`` for the unit tangent t along the line, and needs ``w dv / d``
steps d (the formula of `fiveaxis.cam.contour.sections`, by the curvature across the line). On each line the
place with the most steps counts, and a line lies wherever their integral has grown by one: no place then has
more than one step between neighbouring lines, and the first and the last line lie half a step inside.

A pass goes on across an edge at which the surface does, along the parameter of the next face that keeps its
heading; the steps of all faces that it runs on count. What no pass has reached of those faces gets lines of
its own. Where a border slants or bends so that half a step from it isn't enough, a pass runs along it.

References
----------
Elber, Cohen (1994), toolpath generation for freeform surface models; Lin, Koren (1996), efficient tool-path
planning for machining free-form surfaces.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, MeshError, angle_between
from fiveaxis.cam.contour.contacts import CHORD_DEPTH, Contacts, Sampling, follow
from fiveaxis.cam.contour.leaning import Leaning
from fiveaxis.cam.contour.options import PlanOptions
from fiveaxis.cam.contour.parameter_lines import JOIN, Chain, Line, Places, Tracer, convexity
from fiveaxis.cam.contour.sections import HOLLOWEST_EXACT, runs, scallop_step
from fiveaxis.cam.mesh.distance import TriangleTree
from fiveaxis.cam.mesh.surface import Surface

# Lines at which the steps of a face are counted, and those at which its two parameters are compared.
CELLS, COMPARED = 64, 9
# Stations of a line at which steps are counted, and between which contacts are placed.
COUNTED, NODES = np.linspace(0.0, 1.0, 65), np.linspace(0.0, 1.0, 257)
MIDDLE = np.array([0.5])
# Steps too few for a line: borders are looked after anyhow.
FEWEST_STEPS = 0.1
# Passes of one parameter are longer than those of the other only if by more than this factor.
LONGER = 1.25
# A border farther from its nearest pass than half a step by more than this share gets a pass of its own.
BARE = 0.03
# Places at which a border is looked at, for each contact of the largest spacing.
FINER = 6
# Share of the way to the middle of a face by which its border is left to find curvatures: a pole has none.
OFF_BORDER = 1e-4
# Straight moves may be off a hollow by this share of the scallop, and off their line by this share of the
# step on a flat face: both raise the ridges.
HOLLOW_SHARE, SIDE_SHARE = 0.1, 0.01
# Neighbouring passes are at most this many of the largest steps apart where they come nearest.
APART = 1.5


def flow_lines(
    surface: Surface, options: PlanOptions, leaning: Leaning, sampling: Sampling, name: str
) -> tuple[list[list[Contacts]], list[float]]:
    """Place contacts along lines on the faces that have walls.

    Returns
    -------
    contacts : those of each line, in the order of cutting
    farthest : mm, largest distance of neighbouring passes of each line and the next

    Raises
    ------
    MeshError
        The surface, of the file `name`, is a mesh without a model.
    """
    if surface.model is None:
        raise MeshError(
            "strategy = 'flow' follows the faces of a CAD file, and a mesh has none; give the STEP file that "
            "it was made of (.step)",
            file=name,
        )

    def step(curvature: Array, bend: Array) -> Array:
        largest = np.full_like(curvature, options.step or np.inf)
        if options.scallop is None:
            return largest
        strip = np.maximum(leaning.strip_radius(options.scallop, bend), options.scallop)
        return np.minimum(
            largest, scallop_step(strip, options.scallop, np.maximum(curvature, HOLLOWEST_EXACT / strip))
        )

    faces = np.unique(surface.model.owner[options.is_wall(surface.facet_normals)])
    tracer = Tracer(surface.model, frozenset(faces.tolist()), surface.crease)
    along = None if options.flow_along is None else "uv".index(options.flow_along)
    flat, widest = step(np.array([0.0, -np.inf]), np.zeros(2)).tolist()
    hollow = CHORD_DEPTH if options.scallop is None else min(CHORD_DEPTH, HOLLOW_SHARE * options.scallop)
    sampling = replace(sampling, hollow=hollow, sideways=SIDE_SHARE * flat)
    levels = Flow(tracer, step, sampling, along).levels()
    return levels, [APART * widest] * (len(levels) - 1)


@dataclass(frozen=True, eq=False)
class Flow:
    """Plans lines over faces.

    Parameters
    ----------
    tracer : follows a line over the faces
    step : largest distance of passes, (n,) mm, on a surface of curvatures across and along them, (n,) 1/mm,
        convex > 0
    sampling : of the contacts
    along : the parameter that runs, 0 for u and 1 for v; None for the one with the longer passes on each
        face, or with the straighter ones where neither are longer by a quarter
    done : of each face, the parameter that runs on it, and the ranges of the other one that have passes
    """

    tracer: Tracer
    step: Callable[[Array, Array], Array]
    sampling: Sampling
    along: int | None = None
    done: dict[int, tuple[int, list[tuple[float, float]]]] = field(default_factory=dict)

    def levels(self) -> list[list[Contacts]]:
        """Return the passes over all faces, those of one line together, in the order of cutting."""
        faces = sorted(self.tracer.faces, key=lambda f: (-self.tracer.model.faces[f].area, f))
        found: list[list[Contacts]] = []
        for face in faces:
            along = self.done[face][0] if face in self.done else self.along
            along = self._longer(face) if along is None else along
            for low, high in self._free(face, along):
                found += self._band(face, along, low, high)
        rims: list[list[Contacts]] = []
        passes = self._moves([contacts for level in found for contacts in level])
        for face in faces:
            near = self._moves([contacts for level in rims for contacts in level])
            rims.append(self._rims(face, [tree for tree in (passes, near) if tree is not None]))
        return [level for level in (*found, *rims) if level]

    def _free(self, face: int, along: int) -> list[tuple[float, float]]:
        """Find the ranges of the parameter that stays without passes."""
        low, high = np.reshape(self.tracer.model.faces[face].box, (2, 2))[1 - along].tolist()
        free = []
        for begin, end in sorted(self.done.get(face, (along, []))[1]):
            free.append((low, begin))
            low = max(low, end)
        return [(a, b) for a, b in (*free, (low, high)) if a < b]

    def _allowed(self, face: int, along: int, value: float) -> bool:
        if face not in self.done:
            return True
        own, ranges = self.done[face]
        return own == along and not any(low <= value <= high for low, high in ranges)

    def _band(self, face: int, along: int, low: float, high: float) -> list[list[Contacts]]:
        """Lay the passes over a range of a face, and over its neighbours as far as they go on there."""
        edges = np.linspace(low, high, CELLS + 1)
        cells = self.tracer.trace(face, along, (edges[:-1] + edges[1:]) / 2.0, self._allowed)
        grown = np.append(0.0, np.cumsum(self._steps([_lines(chains) for chains in cells])))
        count = math.ceil(grown[-1] - 1e-6) if grown[-1] > FEWEST_STEPS else 0
        values = np.interp((np.arange(count) + 0.5) * grown[-1] / max(count, 1), grown, edges)
        traced = [chains for chains in self.tracer.trace(face, along, values, self._allowed) if chains]
        self._note(face, along, (low, high), [line for chains in traced for line in _lines(chains)])
        if not traced:
            return []
        ends = [level[0].lines[0] for level in (traced[0], traced[-1])]
        heights = Places.on(self.tracer.model, ends, MIDDLE).points[:, 2]
        down = heights[0] < heights[1]
        contacts = iter(self._contacts(self._climbing([c for chains in traced for c in chains], down)))
        levels = [[next(contacts) for _ in chains] for chains in traced]
        return levels[::-1] if down else levels

    def _rates(self, lines: Sequence[Line]) -> Array:
        """Compute the most steps per unit of the parameter that stays, of each line, (k,)."""
        places = Places.on(self.tracer.model, lines, COUNTED)
        steps = places.width / self.step(places.curvature, places.bend)
        return np.asarray(steps.reshape(len(lines), -1).max(axis=1))

    def _steps(self, cells: Sequence[Sequence[Line]]) -> Array:
        """Compute the most steps that a face needs across each of neighbouring lines, (n,)."""
        lines = [(k, line) for k, cell in enumerate(cells) for line in cell]
        rates = self._rates([line for _, line in lines]) if lines else np.zeros(0)
        most = np.zeros(len(cells))
        for face in sorted({line.face for _, line in lines}):
            values, rate = np.full(len(cells), np.nan), np.zeros(len(cells))
            for (k, line), steps in zip(lines, rates, strict=True):
                if line.face == face:
                    values[k], rate[k] = line.value, max(rate[k], steps)
            # Where a face begins there is a difference to one side only; where lines come upon it at another
            # place than before, the smaller one counts.
            wide = np.abs(np.diff(values))
            wide = np.fmin(np.append(wide, np.nan), np.append(np.nan, wide))
            most = np.fmax(most, rate * wide)
        return most

    def _note(self, lead: int, along: int, span: tuple[float, float], lines: Sequence[Line]) -> None:
        """Note the ranges of the parameter that stays that now have passes, on every face."""
        self.done.setdefault(lead, (along, []))[1].append(span)
        lines = [line for line in lines if line.face != lead]
        half = (0.5 + BARE) / self._rates(lines) if lines else np.zeros(0)
        for line, reach in zip(lines, half.tolist(), strict=True):
            ranges = self.done.setdefault(line.face, (line.along, []))[1]
            ranges.append((line.value - reach, line.value + reach))

    def _longer(self, face: int) -> int:
        """Choose the parameter of a face along which passes are longer, or else straighter."""
        length, turn = np.zeros(2), np.zeros(2)
        for along in (0, 1):
            low, high = np.reshape(self.tracer.model.faces[face].box, (2, 2))[1 - along]
            values = low + (high - low) * (np.arange(COMPARED) + 0.5) / COMPARED
            traced = self.tracer.trace(face, along, values, self._allowed)
            chains = [chain for level in traced for chain in level]
            if chains:
                points = Places.on(self.tracer.model, _lines(chains), COUNTED).points
                moves = np.diff(points.reshape(-1, len(COUNTED), 3), axis=1)
                length[along] = np.linalg.norm(moves, axis=2).sum() / len(chains)
                turns = angle_between(moves[:, :-1].reshape(-1, 3), moves[:, 1:].reshape(-1, 3))
                turn[along] = turns.sum() / len(chains)
        is_longer = length.max() > LONGER * length.min()
        return int(length.argmax() if is_longer else turn.argmin())

    def _climbing(self, chains: Sequence[Chain], down: bool) -> list[Chain]:
        """Turn chains so that the strip that the next pass cuts lies to the right of the feed.

        `down` is whether the next pass lies against the direction in which lines were traced.
        """
        lines = [chain.lines[0] for chain in chains]
        places = Places.on(self.tracer.model, lines, MIDDLE)
        right = np.sum(np.cross(places.heading, places.normals) * places.across, axis=1)
        forward = [line.nodes[-1, line.along] > line.nodes[0, line.along] for line in lines]
        climbs = ((right > 0.0) == forward) != down
        return [chain if climb else chain.reversed() for chain, climb in zip(chains, climbs, strict=True)]

    def _contacts(self, chains: Sequence[Chain]) -> list[Contacts]:
        """Place contacts along chains, with points and normals of their faces."""
        model = self.tracer.model
        # The nodes of each line as starts and ends of segments.
        rows = np.repeat(np.arange(len(NODES)), 2)[1:-1]
        lines = _lines(chains)
        uv = np.concatenate([line.at(NODES)[rows] for line in lines])
        faces = np.repeat([line.face for line in lines], len(rows))
        points, normals = model.evaluate(faces, uv)[:, 0], model.normals(faces, uv)

        def onto(first: int, segment: IntArray, share: Array) -> tuple[Array, Array]:
            k = first + 2 * segment
            at = uv[k] + share[:, None] * (uv[k + 1] - uv[k])
            return model.evaluate(faces[k], at)[:, 0], model.normals(faces[k], at)

        found, end = [], 0
        for chain in chains:
            begin, end = end, end + len(rows) * len(chain.lines)
            nodes = points[begin:end], normals[begin:end], partial(onto, begin)
            found.append(follow(*nodes, self.sampling, closed=chain.closed, crease=self.tracer.crease))
        return found

    def _rims(self, face: int, passes: Sequence[TriangleTree]) -> list[Contacts]:
        """Place passes along the stretches of a face's border that no other pass comes near enough."""
        model, found = self.tracer.model, []
        segments = model.trims.border[model.trims.first[face] : model.trims.first[face + 1], :4]
        breaks = np.flatnonzero((segments[1:, :2] != segments[:-1, 2:]).any(axis=1)) + 1
        for edge in np.split(segments, breaks):
            line = Line(face, np.vstack([edge[:, :2], edge[-1:, 2:]]), 0)
            moves = np.diff(model.evaluate(face, line.at(NODES))[:, 0], axis=0)
            length = np.linalg.norm(moves, axis=1).sum()
            if length <= max(JOIN, self.sampling.spacing):
                continue
            stations = np.linspace(
                0.0, 1.0, max(len(NODES), math.ceil(FINER * length / self.sampling.spacing))
            )
            bare, inwards = self._bare(line, stations, passes)
            for begin, end in runs(bare):
                (rim,) = self._contacts([Chain([Line(face, line.at(stations[begin:end]), 0)], closed=False)])
                right = np.cross(rim.points[-1] - rim.points[0], rim.normals[len(rim) // 2])
                climbs = np.sum(right * inwards[begin:end].mean(axis=0)) >= 0.0
                found.append(rim if climbs else rim.reversed())
        return found

    def _bare(self, line: Line, stations: Array, passes: Sequence[TriangleTree]) -> tuple[BoolArray, Array]:
        """Find where passes are too far from a border, (n,), and the way to them, (n, 3) mm.

        They are compared by the ball's centres, which are far apart on both sides of a sharp edge. Bare
        stretches are longer by a step at both ends: they don't end where the next pass just comes near, and
        join those of a border that slants past pass after pass.
        """
        model, uv = self.tracer.model, line.at(stations)
        if not passes:
            return np.ones(len(uv), dtype=bool), np.zeros((len(uv), 3))
        uv += OFF_BORDER * (np.reshape(model.faces[line.face].box, (2, 2)).mean(axis=1) - uv)
        values, normals = model.evaluate(line.face, uv), model.normals(line.face, uv)
        centres = values[:, 0] + self.sampling.radius * normals
        ways = np.stack([tree.nearest(centres)[0] - centres for tree in passes])
        towards = ways[np.linalg.norm(ways, axis=2).argmin(axis=0), np.arange(len(uv))]
        (e, f), (_, g) = np.einsum("nik,njk->ijn", values[:, 1:3], values[:, 1:3])
        p, q = np.einsum("nik,nk->in", values[:, 1:3], towards)
        # In the parameters, the way to the pass and the direction of the pass, square to it.
        du, dv = g * p - f * q, e * q - f * p
        across, ahead = np.stack([du, dv], axis=1), np.stack([-f * du - g * dv, e * du + f * dv], axis=1)
        curvature, bend = (convexity(values, normals, some) for some in (across, ahead))
        step = self.step(curvature, bend)
        reach = (1.0 + BARE) * step / 2.0 * (1.0 + self.sampling.radius * curvature)
        far = np.append(0, np.cumsum(np.linalg.norm(towards, axis=1) > reach))
        way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(values[:, 0], axis=0), axis=1)))
        return far[np.searchsorted(way, way + step, "right")] > far[np.searchsorted(way, way - step)], towards

    def _moves(self, passes: Sequence[Contacts]) -> TriangleTree | None:
        """Return the moves of the ball's centre in passes in a tree; None without any."""
        if not passes:
            return None
        centres = [contacts.points + self.sampling.radius * contacts.normals for contacts in passes]
        closed = [np.vstack([c, c[:1]]) if p.closed else c for c, p in zip(centres, passes, strict=True)]
        return TriangleTree.build(np.vstack([np.stack([c[:-1], c[1:], c[1:]], axis=1) for c in closed]))


def _lines(chains: Sequence[Chain]) -> list[Line]:
    return [line for chain in chains for line in chain.lines]
