"""Maps of postures: the power surface at a location, and the least energy along a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture import RESULT, Solution
from fiveaxis.report.chart import (
    AFTER,
    BEFORE,
    BELOW,
    INK,
    LEFT,
    RIGHT,
    WIDTH,
    Panel,
    Range,
    break_jumps,
    labelled,
    legend,
    multiples,
    svg,
    text,
    thin_rows,
    widened,
)
from fiveaxis.report.figures import LOCATION_LABEL, series_of
from fiveaxis.report.heat import LIGHT, SCALE, TALL, WIDE, HeatMap
from fiveaxis.report.landscape import PostureMap, modulo_turn

if TYPE_CHECKING:
    from fiveaxis.report.surfaces import LocationSurface, Valley

ANGLE_STEPS = (15.0, 30.0, 45.0, 60.0, 90.0, 180.0)
# A figure of several maps side by side, points.
SIDE_BY_SIDE, MAPS_TOP = 792.0, 60.0
COST_LABEL = "energy from axis zero, S_W (J)"
# A light line with a dark rim is visible on any colour.
RIM, FLOOR = "#000000", "#888888"
# Okabe & Ito's palette without blue and yellow, which are the map's; the first program is the result.
PROGRAMS = (LIGHT, "#D55E00", "#56B4E9", "#CC79A7", "#009E73", RIM)
DASHES = ("", "6 2", "6 2 1 2", "1 2", "8 1.5 1.5 1.5 1.5 1.5", "1 4")
DOTTED, DASHED = "1 1.6", "5 3"
# Outlines of marks, of about the same size: circle, square, diamond, triangles, cross.
MARKS = (
    "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z",
    "M-.9-.9h1.8v1.8h-1.8z",
    "M0-1.25L1.25 0L0 1.25L-1.25 0z",
    "M0-1.1L1.1.8h-2.2z",
    "M0 1.1L1.1-.8h-2.2z",
    "M-.4-1.1h.8v.7h.7v.8h-.7v.7h-.8v-.7h-.7v-.8h.7z",
)


def posture_map_figure(solution: Solution, landscape: PostureMap, baseline: str | None) -> str:
    """Draw the least cost over the path and the first rotary axis, with the chosen curve.

    The grey is hatched where only collisions forbid every posture.
    """
    letter = solution.machine.rotaries[0]
    # A baseline with locations of its own has no curve here.
    elsewhere = baseline is not None and solution.compared[baseline].toolpath is not None
    names = series_of(solution, None if elsewhere else baseline)
    curves = {name: np.degrees(_modulo(solution, name)) for name in names}
    reached = [np.column_stack([np.arange(len(angles)), angles]) for angles in curves.values()]
    locations = landscape.locations.astype(float)
    heat = HeatMap(locations, np.degrees(landscape.first), landscape.cost, np.concatenate(reached))
    parts = [
        text(f"Which {letter} was chosen, and what others cost", LEFT, 12.0, bold=True),
        *heat.draw(COST_LABEL, landscape.colliding, crossed=True),
        heat.panel.frame(f"{letter} (deg)", LOCATION_LABEL, y_ticks=_angle_ticks(heat.panel.y), grid=False),
    ]
    for name, angles in curves.items():
        colour, width = (LIGHT, 1.4) if name == RESULT else (BEFORE, 3.4)
        broken = break_jumps(angles, 180.0)
        # Jumps stay: a line from before to after one would cross the map.
        rows = np.union1d(thin_rows(broken), np.flatnonzero(np.isnan(broken)))
        x, y = rows.astype(float), broken[rows]
        parts += [heat.panel.line(x, y, RIM, width + 1.6), heat.panel.line(x, y, colour, width)]
    colours = {name: INK if name == RESULT else BEFORE for name in curves}
    label = f"Map: energy over location and {letter}, with the chosen {letter} as a line"
    return svg(heat.panel.bottom + BELOW, [*parts, legend(colours, LEFT + WIDE, 12.0)], label)


def surface_figure(surface: LocationSurface, baseline: str | None) -> str:
    """Draw the power surface at a location with the chosen posture: hatched where tilt or limits forbid."""
    first, second = surface.power.letters
    # A baseline with locations of its own has no posture here.
    colours = {} if baseline is None or baseline not in surface.postures else {baseline: BEFORE}
    colours[RESULT] = AFTER
    marked = {name: np.degrees(surface.postures[name][0]) for name in colours}
    across, up = np.degrees(surface.power.first), np.degrees(surface.power.second)
    heat = HeatMap(across, up, surface.power.total, np.array(list(marked.values())))
    panel = heat.panel
    title = f"Power surface at location {surface.location}; hatched: tilt or limits forbid it"
    parts = [
        text(title, LEFT, 12.0, bold=True),
        *heat.draw(COST_LABEL, ~surface.admissible, veiled=True),
        panel.frame(f"{second} (deg)", f"{first} (deg)", **_both_ticks(panel)),
    ]
    for name, posture in marked.items():
        at, down = float(panel.across(posture[0])), float(panel.down(posture[1]))
        parts.append(
            f'<circle cx="{at:.2f}" cy="{down:.2f}" r="{4.5 if name == RESULT else 6.5}" '
            f'fill="{colours[name]}" stroke="#ffffff" stroke-width="1.2"/>'
        )
    label = f"Map: energy over {first} and {second} at location {surface.location}, chosen posture marked"
    return svg(panel.bottom + BELOW, [*parts, legend(colours, LEFT + WIDE, panel.bottom + 27.0)], label)


def draw_location(surface: LocationSurface, parts: Mapping[str, Array]) -> str:
    """Draw parts of the power surface, (g, h) J each, over both rotary angles.

    Hatched is what tilt or axis limits forbid; a dotted line is a bound of the tilt, a dashed one the middle
    between the branches. A filled marker is a program's posture, a hollow one its other branch.
    """
    first, second = surface.power.letters
    across, up = np.degrees(surface.power.first), np.degrees(surface.power.second)
    share = SIDE_BY_SIDE / len(parts)
    bounds = " and ".join(lean.text for lean in surface.leans)
    explained = (
        "hatched: tilt or axis limits forbid it · dashed: between the branches · "
        f"hollow: same tool axis, other branch{f' · dotted: {bounds}' if bounds else ''}"
    )
    drawn = [
        text(f"Energy from the axes' zero: {surface.title}", LEFT, 12.0, bold=True),
        text(explained, LEFT, 28.0),
    ]
    for k, (name, joules) in enumerate(parts.items()):
        left = LEFT + k * share
        heat = HeatMap(across, up, joules, top=MAPS_TOP, width=share - LEFT - SCALE, left=left)
        label = f"{second} (deg)" if k == 0 else ""
        drawn += [
            *heat.draw("J", ~surface.admissible, veiled=True),
            *heat.levels(),
            *_bound_lines(heat, surface),
            heat.panel.frame(label, f"{first} (deg)", **_both_ticks(heat.panel)),
            text(name, left, MAPS_TOP - 6.0, bold=True),
        ]
        for number, postures in reversed(list(enumerate(surface.postures.values()))):
            for other, posture in enumerate(np.degrees(postures)):
                x, y = float(heat.panel.across(posture[0])), float(heat.panel.down(posture[1]))
                drawn.append(_mark(number, x, y, hollow=other > 0))
    numbers = {name: number for number, name in enumerate(surface.postures)}
    below = MAPS_TOP + TALL + BELOW + 14.0

    def sample(name: str, x: float, y: float) -> str:
        return _mark(numbers[name], x, y)

    drawn.append(legend(dict.fromkeys(numbers, INK), SIDE_BY_SIDE - SCALE, below, sample))
    return svg(below + 10.0, drawn, f"Maps: energy over {first} and {second}", width=SIDE_BY_SIDE)


def draw_valley(valley: Valley) -> str:
    """Draw the least energy over path and first rotary angle with the programs' postures in it.

    Below is S_W of each program's posture along the path. Grey: no posture is admissible.
    """
    along = valley.locations.astype(float)
    heat = HeatMap(along, np.degrees(valley.first), valley.cost)
    upper = heat.panel
    floor = np.where(np.isnan(valley.cost), np.inf, valley.cost).min(axis=1)
    floor[np.isinf(floor)] = np.nan
    lower = Panel(upper.bottom + 12.0, 110.0, upper.x, widened(floor, *valley.heights.values()), WIDE)
    parts = [
        text(f"Least S_W of each {valley.letter}: {valley.title}", LEFT, 12.0, bold=True),
        *heat.draw("J"),
        *heat.levels(),
        upper.frame(f"{valley.letter} (deg)", y_ticks=_angle_ticks(upper.y), grid=False),
        lower.frame("S_W of the posture (J)", LOCATION_LABEL),
        lower.line(along, floor, FLOOR, 1.2),
    ]
    numbers = {name: number for number, name in enumerate(valley.postures)}
    for name, number in reversed(numbers.items()):
        # A wrapped angle jumps by a turn, and no line goes there.
        parts += _curve(upper, along, break_jumps(np.degrees(valley.postures[name]), 180.0), number)
        parts += _curve(lower, along, valley.heights[name], number)

    def sample(name: str, x: float, y: float) -> str:
        ends, level = Panel(y - 1.0, 2.0, (0.0, 1.0), (-1.0, 1.0), 15.0, x - 8.0), np.zeros(2)
        if name not in numbers:
            return ends.line(np.arange(2.0), level, FLOOR, 1.2)
        return "".join(_curve(ends, np.arange(2.0), level, numbers[name]))

    below = lower.bottom + BELOW + 8.0
    names = dict.fromkeys(["floor of the valley", *numbers], INK)
    parts.append(legend(names, WIDTH - RIGHT, below, sample))
    if valley.elsewhere:
        words = f"not shown, with locations of their own: {', '.join(valley.elsewhere)}"
        parts.append(text(words, LEFT, below + 14.0))
    return svg(below + 24.0, parts, f"Map: least energy over location and {valley.letter}")


def _bound_lines(heat: HeatMap, surface: LocationSurface) -> list[str]:
    """Draw the middles between the branches, and the bounds of the tilt with their angles."""
    # The branches meet in their middle and half a turn from there.
    halves = np.degrees(surface.middle) + 180.0 * np.arange(-4, 5)
    middles = halves[(halves > heat.y[0]) & (halves < heat.y[-1])]
    ends = np.array(heat.panel.x)
    parts = [heat.panel.line(ends, np.full(2, level), LIGHT, 1.0, dashes=DASHED) for level in middles]
    for lean in surface.leans:
        for level in np.degrees([lean.low, lean.high]):
            parts += heat.contours(np.degrees(lean.angle), [level], 1.2, DOTTED, f"{level:.3g}°")
    return parts


def _mark(number: int, x: float, y: float, *, hollow: bool = False) -> str:
    """Mark a program's posture, or that of its other branch."""
    size, colour = (5.0 if number == 0 else 4.0), PROGRAMS[number % len(PROGRAMS)]
    fill, rim, width = ("none", colour, 1.6) if hollow else (colour, RIM, 1.0)
    return (
        f'<path d="{MARKS[number % len(MARKS)]}" transform="translate({x:.2f} {y:.2f}) scale({size:g})" '
        f'fill="{fill}" stroke="{rim}" stroke-width="{width / size:g}"/>'
    )


