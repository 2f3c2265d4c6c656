"""Figures of the concept pages, drawn from the library's own results; the same bytes at every build."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import fiveaxis as fx

MACHINE = "hayashi-640123"
EXAMPLES = Path(__file__).parents[1] / "examples"
PART = EXAMPLES / "overhang/part.stl"
BLUE, ORANGE, GREY = "#3465a4", "#ce5c00", "#babdb6"
STYLE: Any = {"svg.hashsalt": "fiveaxis", "svg.fonttype": "path", "font.size": 9, "axes.spines.top": False}


def draw_all(folder: Path) -> None:
    """Draw every figure into a folder, beside the pictures of the examples."""
    folder.mkdir(parents=True, exist_ok=True)
    # Its logs aren't in the project, so that it can't be drawn here.
    shutil.copy(EXAMPLES / "calibration/umich-x.svg", folder)
    # The place of `examples/02_power_surface.py`.
    tip = fx.tip_surface(fx.load_machine(MACHINE), (30.0, 10.0, 20.0), normal=(0, 0, 1), tilt=(15, 75))
    tip.write(folder / "power-surface.svg")
    fx.path_valley(solved()).write(folder / "valley.svg")
    drawings = {
        "chain": chain,
        "baselines": baselines,
        "lean": lean,
        "verification": verification,
    }
    with mpl.rc_context(STYLE):
        for name, draw in drawings.items():
            draw().savefig(folder / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")


def chain() -> Figure:
    """Draw the chain of the measured machine, from the workpiece to the tool."""
    code = fx.load_machine(MACHINE).code
    names = ["workpiece", *code.table, "bed", *code.head, "tool"]
    figure, axes = _empty(7.0, 1.3)
    bed = names.index("bed")
    for place, name in enumerate(names):
        colour = GREY if name in ("workpiece", "bed", "tool") else ORANGE if name in "ABC" else BLUE
        _box(axes, place, 0.0, name, colour)
        if place:
            axes.annotate("", (place - 0.42, 0.0), (place - 0.58, 0.0), arrowprops={"arrowstyle": "-"})
    axes.text(bed / 2.0, -0.62, "carries the workpiece", ha="center")
    axes.text((bed + len(names) - 1) / 2.0, -0.62, "carries the tool", ha="center")
    axes.set(xlim=(-0.6, len(names) - 0.4), ylim=(-0.8, 0.5))
    return figure


@cache
def solved() -> fx.Solution:
    """Optimise the example part."""
    tool = fx.Tool.ball(8)
    toolpath = fx.plan_contour(PART, tool, stepdown=3, spacing=0.5, overhang=True, feed_mm_min=1000)
    return fx.optimise(toolpath, fx.load_machine(MACHINE), tilt=(15, 75), effort="quick")


def baselines() -> Figure:
    """Draw the energy of the example's program beside its baselines', by axis."""
    solution = solved()
    energies = {"optimised": solution.energy, **solution.baselines}
    figure = Figure(figsize=(6.0, 2.2))
    axes = figure.subplots()
    names = list(energies)[::-1]
    left = np.zeros(len(names))
    for number, letter in enumerate(solution.energy.by_axis):
        shares = np.array([energies[name].by_axis[letter] for name in names]) / 1000.0
        axes.barh(names, shares, left=left, label=letter, color=f"C{number}")
        left += shares
    axes.set(xlabel="energy of the program's feed drives, kJ")
    axes.legend(ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return figure


def lean() -> Figure:
    """Sketch tilt, lead and lean of a tool on a surface, each in the plane in which it is measured."""
    figure = Figure(figsize=(6.6, 2.4))
    sketches = (
        ("tilt", "any direction", 35.0),
        ("lead", "along the feed →", 35.0),
        ("lean", "across the feed,\nseen from behind", -35.0),
    )
    for axes, (name, about, angle) in zip(figure.subplots(1, 3), sketches, strict=True):
        turn = np.radians(angle)
        tip = (np.sin(turn), np.cos(turn))
        axes.plot([-1.0, 1.0], [0.0, 0.0], color="black")
        axes.annotate("", (0.0, 1.15), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": BLUE})
        axes.annotate("", tip, (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": ORANGE, "lw": 2})
        arc = np.linspace(0.0, turn, 20)
        axes.plot(0.6 * np.sin(arc), 0.6 * np.cos(arc), color="black", lw=0.8)
        axes.text(0.75 * np.sin(turn / 2), 0.72 * np.cos(turn / 2), name, ha="center")
        axes.text(0.0, 1.2, "normal", color=BLUE, ha="center")
        axes.text(1.08 * tip[0], 1.05 * tip[1], "tool", color=ORANGE, ha="center")
        axes.text(0.0, -0.12, about, ha="center", va="top")
        axes.set(xlim=(-1.1, 1.1), ylim=(-0.5, 1.35), aspect="equal")
        axes.axis("off")
    return figure


def verification() -> Figure:
    """Draw what happens to a program between the optimiser and the file."""
    figure, axes = _empty(7.0, 1.0)
    steps = ("postures", "program\nmotion", "text", "read back", "checks", "file")
    for place, name in enumerate(steps):
        _box(axes, place, 0.0, name, ORANGE if name in ("read back", "checks") else GREY)
        if place:
            axes.annotate("", (place - 0.41, 0.0), (place - 0.59, 0.0), arrowprops={"arrowstyle": "->"})
    axes.set(xlim=(-0.6, len(steps) - 0.4), ylim=(-0.5, 0.5))
    return figure


def _empty(width: float, height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height))
    axes = figure.subplots()
    axes.axis("off")
    return figure, axes


def _box(axes: Axes, x: float, y: float, text: str, colour: str) -> None:
    axes.text(
        x, y, text, ha="center", va="center", bbox={"boxstyle": "round,pad=0.4", "fc": colour, "alpha": 0.5}
    )
