"""Findings on a path as a whole."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array
from fiveaxis.toolpath import Toolpath

# Chord between two tool axes that count as the same: files write 6 to 7 decimals.
SAME_AXIS = 2e-6


def remark_on(toolpath: Toolpath) -> tuple[Finding, ...]:
    """Return the note ``no-simultaneous-path`` if the tool axis never changes within a cut.

    Such a path is a 3-axis path if the tool axis has one direction, and a 3+2 path if it has several.

    Parameters
    ----------
    toolpath : as read; without tool axes or cuts there is no finding
    """
    if not toolpath.has_axes or not toolpath.cutting.any() or _turns_while_cutting(toolpath):
        return ()
    directions = _distinct(toolpath.axis[toolpath.cutting])
    several = len(directions) > 1
    # + 0.0 removes the sign of a negative zero.
    first = ", ".join(f"{c + 0.0:.6g}" for c in directions[0])
    what = (
        f"a 3+2 path: its cuts have {len(directions)} directions of the tool axis, and none of them changes "
        "within a cut"
        if several
        else f"a 3-axis path: its cuts have one direction of the tool axis, ({first})"
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
    """Check whether the tool axis changes within any cutting move."""
    turns = np.linalg.norm(np.diff(toolpath.axis, axis=0), axis=1) > SAME_AXIS
    return bool(np.any(turns & toolpath.cutting[1:]))


def _distinct(axes: Array) -> Array:
    """Return the distinct directions, (m, 3), in order of appearance."""
    # Exact duplicates are removed first: few directions remain to be compared one by one.
    _, first = np.unique(axes, axis=0, return_index=True)
    kept: list[Array] = []
    for axis in axes[np.sort(first)]:
        if not any(np.linalg.norm(axis - k, axis=-1) <= SAME_AXIS for k in kept):
            kept.append(axis)
    return np.array(kept)
