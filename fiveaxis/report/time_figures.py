"""What the axes do over time: their speeds, and the power of their drives, before and after, as SVG."""

from __future__ import annotations

import numpy as np

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.machine import Axis
from fiveaxis.motion import Motion
from fiveaxis.posture import Solution
from fiveaxis.report.canvas import AFTER, thin_rows
from fiveaxis.report.chart import BELOW, Range, svg, widened
from fiveaxis.report.figures import band, heading, motion_of, series_of

TIME_LABEL = "time (s)"
# A line of steps has two points a row: half the rows of a line of points.
BUCKETS = 150


def speed_lines(solution: Solution, baseline: str | None) -> str:
    """Draw every axis's mean speed in each move over time, its highest speed dotted where it is near.

    Parameters
    ----------
    baseline : name of the baseline shown as "before"; None draws the result alone
    """
    machine = solution.machine
    speeds = {
        name: 60.0 * machine.shown(mean_speeds(motion_of(solution, name))).T
        for name in series_of(solution, baseline)
    }
    names = [f"{axis.letter} ({axis.unit}/min)" for axis in machine.axes]
    bounds = [
        _highest(axis, widened(*(rows[k] for rows in speeds.values()))) for k, axis in enumerate(machine.axes)
    ]
    return _bands(solution, baseline, "Speed of every axis, mean over each move", names, speeds, bounds)


def power_lines(solution: Solution, baseline: str | None) -> str:
    """Draw the power of every feed drive over time, at the mean speed of each move, and their sum."""
    powers = {name: drive_powers(solution, name) for name in series_of(solution, baseline)}
    names = [f"{letter} (W)" for letter in (*solution.machine.letters, "all")]
    return _bands(solution, baseline, "Power of the feed drives", names, powers, [()] * len(names))


def drive_powers(solution: Solution, name: str) -> Array:
    """Compute the power of each drive and, in the last row, of all in each move, (k + 1, n) W."""
    powers = move_powers(solution.machine, motion_of(solution, name)).T
    return np.vstack([powers, powers.sum(axis=0)])


def mean_speeds(motion: Motion) -> Array:
    """Compute every axis's mean speed in the move that ends at the row, (n, k), mm/s and rad/s.

    A move that takes no time has none: 0.
    """
    timed = motion.time > 0.0
    return np.where(timed[:, None], motion.moves / np.where(timed, motion.time, 1.0)[:, None], 0.0)


def _bands(
    solution: Solution,
    baseline: str | None,
    title: str,
    names: list[str],
    values: dict[str, Array],
    bounds: list[tuple[float, ...]],
) -> str:
    """Draw what holds for the whole of the move that ends at a row, one band a name."""
    series = series_of(solution, baseline)
    ends = {name: np.cumsum(motion_of(solution, name).time) for name in series}
    x = widened(np.array([0.0]), *ends.values(), margin=0.01)
    parts = [heading(series, title)]
    for k, label in enumerate(names):
        panel = band(k, x, widened(*(rows[k] for rows in values.values()), np.array(bounds[k])))
        parts.append(panel.frame(label, TIME_LABEL if k == len(names) - 1 else ""))
        parts += [panel.level(bound) for bound in bounds[k]]
        for name, colour in series.items():
            rows = thin_rows(values[name][k], BUCKETS)
            width = 1.0 if colour == AFTER else 2.0
            parts.append(panel.steps(ends[name][rows], values[name][k][rows], colour, width))
    return svg(panel.bottom + BELOW, parts)


def _highest(axis: Axis, shown: Range) -> tuple[float, ...]:
    """Give the highest speeds, per minute, that the motion comes near; a far one would flatten the line."""
    if axis.max_speed is None:
        return ()
    most = 60.0 * float(axis.shown(axis.max_speed))
    return tuple(bound for bound in (most, -most) if 2.0 * shown[0] <= bound <= 2.0 * shown[1])
