"""Durations of moves, and the axes' highest speeds and accelerations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, Finding, MachineError, Severity
from fiveaxis.model.kinematics.poses import tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.toolpath.operation import MoveKind
from fiveaxis.model.toolpath.path import Toolpath

# mm: smaller moves are rounding; a control doesn't resolve them.
STANDSTILL = 1e-6
# Where F is the tip's, a block takes at least this share of the time that the pivot would: while the tip
# hardly moves, nothing but highest speeds, which few machine files state, would bound how fast axes turn.
LEAST_OF_PIVOT = 0.5


@dataclass(frozen=True, eq=False)
class AxisBounds:
    """Highest speed, acceleration and jerk of every axis; infinite if the machine states none.

    Parameters
    ----------
    speed : (k,), mm/s and rad/s
    acceleration : (k,), mm/s² and rad/s²
    jerk : (k,), mm/s³ and rad/s³
    """

    speed: Array
    acceleration: Array
    jerk: Array

    @property
    def accelerates_at_once(self) -> bool:
        """Whether no axis has a highest acceleration."""
        return bool(np.isinf(self.acceleration).all())

    @property
    def limits_jerk(self) -> bool:
        """Whether an axis has a highest jerk, and one a highest acceleration."""
        return bool(np.isfinite(self.jerk).any()) and not self.accelerates_at_once


def axis_bounds(machine: Machine) -> AxisBounds:
    """Collect the axes' bounds; `MachineError` for one that isn't a positive number."""
    bounds = {}
    for name, unit in (("max_speed", "s"), ("max_acceleration", "s²"), ("max_jerk", "s³")):
        values = [getattr(axis, name) for axis in machine.axes]
        for axis, value in zip(machine.axes, values, strict=True):
            if value is not None and not value > 0.0:
                raise MachineError(
                    f"machine {machine.name!r}: {name} of {axis.letter} is {axis.shown(value):g} "
                    f"{axis.unit}/{unit}; it must be above 0"
                )
        bounds[name] = np.array([np.inf if value is None else value for value in values])
    return AxisBounds(*bounds.values())


def axis_times(machine: Machine, moves: Array) -> Array:
    """Compute how long moves, (n, k) mm and rad, take at least, (n,) s, since axes have a highest speed."""
    return np.asarray((np.abs(moves) / axis_bounds(machine).speed).max(axis=1, initial=0.0))


def block_times(toolpath: Toolpath, machine: Machine, positions: Array, *, by_tip: bool = False) -> Array:
    """Compute the duration of every move at the programmed feed and the axes' highest speeds.

    The feed is that of the pivot in the workpiece, so it doesn't depend on the posture, or that of the tip,
    which a control with tool centre point control keeps to. In a link nothing is touched, and a pivot beside
    the tool's axis may stand while the tool swings about it: there the feed is that of the tool's centre. A
    move that only turns rotary axes takes the
    programmed number as deg/min, as RS274/NGC controls do. An axis that would exceed its highest speed slows
    the move down. A rapid move takes as long as its slowest axis at `rapid_speeds`. Acceleration isn't
    considered.

    Parameters
    ----------
    toolpath : lengths, feeds and kinds of the moves
    machine : highest speeds; an axis without one sets no bound on cuts and links
    positions : (n, k), mm and rad
    by_tip : whether the feed is that of the tip, which moves straight; the time is then at least
        `LEAST_OF_PIVOT` of what the pivot would take

    Returns
    -------
    (n,), s; 0 for the first row
    """
    moves = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))
    turn = moves[:, machine.rotary_columns].max(axis=1, initial=0.0)
    times = _times_of(_fed_lengths(toolpath, machine, positions, by_tip), turn, toolpath.feed)
    if by_tip:
        # The pivot of an inserted location isn't always known.
        times = np.fmax(times, LEAST_OF_PIVOT * toolpath.lengths / toolpath.feed)
    times = np.maximum(times, axis_times(machine, moves))
    rapid = toolpath.rapid
    times[rapid] = (moves[rapid] / rapid_speeds(machine, toolpath.feed[rapid])).max(axis=1, initial=0.0)
    return times


def _fed_lengths(toolpath: Toolpath, machine: Machine, positions: Array, by_tip: bool) -> Array:
    """Measure the course of the point that the feed is of, in each move, (n,) mm."""
    beside = np.asarray((toolpath.kind == MoveKind.LINK) & bool(toolpath.zone.offset))
    if not (by_tip or beside.any()):
        return toolpath.lengths
    tip, axis = tool_poses(machine, positions)
    point = tip if by_tip else tip + toolpath.zone.height * axis
    steps = np.linalg.norm(np.diff(point, axis=0, prepend=point[:1]), axis=1)
    return steps if by_tip else np.where(beside, steps, toolpath.lengths)


def feed_times(toolpath: Toolpath, turn: Array | float = 0.0) -> Array:
    """Compute the duration of every move at the programmed feed alone, (n,) s; 0 for the first row.

    Where the pivot stands still, what the rotary axes turn by, (n,) rad, counts.
    """
    return _times_of(toolpath.lengths, turn, toolpath.feed)


def _times_of(length: Array, turn: Array | float, feed: Array) -> Array:
    """Compute the durations of moves of some length, mm, or of some turn, rad, where they have none."""
    return np.asarray(np.where(length > STANDSTILL, length, np.degrees(turn)) / feed)


def rapid_speeds(machine: Machine, feed: Array) -> Array:
    """Return the speed of every axis in rapid moves, (n, k) mm/s and rad/s: its highest or the rows' feed.

    Of feeds, (n,) mm/s, rotary axes take the number as deg/s.
    """
    stated = np.where(machine.is_rotary, np.radians(feed)[:, None], feed[:, None])
    known = axis_bounds(machine).speed
    return np.where(np.isfinite(known), known, stated)


def rapid_findings(toolpath: Toolpath, machine: Machine, positions: Array) -> list[Finding]:
    """Report the axes without a known speed in rapid moves, and the feed used instead, in one finding."""
    rapid = np.flatnonzero(toolpath.rapid)
    if not len(rapid):
        return []
    travel = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))[rapid].max(axis=0)
    moving = [axis for axis, most in zip(machine.axes, travel, strict=True) if most > STANDSTILL]
    unknown = [axis.letter for axis in moving if axis.max_speed is None]
    if not unknown:
        return []
    feeds = 60.0 * toolpath.feed[rapid]
    taken = f"{feeds.min():.6g}" + (f" to {feeds.max():.6g}" if np.ptp(feeds) > STANDSTILL else "")
    return [
        Finding(
            Severity.WARNING,
            "rapid-speed-unknown",
            f"machine {machine.name!r} states no highest speed of {', '.join(unknown)}: {len(rapid)} rapid "
            f"moves are timed at the path's {taken} mm/min (deg/min); give the rapid speed (--rapid), or "
            "max_speed in the machine file",
            toolpath.place(int(rapid[0])),
            float(len(rapid)),
        )
    ]


def least_times(toolpath: Toolpath, machine: Machine) -> Array:
    """Compute the part of every move's duration that doesn't depend on the posture, (n,) s.

    It is the duration at the programmed feed. A rapid move has no such part, as its duration depends on the
    axes' travel alone, unless a linear axis has no known speed: then the duration at the row's feed is used.
    """
    return np.where(toolpath.rapid & times_rapids(machine), 0.0, feed_times(toolpath))


def times_rapids(machine: Machine) -> bool:
    """Check whether the highest speed of every linear axis is known, so that rapid moves can be timed."""
    return bool(np.isfinite(axis_bounds(machine).speed[~machine.is_rotary]).all())
