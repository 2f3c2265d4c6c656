"""Postures that keep the tool clear of the workpiece side: the optimiser's collision mask.

Whether the tool clears the part depends only on the tool axis, not on the kinematic branch or the turn count
that reaches it. So answers are cached by location and by cell of tool-axis directions.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from threading import Lock
from typing import Any

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled, inverse_transform, normalise, product
from fiveaxis.check.collision.assumed import with_nose, with_stated_table
from fiveaxis.check.collision.cones import Coned
from fiveaxis.check.collision.obstacles import Obstacle, Solid, tool_solids
from fiveaxis.check.collision.shrinking import ShrinkingStock
from fiveaxis.check.collision.surroundings import Clearances, Surroundings, shape_triangles
from fiveaxis.model import CUTTER, SHANK, Cylinder, Machine, Tool, Toolpath, tool_axes

# Cells per side of the map of directions: about 4 deg each, near the spacing of a search's postures.
CELLS = 48
# Paths of which the answers are kept.
PATHS = 4
UNKNOWN, CLEAR, BLOCKED = 0, 1, 2
logger = logging.getLogger(__name__)

# mm: allowed depth of the cutter in the part, which it touches.
GOUGE = 0.01
HEAD = "head"
# mm and 1: a cylinder of the head this near to the tool axis, and this parallel to it, turns with the tool.
OFF_AXIS, OFF_DIRECTION = 1e-6, 1e-9


@dataclass(eq=False)
class Accessibility:
    """A mask that admits the postures in which no solid of the tool reaches into an obstacle.

    A call answers exactly. `rough` answers for the centre of the direction cell that a posture falls in, from
    a map that is filled on demand. Both answers depend on the query alone, so neither the order of queries
    nor threads change them.

    Parameters
    ----------
    toolpath : contact points, which the tool keeps at any lean
    machine : its rotary axes set the tool's direction
    obstacles : bodies to stay clear of
    tested : number of postures tested, those found in the map not counted
    """

    toolpath: Toolpath
    machine: Machine
    obstacles: Sequence[Obstacle | ShrinkingStock]
    tested: int = 0
    _map: Array = field(default_factory=lambda: np.zeros((0, CELLS * CELLS), dtype=np.uint8), repr=False)
    _lock: Any = field(default_factory=Lock, repr=False)

    def __call__(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check exactly in which postures, (m, 2) rad, every solid is clear of every obstacle, (m,)."""
        if len(rows) < len(self.toolpath):
            return self.clear(rows, tool_axes(self.machine, rotary))
        return self._of_path(rows.tobytes(), rotary.tobytes()).copy()

    def clear(self, rows: IntArray, axis: Array) -> BoolArray:
        """Check exactly which tool axes, (m, 3) unit vectors in the workpiece frame, are clear; (m,)."""
        tip = self._tips(rows, axis)
        self.tested += len(rows)
        free = np.ones(len(rows), dtype=bool)
        for obstacle in self.obstacles:
            open_rows = np.flatnonzero(free)
            free[open_rows] = ~obstacle.hit_by(rows[open_rows], tip[open_rows], axis[open_rows])
        return free

    def blockers(self, row: int, axis: Array) -> dict[str, float]:
        """Find what blocks tool axes, (m, 3) unit vectors, at a location: pair of bodies → share of them."""
        rows = np.full(len(axis), row)
        tip = self._tips(rows, axis)
        blocked: dict[str, BoolArray] = {}
        for obstacle in self.obstacles:
            for solid in obstacle.solids:
                pair = f"{solid.name} with {obstacle.name}"
                hit = replace(obstacle, solids=(solid,)).hit_by(rows, tip, axis)
                blocked[pair] = blocked.get(pair, False) | hit
        shares = {pair: float(hit.mean()) for pair, hit in blocked.items() if hit.any()}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def rough(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check which postures are clear at the centre of their cell; arguments as for `__call__`."""
        with self._lock:
            return self._look_up(rows, cells_of(tool_axes(self.machine, rotary), CELLS)) == CLEAR

    @cached_property
    def _of_path(self) -> Callable[[bytes, bytes], BoolArray]:
        """Answers for a whole path, which is asked again where it is refined, priced and delivered."""

        def clear(rows: bytes, rotary: bytes) -> BoolArray:
            postures = np.frombuffer(rotary).reshape(-1, 2)
            return self.clear(np.frombuffer(rows, dtype=np.int64), tool_axes(self.machine, postures))

        return lru_cache(PATHS)(clear)

    @cached_property
    def _slots(self) -> IntArray:
        """(n,), the row of the map that each location has; −1 for none."""
        return np.full(len(self.toolpath), -1)

    @cached_property
    def _centres(self) -> Array:
        """(CELLS², 3), directions at the centres of a location's cells."""
        return cell_centres(np.arange(CELLS * CELLS), CELLS)

    @cached_property
    def _normals(self) -> Array:
        """(n, 3), of the path; 0 where there is none."""
        return np.nan_to_num(self.toolpath.normal)

    def _tips(self, rows: IntArray, axis: Array) -> Array:
        return self.toolpath.zone.tip(self.toolpath.pivot[rows], self._normals[rows], axis)

    def _look_up(self, rows: IntArray, cells: IntArray) -> Array:
        slots = self._slots[rows]
        if (slots < 0).any():
            new = np.unique(rows[slots < 0])
            used = int(self._slots.max()) + 1
            self._slots[new] = used + np.arange(len(new))
            if used + len(new) > len(self._map):
                # Twice as many as needed: locations come a few at a time.
                more = 2 * (used + len(new)) - len(self._map)
                self._map = np.concatenate([self._map, np.zeros((more, CELLS * CELLS), dtype=np.uint8)])
            slots = self._slots[rows]
        keys, flat = slots * (CELLS * CELLS) + cells, self._map.reshape(-1)
        unknown = np.flatnonzero(flat[keys] == UNKNOWN)
        if len(unknown):
            new_keys, first = np.unique(keys[unknown], return_index=True)
            free = self.clear(rows[unknown[first]], self._centres[new_keys % (CELLS * CELLS)])
            flat[new_keys] = np.where(free, CLEAR, BLOCKED)
        return flat[keys]


@compiled
def cells_of(directions: Array, count: int) -> IntArray:
    """Find the cell of each direction, (m, 3) of any length, in a map of `count` cells per side; (m,).

    The sphere is projected onto an octahedron and unfolded to a square, which is divided into equal cells.
    Unlike on a grid of longitude and latitude, neighbouring directions share a cell or lie in neighbouring
    ones, and the cells are of similar size.
    """
    cells = np.empty(len(directions), np.int64)
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        length = abs(x) + abs(y) + abs(z)
        u, v = x / length, y / length
        if z < 0.0:
            # The lower half is folded outwards over the square's corners.
            u, v = np.copysign(1.0 - abs(v), u), np.copysign(1.0 - abs(u), v)
        column, row = (u + 1.0) / 2.0 * count, (v + 1.0) / 2.0 * count
        # NaN, of a posture that no axis values give, has a cell, too: the first one of its row or column.
        column, row = (column if column > 0.0 else 0.0), (row if row > 0.0 else 0.0)
        cells[i] = min(int(row), count - 1) * count + min(int(column), count - 1)
    return cells


def cell_centres(cells: IntArray, count: int) -> Array:
    """Return the direction at the centre of each cell, (m, 3) unit vectors; the inverse of `cells_of`."""
    row, column = np.divmod(cells, count)
    u, v = (2.0 * (column + 0.5) / count - 1.0, 2.0 * (row + 0.5) / count - 1.0)
    z = 1.0 - np.abs(u) - np.abs(v)
    folded = np.maximum(-z, 0.0)
    return normalise(np.column_stack([u - np.copysign(folded, u), v - np.copysign(folded, v), z]))


def find_accessible(
    toolpath: Toolpath,
    machine: Machine,
    surroundings: Surroundings,
    *,
    extra: float = 0.0,
    whole_head: bool = False,
) -> Accessibility | None:
    """Build the mask that admits postures in which the tool is clear of everything on the workpiece side.

    Cutter, shank, holder and the head's cylinders about the tool axis are tested against part, fixtures, the
    bodies that move with the workpiece and, except the cutter, the stock: with a closed part in it, what
    earlier moves have left of it (`ShrinkingStock`). A spindle nose is assumed where the head has no bodies,
    and a table where its height was stated (`fiveaxis.check.collision.assumed`). Other bodies, such as a
    trunnion, depend on the axis values; only verification tests them.

    Parameters
    ----------
    toolpath : with its tool, in the zone of the cutter that touches (`Constraints.zoned`)
    machine : with its bodies
    surroundings : with the clearances
    extra : mm, added to every clearance
    whole_head : whether all bodies of the head are tested, each as the cylinder about the tool axis around it

    Returns
    -------
    None if there are no obstacles, or nothing that could touch them: a bare ball covers the same space at
    any lean

    Raises
    ------
    MeshError
        A fixture's or body's mesh can't be read.
    """
    tool, clearances = toolpath.tool, surroundings.clearances
    machine = with_stated_table(with_nose(machine, tool), surroundings, toolpath)
    head = [solid.grown(clearances.machine + extra) for solid in head_solids(machine, whole=whole_head)]
    obstacles: list[Obstacle | ShrinkingStock] = []
    for name, mesh in surroundings.meshes.items():
        solids = [*_solids_above_cut(tool, clearances, extra), *head]
        solids = [solid for solid in solids if len(solid.frusta)]
        if name == "stock" and surroundings.blank is not None:
            obstacles.append(ShrinkingStock.build(surroundings.blank, toolpath, tuple(solids)))
            continue
        if name == "part":
            solids.insert(0, _cutter_in_cut(tool))
        obstacles.append(Obstacle.build(name, mesh, solids))
    around = [(fixture.name, shape_triangles(fixture.shape)) for fixture in surroundings.fixtures]
    solids = [solid.grown(clearances.by_kind[solid.name] + extra) for solid in tool_solids(tool)]
    bodies = (*around, *_table_bodies(machine))
    others = [Obstacle.build(name, triangles, [*solids, *head]) for name, triangles in bodies]
    _log_obstacles(toolpath, [obstacle for obstacle in (*obstacles, *others) if obstacle.solids])
    apart = (part for one in obstacles for part in _shank_apart(one, toolpath))
    obstacles = [obstacle for obstacle in (*apart, *others) if obstacle.solids]
    return Accessibility(toolpath, machine, obstacles) if obstacles else None


def _shank_apart(
    obstacle: Obstacle | ShrinkingStock, toolpath: Toolpath
) -> Iterator[Obstacle | ShrinkingStock]:
    """Yield an obstacle without the shank, and for the shank with its cones: thick parts hit soonest."""
    if isinstance(obstacle, ShrinkingStock):
        yield obstacle
        return
    thin = tuple(solid for solid in obstacle.solids if solid.name == SHANK)
    yield replace(obstacle, solids=tuple(solid for solid in obstacle.solids if solid.name != SHANK))
    yield Coned.of(replace(obstacle, solids=thin), toolpath)


def _log_obstacles(toolpath: Toolpath, obstacles: list[Obstacle | ShrinkingStock]) -> None:
    names = ", ".join(obstacle.name for obstacle in obstacles) or "nothing that a leaning tool could touch"
    logger.info("postures of %d locations are kept clear of %s", len(toolpath), names)
    for obstacle in obstacles:
        solids = ", ".join(dict.fromkeys(solid.name for solid in obstacle.solids))
        logger.debug("%s is tested against %s", obstacle.name, solids)


def head_solids(machine: Machine, *, whole: bool = False) -> Iterator[Solid]:
    """Yield the head's cylinders about the tool axis, such as the spindle nose.

    With `whole` its other bodies count too, each as the cylinder about the tool axis around it.
    """
    for body in machine.bodies:
        if body.link != machine.code.links[-1]:
            continue
        shape, placed = body.shape, product(inverse_transform(machine.chain.tool_home), machine.machine_frame)
        if isinstance(shape, Cylinder):
            frame = product(placed, shape.frame)
            if np.hypot(frame[0, 3], frame[1, 3]) < OFF_AXIS and abs(frame[2, 2]) > 1.0 - OFF_DIRECTION:
                low, high = frame[2, 3] + np.array([-0.5, 0.5]) * shape.height
                yield Solid(HEAD, np.array([[low, shape.radius, high, shape.radius]]))
                continue
        if whole:
            x, y, z = np.moveaxis(product(shape_triangles(shape), placed[:3, :3].T) + placed[:3, 3], -1, 0)
            radius = np.hypot(x, y).max()
            yield Solid(HEAD, np.array([[z.min(), radius, z.max(), radius]]))


def _cutter_in_cut(tool: Tool) -> Solid:
    """Build the portion of the cutter that a lean could push into the part; a ball turns in place."""
    cutter = tool.cutter
    solid = tool_solids(tool)[0].grown(-GOUGE)
    if not cutter.is_ball:
        return solid
    if cutter.length is None:
        return Solid(CUTTER, solid.frusta[:0])
    ball = cutter.zones[0].outline()[-1, 1]
    return Solid(CUTTER, solid.frusta[solid.frusta[:, 0] >= ball - GOUGE])


def _solids_above_cut(tool: Tool, clearances: Clearances, extra: float) -> Iterator[Solid]:
    """Yield shank and holder, grown by their clearance to part and stock.

    The shank starts at the cutter, which touches: its clearance grows from 0 over a length of its own radius.
    """
    for solid in tool_solids(tool)[1:]:
        margin = clearances.by_kind[solid.name] + extra
        if solid.name != SHANK:
            yield solid.grown(margin)
            continue
        low, radius, high, _ = solid.frusta[0]
        top = min(low + radius, high)
        cone = [low, radius, top, radius + margin * (top - low) / radius]
        rest = [top, cone[3], high, cone[3]]
        yield Solid(SHANK, np.array([cone, rest] if high > top else [cone]))


def _table_bodies(machine: Machine) -> Iterator[tuple[str, Array]]:
    """Yield name and triangles, (f, 3, 3) mm, workpiece frame, of bodies that move with the workpiece."""
    for number, body in enumerate(machine.bodies):
        if body.link == machine.code.links[0]:
            frame = machine.machine_frame
            yield (
                body.assumed or f"{body.link} body {number}",
                product(shape_triangles(body.shape), frame[:3, :3].T) + frame[:3, 3],
            )
