"""Refinements and searches on the locations of a program, within mask and cone.

The solvers don't handle masks. Where a mask refuses what they find, they get a half-space of the tool axis,
bounded by a plane between an admitted and the refused posture, and only the path near it is refined again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, Steps, normalise, perpendicular, product
from fiveaxis.model import INSIDE_OF, TURN, BlockCosts, TiltBounds, interpolate, tool_axes
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import Instance, Problem
from fiveaxis.posture.search.successors import (
    Admits,
    ConeLimit,
    Resolution,
    cheapest_path,
    in_the_way,
    path_anywhere,
    widened,
)
from fiveaxis.posture.strategy.effort import DEGREE, Effort
from fiveaxis.posture.strategy.singular import Cone, bounded_within, turning_within

# First barrier parameter, J, near a path; IPOPT's iterations where a path is searched.
BARRIER, WHOLE_ITERATIONS = 1e-2, 120
# IPOPT's iterations near a path, and the structured method's last barrier parameter, J; the same of a path
# that will be solved again, with other prices.
FINE, ROUGH = (25, 1e-5), (20, 5e-3)
# Steps that are solved at once; longer paths are solved in parts.
PART = 30_000
# Most single planes of a location; then up to three times three planes close around the admitted axis.
MOST_PLANES, PINCHES, AROUND = 5, 3, 3
# Locations to each side of a refused one that are refined again with it; share above which all of them are.
NEAR, WIDESPREAD = 40, 0.005
# Where planes don't help: how many locations to each side return to the admitted path, step by step.
REACHES = (0, 5, 20, 80)
HALVINGS = 6
# Number of postures queried around one on the edge of the mask, and their distance (rad).
PROBES, PROBE = 8, 1.0 * DEGREE
# Share of their spread below which points lie on a line.
FLATTEST = 1e-3
# Distance of three planes from an admitted tool axis (rad), its factor for the next three; resolution (rad).
PINCH, CLOSER, APART = 0.25 * DEGREE, 0.1, 0.01 * DEGREE

# No planes that confine a path.
FREE: Array = np.empty((0, 0))

# Refines a problem from a start, (n, 2) rad, with each end held or free.
Solver = Callable[[Problem, Array, tuple[bool, bool]], Array]


def refined(problem: Problem, start: Array, effort: Effort) -> Array:
    """Refine a path, (n, 2) rad; the start itself if that is no improvement."""
    return refine(
        problem.eased(start),
        start,
        iterations=WHOLE_ITERATIONS,
        barrier=BARRIER,
        last=effort.last_barrier,
        solver=effort.solver,
    ).rotary


@dataclass(frozen=True, eq=False)
class Near:
    """Refinements and searches within cone and mask; `begun` is a path at the given locations, (n, 2) rad."""

    effort: Effort
    cone: Cone | None
    mask: Mask | None
    begun: Array

    def refined(
        self, instance: Instance, problem: Problem, start: Array, rough: bool = False, planes: Array = FREE
    ) -> Array:
        """Solve a problem, which has other prices than `instance`, near a start, (n, 2) rad.

        It is solved roughly if it will be solved again. Returned are postures and, in further columns,
        (n, 2 + p), the planes that confined them to the mask: the next refinement may begin with these.
        """
        problem = self._within_cone(instance, problem, start).eased(start)
        (iterations, last), solver = ROUGH if rough else FINE, self.effort.solver
        nearby = partial(refine, iterations=iterations, barrier=BARRIER, near=True, last=last, solver=solver)

        def solve(problem: Problem, start: Array, held: tuple[bool, bool]) -> Array:
            return nearby(problem, start, held=held).rotary

        mask = self._along(instance)
        if mask is not None:
            kept = Planes.around(tool_axes(problem.machine, start), planes)
            return np.hstack([Confinement(problem, mask, solve, kept).refined(start), kept.columns])
        # Part by part, as a million locations at once take gigabytes.
        found, last_row = start.copy(), len(start) - 1
        for first, end in pairwise(np.linspace(0, last_row, max(1, -(-last_row // PART)) + 1).astype(int)):
            rows, held = slice(first, end + 1), (bool(first > 0), bool(end < last_row))
            found[rows] = solve(problem.between(first, end), found[rows], held)
        return found

    def searched(
        self,
        instance: Instance,
        costs: BlockCosts,
        resolution: Resolution,
        start: Array,
        steps: Steps,
        free: BoolArray | None = None,
    ) -> Array:
        """Search a corridor about a start, (n, 2) rad, where that is free to change."""
        mask = None if self.mask is None else self.mask.halfway(instance.location)
        admits = None if mask is None else mask.admits
        tight = None if admits is None else self._tight(instance, admits) | in_the_way(start, admits)
        limit = self._cone_limit(instance)
        found = cheapest_path(instance.problem, costs, resolution, start, free, admits, tight, limit, steps)
        return found if len(found) == len(start) else start

    def found_anywhere(
        self,
        instance: Instance,
        costs: BlockCosts,
        resolution: Resolution,
        steps: Steps,
        queries_all: bool = False,
    ) -> Array | None:
        """Search all postures, (n, 2) rad, None for no sequence; `queries_all` asks the mask everywhere."""
        tight = None
        rough = None if self.mask is None else self.mask.halfway(instance.location).roughly_admits
        if rough is not None:
            tight = np.ones(len(instance.path), dtype=bool) if queries_all else self._tight(instance, rough)
        cone_limit = self._cone_limit(instance)
        found = path_anywhere(instance.problem, costs, resolution, rough, tight, cone_limit, steps)
        return found if len(found) == len(instance.problem) else None

    def _tight(self, instance: Instance, admits: Admits) -> BoolArray:
        """Find where the mask is in the way of the path to begin with, (n,): so it will be of others."""
        return in_the_way(interpolate(self.begun, instance.location), admits)

    def refused(self, instance: Instance, rotary: Array) -> BoolArray:
        """Find the postures, (n, 2) rad, that the mask refuses; (n,)."""
        return ~(self._along(instance) or Mask()).admits(np.arange(len(rotary)), rotary)

    def turned(self, instance: Instance, rotary: Array) -> float:
        """Sum how far the first rotary axis turns too far within the cone on a path, (n, 2) rad; rad."""
        if self.cone is None:
            return 0.0
        path = instance.path
        moves = turning_within(path, instance.problem.machine, rotary, self.cone)
        return float((np.abs(np.diff(rotary[:, 0])) - self.cone.most(path))[moves].sum())

    def _along(self, instance: Instance) -> Mask | None:
        return None if self.mask is None else self.mask.along(instance.location)

    def _cone_limit(self, instance: Instance) -> ConeLimit | None:
        return None if self.cone is None else ConeLimit(self.cone.angle, self.cone.most(instance.path))

    def _within_cone(self, instance: Instance, problem: Problem, start: Array) -> Problem:
        if self.cone is None:
            return problem
        problem = bounded_within(problem, instance.path, start, self.cone)
        turned = np.abs(np.diff(start, axis=0))
        return replace(problem, max_turn=np.maximum(problem.max_turn, turned))


@dataclass(eq=False)
class Planes:
    """Half-spaces in which the tool axes of n locations have to stay.

    Their inward unit normals, (n, p, 3), are NaN where unused; counted, (n,), is how many are used, and how
    often three were set close around an admitted tool axis (pinches).
    """

    inwards: Array
    count: IntArray
    pinches: IntArray

    @classmethod
    def none(cls, n: int) -> Planes:
        """Start without planes."""
        most = MOST_PLANES + AROUND * PINCHES
        counts = np.zeros((2, n), dtype=np.int64)
        return cls(np.full((n, most, 3), np.nan), *counts)

    @classmethod
    def around(cls, axis: Array, known: Array) -> Planes:
        """Start with known planes that have tool axes, (n, 3), inside, if they are few and as many rows."""
        planes = cls.none(len(axis))
        if len(known) == len(axis) and known.shape[1] < 3 * MOST_PLANES:
            inwards = known.reshape(len(axis), -1, 3)
            inside = np.sum(inwards * axis[:, None], axis=2, keepdims=True) >= 0.0
            planes.inwards[:, : inside.shape[1]] = np.where(inside, inwards, np.nan)
            planes.count[:] = inside.shape[1]
        return planes

    @property
    def columns(self) -> Array:
        """(n, 3 p), the normals of every location's planes side by side."""
        return self.inwards[:, : self.count.max()].reshape(len(self.count), -1)

    def add(self, rows: IntArray, inwards: Array) -> None:
        """Add a plane to each of some locations; (m, 3)."""
        self.inwards[rows, self.count[rows]] = inwards
        self.count[rows] += 1

    def bounding(self, problem: Problem, first: int, last: int) -> Problem:
        """Return a part of a problem, bounded by its planes."""
        part, most = problem.between(first, last), int(self.count[first : last + 1].max())
        bounds = [
            TiltBounds(self.inwards[first : last + 1, number], 0.0, np.pi / 2.0, f"{INSIDE_OF}the mask")
            for number in range(most)
        ]
        return replace(part, bounds=(*part.bounds, *bounds))


