"""The check of the cutter against the part's mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between
from fiveaxis.mesh import TriangleTree, load_mesh, tree_of
from fiveaxis.verification.check_context import CheckContext, Tolerances
from fiveaxis.verification.checks import largest
from fiveaxis.verification.cutting_body import CuttingBody
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.report import Result, left_out

if TYPE_CHECKING:
    import trimesh

# rad: a rotary axis turns by no more between two places of a way that are looked at.
TURN = np.radians(2.0)
# rad: by a turn this small the distance to an axis is measured.
LITTLE = 1e-4
# Halvings of a part of a way.
MOST_ROUNDS = 40


def check_gouge(
    context: CheckContext, part: str | Path | trimesh.Trimesh | None, *, tcp_height: float | None = None
) -> Result:
    """Check that the cutter stays out of the part, at the locations and in the moves between them.

    The cutting part may reach `Tolerances.row_gouge` deep at a location and `Tolerances.chord_gouge` within a
    move; in links and rapid moves too.

    Parameters
    ----------
    context : the motion
    part : the mesh, or its file; without it nothing is checked
    tcp_height : mm above the tip, of the point that goes straight under TCP while the rotary axes turn in
        proportion; None with joint interpolation

    Raises
    ------
    MeshError
        The part can't be read.
    """
    if part is None:
        return left_out("gouge", {"gouge_depth_mm": None}, "gouges: no mesh of the part was given")
    mesh = load_mesh(part, allow_open=True) if isinstance(part, str | Path) else part
    tolerances, body = context.tolerances, CuttingBody.of(context.toolpath.tool)
    here, way = gouge_depths(context, mesh, tcp_height=tcp_height)
    allowed = _allowed_at_rows(context)
    rows = np.flatnonzero((here > allowed) | (way > tolerances.chord_gouge))
    depth = np.fmax(here, way)
    name = "ball" if context.toolpath.tool.cutter.is_ball else "cutter"

    def message(i: int) -> str:
        at_location = here[rows[i]] > allowed[rows[i]]
        place, bound = (
            ("here", allowed[rows[i]]) if at_location else ("on the way here", tolerances.chord_gouge)
        )
        return (
            f"the {name} reaches {depth[rows[i]]:.3g} mm deep into the part {place} (at most "
            f"{bound:g} mm {'at a location' if at_location else 'between two locations'}); "
            "check that part and path have one zero, or take a smaller tool"
        )

    inside = "whether the whole path lies inside the part: its mesh isn't watertight"
    return Result(
        code="gouge",
        severity=Severity.ERROR,
        rows=rows,
        values=depth[rows],
        message=message,
        figures={"gouge_depth_mm": largest(np.maximum(depth, 0.0))},
        checked=(_what_was_checked(name, body, tolerances, float(allowed.min()), tcp_height),),
        not_checked=(
            *(() if mesh.is_watertight else (inside,)),
            *(() if body.is_stated else (_unstated(body),)),
        ),
    )


def _allowed_at_rows(context: CheckContext) -> Array:
    """Say how deep the cutter may reach into the part at each row, (n,) mm."""
    tolerances, inserted = context.tolerances, context.constraints.inserted
    if inserted is None:
        return np.full(len(context.positions), tolerances.row_gouge)
    return np.where(inserted, tolerances.row_gouge, tolerances.location_gouge)


def _what_was_checked(
    name: str, body: CuttingBody, tolerances: Tolerances, allowed: float, tcp_height: float | None
) -> str:
    point = f"the point {tcp_height:g} mm above its tip" if tcp_height else "its tip"
    how = "with all axes linear in time" if tcp_height is None else f"with {point} moving straight"
    return (
        f"{name}, up to {body.height:g} mm above its tip, against the part's mesh at every location and, "
        f"{how}, between them: every {body.finest:.3g} mm where the surface is near; at most "
        f"{allowed:.4g} mm deep at a location, {tolerances.chord_gouge:g} mm between "
        f"(gouge tolerance {tolerances.gouge:g} mm)"
    )


def _unstated(body: CuttingBody) -> str:
    return f"cutting edges higher than {body.height:g} mm: the tool states no cutting length"


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the tool: tip and axis, (n, 3) mm and unit vectors."""

    tip: Array
    axis: Array


