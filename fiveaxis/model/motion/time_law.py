"""The fastest timing of a motion within feed, and the axes' speeds, accelerations and jerks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, BoolArray, IntArray, MachineError, SettingError, ToolpathError
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.jerk_law import run_with_jerk
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.phases import Phases, run_phases, with_dwells
from fiveaxis.model.motion.rounding import RoundedPath, round_corners
from fiveaxis.model.motion.smoothing import SMOOTH, SmoothPath, smooth_corners
from fiveaxis.model.motion.timing import STANDSTILL, AxisBounds, axis_bounds
from fiveaxis.model.toolpath.dividing import part_places

# mm per rad: lever for deviations of rotary axes, about a cutter's radius.
LEVER = 10.0
# A dwell is a row in which no axis moves by more (mm, rad) and that takes longer (s).
NO_MOVE, SHORTEST_DWELL = 1e-9, 1e-3
# s: shortest duration of a block, and of a limit that is reported.
INSTANT = 1e-9
# Gauss points of an interval from 0 to 1, exact for powers up to the third degree in time.
GAUSS_POINTS = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)
# A run within jerk that takes so many times as long as without is compared with one that stops at corners.
MUCH_LONGER = 1.3


@dataclass(frozen=True, eq=False)
class Samples:
    """A time law sampled so that the weighted sum is the integral over time.

    Parameters
    ----------
    time : (s,), s, ascending
    weight : (s,), s; the sum over a block is its duration
    block : (s,), row of the motion at which the sample's move ends
    position, speed, acceleration : (s, k), mm and rad, per s, per s²
    """

    time: Array
    weight: Array
    block: IntArray
    position: Array
    speed: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """A motion in time: station along its path, in phases of constant second derivative, or smooth ones.

    Parameters
    ----------
    motion : with the times of this law
    path : of the axes, corners rounded
    phases : of the station in time
    feed_speed : (n,), mm/s, path speed in each block at its feed; NaN where nothing moves
    bounds : of the axes
    """

    motion: Motion
    path: RoundedPath
    phases: Phases
    feed_speed: Array
    bounds: AxisBounds

    @property
    def total(self) -> float:
        """Time of the whole motion, s."""
        return float(self.motion.time.sum())

    @cached_property
    def rates(self) -> Array:
        """(n, k), mm/s and rad/s: speed of every axis at the end of each block."""
        phases = self.phases
        last = np.searchsorted(phases.block, np.arange(len(self.motion)), side="right") - 1
        if len(phases) == 0:
            return np.zeros_like(self.motion.positions)
        held = np.maximum(last, 0)
        path_speed = np.where(last < 0, 0.0, phases.end_path_speed[held])
        # Just before the end, as at a corner without rounding the slope of the block itself counts.
        _, slope, _ = self.path.at(phases.end_station[held] - 1e-9)
        return slope * path_speed[:, None]

    def at(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Compute axis values, speeds and accelerations at given times.

        Parameters
        ----------
        time : (s,) or one, s from the start; before it and after the end the motion rests

        Returns
        -------
        q, qd, qdd : (s, k), mm and rad, per s, per s²
        """
        times = np.atleast_1d(np.asarray(time, dtype=float))
        station, path_speed, path_acceleration, _ = self.phases.at(times)
        position, slope, bend = self.path.at(station)
        acceleration = path_acceleration[:, None] * slope + (path_speed**2)[:, None] * bend
        return position, path_speed[:, None] * slope, acceleration

    def jerk(self, time: Array) -> Array:
        """Compute the axes' jerk at times, (s, k), mm and rad per s³; 0 where none limits the motion."""
        if not isinstance(self.path, SmoothPath):
            return np.zeros((len(time), len(self.motion.letters)))
        station, *rates = self.phases.at(time)
        u1, u2, u3 = (rate[:, None] for rate in rates)
        _, slope, bend, third = self.path.derivatives(station)
        return slope * u3 + 3.0 * bend * u1 * u2 + third * (u1 * u1 * u1)

    @cached_property
    def samples(self) -> Samples:
        """Two samples in every phase, for integrals of a power P(v, a) over time."""
        return self.sampled(np.ones(len(self.phases), dtype=np.int64))

    def sampled(self, parts: IntArray) -> Samples:
        """Take two samples in every part of every phase, for a power that depends on the position too.

        Parameters
        ----------
        parts : (p,), at least 1, number of equal parts of each phase
        """
        phases = self.phases
        phase, begin = part_places(parts)
        start, length = phases.start[phase] + begin * phases.duration[phase], (phases.duration / parts)[phase]
        time = (start[:, None] + length[:, None] * GAUSS_POINTS).ravel()
        block, weight = np.repeat(phases.block[phase], 2), np.repeat(length / 2.0, 2)
        return Samples(time, weight, block, *self.at(time))


def levers(letters: str) -> Array:
    """Return what makes axes comparable, (k,): 1, and of rotary ones mm per rad."""
    return np.array([LEVER if letter in "ABC" else 1.0 for letter in letters])