@dataclass(frozen=True, eq=False)
class Confinement:
    """Refinement of a problem within a mask of its locations and planes; `solve` refines without one."""

    problem: Problem
    mask: Mask
    solve: Solver
    planes: Planes

    def refined(self, start: Array) -> Array:
        """Refine a path, (n, 2) rad; the result is refused only where the start is.

        It is never costlier than a start that keeps all bounds.
        """
        found = self._round(start)
        return start if found is None or self.problem.priced(found) >= self.problem.priced(start) else found

    def _admits(self, path: Array) -> BoolArray:
        return self.mask.admits(np.arange(len(path)), path)

    def _round(self, path: Array) -> Array | None:
        """Refine once, with as many planes as needed; None if that fails."""
        n, admitted = len(path), self._admits(path)
        whole = [(0, n - 1)]
        changed = everywhere = np.arange(n)
        found = self._solved(path.copy(), whole)
        for number in range(MOST_PLANES + PINCHES):
            clean = self.mask.admits(changed, found[changed])
            refused = changed[~clean & admitted[changed]]
            if not len(refused):
                return found
            self._cut(refused, path[refused], found[refused], number >= MOST_PLANES)
            widespread = len(refused) > WIDESPREAD * n
            windows = whole if widespread else windows_around(refused, n, NEAR)
            found = self._solved(path.copy() if widespread else blended(found, path, refused), windows)
            changed = np.concatenate([everywhere[first : last + 1] for first, last in windows])
        return self._restored(found, path, admitted)

    def _solved(self, path: Array, windows: list[tuple[int, int]]) -> Array:
        """Solve a path, which is changed, in windows, each from its first to its last location."""
        for first, last in windows:
            rows, held = slice(first, last + 1), (first > 0, last < len(path) - 1)
            path[rows] = self.solve(self.planes.bounding(self.problem, first, last), path[rows], held)
        return path

    def _restored(self, found: Array, path: Array, admitted: BoolArray) -> Array | None:
        """Return the refined path with the admitted one wherever it is refused, without refining again."""
        far = np.zeros(0, dtype=np.int64)
        for reach in REACHES:
            refused = np.flatnonzero(~self._admits(found) & admitted)
            if not len(refused):
                return found
            far = np.union1d(far, refused)
            spread = np.unique(np.clip(far[:, None] + np.arange(-reach, reach + 1), 0, len(path) - 1))
            found = blended(found, path, spread)
        return None if np.any(~self._admits(found) & admitted) else found

    def _cut(self, rows: IntArray, clean: Array, refused: Array, pinch: bool) -> None:
        """Add a plane between each admitted and refused posture, or three around the admitted one."""
        machine, planes = self.problem.machine, self.planes
        inwards = self._between(rows, clean, refused)
        without = np.isnan(inwards).any(axis=1) | pinch
        without &= planes.count[rows] + AROUND <= planes.inwards.shape[1]
        close = PINCH * np.array([CLOSER**k for k in planes.pinches[rows[without]].tolist()])
        for sides in np.moveaxis(pinched(tool_axes(machine, clean[without]), close), 1, 0):
            planes.add(rows[without], sides)
        planes.pinches[rows[without]] += 1
        cut = ~without & ~np.isnan(inwards).any(axis=1) & (planes.count[rows] < planes.inwards.shape[1])
        planes.add(rows[cut], inwards[cut])

    def _between(self, rows: IntArray, clean: Array, refused: Array) -> Array:
        """Find planes between admitted and refused postures, (m, 2) rad; (m, 3), NaN where that fails."""
        machine = self.problem.machine
        edge = self._edge(rows, clean, refused)
        inside, outside = tool_axes(machine, clean), tool_axes(machine, refused)
        at_edge = tool_axes(machine, edge)
        back = inside - at_edge * np.sum(inside * at_edge, axis=1, keepdims=True)
        apart = np.linalg.norm(back, axis=1, keepdims=True) > APART
        straight = normalise(np.where(apart, back, np.nan))
        fitted = self._inwards(rows, edge)
        for inwards in (fitted, straight):
            # A plane has to separate the admitted from the refused axis.
            wrong = (np.sum(inwards * inside, axis=1) < 0.0) | (np.sum(inwards * outside, axis=1) > 0.0)
            inwards[wrong] = np.nan
        return np.where(np.isnan(fitted), straight, fitted)

    def _edge(self, rows: IntArray, clean: Array, refused: Array) -> Array:
        """Bisect between admitted and refused postures for the last admitted one."""
        low, high = np.zeros(len(rows)), np.ones(len(rows))
        offset = refused - clean
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            is_clean = self.mask.admits(rows, clean + middle[:, None] * offset)
            low, high = np.where(is_clean, middle, low), np.where(is_clean, high, middle)
        return np.asarray(clean + low[:, None] * offset)

    def _inwards(self, rows: IntArray, edge: Array) -> Array:
        """Find the direction into the admitted side of the edge, (m, 3), by the mask's answers around it."""
        machine = self.problem.machine
        turn = np.arange(PROBES) * TURN / PROBES
        ring = PROBE * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        tried = (edge[:, None] + ring).reshape(-1, 2)
        clean = self.mask.admits(np.repeat(rows, PROBES), tried).reshape(len(rows), PROBES)
        axis = tool_axes(machine, edge)
        across = perpendicular(axis)
        plane = np.stack([across, np.cross(axis, across)], axis=-1)
        moved = product(tool_axes(machine, tried).reshape(len(rows), PROBES, 3) - axis[:, None], plane)
        fitted = product(plane, _gradient(moved, np.where(clean, 1.0, -1.0))[..., None])[..., 0]
        known = np.linalg.norm(fitted, axis=1) > 1e-9
        return normalise(np.where(known[:, None], fitted, np.nan))