@dataclass(frozen=True, eq=False)
class MovePoses:
    """Poses within the moves from row to row.

    Parameters
    ----------
    context : the motion
    tcp_height : see `check_gouge`
    reach : mm, radius and height above the tip, (m, 2), of the cutter's outermost points
    """

    context: CheckContext
    tcp_height: float | None
    reach: Array

    @property
    def height(self) -> float:
        """Height above the tip, mm, of the point that is followed: the one under TCP, else the centre."""
        return self.context.toolpath.zone.height if self.tcp_height is None else self.tcp_height

    @cached_property
    def lever(self) -> float:
        """Largest distance of the cutter's points from the point that is followed, mm."""
        return float(np.linalg.norm(self.reach - [0.0, self.height], axis=1).max())

    @cached_property
    def followed(self) -> Array:
        """That point at every row, (n, 3) mm."""
        return self.context.tip + self.height * self.context.axis

    def places(self, row: IntArray, share: Array) -> Places:
        """Place the tool at shares, (m,) 0…1, of the moves that end at rows, (m,)."""
        context, part = self.context, share[:, None]
        before, after = context.positions[row - 1], context.positions[row]
        tip, axis = tool_poses(context.machine, before + part * (after - before))
        if self.tcp_height is not None:
            tip = (1.0 - part) * self.followed[row - 1] + part * self.followed[row] - self.tcp_height * axis
        return Places(tip, axis)

    def movement(self, one: Places, two: Places) -> Array:
        """Bound how far any point of the cutter goes between near places, (m,) mm."""
        way = np.linalg.norm(two.tip - one.tip + self.height * (two.axis - one.axis), axis=1)
        return np.asarray(way + self.lever * angle_between(one.axis, two.axis))

    def bends(self, row: IntArray) -> Array:
        """Bound the second derivative of any point's place by the share of the moves to rows, (m,) mm.

        A point's place is a product of one factor per joint. Its second derivative by two joint values is 0
        where the one nearer to the workpiece is linear; where it turns it is no longer than the derivative by
        the other: 1 for a linear joint, the distance to the axis for a rotary one. That is measured where the
        way begins, and grows no more than the joints beyond the axis move the point.
        """
        context, machine = self.context, self.context.machine
        steps, before = context.steps[row], context.positions[row - 1]
        bend, moved = np.zeros(len(row)), np.zeros(len(row))
        for joint in reversed(machine.chain.joints):
            column = machine.column(joint.letter)
            step = steps[:, column]
            if joint.is_rotary:
                # Where a point moves straight, the others turn about it alone.
                arm = np.full(len(row), self.lever)
                if self.tcp_height is None:
                    turned = before + LITTLE * (np.arange(before.shape[1]) == column)
                    tip, axis = tool_poses(machine, turned)
                    swing = tip + self.height * axis - self.followed[row - 1]
                    arm = arm + np.linalg.norm(swing, axis=1) / LITTLE + moved
                bend = bend + step * (step * arm + 2.0 * moved)
                moved = moved + step * arm
            elif self.tcp_height is None:
                moved = moved + step
        return bend


def gouge_depths(
    context: CheckContext, mesh: trimesh.Trimesh, *, tcp_height: float | None = None
) -> tuple[Array, Array]:
    """Measure how deep the cutter reaches into the part.

    No depth changes faster than the cutter moves, so the way between two places is divided only while their
    depths and the movement leave room for a gouge, and no finer than `CuttingBody.finest`.

    Returns
    -------
    here : (n,), mm: at the location; negative is room, told no further than a move could use it up; NaN
        where the tool's place is unknown
    way : (n,), mm: the deepest between the location before and this one, −∞ where nothing was near
    """
    body = CuttingBody.of(context.toolpath.tool)
    tree = tree_of(mesh)
    outline = context.toolpath.tool.cutter.outline()
    moves = MovePoses(context, tcp_height, np.vstack([outline, [body.radius, body.height]]))
    known: BoolArray = np.logical_and.reduce(np.isfinite(context.tip), axis=1)
    here, way = np.full(len(known), np.nan), np.full(len(known), -np.inf)
    begins = _begin(moves, known)
    floors = np.zeros(len(known))
    for ends in (begins.row - 1, begins.row):
        np.minimum.at(floors, ends, -begins.movement)
    here[known] = body.depths(context.tip[known], context.axis[known], tree, floors[known])
    _search(moves, begins, here, way, body, tree)
    if mesh.is_watertight:
        _sink_enclosed(here, way, context, body, mesh, tree)
    return here, way


