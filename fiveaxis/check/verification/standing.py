"""The check against the assumed table, and how high the part has to stand over it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fiveaxis.base import JOB, Array, Gap, product, risk
from fiveaxis.check.collision.assumed import TABLE, AssumedTable, Standing
from fiveaxis.check.collision.scene import (
    MACHINE,
    Scene,
    SceneBody,
    build_scene,
    choose_pairs,
    describe,
    place_body,
)
from fiveaxis.check.collision.surroundings import Clearances, Surroundings
from fiveaxis.check.collision.sweep import Sweep
from fiveaxis.check.collision.travel import Stretch, Travel
from fiveaxis.check.verification.check_context import CheckContext, PathConstraints, make_context
from fiveaxis.check.verification.collisions import CODES, TOLERANCE, known_stretches, results_of, sweep_all
from fiveaxis.check.verification.model import link_poses, tool_poses
from fiveaxis.check.verification.report import Result
from fiveaxis.check.verification.tcp_moves import divide_tcp_moves
from fiveaxis.model import MoveKind, Toolpath, divided_rows, interpolate, lead_positions
from fiveaxis.nc import TracedProgram

# mm: smaller excess of a needed height over a whole number is rounding.
ROUNDING = 1e-6
MOST_PARTS = 4_000
STATED = "above_table (--above-table)", JOB


def check_table(
    context: CheckContext, surroundings: Surroundings, *, tcp_height: float | None = None
) -> tuple[Result, ...]:
    """Check cutter, shank, holder and head against the table that is assumed where none is described.

    Its face is where somebody stated it (`Surroundings.above_table`). Else it is as far below the lowest
    point of part, stock and fixtures as the moves need, and then nobody knows whether the part stands so
    high: a risk, unless it may stand on the table itself.

    Parameters
    ----------
    context : all moves of a program, with the whole tool
    tcp_height : mm above the tip, of the point that moves straight under TCP; None with joint interpolation

    Returns
    -------
    As of `check_collisions`; the first says how the part stands. None where the table is described.
    """
    machine, tool = context.machine, context.toolpath.tool
    table = AssumedTable.of(machine, surroundings, context.tip[context.toolpath.cutting])
    if table is None:
        unused = Gap("above_table: the machine's file has bodies under the part, and these count")
        told = Result(f"{MACHINE}-collision", not_checked=(unused,))
        return () if surroundings.above_table is None else (told,)
    clearances, links = surroundings.clearances, machine.code.head or (machine.code.links[-1],)
    scene = build_scene(machine, tool, Surroundings())
    movers = tuple(body for body in scene.bodies if body.link in links)
    ground = place_body(table.body(0.0), machine)
    height = _height_needed(context, movers, ground, table.radius, clearances, tcp_height)
    needed = float(math.ceil(height - ROUNDING))
    stated = surroundings.above_table
    standing = Standing(table, needed if stated is None else stated, needed, stated is not None)
    ground = place_body(standing.body, machine)
    pairs, _ = choose_pairs(Scene(machine.code, (*movers, ground)), clearances)
    found = sweep_all(context, pairs, Sweep(TOLERANCE), tcp_height)
    remedy = f"raise the part over the table by packers or a riser, to {needed:g} mm at least (above_table)"
    hits = [result for kind in CODES for result in results_of(kind, found, True, remedy)]
    how = "as stated" if standing.stated else "assumed: as far as the program needs it"
    where = f"face {standing.height:g} mm below the lowest point of part, stock and fixtures, {how}"
    clear = [pair for pair in pairs if not any(pair is hit for hit, _ in found)]
    checked = (f"{TABLE}, radius {table.radius:g} mm: {where}", *describe(clear))
    text = f"height over the table, at least {needed:g} mm: nobody stated that of the part's lowest point"
    gap = () if standing.stated or not needed else (risk(text, *STATED),)
    told = Result(f"{MACHINE}-collision", checked=checked, not_checked=gap, standing=standing)
    # The figures are those of the check of all other bodies.
    return (told, *(replace(result, figures={}) for result in hits))


def every_text_move(context: CheckContext, read: TracedProgram) -> CheckContext:
    """Return the moves of a text of our own, with the tool, whole, of a context of its path's locations."""
    tip, axis = tool_poses(context.machine, read.motion.positions)
    path = Toolpath.from_tips(tip, axis, context.toolpath.tool, kind=read.motion.kind)
    path = replace(path, source=read.path.source, name=read.path.name)
    return make_context(read.motion, context.machine, path, PathConstraints(), context.tolerances)


