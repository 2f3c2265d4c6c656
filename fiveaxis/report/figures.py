"""Line and bar charts, as SVG."""

from __future__ import annotations

import numpy as np

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.kinematics import tool_axes
from fiveaxis.motion import Motion
from fiveaxis.posture import Solution
from fiveaxis.report.canvas import AFTER, BEFORE, thin_rows
from fiveaxis.report.chart import (
    BELOW,
    LEFT,
    RIGHT,
    TOP,
    WIDTH,
    Panel,
    Range,
    legend,
    svg,
    text,
    widened,
)

LOCATION_LABEL = "location along the path (row, from 0)"
# Points: height of a band, and of what is between two.
BAND, GAP = 66.0, 12.0


def energy_bars(solution: Solution, baseline: str | None) -> str:
    """Draw the energy of each axis before and after, with the figures on the bars.

    Parameters
    ----------
    baseline : name of the baseline shown as "before"; None draws the result alone
    """
    series, letters = series_of(solution, baseline), solution.machine.letters
    energies = [solution.energy if name == "optimised" else solution.baselines[name] for name in series]
    heights = np.array([[energy.by_axis[letter] for letter in letters] for energy in energies])
    most = max(float(heights.max()), 1e-9)
    panel = Panel(TOP, 140.0, (-0.6, len(letters) - 0.4), (min(0.0, float(heights.min())), 1.12 * most))
    parts = [
        heading(series, "What each axis spends (feed drives only)"),
        panel.frame("energy (J)", "machine axis", x_ticks=dict(enumerate(letters))),
    ]
    width = 0.8 / len(series)
    for row, colour, shift in zip(heights, series.values(), _shifts(len(series)), strict=True):
        parts += [panel.bar(k + shift, 0.96 * width, h, colour, _joules(h)) for k, h in enumerate(row)]
    return svg(panel.bottom + BELOW, parts)


def spending_lines(solution: Solution, baseline: str | None) -> str:
    """Draw the energy added up along the path: steep is where it goes."""
    series = series_of(solution, baseline)
    spent = {}
    for name in series:
        motion = motion_of(solution, name)
        spent[name] = np.cumsum(move_powers(solution.machine, motion).sum(axis=1) * motion.time)
    most = max(float(values[-1]) for values in spent.values())
    panel = Panel(TOP, 125.0, along(solution), (0.0, 1.05 * most or 1.0))
    lines = (thinned_line(panel, values, series[name]) for name, values in spent.items())
    return svg(
        panel.bottom + BELOW,
        [
            heading(series, "Where along the path the energy is spent"),
            panel.frame("energy so far (J)", LOCATION_LABEL),
            *lines,
        ],
    )


def axis_lines(solution: Solution, baseline: str | None) -> str:
    """Draw every axis and the tilt along the path, before and after, one band each."""
    machine, series = solution.machine, series_of(solution, baseline)
    shown = []
    for name in series:
        motion = motion_of(solution, name)
        shown.append([*machine.shown(motion.positions).T, tilts_shown(solution, motion)])
    tilts = np.degrees([solution.tilt.low, solution.tilt.high])
    names = [*(f"{axis.letter} ({axis.unit})" for axis in machine.axes), "tilt (deg)"]
    parts = [heading(series, "Axis values and tilt along the path")]
    for k, name in enumerate(names):
        values = [columns[k] for columns in shown]
        last = name == names[-1]
        panel = band(k, along(solution), widened(*values, *([tilts] if last else [])))
        parts.append(panel.frame(name, LOCATION_LABEL if last else ""))
        parts += [panel.level(float(tilt)) for tilt in tilts] if last else []
        parts += [thinned_line(panel, v, c) for v, c in zip(values, series.values(), strict=True)]
    return svg(panel.bottom + BELOW, parts)


def band(number: int, x: Range, y: Range) -> Panel:
    """Place one of several panels below each other, counted from 0."""
    return Panel(TOP + number * (BAND + GAP), BAND, x, y)


def heading(series: dict[str, str], title: str) -> str:
    """Write what a chart shows, and name its lines."""
    return text(title, LEFT, 12.0, bold=True) + legend(series, WIDTH - RIGHT, 12.0)


def along(solution: Solution) -> Range:
    """Give the range of the locations' numbers, with a little room."""
    return widened(np.array([0.0, len(solution.toolpath) - 1.0]), margin=0.01)


def thinned_line(panel: Panel, values: Array, colour: str) -> str:
    """Draw a line over the locations, thinned so that it looks the same."""
    rows = thin_rows(values)
    # Where both lines coincide the one before shows as a rim about the one after.
    return panel.line(rows.astype(float), values[rows], colour, 1.1 if colour == AFTER else 2.2)


def motion_of(solution: Solution, name: str) -> Motion:
    """Find the motion of a line in a chart: a baseline's, or the result's under the name "optimised"."""
    return solution.motion if name == "optimised" else solution.compared[name].motion


def tilts_shown(solution: Solution, motion: Motion) -> Array:
    """Measure the angle between tool axis and reference along a motion, (n,) deg, NaN where nothing binds."""
    rotary = motion.positions[:, solution.machine.rotary_columns]
    return np.degrees(solution.tilt.angles(tool_axes(solution.machine, rotary)))


def series_of(solution: Solution, baseline: str | None) -> dict[str, str]:
    """Give the lines of a chart with their colours, before first."""
    return {"optimised": AFTER} if baseline is None else {baseline: BEFORE, "optimised": AFTER}


def _shifts(bars: int) -> Array:
    """Place so many bars side by side about a tick."""
    return (np.arange(bars) - (bars - 1) / 2.0) * 0.8 / bars


def _joules(value: float) -> str:
    """Write an energy with thin spaces between thousands."""
    return f"{value:,.0f}".replace(",", "\u2009")