@dataclass(frozen=True, eq=False)
class Stretches:
    """Parts of moves.

    Parameters
    ----------
    row : (m,), where the way ends
    low, high : (m,), shares of the way
    movement : (m,), mm, of the cutter in the part
    """

    row: IntArray
    low: Array
    high: Array
    movement: Array

    def at(self, which: BoolArray) -> Stretches:
        """Give some of them."""
        return Stretches(self.row[which], self.low[which], self.high[which], self.movement[which])


def _begin(moves: MovePoses, known: BoolArray) -> Stretches:
    """Divide the moves so that no rotary axis turns by more than `TURN` in a part."""
    context = moves.context
    row = np.flatnonzero(known[1:] & known[:-1]) + 1
    turns = context.steps[row][:, context.machine.rotary_columns].max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(turns / TURN), 1.0).astype(np.int64)
    owner = np.repeat(row, parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.repeat(1.0 / parts, parts)
    low, high = number * share, (number + 1) * share
    one, two = moves.places(owner, low), moves.places(owner, high)
    # No point is faster or slower than its chord by more than half its bend: ends may coincide.
    bends = np.repeat(moves.bends(row), parts) * share * share / 2.0
    return Stretches(owner, low, high, moves.movement(one, two) + bends)


def _search(
    moves: MovePoses, open_parts: Stretches, here: Array, way: Array, body: CuttingBody, tree: TriangleTree
) -> None:
    """Halve parts of moves while a gouge may hide in them; writes the deepest places into `way`."""
    limit = min(moves.context.tolerances.gouge, moves.context.tolerances.chord_gouge)
    parts = open_parts

    def measure(row: IntArray, share: Array, floors: Array) -> Array:
        places = moves.places(row, share)
        depths = body.depths(places.tip, places.axis, tree, floors)
        np.maximum.at(way, row, depths)
        return depths

    # The ends of the first parts: rows that are measured already, or places between them.
    first, last = here[parts.row - 1].copy(), here[parts.row].copy()
    inner = parts.low > 0.0
    floors = np.minimum(-parts.movement, -np.roll(parts.movement, 1))
    first[inner] = measure(parts.row[inner], parts.low[inner], floors[inner])
    ends = np.flatnonzero(inner) - 1
    last[ends] = first[inner]
    for _ in range(MOST_ROUNDS):
        # A way out of the surface at one end and into it at the other is deepest in between.
        hidden = 0.5 * (first + last + parts.movement)
        going = (hidden > limit) & (parts.movement > body.finest)
        if not going.any():
            break
        parts, first, last = parts.at(going), first[going], last[going]
        middle = 0.5 * (parts.low + parts.high)
        depth = measure(parts.row, middle, -parts.movement)
        halves = 0.5 * parts.movement
        parts = Stretches(
            np.concatenate([parts.row, parts.row]),
            np.concatenate([parts.low, middle]),
            np.concatenate([middle, parts.high]),
            np.concatenate([halves, halves]),
        )
        first, last = np.concatenate([first, depth]), np.concatenate([depth, last])


def _sink_enclosed(
    here: Array,
    way: Array,
    context: CheckContext,
    body: CuttingBody,
    mesh: trimesh.Trimesh,
    tree: TriangleTree,
) -> None:
    """Give the depth of locations deep inside the part, where no triangle tells.

    The cutter can't cross the surface without touching it, so all locations of a run without touch lie on the
    same side, and one of them tells for all.
    """
    tolerance = context.tolerances.row_gouge
    hearts = context.tip + body.heart * context.axis
    free = np.isfinite(here) & (here <= tolerance)
    joined = free[1:] & free[:-1] & (way[1:] <= tolerance)
    starts = free & ~np.concatenate([[False], joined])
    run = np.cumsum(starts) - 1
    inside = np.asarray(mesh.contains(hearts[starts]))
    sunk = np.flatnonzero(free)[inside[run[free]]]
    # The distance to the surface adds to the radius instead of making room.
    here[sunk] = body.radius + tree.distances(hearts[sunk])
