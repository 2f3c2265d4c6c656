"""Line and bar charts of the result and its baseline over the path and over time, as SVG."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array
from fiveaxis.lab import CutCourse
from fiveaxis.model import Axis, move_powers, tool_axes
from fiveaxis.posture import RESULT, Optimum
from fiveaxis.show.report.chart import (
    AFTER,
    BEFORE,
    BELOW,
    LEFT,
    TOP,
    Panel,
    Range,
    heading,
    svg,
    text,
    thin_rows,
    widened,
)
from fiveaxis.show.report.facts import FrontPrograms
from fiveaxis.show.report.words import number

LOCATION_LABEL = "location along the path (row, from 0)"
TIME_LABEL = "time (s)"
# Height of a band and of the gap between two, points.
BAND, GAP = 66.0, 12.0
# A line of steps has two points per row, so it gets half the rows of a line of points.
STEP_BUCKETS = 400
# What the charts go over, as the page's script says it.
PATH, TIME = "location", "time in s"


def energy_bars(solution: Optimum, baseline: str | None) -> str:
    """Draw the energy of each axis, of a baseline and after, with the figures on the bars."""
    series, letters = series_of(solution, baseline), solution.machine.letters
    energies = [solution.energies[name] for name in series]
    heights = np.array([[energy.by_axis[letter] for letter in letters] for energy in energies])
    most = max(float(heights.max()), 1e-9)
    panel = Panel(TOP, 140.0, (-0.6, len(letters) - 0.4), (min(0.0, float(heights.min())), 1.12 * most))
    parts = [
        heading(series, "What each axis spends (feed drives only)"),
        panel.frame("energy (J)", "machine axis", x_ticks=dict(enumerate(letters))),
    ]
    width = 0.8 / len(series)
    for row, colour, shift in zip(heights, series.values(), shifts(len(series)), strict=True):
        parts += [panel.bar(k + shift, 0.96 * width, h, colour, number(h)) for k, h in enumerate(row)]
    return svg(panel.bottom + BELOW, parts, f"Bar chart: energy of each axis, {' and '.join(series)}")


def spending_lines(solution: Optimum, baseline: str | None) -> str:
    """Draw the energy added up along the path: it is spent where the line is steep."""
    series, last = series_of(solution, baseline), len(solution.toolpath) - 1
    spent = {}
    for name in series:
        if name in solution.spent:
            spent[name] = solution.spent[name]
            continue
        motion = solution.timed(name)
        spent[name] = np.cumsum(move_powers(solution.machine, motion).sum(axis=1) * motion.time)
    most = max(float(values[-1]) for values in spent.values())
    panel = Panel(TOP, 125.0, along(solution), (0.0, 1.05 * most or 1.0))
    title, label = "Where along the path the energy is spent", "energy so far (J)"
    lines = [thinned_line(panel, last, values, series[name], name) for name, values in spent.items()]
    drawn = panel.group(label, [panel.frame(label, LOCATION_LABEL), *lines])
    return svg(panel.bottom + BELOW, [heading(series, title), drawn], _line_chart(title, series), PATH)


def axis_lines(solution: Optimum, baseline: str | None) -> str:
    """Draw every axis and the tilt along the path, before and after, one band each."""
    machine, series = solution.machine, series_of(solution, baseline)
    rows = {
        name: [*machine.shown(solution.timed(name).positions).T, tilts_shown(solution, name)]
        for name in series
    }
    names = [*(f"{axis.letter} ({axis.unit})" for axis in machine.axes), "tilt (deg)"]
    bounds: list[Sequence[float]] = [()] * len(machine.axes)
    bounds.append(np.degrees([solution.tilt.low, solution.tilt.high]).tolist())
    end = len(solution.toolpath) - 1

    def draw(panel: Panel, name: str, values: Array) -> str:
        return thinned_line(panel, end, values, series[name], name)

    title = "Axis values and tilt along the path"
    return _bands(title, series, (LOCATION_LABEL, PATH), along(solution), names, rows, draw, bounds)


def speed_lines(solution: Optimum, baseline: str | None) -> str:
    """Draw every axis's mean speed in each move over time, with its highest speed dotted if it comes near."""
    machine = solution.machine
    speeds = {
        name: 60.0 * machine.shown(solution.timed(name).speeds).T for name in series_of(solution, baseline)
    }
    names = [f"{axis.letter} ({axis.unit}/min)" for axis in machine.axes]
    bounds = [
        _highest(axis, widened(*(rows[k] for rows in speeds.values()))) for k, axis in enumerate(machine.axes)
    ]
    title = "Speed of every axis, mean over each move"
    return _over_time(title, series_of(solution, baseline), names, speeds, _ends(solution, speeds), bounds)


