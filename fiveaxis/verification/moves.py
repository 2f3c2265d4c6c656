"""The checks on what happens between two locations: speeds, and the way of the ball."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.verification.check_context import CheckContext
from fiveaxis.verification.checks import largest
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.report import Result, left_out

# Rows, (m,), and a share of the moves that end there → axes, (m, k) mm and rad.
Within = Callable[[IntArray, float], Array]
# Where within a block the ball's deviation from its chord is measured, as shares of the block.
SAMPLES = (0.25, 0.5, 0.75)


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
            f"at its highest speed {axis.shown(speeds[columns[i]]):g} {axis.unit}/s, the block lasts "
            f"{given[rows[i], 0]:.4g} s; lower the feed"
        )

    known = [a.letter for a in axes if a.max_speed is not None]
    unknown = [a.letter for a in axes if a.max_speed is None]
    return Result(
        code="speed",
        severity=Severity.ERROR,
        rows=rows,
        values=(needed - given)[rows, columns],
        message=message,
        figures={"speed_share": _largest_share(needed, given) if known else None},
        checked=(f"highest speed of {', '.join(known)} in every block",) if known else (),
        not_checked=(f"speed of {', '.join(unknown)}: the machine states no highest one",) if unknown else (),
    )


def _largest_share(needed: Array, given: Array) -> float | None:
    """Give the largest share of an axis's highest speed that any block with a duration uses."""
    lasting = given[:, 0] > 0.0
    return largest(needed[lasting] / given[lasting])


def check_deviation(context: CheckContext, severity: Severity | None, within: Within | None = None) -> Result:
    """Measure how far the tool's centre leaves its chord between two rows.

    A control with tool centre point programming keeps the centre on the chord; one without doesn't, and this
    is what it cuts too deep or leaves.

    Parameters
    ----------
    context : the motion
    severity : of leaving it; None where blocks are inserted between the rows, so that only the figure counts
    within : gives the axes within moves, as a program's text leads them; by default all of them run linearly
    """
    deviation = chord_deviations(context, within)
    figures = {"tip_deviation_mm": largest(deviation)}
    if severity is None:
        return left_out("tip-deviation", figures)
    limit = context.tolerances.deviation
    rows = np.flatnonzero(deviation > limit)

    how = "with all axes linear in machine coordinates " if within is None else ""

    def message(i: int) -> str:
        return (
            f"{how}the tool's centre leaves its chord by {deviation[rows[i]]:.3g} mm (at most {limit:g} mm); "
            "use tool centre point control or put locations closer together"
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
            + (
                "if the control has no TCP"
                if within is None
                else f"within {limit:g} mm, as the text leads it"
            ),
        ),
    )


def chord_deviations(context: CheckContext, within: Within | None = None) -> Array:
    """Measure the largest distance between ball centre and chord in each cutting block.

    Parameters
    ----------
    within : gives the axes, (m, k) mm and rad, at a share of the moves that end at rows, (m,); by default all
        of them run linearly

    Returns
    -------
    (n,), mm; NaN where no cut ends or an axis value is unknown
    """
    ends = np.flatnonzero(context.cutting)
    positions, wanted = context.positions, context.toolpath.centres(context.axis)
    before, after = positions[ends - 1], positions[ends]
    worst = np.zeros(len(ends))
    for share in SAMPLES:
        there = before + share * (after - before) if within is None else within(ends, share)
        tip, axis = tool_poses(context.machine, there)
        centre = tip + context.toolpath.zone.height * axis
        worst = np.maximum(worst, segment_distances(centre, wanted[ends - 1], wanted[ends]))
    deviation = np.full(len(positions), np.nan)
    deviation[ends] = worst
    return deviation


def segment_distances(points: Array, start: Array, end: Array) -> Array:
    """Measure the distance of points to segments, row by row: (n, 3) mm each → (n,) mm."""
    way = end - start
    length = np.sum(way * way, axis=1)
    along = np.sum((points - start) * way, axis=1)
    share = np.clip(along / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    distances: Array = np.linalg.norm(points - (start + share[:, None] * way), axis=1)
    return distances
