"""Raster images of numbers: colours that rise evenly in lightness, and PNG without a library."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.report.chart import FORBIDDEN

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


def coloured(values: Array, bounds: tuple[float, float]) -> Pixels:
    """Convert numbers, (h, w), to colours, (h, w, 3): darkest to lightest between the bounds, NaN grey."""
    low, high = bounds
    share = np.linspace(0.0, 1.0, len(CIVIDIS))
    at = np.clip((values - low) / (high - low), 0.0, 1.0)
    picture = np.stack([np.interp(at, share, channel) for channel in np.array(CIVIDIS).T], axis=-1)
    picture[np.isnan(values)] = [int(FORBIDDEN[k : k + 2], 16) for k in (1, 3, 5)]
    return picture.round().astype(np.uint8)


def enlarged(cells: Pixels | BoolArray) -> NDArray[np.uint8]:
    """Enlarge every cell to `CELL` × `CELL` pixels, in which a hatching can be drawn."""
    return np.repeat(np.repeat(cells, CELL, axis=0), CELL, axis=1)


def hatched(picture: Pixels, where: BoolArray, *, crossed: bool) -> Pixels:
    """Hatch a part, (h, w), of a picture, (h, w, 3), in black, in both directions if `crossed`."""
    row, column = np.indices(where.shape)
    lines = (row + column) % HATCH == 0
    if crossed:
        lines |= (row - column) % HATCH == 0
    drawn = picture.copy()
    drawn[where & lines] = 0
    return drawn


def veiled(picture: Pixels, where: BoolArray) -> Pixels:
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
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 9)), (b"IEND", b"")
    data = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")
