"""The check of the cutter against the part's mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between
from fiveaxis.mesh import TriangleTree, load_mesh
from fiveaxis.verification.checks import largest
from fiveaxis.verification.cutting_body import CuttingBody
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.report import Result, left_out
from fiveaxis.verification.subject import Subject, Tolerances

if TYPE_CHECKING:
    import trimesh

# rad: a rotary axis turns by no more between two places of a way that are looked at.
TURN = np.radians(2.0)
# rad: by a turn this small the distance to an axis is measured.
LITTLE = 1e-4
# Halvings of a part of a way.
MOST_ROUNDS = 40


def check_gouge(
    subject: Subject, part: str | Path | trimesh.Trimesh | None, *, led: float | None = None
) -> Result:
    """Check that the cutter stays out of the part, at the locations and on the ways between them.

    The cutting part may reach `Tolerances.row_gouge` deep at a location and `Tolerances.chord_gouge` within a
    move; in links and rapid moves too.

    Parameters
    ----------
    subject : the motion
    part : the mesh, or its file; without it nothing is checked
    led : mm above the tip, of the point that a control leads straight (tool centre point control) while the
        rotary axes turn in proportion; None where all axes run linearly

    Raises
    ------
    MeshError
        The part can't be read.
    """
    if part is None:
        return left_out("gouge", {"gouge_depth_mm": None}, "gouges: no mesh of the part was given")
    mesh = load_mesh(part, allow_open=True) if isinstance(part, str | Path) else part
    tolerances, body = subject.tolerances, CuttingBody.of(subject.toolpath.tool)
    here, way = gouge_depths(subject, mesh, led=led)
    allowed = _allowed_at_rows(subject)
    rows = np.flatnonzero((here > allowed) | (way > tolerances.chord_gouge))
    depth = np.fmax(here, way)
    name = "ball" if subject.toolpath.tool.cutter.is_ball else "cutter"

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
        checked=(_what_was_checked(name, body, tolerances, float(allowed.min()), led),),
        not_checked=(
            *(() if mesh.is_watertight else (inside,)),
            *(() if body.is_stated else (_unstated(body),)),
        ),
    )


def _allowed_at_rows(subject: Subject) -> Array:
    """Say how deep the cutter may reach into the part at each row, (n,) mm."""
    tolerances, inserted = subject.tolerances, subject.asked.inserted
    if inserted is None:
        return np.full(len(subject.positions), tolerances.row_gouge)
    return np.where(inserted, tolerances.row_gouge, tolerances.location_gouge)


def _what_was_checked(
    name: str, body: CuttingBody, tolerances: Tolerances, allowed: float, led: float | None
) -> str:
    point = f"the point {led:g} mm above its tip" if led else "its tip"
    how = "with all axes linear in time" if led is None else f"with {point} led straight"
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
class Ways:
    """The ways between the rows of a motion.

    Parameters
    ----------
    subject : the motion
    led : see `check_gouge`
    reach : mm, radius and height above the tip, (m, 2), of the cutter's outermost points
    """

    subject: Subject
    led: float | None
    reach: Array

    @property
    def height(self) -> float:
        """Height above the tip, mm, of the point that is followed: that which is led, else the centre."""
        return self.subject.toolpath.zone.height if self.led is None else self.led

    @cached_property
    def lever(self) -> float:
        """Largest distance of the cutter's points from the point that is followed, mm."""
        return float(np.linalg.norm(self.reach - [0.0, self.height], axis=1).max())

    @cached_property
    def followed(self) -> Array:
        """That point at every row, (n, 3) mm."""
        return self.subject.tip + self.height * self.subject.axis

    def places(self, row: IntArray, share: Array) -> Places:
        """Place the tool at shares, (m,) 0…1, of the ways that end at rows, (m,)."""
        subject, part = self.subject, share[:, None]
        before, after = subject.positions[row - 1], subject.positions[row]
        tip, axis = tool_poses(subject.machine, before + part * (after - before))
        if self.led is not None:
            tip = (1.0 - part) * self.followed[row - 1] + part * self.followed[row] - self.led * axis
        return Places(tip, axis)

    def movement(self, one: Places, two: Places) -> Array:
        """Bound how far any point of the cutter goes between near places, (m,) mm."""
        way = np.linalg.norm(two.tip - one.tip + self.height * (two.axis - one.axis), axis=1)
        return np.asarray(way + self.lever * angle_between(one.axis, two.axis))

    def bends(self, row: IntArray) -> Array:
        """Bound the second derivative of any point's place by the share of the ways to rows, (m,) mm.

        A point's place is a product of one factor per joint. Its second derivative by two joint values is 0
        where the one nearer to the workpiece is linear; where it turns it is no longer than the derivative by
        the other: 1 for a linear joint, the distance to the axis for a rotary one. That is measured where the
        way begins, and grows no more than the joints beyond the axis move the point.
        """
        subject, machine = self.subject, self.subject.machine
        steps, before = subject.steps[row], subject.positions[row - 1]
        bend, moved = np.zeros(len(row)), np.zeros(len(row))
        for joint in reversed(machine.chain.joints):
            column = machine.column(joint.letter)
            step = steps[:, column]
            if joint.is_rotary:
                # Where a point is led straight, the others turn about it alone.
                arm = np.full(len(row), self.lever)
                if self.led is None:
                    turned = before + LITTLE * (np.arange(before.shape[1]) == column)
                    tip, axis = tool_poses(machine, turned)
                    swing = tip + self.height * axis - self.followed[row - 1]
                    arm = arm + np.linalg.norm(swing, axis=1) / LITTLE + moved
                bend = bend + step * (step * arm + 2.0 * moved)
                moved = moved + step * arm
            elif self.led is None:
                moved = moved + step
        return bend


