"""What the axes do over time: their speeds, and the power of their drives, before and after, as SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.machine import Axis
from fiveaxis.motion import Motion
from fiveaxis.posture import Solution
from fiveaxis.report.canvas import AFTER, BOUND, WIDTH, as_svg, drawing, new_figure, thin_rows
from fiveaxis.report.figures import motion_of, series_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TIME_LABEL = "time (s)"
# A line of steps has two points a row: half the rows of a line of points.
BUCKETS = 150
BAND = 0.95  # inches


def speed_lines(solution: Solution, baseline: str | None) -> str:
    """Draw every axis's mean speed in each move over time, its highest speed dotted where it is near.

    Parameters
    ----------
    baseline : name of the baseline shown as "before"; None draws the result alone
    """
    machine = solution.machine
    with drawing("speed-lines"):
        figure, bands = _bands(len(machine.axes))
        for name, colour in series_of(solution, baseline).items():
            motion = motion_of(solution, name)
            speeds = 60.0 * machine.shown(mean_speeds(motion))
            for band, values in zip(bands, speeds.T, strict=True):
                _steps(band, motion, values, name, colour)
        for band, axis in zip(bands, machine.axes, strict=True):
            band.set_ylabel(f"{axis.letter} ({axis.unit}/min)")
            _mark_highest(band, axis)
        return _finish(figure, bands, "Speed of every axis, mean over each move")


def power_lines(solution: Solution, baseline: str | None) -> str:
    """Draw the power of every feed drive over time, at the mean speed of each move, and their sum."""
    machine = solution.machine
    with drawing("power-lines"):
        figure, bands = _bands(len(machine.axes) + 1)
        for name, colour in series_of(solution, baseline).items():
            motion = motion_of(solution, name)
            powers = move_powers(machine, motion)
            for band, values in zip(bands, [*powers.T, powers.sum(axis=1)], strict=True):
                _steps(band, motion, values, name, colour)
        for band, name in zip(bands, [*machine.letters, "all"], strict=True):
            band.set_ylabel(f"{name} (W)")
        return _finish(figure, bands, "Power of the feed drives")


def mean_speeds(motion: Motion) -> Array:
    """Compute every axis's mean speed in the move that ends at the row, (n, k), mm/s and rad/s.

    A move that takes no time has none: 0.
    """
    timed = motion.time > 0.0
    return np.where(timed[:, None], motion.moves / np.where(timed, motion.time, 1.0)[:, None], 0.0)


def _bands(count: int) -> tuple[Figure, list[Axes]]:
    figure = new_figure(WIDTH, BAND * count + 0.6)
    return figure, list(np.atleast_1d(figure.subplots(count, 1, sharex=True)))


def _steps(axes: Axes, motion: Motion, values: Array, name: str, colour: str) -> None:
    """Draw what holds for the whole of the move that ends at a row."""
    rows = thin_rows(values, BUCKETS)
    width = 1.0 if colour == AFTER else 2.0
    end = np.cumsum(motion.time)[rows]
    axes.plot(end, values[rows], color=colour, label=name, linewidth=width, drawstyle="steps-pre")


def _mark_highest(axes: Axes, axis: Axis) -> None:
    """Dot the highest speed where the motion comes near it; a far one would flatten the line."""
    if axis.max_speed is None:
        return
    low, high = axes.get_ylim()
    most = 60.0 * float(axis.shown(axis.max_speed))
    for bound in (most, -most):
        if 2.0 * low <= bound <= 2.0 * high:
            axes.axhline(bound, color=BOUND, linewidth=0.9, linestyle=":")


def _finish(figure: Figure, bands: list[Axes], title: str) -> str:
    bands[0].set_title(title)
    bands[0].margins(x=0.01)
    bands[-1].set_xlabel(TIME_LABEL)
    figure.align_ylabels()
    bands[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
    return as_svg(figure)