def power_lines(solution: Optimum, baseline: str | None) -> str:
    """Draw the power of every feed drive over time, at the mean speed of each move, and their sum."""
    powers = {name: drive_powers(solution, name) for name in series_of(solution, baseline)}
    names = [f"{letter} (W)" for letter in (*solution.machine.letters, "all")]
    series = series_of(solution, baseline)
    return _over_time("Power of the feed drives", series, names, powers, _ends(solution, powers))


def cut_lines(course: CutCourse) -> str:
    """Draw the material removal rate, and the power of the cut where it is known, over time."""
    values = {"removal (mm³/s)": course.rate}
    if course.power is not None:
        values["cut (W)"] = course.power
    rows, ends = {RESULT: list(values.values())}, {RESULT: course.ends}
    return _over_time("What is cut of the stock", {RESULT: AFTER}, list(values), rows, ends)


def drive_powers(solution: Optimum, name: str) -> Array:
    """Compute the power of each drive in each move, and in the last row their sum, (k + 1, n) W."""
    powers = move_powers(solution.machine, solution.timed(name)).T
    return np.vstack([powers, powers.sum(axis=0)])


def front_chart(front: FrontPrograms) -> str:
    """Draw the programs of a front by their numbers, over what they cost energy for."""
    energies = [each.point.energy for each in front.points]
    based = front.with_base
    energy = np.array([e.total if e.with_base is None else e.with_base for e in energies])
    over, values = "bends Σ‖Δρ‖² (rad²)", np.array([each.point.bend for each in front.points])
    if front.by_time:
        over, values = "run time on the control’s clock (s)", np.array([e.time for e in energies])
    panel = Panel(TOP, 150.0, widened(values), widened(energy, margin=0.1))
    parts = [
        text(f"What {front.costs} costs{'' if based else ' (feed drives only)'}", LEFT, 12.0, bold=True),
        *(panel.frame("energy (J)", over), panel.line(values, energy, AFTER, 1.0)),
    ]
    for each, x, y in zip(front.points, panel.across(values), panel.down(energy), strict=True):
        size = 5.0 if each.number == front.picked else 3.0
        parts.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{size:g}" fill="{AFTER}"/>')
        parts.append(text(str(each.number), float(x) + 6.0, float(y) - 5.0))
    return svg(panel.bottom + BELOW, parts, f"Line chart: energy over {over}, one point for each solution")


def _ends(solution: Optimum, names: Iterable[str]) -> dict[str, Array]:
    """Return when each move of programs ends, (n,) s."""
    return {name: np.cumsum(solution.timed(name).time) for name in names}


def _over_time(
    title: str,
    series: Mapping[str, str],
    names: Sequence[str],
    values: Mapping[str, Sequence[Array] | Array],
    ends: Mapping[str, Array],
    bounds: Sequence[Sequence[float]] = (),
) -> str:
    """Draw values that hold for the whole move that ends at a row, one band per name."""

    def draw(panel: Panel, name: str, rows: Array) -> str:
        kept = thin_rows(rows, STEP_BUCKETS)
        width = 1.0 if series[name] == AFTER else 2.0
        return panel.steps(ends[name][kept], rows[kept], series[name], width, name)

    x = widened(np.array([0.0]), *ends.values(), margin=0.01)
    return _bands(title, series, (TIME_LABEL, TIME), x, names, values, draw, bounds or [()] * len(names))