def _gradient(at: Array, values: Array) -> Array:
    """Fit the gradient, (m, 2), of values, (m, p), at points, (m, p, 2); it lies along points on a line."""
    spread = np.einsum("mpi,mpj->mij", at, at)
    pull = np.einsum("mpi,mp->mi", at, values)
    size = spread[:, 0, 0] + spread[:, 1, 1]
    area = spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] ** 2
    # The pseudoinverse: of a matrix of rank 1 it is the matrix over its trace squared.
    is_line = area <= (FLATTEST * size) ** 2
    inverse = np.where(is_line[:, None, None], spread, size[:, None, None] * np.eye(2) - spread)
    scale = np.where(is_line, size**2, area)
    inverse /= np.where(scale > 0.0, scale, 1.0)[:, None, None]
    return np.einsum("mij,mj->mi", inverse, pull)


def pinched(axis: Array, close: Array) -> Array:
    """Set three planes around tool axes, (m, 3), at (m,) rad; (m, 3 planes, 3) inward unit normals."""
    first = normalise(perpendicular(axis))
    second = np.cross(axis, first)
    turn = np.arange(AROUND) * TURN / AROUND
    outwards = np.cos(turn)[:, None] * first[:, None] + np.sin(turn)[:, None] * second[:, None]
    inwards: Array = np.sin(close)[:, None, None] * axis[:, None] - np.cos(close)[:, None, None] * outwards
    return inwards


def blended(path: Array, other: Array, rows: IntArray) -> Array:
    """Blend a path, (n, 2) rad, into another at some locations, fading out over `NEAR` locations."""
    every = np.arange(len(path))
    after = np.clip(np.searchsorted(rows, every), 0, len(rows) - 1)
    away = np.minimum(np.abs(rows[after] - every), np.abs(rows[np.maximum(after - 1, 0)] - every))
    share = np.maximum(1.0 - away / NEAR, 0.0)[:, None]
    return np.asarray(path + share * (other - path))


def windows_around(rows: IntArray, count: int, margin: int) -> list[tuple[int, int]]:
    """Find the first and last location of windows around locations with a margin; overlaps are merged."""
    near = np.isin(np.arange(count), rows)
    near = np.pad(widened(near, margin), 1)
    edges = np.flatnonzero(np.diff(near.astype(np.int8)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]
