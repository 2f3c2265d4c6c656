"""Raster images of numbers: colours that rise evenly in lightness, and PNG without a library."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray

Pixels = NDArray[np.uint8]

# Cividis (Nuñez, Anderton and Renslow) at 17 even steps, ordered also for colour-blind readers and in grey.
CIVIDIS = (
    (0, 34, 78), (0, 46, 106), (26, 56, 111), (50, 67, 109), (67, 78, 108), (83, 90, 109), (97, 101, 111),
    (111, 112, 115), (125, 124, 120), (140, 136, 120), (155, 148, 118), (171, 160, 114), (188, 174, 108),
    (205, 187, 99), (222, 201, 88), (240, 216, 70), (254, 232, 56),
)  # fmt: skip
# Side of a cell, and distance of the lines of a hatching, pixels.
CELL, HATCH = 3, 8


def rgb(colour: str) -> Pixels:
    """Convert ``#rrggbb`` to (3,) levels."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=np.uint8)


def coloured(values: Array, bounds: tuple[float, float], missing: str) -> Pixels:
    """Convert numbers, (h, w), to colours, (h, w, 3).

    Parameters
    ----------
    values : NaN gets the colour `missing`
    bounds : values of the darkest and of the lightest colour
    """
    low, high = bounds
    share = np.linspace(0.0, 1.0, len(CIVIDIS))
    at = np.clip((values - low) / (high - low), 0.0, 1.0)
    picture = np.stack([np.interp(at, share, channel) for channel in np.array(CIVIDIS).T], axis=-1)
    picture[np.isnan(values)] = rgb(missing)
    return picture.round().astype(np.uint8)


def enlarged(cells: Pixels | BoolArray) -> NDArray[np.uint8]:
    """Enlarge every cell to `CELL` × `CELL` pixels, in which a hatching can be drawn."""
    return np.repeat(np.repeat(cells, CELL, axis=0), CELL, axis=1)


def hatched(picture: Pixels, where: BoolArray, *, colour: str, crossed: bool) -> Pixels:
    """Draw slanting lines over a part of a picture, and those across with `crossed`.

    Parameters
    ----------
    picture : (h, w, 3), pixels
    where : (h, w)
    """
    row, column = np.indices(where.shape)
    lines = (row + column) % HATCH == 0
    if crossed:
        lines |= (row - column) % HATCH == 0
    drawn = picture.copy()
    drawn[where & lines] = rgb(colour)
    return drawn


def veiled(picture: Pixels, where: BoolArray, share: float = 0.4) -> Pixels:
    """Whiten a part of a picture, (h, w)."""
    drawn = picture.astype(float)
    drawn[where] += share * (255.0 - drawn[where])
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
