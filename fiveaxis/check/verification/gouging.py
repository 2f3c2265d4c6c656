"""The check of the cutter against the part's mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.base import JOB, Array, BoolArray, IntArray, angle_between, risk
from fiveaxis.cam import Mesh, Model, TriangleTree, size_text, tree_of
from fiveaxis.check.collision.scene import LENGTH, WATERTIGHT
from fiveaxis.check.verification.check_context import CheckContext, Tolerances
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result, left_out

NO_PART = risk("gouges: no mesh of the part was given", "part (--part)", JOB)
# rad: largest turn of a rotary axis between two poses that are checked.
TURN = np.radians(2.0)
# rad: the turn by which the distance to an axis is measured.
LITTLE = 1e-4
# Halvings of a part of a move.
MOST_ROUNDS = 40


def check_gouge(context: CheckContext, part: Mesh | None, *, tcp_height: float | None = None) -> Result:
    """Check that the cutter stays out of the part, at the locations and in the moves between them.

    Its depth may be `Tolerances.row_gouge` at a location and `Tolerances.chord_gouge` within a move, in links
    and rapid moves too.

    Parameters
    ----------
    context : the motion
    part : its mesh; without it nothing is checked
    tcp_height : mm above the tip, of the point that moves straight under TCP while the rotary axes turn in
        proportion; None with joint interpolation
    """
    if part is None:
        return left_out("gouge", {"gouge_depth_mm": None}, NO_PART)
    part, tolerances = Mesh.of(part), context.tolerances
    body = CuttingBody.of(context.toolpath.tool)
    here, within = gouge_depths(context, part, tcp_height=tcp_height)
    inserted = context.constraints.inserted
    given = np.zeros(len(here), dtype=bool) if inserted is None else ~inserted
    allowed = np.where(given, tolerances.location_gouge, tolerances.row_gouge)
    rows = np.flatnonzero((here > allowed) | (within > tolerances.chord_gouge))
    depth = np.fmax(here, within)
    name = "ball" if context.toolpath.tool.cutter.is_ball else "cutter"

    def message(i: int) -> str:
        at_location = here[rows[i]] > allowed[rows[i]]
        where, bound = (
            (f"here (at most {allowed[rows[i]]:g} mm", "at a location")
            if at_location
            else (f"in the move to here (at most {tolerances.chord_gouge:g} mm", "between two locations")
        )
        return (
            f"the {name} reaches {depth[rows[i]]:.3g} mm deep into the part {where} {bound}); "
            "check that part and path have the same zero, or take a smaller tool"
        )

    inside = risk("whether the whole path lies inside the part: its mesh isn't watertight", *WATERTIGHT)
    edges = risk(f"cutting edges higher than {body.height:g} mm: the tool states no cutting length", *LENGTH)
    return Result(
        code="gouge",
        rows=rows,
        values=depth[rows],
        message=message,
        figures={"gouge_depth_mm": largest(np.maximum(depth, 0.0))},
        checked=(_what_was_checked(name, body, part, tolerances, float(allowed.min()), tcp_height),),
        not_checked=(*(() if part.is_watertight else (inside,)), *(() if body.is_stated else (edges,))),
    )


def _what_was_checked(
    name: str,
    body: CuttingBody,
    mesh: Mesh,
    tolerances: Tolerances,
    allowed: float,
    tcp_height: float | None,
) -> str:
    point = f"the point {tcp_height:g} mm above its tip" if tcp_height else "its tip"
    how = "with all axes linear in time" if tcp_height is None else f"with {point} moving straight"
    what, model = f"the part's mesh ({size_text(mesh.extents)})", mesh.model
    if model is not None:
        what += f", which is within {model.deviation:.2g} mm of the model's surfaces"
        what += ", and against these where that leaves a doubt,"
    return (
        f"{name}, up to {body.height:g} mm above its tip, against {what} at every location "
        f"and, {how}, between them: every {body.finest:.3g} mm where the surface is near; at most "
        f"{allowed:.4g} mm deep at a location, {tolerances.chord_gouge:g} mm between "
        f"(gouge tolerance {tolerances.gouge:g} mm)"
    )


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
        """Height of the reference point above the tip, mm: that which TCP moves straight, or the centre."""
        return self.context.toolpath.zone.height if self.tcp_height is None else self.tcp_height

    @cached_property
    def lever(self) -> float:
        """Largest distance of the cutter's points from the reference point, mm."""
        return float(np.linalg.norm(self.reach - [0.0, self.height], axis=1).max())

    @cached_property
    def followed(self) -> Array:
        """The reference point at every row, (n, 3) mm."""
        return self.context.tip + self.height * self.context.axis

    def poses(self, row: IntArray, share: Array) -> tuple[Array, Array]:
        """Compute the tool poses at shares, (m,) 0…1, of the moves that end at rows, (m,)."""
        context, part = self.context, share[:, None]
        before, after = context.positions[row - 1], context.positions[row]
        tip, axis = tool_poses(context.machine, before + part * (after - before))
        if self.tcp_height is not None:
            tip = (1.0 - part) * self.followed[row - 1] + part * self.followed[row] - self.tcp_height * axis
        return tip, axis

    def movement(self, one: tuple[Array, Array], two: tuple[Array, Array]) -> Array:
        """Bound the movement of any point of the cutter between near poses, (m,) mm."""
        step = np.linalg.norm(two[0] - one[0] + self.height * (two[1] - one[1]), axis=1)
        return np.asarray(step + self.lever * angle_between(one[1], two[1]))

    def bends(self, row: IntArray) -> Array:
        """Bound the second derivative of any point's position by the share of the moves to rows, (m,) mm.

        It is the bound of `fiveaxis.check.collision.travel.Travel.bends`, with the distance to an axis from a
        little turn about it.
        """
        context, machine = self.context, self.context.machine
        steps, before = context.steps[row], context.positions[row - 1]
        bend, moved = np.zeros(len(row)), np.zeros(len(row))
        for joint in reversed(machine.chain.joints):
            column = machine.column(joint.letter)
            step = steps[:, column]
            if joint.is_rotary:
                # Under TCP the reference point moves straight and the others only turn about it.
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


