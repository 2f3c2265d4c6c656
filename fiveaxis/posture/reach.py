"""Which locations have no admissible posture, and what stands in their way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray, perpendicular
from fiveaxis.machine import Machine
from fiveaxis.posture.baselines import INSIDE, nearest_to_reference
from fiveaxis.posture.branches import Postures, postures
from fiveaxis.toolpath import TiltBounds, Toolpath

# Tool axes that are tried at a location: rings of this many around the reference, over the tilt range.
RINGS, AXES_PER_RING = 13, 120


def unreachable(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> list[Finding]:
    """List the locations where no tool axis of the tilt range lies within the axis limits.

    Most locations are cleared by the first posture tried, the upward lean of the ``normal`` baseline; the
    rest by sampling the whole tilt range, so a set narrower than the samples' spacing may be missed.

    Returns
    -------
    One finding a location, code ``no-posture``, with the axis and the limit of the nearest posture.
    """
    _, open_rows = nearest_to_reference(toolpath, machine, tilt)
    rows = np.flatnonzero(open_rows)
    return list(_blocked(toolpath, machine, tilt, rows))


def _blocked(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, rows: IntArray) -> Iterator[Finding]:
    for row in rows:
        axes = ring_axes(tilt.reference[row], tilt.low, tilt.high)
        tried = postures(machine, toolpath.at(np.full(len(axes), row)), axes)
        if tried.allowed.any():
            continue
        axis, value, limit, overrun = _nearest_miss(machine, tried)
        yield Finding(
            Severity.ERROR,
            "no-posture",
            f"no tool axis within {np.degrees(tilt.low):g}…{np.degrees(tilt.high):g} deg of the {tilt.name} "
            f"lies inside the axis limits; the nearest needs {axis} ({value}, limit {limit}); widen the "
            "tilt range or set the part up differently",
            toolpath.place(row),
            overrun,
        )


def ring_axes(reference: Array, low: float, high: float) -> Array:
    """Sample tool axes around a reference direction.

    Parameters
    ----------
    reference : (3,), unit vector
    low, high : rad, range of the angle to it

    Returns
    -------
    (rings · axes, 3), unit vectors
    """
    across = perpendicular(reference)
    third = np.cross(reference, across)
    angle = np.linspace(low + INSIDE, high - INSIDE, RINGS)[:, None, None]
    turn = np.linspace(0.0, 2.0 * np.pi, AXES_PER_RING, endpoint=False)[None, :, None]
    around = np.cos(turn) * across + np.sin(turn) * third
    return (np.cos(angle) * reference + np.sin(angle) * around).reshape(-1, 3)


def _nearest_miss(machine: Machine, tried: Postures) -> tuple[str, str, str, float]:
    """Name the axis, its value and limit in the posture that misses its limits by the least."""
    positions = tried.positions.reshape(-1, len(machine.axes))
    positions = positions[np.isfinite(positions).all(axis=1)]
    if not len(positions):
        return "a tool axis that the rotary axes can't give", "none", "none", float("inf")
    shown = machine.shown(positions)
    low, high = machine.shown(machine.low), machine.shown(machine.high)
    overrun = np.maximum(np.maximum(low - shown, shown - high), 0.0)
    best = int(np.argmin(overrun.max(axis=1)))
    column = int(np.argmax(overrun[best]))
    axis = machine.axes[column]
    limit = low[column] if shown[best, column] < low[column] else high[column]
    return (
        axis.letter,
        f"{shown[best, column]:.3f} {axis.unit}",
        f"{limit:g} {axis.unit}",
        float(overrun[best, column]),
    )
