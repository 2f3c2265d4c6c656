"""Maps of postures: numbers over a grid as colours, the power surface at a location, the energy along a path.

A map is a picture inside SVG, written without a library.
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray
from fiveaxis.show.report.chart import (
    BELOW,
    FORBIDDEN,
    INK,
    LEFT,
    RIGHT,
    TOP,
    WIDTH,
    Panel,
    Range,
    break_jumps,
    labelled,
    legend,
    multiples,
    svg,
    text,
    ticks,
    widened,
)
from fiveaxis.show.report.figures import LOCATION_LABEL

if TYPE_CHECKING:
    from fiveaxis.show.report.surfaces import LocationSurface, Valley

Pixels = NDArray[np.uint8]

# Cividis (Nuñez, Anderton and Renslow) at 17 even steps, ordered also for colour-blind readers and in grey.
CIVIDIS = (
    (0, 34, 78), (0, 46, 106), (26, 56, 111), (50, 67, 109), (67, 78, 108), (83, 90, 109), (97, 101, 111),
    (111, 112, 115), (125, 124, 120), (140, 136, 120), (155, 148, 118), (171, 160, 114), (188, 174, 108),
    (205, 187, 99), (222, 201, 88), (240, 216, 70), (254, 232, 56),
)  # fmt: skip
# Side of a cell, distance of the lines of a hatching, and most pixels of a side.
CELL, HATCH, MOST_PIXELS = 3, 8, 1500
VEIL = 0.4
# Height of a map, room for its colour scale on the right, points; the scale's distance, width and label.
TALL, SCALE = 200.0, 62.0
BAR_AT, BAR, LABEL_AT = 12.0, 12.0, 69.0
WIDE = WIDTH - LEFT - RIGHT - SCALE
# Lines on a map.
LIGHT = "#ffffff"
ANGLE_STEPS = (15.0, 30.0, 45.0, 60.0, 90.0, 180.0)
# A figure of several maps side by side, points.
SIDE_BY_SIDE, MAPS_TOP = 792.0, 60.0
# A light line with a dark rim is visible on any colour.
RIM = "#000000"
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


def draw_location(surface: LocationSurface, parts: Mapping[str, Array]) -> str:
    """Draw parts of the power surface, (g, h) J each, over both rotary angles, side by side.

    Hatched is what tilt or axis limits forbid; a dotted line is a bound of the tilt, a dashed one the middle
    between the branches. A filled marker is a program's posture, a hollow one its other branch.
    """
    first, second = surface.power.letters
    across, up = np.degrees(surface.power.first), np.degrees(surface.power.second)
    whole = WIDTH if len(parts) == 1 else SIDE_BY_SIDE
    share = whole / len(parts)
    bounds = " and ".join(bound.text for bound, _ in surface.leans)
    explained = f"hollow: same tool axis, other branch{f' · dotted: {bounds}' if bounds else ''}"
    drawn = [
        text(f"Energy from the axes' zero: {surface.title}", LEFT, 12.0, bold=True),
        text("hatched: tilt or axis limits forbid it · dashed: between the branches", LEFT, 26.0),
        text(explained, LEFT, 38.0),
    ]
    reached = np.degrees(np.concatenate([np.empty((0, 2)), *surface.postures.values()]))
    for k, (name, joules) in enumerate(parts.items()):
        left = LEFT + k * share
        heat = HeatMap(across, up, joules, reached, MAPS_TOP, share - LEFT - SCALE, left)
        ticks_across = _angle_ticks(heat.panel.x, heat.panel.width / 50.0)
        ticks_up = _angle_ticks(heat.panel.y)
        label = f"{second} (deg)" if k == 0 else ""
        drawn += [
            *heat.draw(~surface.admissible, veiled=True),
            *heat.levels(),
            *_bound_lines(heat, surface),
            heat.panel.frame(label, f"{first} (deg)", x_ticks=ticks_across, y_ticks=ticks_up, grid=False),
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

    drawn.append(legend(dict.fromkeys(numbers, INK), whole - SCALE, below, sample))
    return svg(below + 10.0, drawn, f"Map: energy over {first} and {second}", width=whole)


def draw_valley(valley: Valley) -> str:
    """Draw the least energy over path and first rotary angle with the programs' postures in it.

    Below is what each program's moves cost, per mm and from the start on: how high a posture lies costs
    nothing. Grey: no posture is admissible; hatched where only collisions forbid them.
    """
    along = valley.locations.astype(float)
    reached = [np.column_stack([along, np.degrees(angles)]) for angles in valley.postures.values()]
    heat = HeatMap(along, np.degrees(valley.first), valley.cost, np.concatenate(reached))
    upper = heat.panel
    rates = valley.rates()
    middle = Panel(upper.bottom + 12.0, 80.0, upper.x, widened(np.zeros(1), *rates.values()), WIDE)
    lower = Panel(middle.bottom + 12.0, 110.0, upper.x, widened(*valley.spent.values()), WIDE)
    parts = [
        text(f"Least S_W of each {valley.letter}: {valley.title}", LEFT, 12.0, bold=True),
        *heat.draw(valley.colliding),
        upper.frame(f"{valley.letter} (deg)", y_ticks=_angle_ticks(upper.y), grid=False),
        middle.frame("moves (J/mm)"),
        lower.frame("spent so far (J)", LOCATION_LABEL),
    ]
    numbers = {name: number for number, name in enumerate(valley.postures)}
    for name, number in reversed(numbers.items()):
        # A wrapped angle jumps by a turn, and no line goes there.
        parts += _curve(upper, along, break_jumps(np.degrees(valley.postures[name]), 180.0), number)
        parts += _curve(middle, along, rates[name], number)
        parts += _curve(lower, along, valley.spent[name], number)

    def sample(name: str, x: float, y: float) -> str:
        ends, level = Panel(y - 1.0, 2.0, (0.0, 1.0), (-1.0, 1.0), 15.0, x - 8.0), np.zeros(2)
        return "".join(_curve(ends, np.arange(2.0), level, numbers[name]))

    below = lower.bottom + BELOW + 8.0
    names = dict.fromkeys(numbers, INK)
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
    for bound, angle in surface.leans:
        for level in np.degrees([bound.low, bound.high]):
            parts += heat.contours(np.degrees(angle), [level], 1.2, DOTTED, f"{level:.3g}°")
    return parts


def _mark(number: int, x: float, y: float, *, hollow: bool = False) -> str:
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
    return [panel.line(x, y, RIM, width + 1.4, dashes=dashes), panel.line(x, y, colour, width, dashes=dashes)]


def _angle_ticks(shown: Range, most: float = 8.0) -> dict[float, str]:
    step = next((s for s in ANGLE_STEPS if (shown[1] - shown[0]) / s <= most), 90.0)
    return labelled(multiples(shown, step))


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Numbers over two evenly spaced grids, to be drawn as colours.

    Parameters
    ----------
    x, y : (m,), (n,)
    values : (m, n); NaN has the colour of what is forbidden
    shown : (k, 2), further points that the map has to reach; NaN is ignored
    top, width, left : of its panel, points
    """

    x: Array
    y: Array
    values: Array
    shown: Array
    top: float = TOP
    width: float = WIDE
    left: float = LEFT

    @cached_property
    def panel(self) -> Panel:
        """The panel that the map is drawn in."""
        x, y = (_covering(_edges(grid), self.shown[:, k]) for k, grid in enumerate((self.x, self.y)))
        return Panel(self.top, TALL, x, y, self.width, self.left)

    @cached_property
    def bounds(self) -> Range:
        """Numbers of the darkest and the lightest colour."""
        known = self.values[np.isfinite(self.values)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
        return low, high if high > low else low + 1.0

    def draw(self, hatched: BoolArray, *, veiled: bool = False) -> list[str]:
        """Draw the colours and their scale, J, with a part, (m, n), hatched."""
        picture = _hatched(
            _enlarged(_coloured(self.values.T, self.bounds)), _enlarged(hatched.T), veiled=veiled
        )
        ground = self.panel.span(self.panel.x, self.panel.y, FORBIDDEN)
        return [ground, _image(self.panel, picture, _edges(self.x), _edges(self.y)), self._scale()]

    def _scale(self) -> str:
        panel = self.panel
        right = panel.left + panel.width
        scale = Panel(panel.top, panel.height, (0.0, 1.0), self.bounds)
        words = "".join(
            text(word, right + BAR_AT + BAR + 4.0, float(scale.down(value)) + 3.0)
            for value, word in labelled(ticks(self.bounds)).items()
        )
        picture = png_address(_coloured(np.linspace(1.0, 0.0, 128)[:, None], (0.0, 1.0)))
        return (
            f'<image x="{right + BAR_AT:g}" y="{panel.top:g}" width="{BAR:g}" height="{panel.height:g}" '
            f'preserveAspectRatio="none" href="{picture}"/>'
            + words
            + text("J", right + LABEL_AT, panel.top + 0.5 * panel.height, anchor="middle", upright=True)
        )

    def levels(self) -> list[str]:
        """Draw thin lines of equal height."""
        return self.contours(self.values, ticks(self.bounds, 8), 0.3)

    def contours(
        self, values: Array, levels: Iterable[float], width: float, dashes: str = "", label: str = ""
    ) -> list[str]:
        """Draw the lines on which values on the grid, (m, n), have certain levels, with a label on one."""
        if min(values.shape) < 2:
            return []
        from contourpy import contour_generator

        contours: Any = contour_generator(x=self.x, y=self.y, z=values.T)
        lines: list[Array] = [line for level in levels for line in contours.lines(level)]
        if not lines:
            return []
        # Missing points break the line.
        gap = np.full((1, 2), np.nan)
        x, y = np.concatenate([part for line in lines for part in (line, gap)]).T
        drawn = [self.panel.line(x, y, LIGHT, width, dashes=dashes)]
        if label:
            longest = max(lines, key=len)
            across, up = longest[len(longest) // 4]
            drawn.append(self.panel.label(label, across, up))
        return drawn


def _edges(grid: Array) -> Range:
    """Compute the outer edges of the cells around evenly spaced grid points."""
    half = 0.5 * float(grid[-1] - grid[0]) / (len(grid) - 1) if len(grid) > 1 else 0.5
    return float(grid[0]) - half, float(grid[-1]) + half


def _covering(shown: Range, values: Array) -> Range:
    """Widen a range to some values: postures outside the axis limits are shown too."""
    known = np.append(values[np.isfinite(values)], shown)
    return float(known.min()), float(known.max())


def _image(panel: Panel, picture: Pixels, x: Range, y: Range) -> str:
    """Place a picture, lowest row first, over a range of the panel."""
    left, right = panel.across(np.array(x)).tolist()
    bottom, top = panel.down(np.array(y)).tolist()
    return (
        f'<image x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" height="{bottom - top:.2f}" '
        f'preserveAspectRatio="none" href="{png_address(picture[::-1])}"/>'
    )


def _coloured(values: Array, bounds: tuple[float, float]) -> Pixels:
    """Convert numbers, (h, w), to colours, (h, w, 3): darkest to lightest between the bounds, NaN grey."""
    low, high = bounds
    share = np.linspace(0.0, 1.0, len(CIVIDIS))
    at = np.clip((values - low) / (high - low), 0.0, 1.0)
    picture = np.stack([np.interp(at, share, channel) for channel in np.array(CIVIDIS).T], axis=-1)
    picture[np.isnan(values)] = [int(FORBIDDEN[k : k + 2], 16) for k in (1, 3, 5)]
    return picture.round().astype(np.uint8)


def _enlarged(cells: NDArray[Any]) -> NDArray[Any]:
    """Enlarge every cell to `CELL` × `CELL` pixels, in which a hatching can be drawn; thin a large grid."""
    for axis, count in enumerate(cells.shape[:2]):
        pixels = min(CELL * count, MOST_PIXELS)
        cells = cells.take(np.arange(pixels) * count // pixels, axis=axis)
    return cells


def _hatched(picture: Pixels, where: BoolArray, *, veiled: bool) -> Pixels:
    """Hatch a part, (h, w), of a picture, (h, w, 3): in two directions, or whitened in one."""
    row, column = np.indices(where.shape)
    lines, drawn = (row + column) % HATCH == 0, picture.astype(float)
    if veiled:
        drawn[where] += VEIL * (255.0 - drawn[where])
    else:
        lines |= (row - column) % HATCH == 0
    drawn[where & lines] = 0.0
    return drawn.round().astype(np.uint8)


def png_address(picture: Pixels) -> str:
    """Encode a picture, (h, w, 3), as the data URI of a PNG."""
    height, width, _ = picture.shape
    rows = picture.reshape(height, 3 * width)
    # Rows differ little from those above, so the differences compress better (filter 2).
    above = np.vstack([np.zeros((1, 3 * width), dtype=np.uint8), rows[:-1]])
    filtered = np.hstack([np.full((height, 1), 2, dtype=np.uint8), rows - above])
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes())), (b"IEND", b"")
    data = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")