def _bands(
    title: str,
    series: Mapping[str, str],
    over: tuple[str, str],
    x: Range,
    names: Sequence[str],
    values: Mapping[str, Sequence[Array] | Array],
    draw: Callable[[Panel, str, Array], str],
    bounds: Sequence[Sequence[float]],
) -> str:
    """Draw bands of lines below each other, each with its bounds dotted.

    Parameters
    ----------
    over : label of the common x axis, and what the page's script calls it
    values : of each line of the series, one after the other by `names`
    """
    parts = [heading(series, title)]
    for k, label in enumerate(names):
        lines = {name: rows[k] for name, rows in values.items()}
        panel = band(k, x, widened(*lines.values(), np.array(bounds[k])))
        drawn = [panel.frame(label, over[0] if k == len(names) - 1 else "")]
        drawn += [panel.level(bound) for bound in bounds[k]]
        drawn += [draw(panel, name, rows) for name, rows in lines.items()]
        parts.append(panel.group(label, drawn))
    return svg(panel.bottom + BELOW, parts, _line_chart(title, series), over[1])


def _line_chart(title: str, series: Mapping[str, str]) -> str:
    return f"Line chart: {title}, {' and '.join(series)}"


def _highest(axis: Axis, shown: Range) -> tuple[float, ...]:
    """Return the highest speeds, per minute, that the motion comes near; others would flatten the line."""
    if axis.max_speed is None:
        return ()
    most = 60.0 * float(axis.shown(axis.max_speed))
    return tuple(bound for bound in (most, -most) if 2.0 * shown[0] <= bound <= 2.0 * shown[1])


def band(index: int, x: Range, y: Range) -> Panel:
    """Make one of several panels below each other, numbered from 0."""
    return Panel(TOP + index * (BAND + GAP), BAND, x, y)


def along(solution: Optimum) -> Range:
    """Compute the range of location numbers, with a little room."""
    return widened(np.array([0.0, len(solution.toolpath) - 1.0]), margin=0.01)


def thinned_line(panel: Panel, last: int, values: Array, colour: str, name: str) -> str:
    """Draw a line from the first location to the last, thinned so that it looks the same."""
    rows = thin_rows(values)
    # A baseline with locations of its own is as long as the result.
    stretch = last / max(len(values) - 1, 1)
    # Where both lines coincide, "before" shows as a rim around "after".
    width = 1.1 if colour == AFTER else 2.2
    return panel.line(stretch * rows.astype(float), values[rows], colour, width, name)


def tilts_shown(solution: Optimum, name: str) -> Array:
    """Compute the angle between tool axis and reference along a chart's line, (n,) deg; NaN without one."""
    motion, tilt = solution.timed(name), solution.tilt
    path = None if name == RESULT else solution.compared[name].toolpath
    if path is not None:
        reference = path.axis if tilt.name == "programmed axis" else path.normal
        tilt = replace(tilt, reference=reference, beside=()).only(path.bounding)
    rotary = motion.positions[:, solution.machine.rotary_columns]
    return np.degrees(tilt.angles(tool_axes(solution.machine, rotary)))


def series_of(solution: Optimum, baseline: str | None) -> dict[str, str]:
    """Return a chart's lines with their colours, "before" first."""
    return ({} if baseline is None else {baseline: BEFORE}) | {RESULT: AFTER}


def shifts(bars: int) -> Array:
    """Compute the offsets of bars side by side at a tick."""
    return (np.arange(bars) - (bars - 1) / 2.0) * 0.8 / bars
