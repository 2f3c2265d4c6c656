"""Maps of the postures that were not chosen, as SVG around a PNG that is written without a library."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.posture import Solution
from fiveaxis.report.chart import (
    AFTER,
    BEFORE,
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
    labels,
    legend,
    multiples,
    svg,
    text,
    thin_rows,
    ticks,
)
from fiveaxis.report.figures import LOCATION_LABEL, motion_of, series_of
from fiveaxis.report.landscape import PostureMap, Surface, modulo_turn

Pixels = NDArray[np.uint8]

# Cividis (Nuñez, Anderton and Renslow) at 17 even steps, ordered also for colour-blind readers and in grey.
CIVIDIS = (
    (0, 34, 78), (0, 46, 106), (26, 56, 111), (50, 67, 109), (67, 78, 108), (83, 90, 109), (97, 101, 111),
    (111, 112, 115), (125, 124, 120), (140, 136, 120), (155, 148, 118), (171, 160, 114), (188, 174, 108),
    (205, 187, 99), (222, 201, 88), (240, 216, 70), (254, 232, 56),
)  # fmt: skip
# Side of a cell, and distance of the lines of a hatching, pixels.
CELL, HATCH = 3, 8
VEIL = 0.4
ANGLE_STEPS = (15.0, 30.0, 45.0, 60.0, 90.0)
# Height and width of a map, position and width of its colour bar, points.
TALL, WIDE = 200.0, WIDTH - LEFT - RIGHT - 62.0
BAR_AT, BAR = WIDTH - RIGHT - 50.0, 12.0
COST_LABEL = "energy from axis zero, S_W (J)"
# A white line with a dark rim is visible on any colour.
CURVE, RIM = "#ffffff", "#000000"


def posture_map_figure(solution: Solution, landscape: PostureMap, baseline: str | None) -> str:
    """Draw the least cost over the path and the first rotary axis as SVG, with the chosen curve.

    The grey is hatched where only collisions forbid every posture.
    """
    letter = solution.machine.rotaries[0]
    first = np.degrees(landscape.first)
    curves = {name: np.degrees(_modulo(solution, name)[:, 0]) for name in _on_map(solution, baseline)}
    locations = landscape.locations.astype(float)
    panel = Panel(TOP, TALL, _edges(locations), _covering(_edges(first), *curves.values()), WIDE)
    bounds = _bounds(landscape.cost)
    picture = _enlarged(_coloured(landscape.cost.T, bounds))
    picture = _hatched(picture, _pixels(landscape.colliding.T), crossed=True)
    parts = [
        text(f"Which {letter} was chosen, and what others cost", LEFT, 12.0, bold=True),
        _ground(panel),
        _image(panel, picture, _edges(locations), _edges(first)),
        panel.frame(f"{letter} (deg)", LOCATION_LABEL, y_ticks=_angle_ticks(panel.y), grid=False),
        _colour_bar(panel, bounds),
    ]
    for name, angles in curves.items():
        colour, width = (CURVE, 1.4) if name == "optimised" else (BEFORE, 3.4)
        broken = break_jumps(angles, 180.0)
        # Jumps stay: a line from before to after one would cross the map.
        rows = np.union1d(thin_rows(broken), np.flatnonzero(np.isnan(broken)))
        x, y = rows.astype(float), broken[rows]
        parts += [panel.line(x, y, RIM, width + 1.6), panel.line(x, y, colour, width)]
    names = {name: INK if name == "optimised" else BEFORE for name in curves}
    label = f"Map: energy over location and {letter}, with the chosen {letter} as a line"
    return svg(panel.bottom + BELOW, [*parts, legend(names, LEFT + WIDE, 12.0)], label)


def surface_figure(solution: Solution, surface: Surface, baseline: str | None) -> str:
    """Draw the power surface at one location as SVG: inadmissible region hatched, chosen posture marked."""
    first, second = solution.machine.rotaries
    across, up = np.degrees(surface.first), np.degrees(surface.second)
    names = _on_map(solution, baseline)
    marked = {name: np.degrees(_modulo(solution, name)[surface.location]) for name in names}
    x, y = (
        _covering(_edges(grid), *(posture[[k]] for posture in marked.values()))
        for k, grid in enumerate((across, up))
    )
    panel, bounds = Panel(TOP, TALL, x, y, WIDE), _bounds(surface.cost)
    forbidden = _pixels(~surface.allowed.T)
    picture = _veiled(_enlarged(_coloured(surface.cost.T, bounds)), forbidden)
    picture = _hatched(picture, forbidden, crossed=False)
    title = f"Power surface at location {surface.location}; hatched: tilt or limits forbid it"
    parts = [
        text(title, LEFT, 12.0, bold=True),
        _ground(panel),
        _image(panel, picture, _edges(across), _edges(up)),
        panel.frame(
            f"{second} (deg)",
            f"{first} (deg)",
            x_ticks=_angle_ticks(x),
            y_ticks=_angle_ticks(y),
            grid=False,
        ),
        _colour_bar(panel, bounds),
    ]
    colours = {name: AFTER if name == "optimised" else BEFORE for name in marked}
    for name, posture in marked.items():
        at, down = float(panel.across(posture[0])), float(panel.down(posture[1]))
        parts.append(
            f'<circle cx="{at:.2f}" cy="{down:.2f}" r="{4.5 if name == "optimised" else 6.5}" '
            f'fill="{colours[name]}" stroke="#ffffff" stroke-width="1.2"/>'
        )
    label = f"Map: energy over {first} and {second} at location {surface.location}, chosen posture marked"
    return svg(panel.bottom + BELOW, [*parts, legend(colours, LEFT + WIDE, panel.bottom + 27.0)], label)


def _on_map(solution: Solution, baseline: str | None) -> dict[str, str]:
    """Return the curves of a map with their colours; not a baseline with locations of its own."""
    elsewhere = baseline is not None and solution.compared[baseline].toolpath is not None
    return series_of(solution, None if elsewhere else baseline)


def _edges(grid: Array) -> Range:
    """Compute the outer edges of the cells around evenly spaced grid points."""
    half = 0.5 * float(grid[-1] - grid[0]) / (len(grid) - 1) if len(grid) > 1 else 0.5
    return float(grid[0]) - half, float(grid[-1]) + half


def _covering(shown: Range, *values: Array) -> Range:
    """Widen a range to show postures outside the axis limits too."""
    known = np.concatenate([np.array(shown), *values])
    return float(known.min()), float(known.max())


def _bounds(cost: Array) -> Range:
    known = cost[np.isfinite(cost)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    return low, high if high > low else low + 1.0


def _pixels(where: BoolArray) -> BoolArray:
    return _enlarged(where).astype(bool)


def _ground(panel: Panel) -> str:
    """Colour the area beyond the map as forbidden."""
    return (
        f'<rect x="{LEFT:g}" y="{panel.top:g}" width="{panel.width:g}" height="{panel.height:g}" '
        f'fill="{FORBIDDEN}"/>'
    )


def _image(panel: Panel, picture: Pixels, x: Range, y: Range) -> str:
    """Place a picture, lowest row first, over a range of the panel."""
    left, right = panel.across(np.array(x)).tolist()
    bottom, top = panel.down(np.array(y)).tolist()
    return (
        f'<image x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" height="{bottom - top:.2f}" '
        f'preserveAspectRatio="none" href="{png_address(picture[::-1])}"/>'
    )


def _colour_bar(panel: Panel, bounds: Range) -> str:
    """Draw the colour scale."""
    scale = Panel(panel.top, panel.height, (0.0, 1.0), bounds)
    colours = np.array(CIVIDIS[::-1], dtype=np.uint8)
    ramp = np.stack([np.interp(np.linspace(0, 16, 128), np.arange(17), c) for c in colours.T], axis=-1)
    steps = ticks(bounds)
    words = "".join(
        text(word, BAR_AT + BAR + 4.0, float(scale.down(value)) + 3.0)
        for value, word in zip(steps, labels(steps), strict=True)
    )
    middle = panel.top + 0.5 * panel.height
    picture = png_address(ramp[:, None].round().astype(np.uint8))
    return (
        f'<image x="{BAR_AT:g}" y="{panel.top:g}" width="{BAR:g}" height="{panel.height:g}" '
        f'preserveAspectRatio="none" href="{picture}"/>'
        + words
        + text(COST_LABEL, WIDTH - 3.0, middle, anchor="middle", upright=True)
    )


def _angle_ticks(shown: Range) -> dict[float, str]:
    """Choose the ticks of an angle: every 15, 30, 45, 60 or 90 degrees."""
    step = next((s for s in ANGLE_STEPS if (shown[1] - shown[0]) / s <= 8.0), 90.0)
    angles = multiples(shown, step)
    return dict(zip(angles, labels(angles), strict=True))


def _modulo(solution: Solution, name: str) -> Array:
    """Compute the rotary angles of a motion in the shown ranges, (n, 2) rad, chain order."""
    machine = solution.machine
    positions = motion_of(solution, name).positions
    columns = (modulo_turn(positions[:, machine.column(c)], machine.axis(c)) for c in machine.rotaries)
    return np.stack(list(columns), axis=1)


def _coloured(values: Array, bounds: tuple[float, float]) -> Pixels:
    """Convert numbers, (h, w), to colours, (h, w, 3): darkest to lightest between the bounds, NaN grey."""
    low, high = bounds
    share = np.linspace(0.0, 1.0, len(CIVIDIS))
    at = np.clip((values - low) / (high - low), 0.0, 1.0)
    picture = np.stack([np.interp(at, share, channel) for channel in np.array(CIVIDIS).T], axis=-1)
    picture[np.isnan(values)] = [int(FORBIDDEN[k : k + 2], 16) for k in (1, 3, 5)]
    return picture.round().astype(np.uint8)


def _enlarged(cells: Pixels | BoolArray) -> NDArray[np.uint8]:
    """Enlarge every cell to `CELL` × `CELL` pixels, in which a hatching can be drawn."""
    return np.repeat(np.repeat(cells, CELL, axis=0), CELL, axis=1)


def _hatched(picture: Pixels, where: BoolArray, *, crossed: bool) -> Pixels:
    """Hatch a part, (h, w), of a picture, (h, w, 3), in black, in both directions if `crossed`."""
    row, column = np.indices(where.shape)
    lines = (row + column) % HATCH == 0
    if crossed:
        lines |= (row - column) % HATCH == 0
    drawn = picture.copy()
    drawn[where & lines] = 0
    return drawn


def _veiled(picture: Pixels, where: BoolArray) -> Pixels:
    """Whiten a part, (h, w), of a picture by the share `VEIL`."""
    drawn = picture.astype(float)
    drawn[where] += VEIL * (255.0 - drawn[where])
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