def _curve(panel: Panel, x: Array, y: Array, number: int) -> list[str]:
    """Draw a program's curve with a rim, so that it is seen on any colour."""
    width, dashes = (2.2 if number == 0 else 1.5), DASHES[number % len(DASHES)]
    colour = PROGRAMS[number % len(PROGRAMS)]
    return [
        panel.line(x, y, RIM, width + 1.4, dashes=dashes),
        panel.line(x, y, colour, width, dashes=dashes),
    ]


def _angle_ticks(shown: Range, most: float = 8.0) -> dict[float, str]:
    """Choose the ticks of an angle: every 15, 30, 45, 60 or 90 degrees."""
    step = next((s for s in ANGLE_STEPS if (shown[1] - shown[0]) / s <= most), 90.0)
    return labelled(multiples(shown, step))


def _both_ticks(panel: Panel) -> dict[str, Any]:
    """Return how a map over two angles is framed."""
    return {
        "x_ticks": _angle_ticks(panel.x, panel.width / 50.0),
        "y_ticks": _angle_ticks(panel.y),
        "grid": False,
    }


def _modulo(solution: Solution, name: str) -> Array:
    """Compute the first rotary angle of a motion in the shown range, (n,) rad."""
    machine, letter = solution.machine, solution.machine.rotaries[0]
    return modulo_turn(solution.timed(name).positions[:, machine.column(letter)], machine.axis(letter))
