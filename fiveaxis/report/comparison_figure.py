"""Variants of one job as bars: what each costs beside its baseline."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.report.calibration_figure import FORMATS
from fiveaxis.report.canvas import AFTER, BEFORE, WIDTH, drawing, label_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Inches that a variant takes, and what title and axis take beside them.
STEP, FRAME = 0.42, 1.3
# Bars beyond these can't be read; the table beside the figure has them all.
MOST = 60
# Longer names leave no room for bars.
LONGEST = 48


@dataclass(frozen=True)
class Bar:
    """One variant.

    Parameters
    ----------
    name : what is different about it
    energy, baseline : J, of the feed drives; None where there is none
    status : what is said in place of a missing energy
    """

    name: str
    energy: float | None
    baseline: float | None
    status: str


def comparison_figure(title: str, bars: Sequence[Bar], baseline: str) -> bytes:
    """Draw what variants cost, in their order from top to bottom.

    Parameters
    ----------
    title : of what they are variants
    bars : the variants; of more than `MOST` the first are drawn, and the title says so
    baseline : name of what they are compared with; empty where there is none

    Returns
    -------
    An SVG file

    Raises
    ------
    SettingError
        No variants.
    """
    if not bars:
        raise SettingError("no variants; there is nothing to draw")
    cut = "" if len(bars) <= MOST else f", the first {MOST} of {len(bars)}"
    with drawing("comparison"):
        figure = new_figure(WIDTH, FRAME + STEP * min(len(bars), MOST))
        axes = figure.subplots()
        _draw(axes, bars[:MOST], baseline)
        if baseline:
            figure.legend(loc="outside lower right", ncols=2)
        # A dollar sign would start a formula.
        name = title.replace("$", r"\$")
        label_axes(axes, "energy of the feed drives, no base load (J)", "", f"{name}{cut}")
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", metadata=dict.fromkeys(FORMATS[".svg"]))
    return buffer.getvalue()


def _draw(axes: Axes, bars: Sequence[Bar], baseline: str) -> None:
    places = np.arange(len(bars))
    spent = [bar.energy or 0.0 for bar in bars]
    known = [bar.baseline or 0.0 for bar in bars]
    if baseline:
        axes.barh(places + 0.2, known, 0.36, color=BEFORE, label=baseline)
    axes.barh(places - 0.2, spent, 0.36, color=AFTER, label="optimised")
    for place, bar in zip(places, bars, strict=True):
        said = bar.status if bar.energy is None else f"{bar.energy:,.0f} J".replace(",", " ")
        end = bar.energy or 0.0
        axes.annotate(f" {said}", (end, place - 0.2), verticalalignment="center", fontsize=8.0)
    axes.set_yticks(places, [_shortened(bar.name) for bar in bars])
    # Said outright, as bars that are missing would leave the limits to chance.
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.15 * max(*spent, *known) or 1.0)


def _shortened(name: str) -> str:
    return (name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…").replace("$", r"\$")