def with_approach(context: CheckContext, read: TracedProgram) -> CheckContext:
    """Add the way to a program's first row, of which its text says nothing.

    By axis words and at rapid the program comes down to it along Z, as the approach of our own programs does:
    from the end of the travel, or 100 mm above.
    """
    motion, machine = context.motion, context.machine
    stays = read.motion.technology is None or read.by_control or read.motion.tcp[0]
    if stays or motion.kind[0] != MoveKind.RAPID:
        return context
    rows = np.maximum(np.arange(-1, len(motion)), 0)
    above = lead_positions(motion, machine, np.zeros(len(machine.letters)))[:1]
    motion = replace(motion.at(rows), positions=np.concatenate([above, motion.positions]))
    return make_context(motion, machine, context.toolpath.at(rows), PathConstraints(), context.tolerances)


def _height_needed(
    context: CheckContext,
    movers: tuple[SceneBody, ...],
    ground: SceneBody,
    radius: float,
    clearances: Clearances,
    tcp_height: float | None,
) -> float:
    """Compute how far a table has to be below where it is for all bodies to keep their clearances, mm, or 0.

    It is never too small: between two rows a point goes below both by at most an eighth of the bound on its
    second derivative (`Travel.bends`), and moves are divided until that is `TOLERANCE`, or `MOST_PARTS`. The
    ground is the table; its piece has its middle on the z axis, which is up.
    """
    machine, poses, (face,) = context.machine, link_poses(context.machine), ground.pieces
    margins = clearances.by_kind
    known, needed = np.asarray(np.isfinite(context.positions).all(axis=1)), 0.0
    for begin, end in known_stretches(known):
        positions = context.positions[begin:end]
        if tcp_height is not None:
            positions, _ = divide_tcp_moves(machine, positions, tcp_height)
        stretch = Stretch(machine, poses, positions)
        travels = [
            (Travel(stretch, piece, face, body.link, ground.link), margins.get(body.kind, margins[MACHINE]))
            for body in movers
            for piece in body.pieces
        ]
        bends = np.max([travel.bends for travel, _ in travels], axis=0) if len(positions) > 1 else np.empty(0)
        parts = np.clip(np.ceil(np.sqrt(bends / 8.0 / TOLERANCE)), 1.0, MOST_PARTS).astype(np.int64)
        if (parts > 1).any():
            stretch = Stretch(machine, poses, interpolate(positions, divided_rows(parts)))
            travels = [(travel.along(stretch), clearance) for travel, clearance in travels]
        top = face.high[2]
        for travel, clearance in travels:
            heights = top + clearance - _lowest_over(travel, radius)
            needed = float(np.max(heights, initial=needed))
    return needed


def _lowest_over(travel: Travel, radius: float) -> Array:
    """Return the lowest point of a piece in each move over a table, (m,) mm along the table's z.

    The lowest point of a circle of radius r about the unit axis o is r·sqrt(1 − o_z²) below its centre.
    """
    mover, pose, circles = travel.mover, travel.poses, travel.mover.circles
    tilted = np.sqrt(np.maximum(1.0 - pose[:, 2, 2] ** 2, 0.0))
    centres = product(pose[:, 2, :3], circles[:, :3].T) + pose[:, 2, 3, None]
    low = (centres - tilted[:, None] * circles[:, 3]).min(axis=1)
    aside = product(pose[:, :2, :3], (mover.low + mover.high) / 2.0) + pose[:, :2, 3]
    if len(low) == 1:
        return low[np.linalg.norm(aside, axis=1) <= radius + mover.size / 2.0]
    # A point leaves the straight line between two rows by no more than it may go below both.
    dip, step = travel.bends / 8.0, np.diff(aside, axis=0)
    squared = np.sum(step * step, axis=1)
    share = -np.sum(aside[:-1] * step, axis=1) / np.where(squared > 0.0, squared, 1.0)
    nearest = np.linalg.norm(aside[:-1] + np.clip(share, 0.0, 1.0)[:, None] * step, axis=1)
    over = nearest <= radius + mover.size / 2.0 + dip
    return np.asarray((np.minimum(low[:-1], low[1:]) - dip)[over])
