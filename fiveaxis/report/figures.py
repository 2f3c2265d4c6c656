"""Line and bar charts, as SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.kinematics import tool_axes
from fiveaxis.motion import Motion
from fiveaxis.posture import Solution
from fiveaxis.report.canvas import (
    AFTER,
    BEFORE,
    BOUND,
    WIDTH,
    as_svg,
    drawing,
    label_axes,
    new_figure,
    thin_rows,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOCATION_LABEL = "location along the path (row, from 0)"


def energy_bars(solution: Solution, baseline: str | None) -> str:
    """Draw the energy of each axis before and after, with the figures on the bars.

    Parameters
    ----------
    baseline : name of the baseline shown as "before"; None draws the result alone
    """
    series = series_of(solution, baseline)
    energies = [solution.energy if name == "optimised" else solution.baselines[name] for name in series]
    with drawing("energy-bars"):
        figure = new_figure(WIDTH, 2.9)
        axes = figure.subplots()
        for (name, colour), energy, shift in zip(series.items(), energies, _shifts(len(series)), strict=True):
            heights = [energy.by_axis[letter] for letter in solution.machine.letters]
            bars = axes.bar(
                np.arange(len(heights)) + shift, heights, 0.8 / len(series), color=colour, label=name
            )
            axes.bar_label(bars, labels=[_joules(h) for h in heights], padding=2, fontsize=8)
        axes.set_xticks(range(len(solution.machine.letters)), list(solution.machine.letters))
        axes.grid(False, axis="x")
        axes.margins(y=0.15)
        label_axes(axes, "machine axis", "energy (J)", "What each axis spends (feed drives only)")
        axes.legend()
        return as_svg(figure)


def spending_lines(solution: Solution, baseline: str | None) -> str:
    """Draw the energy added up along the path: steep is where it goes."""
    with drawing("spending-lines"):
        figure = new_figure(WIDTH, 2.6)
        axes = figure.subplots()
        for name, colour in series_of(solution, baseline).items():
            motion = motion_of(solution, name)
            powers = move_powers(solution.machine, motion).sum(axis=1)
            spent = np.cumsum(powers * motion.time)
            _line(axes, spent, name, colour)
        axes.set_ylim(bottom=0.0)
        axes.margins(x=0.01)
        label_axes(axes, LOCATION_LABEL, "energy so far (J)", "Where along the path the energy is spent")
        axes.legend()
        return as_svg(figure)


def axis_lines(solution: Solution, baseline: str | None) -> str:
    """Draw every axis and the tilt along the path, before and after, one band each."""
    letters = solution.machine.letters
    with drawing("axis-lines"):
        figure = new_figure(WIDTH, 1.15 * (len(letters) + 1) + 0.6)
        bands = figure.subplots(len(letters) + 1, 1, sharex=True)
        for name, colour in series_of(solution, baseline).items():
            motion = motion_of(solution, name)
            shown = solution.machine.shown(motion.positions)
            for band, values in zip(bands, [*shown.T, tilts_shown(solution, motion)], strict=True):
                _line(band, values, name, colour)
        for band, axis in zip(bands, solution.machine.axes, strict=False):
            band.set_ylabel(f"{axis.letter} ({axis.unit})")
        _mark_tilt_bounds(bands[-1], solution)
        bands[0].set_title("Axis values and tilt along the path")
        bands[0].margins(x=0.01)
        bands[-1].set_xlabel(LOCATION_LABEL)
        figure.align_ylabels()
        bands[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
        return as_svg(figure)


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


def _line(axes: Axes, values: Array, name: str, colour: str) -> None:
    rows = thin_rows(values)
    # Where both lines coincide the one before shows as a rim about the one after.
    width = 1.1 if colour == AFTER else 2.2
    axes.plot(rows, values[rows], color=colour, label=name, linewidth=width)


def _mark_tilt_bounds(axes: Axes, solution: Solution) -> None:
    for bound in np.degrees([solution.tilt.low, solution.tilt.high]):
        axes.axhline(bound, color=BOUND, linewidth=0.9, linestyle=":")
    axes.set_ylabel("tilt (deg)")


def _joules(value: float) -> str:
    """Write an energy with thin spaces between thousands."""
    return f"{value:,.0f}".replace(",", "\u2009")