def gouge_depths(subject: Subject, mesh: trimesh.Trimesh, *, led: float | None = None) -> tuple[Array, Array]:
    """Measure how deep the cutter reaches into the part.

    No depth changes faster than the cutter moves, so the way between two places is divided only while their
    depths and the movement leave room for a gouge, and no finer than `CuttingBody.finest`.

    Returns
    -------
    here : (n,), mm: at the location; negative is room, told no further than a move could use it up; NaN
        where the tool's place is unknown
    way : (n,), mm: the deepest between the location before and this one, −∞ where nothing was near
    """
    body = CuttingBody.of(subject.toolpath.tool)
    tree = TriangleTree.build(np.asarray(mesh.triangles, dtype=float))
    outline = subject.toolpath.tool.cutter.outline()
    ways = Ways(subject, led, np.vstack([outline, [body.radius, body.height]]))
    known: BoolArray = np.logical_and.reduce(np.isfinite(subject.tip), axis=1)
    here, way = np.full(len(known), np.nan), np.full(len(known), -np.inf)
    begins = _begin(ways, known)
    floors = np.zeros(len(known))
    for ends in (begins.row - 1, begins.row):
        np.minimum.at(floors, ends, -begins.movement)
    here[known] = body.depths(subject.tip[known], subject.axis[known], tree, floors[known])
    _search(ways, begins, here, way, body, tree)
    if mesh.is_watertight:
        _sink_enclosed(here, way, subject, body, mesh, tree)
    return here, way


@dataclass(frozen=True, eq=False)
class Stretches:
    """Parts of ways.

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


def _begin(ways: Ways, known: BoolArray) -> Stretches:
    """Divide the ways so that no rotary axis turns by more than `TURN` in a part."""
    subject = ways.subject
    row = np.flatnonzero(known[1:] & known[:-1]) + 1
    turns = subject.steps[row][:, subject.machine.rotary_columns].max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(turns / TURN), 1.0).astype(np.int64)
    owner = np.repeat(row, parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.repeat(1.0 / parts, parts)
    low, high = number * share, (number + 1) * share
    one, two = ways.places(owner, low), ways.places(owner, high)
    # No point is faster or slower than its chord by more than half its bend: ends may coincide.
    bends = np.repeat(ways.bends(row), parts) * share * share / 2.0
    return Stretches(owner, low, high, ways.movement(one, two) + bends)


def _search(
    ways: Ways, open_parts: Stretches, here: Array, way: Array, body: CuttingBody, tree: TriangleTree
) -> None:
    """Halve parts of ways while a gouge may hide in them; writes the deepest places into `way`."""
    limit = min(ways.subject.tolerances.gouge, ways.subject.tolerances.chord_gouge)
    parts = open_parts

    def measure(row: IntArray, share: Array, floors: Array) -> Array:
        places = ways.places(row, share)
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
    here: Array, way: Array, subject: Subject, body: CuttingBody, mesh: trimesh.Trimesh, tree: TriangleTree
) -> None:
    """Give the depth of locations deep inside the part, where no triangle tells.

    The cutter can't cross the surface without touching it, so all locations of a run without touch lie on the
    same side, and one of them tells for all.
    """
    tolerance = subject.tolerances.row_gouge
    hearts = subject.tip + body.heart * subject.axis
    free = np.isfinite(here) & (here <= tolerance)
    joined = free[1:] & free[:-1] & (way[1:] <= tolerance)
    starts = free & ~np.concatenate([[False], joined])
    run = np.cumsum(starts) - 1
    inside = np.asarray(mesh.contains(hearts[starts]))
    sunk = np.flatnonzero(free)[inside[run[free]]]
    # The distance to the surface adds to the radius instead of making room.
    here[sunk] = body.radius + tree.distances(hearts[sunk])
