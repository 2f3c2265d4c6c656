"""The checks on moves between locations: speeds, accelerations, and the path of the tool's centre."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fiveaxis.base import MACHINE_FILE, Array, Gap, IntArray, Severity, risk
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result, left_out
from fiveaxis.model import across, turned

# Rows, (m,), and a share of the moves that end there → axes, (m, k) mm and rad.
Within = Callable[[IntArray, float], Array]
KINDS = {"rotary": True, "linear": False}
# Shares of a block at which the deviation of the tool's centre from its path is measured.
SAMPLES = (0.25, 0.5, 0.75)
# Moves that are measured at a time.
PART = 50_000


def check_speeds(context: CheckContext) -> Result:
    """Check that every block lasts long enough for the highest speed of each axis."""
    axes = context.machine.axes
    speeds = np.array([math.inf if a.max_speed is None else a.max_speed for a in axes])
    time = context.motion.time
    # A negative duration is a finding of its own (`check_finite`).
    rotary = np.array([axis.is_rotary for axis in axes])
    rounding = np.where(rotary, context.tolerances.turn, context.tolerances.step)
    steps = np.maximum(context.steps - rounding, 0.0)
    needed, given = steps / speeds, np.where(time >= 0.0, time, np.nan)[:, None]
    rows, columns = np.nonzero(needed > given * (1.0 + context.tolerances.time))

    def message(i: int) -> str:
        axis, step = axes[columns[i]], context.steps[rows[i], columns[i]]
        return (
            f"{axis.letter} needs {needed[rows[i], columns[i]]:.4g} s for {axis.shown(step):.4g} {axis.unit} "
            f"at its highest speed {axis.shown(speeds[columns[i]]):g} {axis.unit}/s, but the block lasts "
            f"{given[rows[i], 0]:.4g} s; lower the feed"
        )

    known = ", ".join(a.letter for a in axes if a.max_speed is not None)
    unknown = ", ".join(a.letter for a in axes if a.max_speed is None)
    lasting = time > 0.0
    return Result(
        code="speed",
        rows=rows,
        values=(needed - given)[rows, columns],
        message=message,
        figures={"speed_share": largest(needed[lasting] / given[lasting]) if known else None},
        checked=(f"highest speed of {known} in every block",) if known else (),
        not_checked=_unstated(risk, "speed", unknown, "max_speed"),
    )


def check_accelerations(context: CheckContext, kind: str) -> Result:
    """Check the change of every axis's mean speed from one cutting block to the next.

    The axes are those of a kind, ``rotary`` or ``linear``. The change is divided by the mean of both
    durations. Beyond the highest acceleration a control slows down or rounds the corner, so the feed isn't
    the programmed one: a warning.
    """
    axes = context.machine.axes
    columns = [c for c, a in enumerate(axes) if a.is_rotary is KINDS[kind]]
    known = [c for c in columns if axes[c].max_acceleration is not None]
    unknown = ", ".join(axes[c].letter for c in columns if c not in known)
    most = np.array([axes[c].max_acceleration for c in known], dtype=float)
    change = speed_changes(context)[:, known]
    share = np.divide(change, most, out=np.zeros_like(change), where=most > 0.0)
    rows, which = np.nonzero(share > 1.0 + context.tolerances.acceleration)

    def message(i: int) -> str:
        axis = axes[known[which[i]]]
        value, bound = axis.shown(change[rows[i], which[i]]), axis.shown(most[which[i]])
        return (
            f"{axis.letter} accelerates by {value:.4g} {axis.unit}/s² from one cutting block to the next (at "
            f"most {bound:g} {axis.unit}/s²): the control slows down or rounds the corner; lower the feed or "
            "smooth the path"
        )

    letters = ", ".join(axes[c].letter for c in known)
    return Result(
        code=f"{kind}-acceleration",
        severity=Severity.WARNING,
        rows=rows,
        values=share[rows, which],
        message=message,
        figures={f"{kind}_acceleration_share": largest(share) if known else None},
        checked=(f"acceleration of {letters} from each cutting block to the next",) if known else (),
        not_checked=_unstated(Gap, "acceleration", unknown, "max_acceleration"),
    )


def _unstated(gap: Callable[..., Gap], what: str, letters: str, key: str) -> tuple[Gap, ...]:
    sentence = f"{what} of {letters}: the machine states no maximum"
    return (gap(sentence, key, MACHINE_FILE),) if letters else ()


def speed_changes(context: CheckContext) -> Array:
    """Measure the change of speed at each location between two cuts; (n, k) mm/s² and rad/s², 0 elsewhere."""
    time = context.motion.time
    timed = context.cutting & np.isfinite(time) & (time > 0.0)
    lasting = np.where(timed, time, 1.0)
    speed = np.diff(context.positions, axis=0, prepend=context.positions[:1]) / lasting[:, None]
    both = timed[1:] & timed[:-1]
    between = (lasting[1:] + lasting[:-1]) / 2.0
    change = np.zeros_like(speed)
    change[:-1][both] = np.abs(np.diff(speed, axis=0))[both] / between[both, None]
    # Next to a value that isn't finite (`check_finite`) nothing is known.
    return np.nan_to_num(change, nan=0.0, posinf=math.inf)


def check_deviation(context: CheckContext, severity: Severity | None, within: Within | None = None) -> Result:
    """Check how far the tool's centre leaves its path between two rows.

    A control with TCP keeps the centre on the chord; one without cuts too deep or leaves material by this.
    The severity is None if blocks are inserted between the rows, so that only the figure counts. Within moves
    all axes are linear in time, unless `within` computes them as a program's text moves them.
    """
    deviation = path_deviations(context, within)
    figures = {"tip_deviation_mm": largest(deviation)}
    if severity is None:
        return left_out("tip-deviation", figures)
    limit = context.tolerances.deviation
    rows = np.flatnonzero(deviation > limit)
    how = "with all axes linear in machine coordinates " if within is None else ""

    def message(i: int) -> str:
        return (
            f"{how}the tool's centre leaves its path by {deviation[rows[i]]:.3g} mm (at most {limit:g} mm); "
            "use a control with TCP or put locations closer together"
        )

    return Result(
        code="tip-deviation",
        severity=severity,
        rows=rows,
        values=deviation[rows],
        message=message,
        figures=figures,
        checked=(
            "path of the tool's centre within each cutting block, "
            + ("if the control has no TCP" if within is None else f"to {limit:g} mm, by the program's text"),
        ),
    )


def path_deviations(context: CheckContext, within: Within | None = None) -> Array:
    """Measure the largest distance between the tool's centre and its path in each cutting block, (n,) mm.

    It is NaN if no cut ends there or an axis value is unknown. `within` computes the axes, (m, k) mm and
    rad, at a share of the moves that end at rows; by default all are linear in time.
    """
    positions, path = context.positions, context.toolpath
    deviation = np.full(len(positions), np.nan)
    cuts = np.flatnonzero(context.cutting)
    # A part at a time: the points within the moves of a million rows would take most of the memory.
    for ends in np.split(cuts, range(PART, len(cuts), PART)):
        before, after = positions[ends - 1], positions[ends]
        deviation[ends] = 0.0
        for share in SAMPLES:
            there = before + share * (after - before) if within is None else within(ends, share)
            tip, axis = tool_poses(context.machine, there)
            off = _distances(context, ends, share, tip + path.zone.height * axis, axis)
            deviation[ends] = np.maximum(deviation[ends], off)
    return deviation


def _distances(context: CheckContext, ends: IntArray, share: float, centre: Array, axis: Array) -> Array:
    """Measure how far from its path the pivot is at a share of the moves that end at rows; (m,) mm.

    Between two rows it may be on the chord or, where the given locations tell a curve, from there to the
    curve (`Course`). The surface normal turns evenly; beside a row without one it is the tool's centre that
    has a chord. Centre and axis, (m, 3), are those of the tool there.
    """
    path, offset = context.toolpath, context.toolpath.zone.offset
    normal = turned(path.normal, np.asarray(ends - 1.0 + share)) if offset else np.zeros_like(centre)
    pivot = centre - offset * across(normal, axis)
    off = segment_distances(pivot, path.pivot[ends - 1], path.pivot[ends])
    if offset:
        wanted = [path.centres(context.axis[rows], rows) for rows in (ends - 1, ends)]
        off = np.where(np.isfinite(normal).all(axis=1), off, segment_distances(centre, *wanted))
    bent = np.flatnonzero(context.course.curved[ends] & np.isfinite(normal).all(axis=1))
    off[bent] = context.course.distances(ends[bent], pivot[bent])
    return off


def segment_distances(points: Array, start: Array, end: Array) -> Array:
    """Measure the distance of points to segments, row by row: (n, 3) mm each → (n,) mm."""
    step = end - start
    square = np.sum(step * step, axis=1)
    along = np.sum((points - start) * step, axis=1)
    share = np.clip(along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    distances: Array = np.linalg.norm(points - (start + share[:, None] * step), axis=1)
    return distances
