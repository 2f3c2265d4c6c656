"""The check of the finished part: the stock is cut along the program and compared with the part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, Severity
from fiveaxis.check.stock.cutting import SLACK, Blank, CutStock, cut_stock
from fiveaxis.check.stock.sweeping import Poses
from fiveaxis.check.verification.check_context import WORDING, CheckContext
from fiveaxis.check.verification.collisions import CODES, REMEDIES
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result
from fiveaxis.model import CUTTER, Interpolation, interpolate


def check_removal(
    context: CheckContext, blank: Blank, *, tcp_height: float | None = None
) -> Iterator[Result]:
    """Cut a stock along the real moves of the axes, links and rapids too, and compare it with the part.

    It is a second opinion to `check_gouge`: other code finds where the part is cut into, and by which block.

    Parameters
    ----------
    context : the motion, with the tool that cuts
    blank : the stock before, with the part in it
    tcp_height : mm above the tip, of the point that moves straight under TCP; None with joint interpolation

    Returns
    -------
    ``gouge``, errors: material of the part is gone, deeper than `Tolerances.chord_gouge`; ``left-over``,
    warnings: ridges between places that are finished, higher than `Blank.tolerance`; ``shank-collision``,
    ``holder-collision`` and, of the cutter at rapid, ``fixture-collision``, errors: they reach into the stock
    as it is at that moment
    """
    cut = cut_along(context, blank, tcp_height)
    how = WORDING[Interpolation.JOINT if tcp_height is None else Interpolation.TCP]
    yield replace(_gouges(cut, context.tolerances.chord_gouge, how), cut=cut)
    yield _left_over(cut, context.toolpath.tool.radius)
    for name in cut.touched:
        yield _touches(cut, name)


def cut_along(context: CheckContext, blank: Blank, tcp_height: float | None) -> CutStock:
    """Cut a stock along the moves between known positions; arguments as for `check_removal`."""
    known = np.asarray(np.isfinite(context.positions).all(axis=1))
    rows = np.flatnonzero(known[1:] & known[:-1]) + 1
    rapid = rows[context.toolpath.rapid[rows]]
    return cut_stock(blank, context.toolpath.tool, _poses(context, tcp_height), rows, len(known), rapid)


def _poses(context: CheckContext, tcp_height: float | None) -> Poses:
    """Return the tool's poses at fractional rows, by the independent kinematics."""

    def poses(place: Array) -> tuple[Array, Array]:
        tip, axis = tool_poses(context.machine, interpolate(context.positions, place))
        if tcp_height is None:
            return tip, axis
        straight = interpolate(context.tip + tcp_height * context.axis, place)
        return straight - tcp_height * axis, axis

    return poses


def _gouges(cut: CutStock, allowed: float, how: str) -> Result:
    found = cut.deviations
    bound = allowed + found.uncertainty
    own = found.surface.cut_by >= cut.first  # what earlier operations made is theirs
    points = found.worst_by_block(np.flatnonzero(own & (found.distance < -bound)), -found.distance)
    depths = -found.distance[points]

    def message(i: int) -> str:
        return (
            f"the finished part lacks {depths[i]:.3g} mm at {_place(found.foot[points[i]])}, cut away on the "
            f"move to here (at most {allowed:g} mm, and {found.uncertainty:g} mm for the rays of the stock); "
            "check that part, stock and path have the same zero, or take a smaller tool"
        )

    return Result(
        code="gouge",
        rows=found.surface.cut_by[points] - cut.first,
        values=depths,
        message=message,
        figures={"stock_gouge_mm": found.deepest},
        checked=(
            f"the stock, cut along all moves ({how}) at rays {found.resolution:.3g} mm apart, against the "
            f"part: it lacks at most {allowed:g} mm; at rays to {found.uncertainty:g} mm, and what is "
            "thinner than their distance may be missed",
        ),
    )


def _left_over(cut: CutStock, radius: float) -> Result:
    found, tolerance = cut.deviations, cut.blank.tolerance
    ridges = found.ridges(tolerance + found.uncertainty, radius)
    points = found.worst_by_block(ridges[found.surface.cut_by[ridges] >= cut.first], found.distance)
    heights, finished = found.distance[points], found.share(-tolerance, tolerance)

    def message(i: int) -> str:
        return (
            f"{heights[i]:.3g} mm of the stock are left at {_place(found.foot[points[i]])} between finished "
            f"places (at most {tolerance:g} mm); bring the passes closer together, or take a larger cutter"
        )

    return Result(
        code="left-over",
        severity=Severity.WARNING,
        rows=found.surface.cut_by[points] - cut.first,
        values=heights,
        message=message,
        figures={
            "left_over_mm": float(heights.max(initial=0.0)),
            "finished_share": finished,
            "left_volume_mm3": found.left_volume,
        },
        checked=(
            f"{100.0 * finished:.3g} % of the part's area are finished to {tolerance:g} mm, and between such "
            "places nothing higher is left",
        ),
    )


def _touches(cut: CutStock, name: str) -> Result:
    """Tell where shank or holder, or the cutter at rapid, reach into the stock as it is at that moment."""
    volume, depth = cut.touched[name], SLACK * cut.deviations.uncertainty
    rows, moves = np.flatnonzero(volume > 0.0), "rapid move" if name == CUTTER else "move"

    def message(i: int) -> str:
        return (
            f"the {name} reaches into the stock that is still there, {volume[rows[i]]:.3g} mm3 of it, on the "
            f"{moves} to here; {REMEDIES[name]}"
        )

    return Result(
        code=f"{CODES[name]}-collision",
        rows=rows,
        values=volume[rows],
        message=message,
        figures={f"{name}_in_stock_mm3": float(volume.max(initial=0.0))},
        checked=(f"{name} against the stock as it is then, in every {moves}: at most {depth:g} mm deep",),
    )


def _place(point: Array) -> str:
    """Write a point of the workpiece frame, (3,) mm."""
    return "X {:.2f} Y {:.2f} Z {:.2f}".format(*point)