@dataclass(frozen=True, eq=False)
class PartDepths:
    """Measures how deep a cutter reaches into a part: in exact surfaces where the mesh leaves a doubt.

    Parameters
    ----------
    body : the cutter
    tree : the part's triangles
    model : the part's exact surfaces; None where only the mesh is known
    doubtful : mm, depths between which the mesh doesn't tell whether they are allowed
    """

    body: CuttingBody
    tree: TriangleTree
    model: Model | None
    doubtful: tuple[float, float]

    @classmethod
    def of(cls, body: CuttingBody, mesh: Mesh, tolerances: Tolerances) -> PartDepths:
        """Prepare the measurement in a mesh in mm."""
        model = mesh.model
        margin = 0.0 if model is None else model.deviation
        allowed = tolerances.gouge, tolerances.location_gouge, tolerances.row_gouge, tolerances.chord_gouge
        return cls(body, tree_of(mesh), model, (min(allowed) - margin, max(allowed) + margin))

    def measure(self, tips: Array, axes: Array, floors: Array) -> Array:
        """Measure depths as `CuttingBody.depths` does."""
        depths = self.body.depths(tips, axes, self.tree, floors)
        if self.model is None:
            return depths
        near = np.flatnonzero((depths > self.doubtful[0]) & (depths < self.doubtful[1]))
        at_least = np.maximum(depths[near] - self.model.deviation, floors[near])
        depths[near] = self.body.depths(tips[near], axes[near], self.model, at_least)
        return depths


