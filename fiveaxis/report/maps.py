"""Maps of the postures that were not chosen, as PNG."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture import Solution
from fiveaxis.report.canvas import (
    AFTER,
    BEFORE,
    FORBIDDEN,
    VEIL,
    WIDTH,
    as_png,
    break_jumps,
    drawing,
    label_axes,
    new_figure,
)
from fiveaxis.report.figures import LOCATION_LABEL, motion_of
from fiveaxis.report.landscape import PostureMap, Surface, modulo_turn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

ANGLE_STEPS = (15.0, 30.0, 45.0, 60.0, 90.0)

_BELOW: dict[str, Any] = {
    "loc": "upper right",
    "bbox_to_anchor": (1.0, -0.14),
    "ncols": 2,
    "borderaxespad": 0.0,
}


def posture_map_png(solution: Solution, landscape: PostureMap, baseline: str | None) -> str:
    """Draw the path against the first rotary axis, coloured by least cost, with the chosen curve.

    Where collisions alone forbid every posture the grey is hatched.

    Returns
    -------
    Address of an inlined PNG
    """
    letter = solution.machine.rotaries[0]
    with drawing("posture-map"):
        figure = new_figure(WIDTH, 3.9)
        axes = figure.subplots()
        mesh = axes.pcolormesh(
            landscape.locations,
            np.degrees(landscape.first),
            landscape.cost.T,
            cmap="cividis",
            rasterized=True,
        )
        _finish(figure, axes, mesh, landscape.first)
        if landscape.colliding.any():
            axes.contourf(
                landscape.locations,
                np.degrees(landscape.first),
                landscape.colliding.T.astype(float),
                levels=[0.5, 1.5],
                colors=[FORBIDDEN],
                hatches=["xxxx"],
            )
        if baseline is not None:
            _curve(axes, solution, baseline, BEFORE, 4.0)
        _curve(axes, solution, "optimised", "white", 1.2)
        label_axes(
            axes, LOCATION_LABEL, f"{letter} (deg)", f"Which {letter} was chosen, and what others cost"
        )
        axes.legend(**_BELOW)
        return as_png(figure)


def surface_png(solution: Solution, surface: Surface, baseline: str | None) -> str:
    """Draw the power surface at one location, the inadmissible region hatched, the chosen posture marked.

    Returns
    -------
    Address of an inlined PNG
    """
    first, second = solution.machine.rotaries
    with drawing("surface"):
        figure = new_figure(WIDTH, 3.7)
        axes = figure.subplots()
        grid = np.degrees(surface.first), np.degrees(surface.second)
        mesh = axes.pcolormesh(*grid, surface.cost.T, cmap="cividis", rasterized=True)
        axes.contourf(
            *grid,
            np.where(surface.allowed.T, 0.0, 1.0),
            levels=[0.5, 1.5],
            colors=[VEIL],
            hatches=["////"],
        )
        _finish(figure, axes, mesh, surface.second)
        _mark_angles(axes.xaxis, surface.first)
        if baseline is not None:
            _posture(axes, solution, surface.location, baseline, "s", BEFORE)
        _posture(axes, solution, surface.location, "optimised", "o", AFTER)
        title = f"Power surface at location {surface.location}; hatched: tilt or limits forbid it"
        label_axes(axes, f"{first} (deg)", f"{second} (deg)", title)
        axes.legend(**_BELOW)
        return as_png(figure)


def _finish(figure: Figure, axes: Axes, mesh: QuadMesh, angles: Array) -> None:
    """Give a map its colour bar, the colour of what is forbidden, and ticks that people count angles by."""
    axes.set_facecolor(FORBIDDEN)
    axes.grid(False)
    figure.colorbar(mesh, ax=axes, label="energy from axis zero, $S_W$ (J)", pad=0.02)
    _mark_angles(axes.yaxis, angles)
    # A posture outside the axis limits widens the picture: it has to be seen.
    axes.margins(0.0)


def _mark_angles(axis: XAxis | YAxis, angles: Array) -> None:
    """Put the ticks of an angle where people count: every 15, 30, 45, 60 or 90 degrees."""
    from matplotlib.ticker import MultipleLocator

    span = float(np.degrees(np.ptp(angles)))
    axis.set_major_locator(MultipleLocator(next((s for s in ANGLE_STEPS if span / s <= 8.0), 90.0)))


def _curve(axes: Axes, solution: Solution, name: str, colour: str, width: float) -> None:
    """Draw the first rotary angle of a motion without its whole turns, rimmed to show on any colour."""
    from matplotlib.patheffects import withStroke

    angles = np.degrees(_modulo(solution, name)[:, 0])
    rim = [withStroke(linewidth=width + 1.6, foreground="black")]
    axes.plot(break_jumps(angles, 180.0), color=colour, label=name, linewidth=width, path_effects=rim)


def _posture(axes: Axes, solution: Solution, location: int, name: str, marker: str, colour: str) -> None:
    """Mark where a motion stands on the surface."""
    first, second = np.degrees(_modulo(solution, name)[location])
    axes.plot(
        first,
        second,
        marker,
        color=colour,
        label=name,
        markersize=9,
        markeredgecolor="white",
        clip_on=False,
        linestyle="none",
    )


def _modulo(solution: Solution, name: str) -> Array:
    """Give the rotary angles of a motion in the shown ranges, (n, 2) rad, chain order."""
    machine = solution.machine
    positions = motion_of(solution, name).positions
    columns = (modulo_turn(positions[:, machine.column(c)], machine.axis(c)) for c in machine.rotaries)
    return np.stack(list(columns), axis=1)
