"""Power of NC programs over time, and their energy by axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.energy import Energy
from fiveaxis.geometry import Array
from fiveaxis.report.canvas import WIDTH, as_svg, drawing, label_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Colours of the axes X Y Z A B C, told apart without colour vision too.
COLOURS = {"X": "#4477AA", "Y": "#66CCEE", "Z": "#EE6677", "A": "#228833", "B": "#AA3377", "C": "#CCBB44"}


def program_figure(
    names: Sequence[str], energies: Sequence[Energy], times: Sequence[Array], by_blocks: Sequence[Array]
) -> str:
    """Draw, for each program, the drives' power over time, and for all the energy by axis.

    Parameters
    ----------
    names, energies : one each a program
    times : (n,), s, of the blocks
    by_blocks : (n, k), J, ∫P dt of the blocks by axis

    Returns
    -------
    SVG
    """
    with drawing("program-energy"):
        figure = new_figure(WIDTH, 2.2 * (len(names) + 1))
        panels = figure.subplots(len(names) + 1, 1)
        letters = list(energies[0].by_axis)
        for axes, name, time, joules in zip(panels, names, times, by_blocks, strict=False):
            _draw_power(axes, name, letters, time, joules)
        _draw_energies(panels[-1], names, energies)
        return as_svg(figure)


def _draw_power(axes: Axes, name: str, letters: Sequence[str], time: Array, joules: Array) -> None:
    """Stack the axes' mean power in each block over the time at which the block runs."""
    runs = time > 0.0
    edges = np.concatenate([[0.0], np.cumsum(time[runs])])
    below = np.zeros(int(runs.sum()))
    for column, letter in enumerate(letters):
        power = joules[runs, column] / time[runs]
        axes.stairs(below + power, edges, baseline=below, fill=True, color=COLOURS[letter], label=letter)
        below = below + power
    label_axes(axes, "time (s)", "drive power (W)", name)
    axes.legend(ncols=len(letters))


def _draw_energies(axes: Axes, names: Sequence[str], energies: Sequence[Energy]) -> None:
    # Programs of one name have a bar each; what an axis gives back stands left of 0.
    places = np.arange(len(names))
    spent, returned = np.zeros(len(names)), np.zeros(len(names))
    for letter in energies[0].by_axis:
        widths = np.array([energy.by_axis[letter] for energy in energies])
        left = np.where(widths < 0.0, returned, spent)
        axes.barh(places, widths, left=left, color=COLOURS[letter], label=letter)
        spent, returned = spent + np.maximum(widths, 0.0), returned + np.minimum(widths, 0.0)
    axes.set_yticks(places, list(names))
    axes.invert_yaxis()
    label_axes(axes, "energy of the feed drives (J)", "program", "by axis, without base power")