def gouge_depths(
    context: CheckContext, mesh: Mesh, *, tcp_height: float | None = None
) -> tuple[Array, Array]:
    """Measure how deep the cutter reaches into the part.

    No depth changes faster than the cutter moves, so a move is divided only while the depths at two poses and
    the movement between them allow a gouge, and no finer than `CuttingBody.finest`.

    Returns
    -------
    here : (n,), mm, at the location; negative is clearance, cut off where no move could use it up; NaN if the
        tool's pose is unknown
    within : (n,), mm, the largest in the move to the location; −∞ if nothing was near
    """
    body = CuttingBody.of(context.toolpath.tool)
    depths = PartDepths.of(body, mesh, context.tolerances)
    outline = context.toolpath.tool.cutter.outline()
    moves = MovePoses(context, tcp_height, np.vstack([outline, [body.radius, body.height]]))
    known: BoolArray = np.logical_and.reduce(np.isfinite(context.tip), axis=1)
    here, within = np.full(len(known), np.nan), np.full(len(known), -np.inf)
    parts = row, _, _, movement = _divide(moves, known)
    floors = np.zeros(len(known))
    for ends in (row - 1, row):
        np.minimum.at(floors, ends, -movement)
    here[known] = depths.measure(context.tip[known], context.axis[known], floors[known])
    _search(moves, parts, here, within, depths)
    if mesh.is_watertight:
        _sink_enclosed(here, within, context, body, mesh)
    return here, within


def _divide(moves: MovePoses, known: BoolArray) -> tuple[IntArray, Array, Array, Array]:
    """Divide the moves so that no rotary axis turns by more than `TURN` in a part.

    Return, (m,) each, where each part's move ends, the shares of the move between which the part is, and the
    cutter's movement in it, mm.
    """
    context = moves.context
    row = np.flatnonzero(known[1:] & known[:-1]) + 1
    turns = context.steps[row][:, context.machine.rotary_columns].max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(turns / TURN), 1.0).astype(np.int64)
    owner = np.repeat(row, parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.repeat(1.0 / parts, parts)
    low, high = number * share, (number + 1) * share
    one, two = moves.poses(owner, low), moves.poses(owner, high)
    # A point's speed differs from that of its chord by at most half its bend; the ends may coincide.
    bends = np.repeat(moves.bends(row), parts) * share * share / 2.0
    return owner, low, high, moves.movement(one, two) + bends


def _search(
    moves: MovePoses,
    parts: tuple[IntArray, Array, Array, Array],
    here: Array,
    within: Array,
    depths: PartDepths,
) -> None:
    """Halve parts of moves while they may contain a gouge; writes the largest depths into `within`."""

    def measure(row: IntArray, share: Array, floors: Array) -> Array:
        found = depths.measure(*moves.poses(row, share), floors)
        np.maximum.at(within, row, found)
        return found

    row, low, high, movement = parts
    # The ends of the first parts are rows that are measured already, or poses between them.
    first, last = here[row - 1].copy(), here[row].copy()
    inner = low > 0.0
    floors = np.minimum(-movement, -np.roll(movement, 1))
    first[inner] = measure(row[inner], low[inner], floors[inner])
    ends = np.flatnonzero(inner) - 1
    last[ends] = first[inner]
    for _ in range(MOST_ROUNDS):
        # Depth can rise from one end and fall to the other by no more than the movement.
        hidden = 0.5 * (first + last + movement)
        going = (hidden > depths.doubtful[0]) & (movement > depths.body.finest)
        if not going.any():
            break
        row = row[going]
        low, high, movement, first, last = (a[going] for a in (low, high, movement, first, last))
        middle = 0.5 * (low + high)
        depth = measure(row, middle, -movement)
        row, movement = np.tile(row, 2), np.tile(0.5 * movement, 2)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        first, last = np.concatenate([first, depth]), np.concatenate([depth, last])


def _sink_enclosed(here: Array, within: Array, context: CheckContext, body: CuttingBody, mesh: Mesh) -> None:
    """Compute the depth of locations deep inside the part, beyond the reach of any triangle.

    The cutter can't cross the surface without touching it, so all locations of a run without contact lie on
    the same side, and one of them decides for all.
    """
    tolerance = context.tolerances.row_gouge
    hearts = context.tip + body.heart * context.axis
    free = np.isfinite(here) & (here <= tolerance)
    joined = free[1:] & free[:-1] & (within[1:] <= tolerance)
    starts = free & ~np.concatenate([[False], joined])
    run = np.cumsum(starts) - 1
    inside = np.asarray(mesh.contains(hearts[starts]))
    sunk = np.flatnonzero(free)[inside[run[free]]]
    # The distance to the surface adds to the radius instead of making room.
    here[sunk] = body.radius + tree_of(mesh).distances(hearts[sunk])
