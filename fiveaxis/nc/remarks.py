"""What a reader has to say about a path as a whole."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array
from fiveaxis.toolpath import Toolpath

# Axes further apart than this (the chord between two unit vectors) differ: files write 6 to 7 decimals.
SAME_AXIS = 2e-6


def remark_on(toolpath: Toolpath) -> tuple[Finding, ...]:
    """Say what someone who means to optimise the path should know about it.

    ``no-simultaneous-path`` (a note): the tool axis never changes within a cut. That is a 3-axis path if it
    has one direction, and a 3+2 path if it has several.

    Parameters
    ----------
    toolpath : as read; one without tool axes, or without cuts, has nothing to say
    """
    if not toolpath.has_axes or not toolpath.cutting.any() or _turns_while_cutting(toolpath):
        return ()
    directions = _distinct(toolpath.axis[toolpath.cutting])
    several = len(directions) > 1
    what = (
        f"a 3+2 path: its cuts have {len(directions)} directions of the tool axis, and none of them changes "
        "within a cut"
        if several
        else f"a 3-axis path: its cuts have one direction of the tool axis, {_shown(directions[0])}"
    )
    return (
        Finding(
            Severity.NOTE,
            "no-simultaneous-path",
            f"{what}; there is no simultaneous 5-axis motion in it",
            Place(file=toolpath.name),
            float(len(directions)),
        ),
    )


def _turns_while_cutting(toolpath: Toolpath) -> bool:
    """Tell whether the axis at the end of any cutting move differs from that at its begin."""
    turns = np.linalg.norm(np.diff(toolpath.axis, axis=0), axis=1) > SAME_AXIS
    return bool(np.any(turns & toolpath.cutting[1:]))


def _distinct(axes: Array) -> Array:
    """Keep one of each direction, (m, 3), in the order of their first appearance."""
    # Exact twins go first: a long path has few directions, and these are then compared one by one.
    _, first = np.unique(axes, axis=0, return_index=True)
    kept: list[Array] = []
    for axis in axes[np.sort(first)]:
        if not any(np.linalg.norm(axis - k) <= SAME_AXIS for k in kept):
            kept.append(axis)
    return np.array(kept)


def _shown(axis: Array) -> str:
    # + 0.0 takes the sign from a minus zero.
    return "(" + ", ".join(f"{c + 0.0:.6g}" for c in axis) + ")"
