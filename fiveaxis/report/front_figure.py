"""A front as a picture: what steadiness costs."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.files import write_atomically
from fiveaxis.posture.strategy.front import Front
from fiveaxis.report.calibration_figure import FORMATS, require_figure_suffix
from fiveaxis.report.canvas import AFTER, BEFORE, DPI, WIDTH, drawing, label_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_front_figure(front: Front, path: str | Path) -> Path:
    """Draw a front into a file.

    Parameters
    ----------
    front : of `find_front`
    path : .png or .svg, replaced in one step

    Raises
    ------
    SettingError
        Another suffix; the file can't be written.
    """
    suffix = require_figure_suffix(path)
    with drawing("front"):
        buffer = io.BytesIO()
        _draw(front).savefig(buffer, format=suffix[1:], dpi=DPI, metadata=dict.fromkeys(FORMATS[suffix]))
    return write_atomically(path, buffer.getvalue())


def _draw(front: Front) -> Figure:
    if not front.points:
        raise SettingError("the front has no points; there is nothing to draw")
    energy = np.array([point.energy.total for point in front.points])
    bend = np.array([point.bend for point in front.points])
    steepest = np.degrees([point.steepest for point in front.points])
    figure = new_figure(WIDTH, 3.2)
    left, right = figure.subplots(1, 2)
    for axes, values, colour in ((left, bend, AFTER), (right, steepest, BEFORE)):
        axes.plot(values, energy, color=colour, marker="o", markersize=4.0)
        axes.margins(0.1)
    for axes, values in ((left, bend), (right, steepest)):
        for end, name in ((0, "cheapest"), (-1, "smoothest")):
            axes.annotate(
                name, (values[end], energy[end]), xytext=(4.0, 6.0), textcoords="offset points", fontsize=8.0
            )
    label_axes(left, "Σ‖Δρ‖² (rad²)", "energy of the feed drives (J)", "What steadiness costs")
    label_axes(right, "largest turn over the way (deg/mm)", "energy of the feed drives (J)")
    return figure
