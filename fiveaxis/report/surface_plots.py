"""The drawings of the power surface: at a location and along a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.report.chart import FORBIDDEN, break_jumps
from fiveaxis.report.plots import label_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fiveaxis.report.surfaces import LocationSurface, Valley

# Inches.
WIDE, HIGH = 11.0, 4.2
COLOURS = "cividis"
# Okabe & Ito's palette without blue and yellow, which are the map's; the first program is the result.
PROGRAMS = ("#ffffff", "#D55E00", "#56B4E9", "#CC79A7", "#009E73", "#000000")
MARKERS, DASHES = "osD^vP", ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (1, 3)))
RIM, CONTRAST = "#000000", "#ffffff"
LEVELS = 12
# Ticks of angles: 15, 30, 45, 60 or 90 deg, times a power of ten.
ANGLE_STEPS = [1, 1.5, 3, 4.5, 6, 9, 10]


def draw_location(surface: LocationSurface, parts: Mapping[str, Array]) -> Figure:
    """Draw parts of the power surface, (g, h) J each, over both rotary angles.

    Hatched is what tilt or axis limits forbid; a dotted line is a bound of the tilt, a dashed one the middle
    between the branches. A filled marker is a program's posture, a hollow one its other branch.
    """
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(WIDE, HIGH)
    panels = figure.subplots(1, len(parts), sharex=True, sharey=True)
    letters = surface.power.letters
    across, up = np.degrees(surface.power.first), np.degrees(surface.power.second)
    # The branches meet in their middle and half a turn from there.
    halves = np.degrees(surface.middle) + 180.0 * np.arange(-4, 5)
    middles = halves[(halves > up[0]) & (halves < up[-1])]
    for axes, (name, joules) in zip(panels, parts.items(), strict=True):
        _draw_map(axes, across, up, joules)
        _draw_bounds(axes, across, up, surface)
        for level in middles:
            axes.axhline(level, color=CONTRAST, linewidth=1.0, linestyle="--")
        for number, (program, postures) in enumerate(surface.postures.items()):
            _mark(axes, np.degrees(postures), number, program)
        label_axes(axes, f"{letters[0]} (deg)", f"{letters[1]} (deg)" if axes is panels[0] else "", name)
    for axis in (panels[0].xaxis, panels[0].yaxis):
        axis.set_major_locator(MaxNLocator(8, steps=ANGLE_STEPS))
    heading = f"Energy from the axes' zero: {surface.title}\n{_explanation(surface)}"
    figure.suptitle(_plain(heading), fontsize=9.0)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, facecolor="#999999", framealpha=1.0)
    return figure


def _explanation(surface: LocationSurface) -> str:
    bounds = " and ".join(lean.text for lean in surface.leans)
    return (
        "hatched: tilt or axis limits forbid it · dashed: between the branches · "
        f"hollow: same tool axis, other branch{f' · dotted: {bounds}' if bounds else ''}"
    )


def draw_valley(valley: Valley) -> Figure:
    """Draw the least energy over path and first rotary angle with the programs' postures in it.

    Below is S_W of each program's posture along the path. Grey: no posture is admissible.
    """
    figure = new_figure(WIDE, 7.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    along, up = valley.locations.astype(float), np.degrees(valley.first)
    _draw_map(upper, along, up, valley.cost)
    floor = np.where(np.isnan(valley.cost), np.inf, valley.cost).min(axis=1)
    floor[np.isinf(floor)] = np.nan
    lower.plot(along, floor, color="#888888", label="floor of the valley")
    for number, (name, angles) in enumerate(valley.postures.items()):
        look = _line(number)
        # A wrapped angle jumps by a turn, and no line goes there.
        line = break_jumps(np.degrees(angles), 180.0)
        upper.plot(along, line, label=name, **look, path_effects=_rim(look["linewidth"]))
        lower.plot(along, valley.heights[name], **look, path_effects=_rim(look["linewidth"]))
    label_axes(
        upper, "", f"{valley.letter} (deg)", _plain(f"Least S_W of each {valley.letter}: {valley.title}")
    )
    label_axes(lower, "location along the path (row, from 0)", "S_W of the posture (J)")
    lower.legend()
    figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    if valley.elsewhere:
        names = ", ".join(valley.elsewhere)
        lower.set_title(f"not shown, with locations of their own: {names}", fontsize=8.0, fontweight="normal")
    return figure


def _draw_map(axes: Axes, across: Array, up: Array, joules: Array) -> None:
    """Draw numbers, (g, h), as colours with contour lines; NaN is grey."""
    axes.set_facecolor(FORBIDDEN)
    axes.grid(visible=False)
    seen = np.ma.masked_invalid(joules.T)
    edges = (*_edges(across), *_edges(up))
    picture = axes.imshow(
        seen, origin="lower", extent=edges, aspect="auto", cmap=COLOURS, interpolation="nearest"
    )
    if seen.count() and min(seen.shape) > 1 and float(seen.max()) > float(seen.min()):
        axes.contour(across, up, seen, levels=LEVELS, colors="#ffffff", linewidths=0.3)
    axes.figure.colorbar(picture, ax=axes, label="J", pad=0.02)


def _edges(grid: Array) -> tuple[float, float]:
    half = 0.5 * float(grid[-1] - grid[0]) / (len(grid) - 1) if len(grid) > 1 else 0.5
    return float(grid[0]) - half, float(grid[-1]) + half


def _draw_bounds(axes: Axes, across: Array, up: Array, surface: LocationSurface) -> None:
    """Hatch what is forbidden, and draw the bounds of the tilt as lines with their angles."""
    forbidden = np.logical_not(surface.admissible).T.astype(float)
    if forbidden.any():
        axes.contourf(across, up, forbidden, levels=[0.5, 1.5], colors=["#ffffff50"], hatches=["///"])
    for lean in surface.leans:
        angle = np.degrees(lean.angle).T
        levels = [level for level in np.degrees([lean.low, lean.high]) if angle.min() < level < angle.max()]
        if levels:
            lines = axes.contour(
                across, up, angle, levels=levels, colors=CONTRAST, linewidths=1.2, linestyles=":"
            )
            axes.clabel(lines, fmt="%.3g°", fontsize=7.0)


def _mark(axes: Axes, postures: Array, number: int, name: str) -> None:
    """Mark a program's posture, and its other branch."""
    look: Any = {
        "linestyle": "none",
        "marker": MARKERS[number % len(MARKERS)],
        "markersize": 9.0 if number == 0 else 6.5,
        "zorder": 4.0 - 0.1 * number,
    }
    colour = PROGRAMS[number % len(PROGRAMS)]
    axes.plot(*postures[0], **look, color=colour, markeredgecolor=RIM, label=_plain(name))
    for other in postures[1:]:
        axes.plot(*other, **look, markerfacecolor="none", markeredgecolor=colour, markeredgewidth=1.6)


def _line(number: int) -> Any:
    return {
        "color": PROGRAMS[number % len(PROGRAMS)],
        "linestyle": DASHES[number % len(DASHES)],
        "linewidth": 2.2 if number == 0 else 1.5,
        "zorder": 4.0 - 0.1 * number,
    }


def _rim(width: float) -> Any:
    """Put a dark rim around a line, so that it is seen on any colour."""
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=width + 1.4, foreground=RIM), Normal()]


def _plain(text: str) -> str:
    # A dollar sign would start a formula.
    return text.replace("$", r"\$")
