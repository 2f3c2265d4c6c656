"""Numbers over a grid as colours: a picture inside SVG, written without a library."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.report.chart import FORBIDDEN, LEFT, RIGHT, TOP, WIDTH, Panel, Range, labelled, text, ticks

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


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Numbers over two evenly spaced grids, to be drawn as colours.

    Parameters
    ----------
    x, y : (m,), (n,)
    values : (m, n); NaN has the colour of what is forbidden
    shown : (k, 2), further points that the map has to reach
    top, width, left : of its panel, points
    """

    x: Array
    y: Array
    values: Array
    shown: Array = field(default_factory=lambda: np.empty((0, 2)))
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

    def draw(
        self, label: str, hatched: BoolArray | None = None, *, crossed: bool = False, veiled: bool = False
    ) -> list[str]:
        """Draw the colours and their scale.

        Parameters
        ----------
        label : of the scale
        hatched : (m, n), what is hatched, in both directions if `crossed`, and whitened if `veiled`
        """
        picture = _enlarged(_coloured(self.values.T, self.bounds))
        if hatched is not None:
            where = _enlarged(hatched.T)
            picture = _hatched(_veiled(picture, where) if veiled else picture, where, crossed=crossed)
        ground = self.panel.span(self.panel.x, self.panel.y, FORBIDDEN)
        return [ground, _image(self.panel, picture, _edges(self.x), _edges(self.y)), self._scale(label)]

    def _scale(self, label: str) -> str:
        panel = self.panel
        right = panel.left + panel.width
        scale = Panel(panel.top, panel.height, (0.0, 1.0), self.bounds)
        words = "".join(
            text(word, right + BAR_AT + BAR + 4.0, float(scale.down(value)) + 3.0)
            for value, word in labelled(ticks(self.bounds)).items()
        )
        colours = np.array(CIVIDIS[::-1], dtype=np.uint8)
        ramp = np.stack([np.interp(np.linspace(0, 16, 128), np.arange(17), c) for c in colours.T], axis=-1)
        picture = png_address(ramp[:, None].round().astype(np.uint8))
        return (
            f'<image x="{right + BAR_AT:g}" y="{panel.top:g}" width="{BAR:g}" height="{panel.height:g}" '
            f'preserveAspectRatio="none" href="{picture}"/>'
            + words
            + text(label, right + LABEL_AT, panel.top + 0.5 * panel.height, anchor="middle", upright=True)
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

        contours = contour_generator(x=self.x, y=self.y, z=values.T)
        lines = [line for level in levels for line in cast("list[Array]", contours.lines(level))]
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
    rows, columns = (_cells(count) for count in cells.shape[:2])
    return cells[rows[:, None], columns]


def _cells(count: int) -> IntArray:
    """Return the cell of each pixel of a side."""
    pixels = min(CELL * count, MOST_PIXELS)
    return np.arange(pixels) * count // pixels


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
