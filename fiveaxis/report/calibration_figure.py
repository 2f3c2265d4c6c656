"""A calibration as a picture: power and its residuals over the axis's speed."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from fiveaxis.energy.calibration_record import Calibration
from fiveaxis.errors import SettingError
from fiveaxis.files import write_atomically
from fiveaxis.report.canvas import AFTER, BEFORE, BOUND, DPI, WIDTH, drawing, label_axes, new_figure

# Suffix of the file -> metadata that would make two runs differ.
FORMATS = {".png": ("Software",), ".svg": ("Date", "Creator", "Format", "Type")}


def write_calibration_figure(calibration: Calibration, path: str | Path) -> Path:
    """Draw measured and fitted power over speed, and what is left in the order of the log.

    A model that lacks a term shows as a bend of the residuals over speed, one whose state drifts (warming
    oil) as a slope over the rows; the band is the residuals' robust scale.

    Parameters
    ----------
    calibration : of `calibrate_drive`
    path : .png or .svg, replaced in one step

    Raises
    ------
    SettingError
        Another suffix; the file can't be written.
    """
    suffix = require_figure_suffix(path)
    turns = calibration.axis in "ABC"
    speed = np.degrees(calibration.speed) if turns else calibration.speed
    left = calibration.power - calibration.fitted
    with drawing("calibration"):
        figure = new_figure(WIDTH, 6.4)
        upper, middle, lower = figure.subplots(3, 1)
        dots = {"linestyle": "none", "marker": ".", "markersize": 3.0}
        upper.plot(speed, calibration.power, color=BEFORE, label="measured", **dots)
        upper.plot(speed, calibration.fitted, color=AFTER, label="fitted", **dots)
        upper.legend()
        middle.plot(speed, left, color=AFTER, **dots)
        lower.plot(calibration.lines, left, color=AFTER, **dots)
        for axes in (middle, lower):
            axes.axhspan(-calibration.noise, calibration.noise, color=BOUND, alpha=0.15, linewidth=0.0)
        unit = "deg/s" if turns else "mm/s"
        title = f"Axis {calibration.axis}, {calibration.model} model, R² {calibration.r_squared:.3f}"
        label_axes(upper, f"speed ({unit})", "power (W)", title)
        label_axes(middle, f"speed ({unit})", "residual (W)")
        label_axes(lower, "line of the log", "residual (W)")
        figure.align_ylabels()
        buffer = io.BytesIO()
        figure.savefig(buffer, format=suffix[1:], dpi=DPI, metadata=dict.fromkeys(FORMATS[suffix]))
    return write_atomically(path, buffer.getvalue())


def require_figure_suffix(path: str | Path) -> str:
    """Give a figure's suffix in lower case.

    Raises
    ------
    SettingError
        No format has it.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise SettingError(f"is not a name for a figure; let it end in {' or '.join(FORMATS)}", file=path)
    return suffix
