"""The finished part as the program leaves it: a map of what is left and what is gouged, and its figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, product
from fiveaxis.check import DEEP, HIGH, CutStock, Deviations, colours_of
from fiveaxis.show.report.maps import png_address
from fiveaxis.show.report.words import number

# Directions from which the part is looked at, and what they are called.
VIEWS = {
    "from the left, in front": (-1.0, -1.0, 0.8),
    "from the right, behind": (1.0, 1.0, 0.8),
    "from above": (0.0, 0.0, 1.0),
    "from below": (0.0, 0.0, -1.0),
}
# Pixels along the longest side of a view.
PIXELS = 260


def finished_section(cut: CutStock | None) -> str:
    """Write the section of the finished part, as HTML; empty if no stock was cut."""
    if cut is None:
        return ""
    found, tolerance = cut.deviations, cut.blank.tolerance
    shares = (
        ("finished", found.share(-tolerance, tolerance)),
        ("higher, up to 2 mm", found.share(tolerance, np.inf)),
        ("lower", found.share(-np.inf, -tolerance)),
    )
    listed = ", ".join(f"{number(100.0 * share, 1)} % {name}" for name, share in shares)
    text = (
        f"The stock, cut along the program at rays {number(found.resolution, 2)} mm apart. Of the part’s "
        f"area {listed} (±{number(tolerance, 2)} mm). Left beyond the part: {number(found.left_volume, 1)} "
        f"mm³; lacking of it: {number(found.gouged_volume, 2)} mm³, at most {number(found.deepest, 3)} mm "
        f"deep. At a ray distances are exact to {number(found.uncertainty, 3)} mm; between rays crests read "
        "lower, and ribs thinner than their distance may be missed."
    )
    pictures = "\n".join(_figure(found, tolerance, name, np.array(view)) for name, view in VIEWS.items())
    legend = (
        f"Green: finished. Red: cut into, dark from {DEEP * tolerance:g} mm. Blue: left, dark from "
        f"{HIGH * tolerance:g} mm. Grey: no block has cut there."
    )
    return (
        f'<section>\n<h2>The finished part</h2>\n<p>{text}</p>\n<div class="views">\n{pictures}\n</div>\n'
        f'<p class="small">{legend}</p>\n</section>'
    )


def _figure(found: Deviations, tolerance: float, name: str, view: Array) -> str:
    address = png_address(part_map(found, tolerance, view))
    image = f'<img alt="The finished part {name}" src="{address}">'
    return f"<figure>{image}<figcaption>{name}</figcaption></figure>"


def part_map(found: Deviations, tolerance: float, view: Array) -> NDArray[np.uint8]:
    """Draw the finished stock's points near the part from a direction, (h, w, 3); white where none is."""
    back = view / np.linalg.norm(view, axis=-1)
    up = np.array([0.0, 1.0, 0.0]) if abs(back[2]) > 0.99 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right, axis=-1)
    up = np.cross(back, right)
    seen = np.flatnonzero(product(found.normal, back) > 0.05)
    points = found.surface.points[seen]
    if not len(points):
        return np.full((1, 1, 3), 255, np.uint8)
    across, high = product(points, right), product(points, up)
    size = max(float(np.ptp(across)), float(np.ptp(high)), 1e-9)
    # Rays are at most √3 of their distance apart on a surface, seen from any side.
    pixel = max(size / PIXELS, found.resolution)
    column = ((across - across.min()) / pixel).astype(int) + 1
    row = ((high.max() - high) / pixel).astype(int) + 1
    picture = np.full((row.max() + 2, column.max() + 2, 3), 255, np.uint8)
    # What is nearer is drawn later, over what is behind it.
    order = np.argsort(product(points, back), kind="stable")
    colours = colours_of(found, tolerance)[seen]
    for down in (0, 1):
        for aside in (0, 1):
            picture[row[order] + down, column[order] + aside] = colours[order]
    picture[row[order], column[order]] = colours[order]
    return picture