def time_motion(
    motion: Motion,
    machine: Machine,
    *,
    corners: Literal["exact-stop"] | float | BoolArray = "exact-stop",
    smooth: float = SMOOTH,
) -> TimeLaw:
    """Compute the fastest timing of a motion, with look-ahead over all its blocks.

    Axes run straight from row to row and pass corners on a parabola (`round_corners`). On one of arm a
    between the unit directions d₁ and d₂, at a constant path speed u̇, axis j accelerates at
    ``(d₂ − d₁)_j u̇² / (2 a)``, and ``a = 4 ε / |d₂ − d₁|`` passes the corner at the tolerance ε. So a corner
    with long sides is passed at the path speed

        u̇² = min_j  8 ε A_j / (|d₂ − d₁| · |d₂ − d₁|_j),

    which for one A in all directions and a turn by δ is ``u̇² = 2 ε A / sin²(δ/2)``. Along the path the
    squared path speed is found by reachability analysis (`highest_speeds`). Bounds hold all along the rounded
    path to within rounding (1e-6). Where an axis has a highest jerk and one a highest acceleration, the path
    gets a continuous second derivative (`smooth_corners`), and its quickest run (`run_with_jerk`) keeps all
    bounds. The motion starts and ends at rest and rests in dwells.

    Parameters
    ----------
    motion : n rows with their times at the programmed feed, as from `follow`; the motion of another time law
        would be slowed down twice
    machine : highest speeds, accelerations and jerks; an unstated one sets no bound, and without any
        acceleration the times are those of `block_times`
    corners : ``exact-stop`` stops at every real corner; a number is the tolerance in mm to pass it; (n,)
        bools are the rows with a stop, corner or not, and all others are parts of curves
    smooth : mm, a corner whose widest rounding passes it within this is part of a curve, not a real one;
        ignored if `corners` has bools

    Returns
    -------
    The time law; its motion has the new times

    Raises
    ------
    ToolpathError, MachineError
        The motion has other axes, no rows, or values or times that aren't numbers; a limit isn't above 0.
    SettingError
        A tolerance below 0 or an unknown word for corners; stops for another number of rows.

    References
    ----------
    Pham & Pham (2018) for the analysis.
    """
    _require_timed(motion, machine)
    stops, tolerance = _corner_rule(corners, len(motion))
    _require_length("smooth", smooth)
    if stops is not None:
        smooth = math.inf
    bounds = axis_bounds(machine)
    if bounds.accelerates_at_once:
        tolerance = smooth = 0.0  # without acceleration limits corners need no rounding
    still = (np.abs(motion.moves) <= NO_MOVE).all(axis=1)
    dwells = still & (motion.time > SHORTEST_DWELL)
    held = dwells if stops is None else dwells | stops
    scale, dwelling = levers(motion.letters), np.where(dwells, motion.time, 0.0)

    def law_of(passed: float, smooth: float) -> tuple[TimeLaw, float]:
        """Time the motion with corners passed at tolerances; return also its time without jerk, s."""
        path, station = round_corners(motion.positions, scale, held, tolerance=passed, smooth=smooth)
        path_speed = _feed_speeds(station, np.where(dwells, 0.0, motion.time))
        if bounds.limits_jerk and path.length > 0.0:
            known = run_phases(path, station, path_speed, np.zeros(len(motion)), bounds)
            path = smooth_corners(path, scale, tolerance=passed, smooth=smooth)
            run = run_with_jerk(path, station, path_speed, known, bounds)
            phases = with_dwells(run, station, dwelling)
        else:
            known = phases = run_phases(path, station, path_speed, dwelling, bounds)
        times = np.zeros(len(motion))
        np.add.at(times, phases.block, phases.duration)
        law = TimeLaw(replace(motion, time=times), path, phases, path_speed, bounds)
        return law, float(known.duration.sum())

    law, known = law_of(tolerance, smooth)
    # A control that would creep around corners stops there, at last in every row.
    for passed, bent in ((0.0, smooth), (0.0, 0.0)):
        if bounds.limits_jerk and stops is None and law.total > dwelling.sum() + MUCH_LONGER * known:
            law = min(law, law_of(passed, bent)[0], key=lambda one: one.total)
    return law


def _require_timed(motion: Motion, machine: Machine) -> None:
    """Raise `ToolpathError` or `MachineError` unless a motion belongs to this machine and can be timed."""
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}; machine {machine.name!r} has {machine.letters}"
        )
    if len(motion) == 0:
        raise ToolpathError("no cutter locations to time")
    timed = np.isfinite(motion.time) & (motion.time >= 0.0)
    moved = (np.abs(motion.moves) > STANDSTILL).any(axis=1)
    faults = (
        (~np.isfinite(motion.positions).all(axis=1), "an axis value that isn't a finite number"),
        (~timed, "a time that isn't 0 s or more"),
        (timed & (motion.time == 0.0) & moved, "a move that takes 0 s at its feed"),
    )
    for bad, what in faults:
        if bad.any():
            row = int(np.argmax(bad))
            raise ToolpathError(
                f"location {row} (source line {motion.source[row]}) has {what}"
                f" ({int(bad.sum())} such locations)"
            )


def _feed_speeds(station: Array, times: Array) -> Array:
    """Compute the path speed in each block at its feed, (n,), mm/s; NaN where nothing moves."""
    steps = np.diff(station, prepend=station[:1])
    moving = np.flatnonzero(steps > 0.0)
    # The time of rows that stand still is added to the next move.
    spent = np.diff(np.cumsum(times)[moving], prepend=0.0)
    path_speed = np.full(len(station), np.nan)
    path_speed[moving] = steps[moving] / np.maximum(spent, INSTANT)
    return path_speed


def _corner_rule(corners: str | float | BoolArray, rows: int) -> tuple[BoolArray | None, float]:
    """Return the stops, (n,), if given row by row, and the tolerance of the other corners, mm."""
    if isinstance(corners, np.ndarray):
        if corners.shape != (rows,) or corners.dtype != np.bool_:
            raise SettingError(
                f"corners has the shape {corners.shape}; stops take one bool for each of {rows} rows"
            )
        return corners, 0.0
    if isinstance(corners, str):
        if corners != "exact-stop":
            raise SettingError(f"corners is {corners!r}; it must be 'exact-stop' or a tolerance in mm")
        return None, 0.0
    _require_length("corners", corners)
    return None, float(corners)


def _require_length(name: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0.0):
        raise SettingError(f"{name} is {value:g} mm; it must be 0 or more")
