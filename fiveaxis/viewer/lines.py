"""Paths in the scene, one line object each, coloured by the power of the feed drives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Toolpath
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.tool_motion import Side

ByteArray = NDArray[np.uint8]

# viridis at 0, 1/8 … 1 (van der Walt and Smith, CC0): perceptually even, safe for the colour-blind.
VIRIDIS = np.array(
    [
        [0.267, 0.005, 0.329],
        [0.278, 0.175, 0.483],
        [0.230, 0.322, 0.546],
        [0.173, 0.449, 0.558],
        [0.128, 0.567, 0.551],
        [0.158, 0.684, 0.502],
        [0.369, 0.789, 0.383],
        [0.678, 0.864, 0.190],
        [0.993, 0.906, 0.144],
    ]
)
# Colour of links and rapids.
AIR = (0.36, 0.38, 0.42)
# Quantile of all powers at which the scale ends, so that one reversal doesn't darken the rest.
CLIPPED_AT = 0.98
# It also ends at this multiple of this quantile of the result's powers, because of costly baselines.
USUAL, MULTIPLE = 0.9, 3.0
# Paths of contacts are lifted by this share of the tool's radius, or the part would hide half of every line.
LIFT = 0.04
# Resolution of points as a share of the path's size: invisible, and it saves two thirds of the bytes.
GRAIN = 2.0**-19


def add_paths(vis: Any, root: str, machine: Machine, sides: Sequence[Side]) -> float:
    """Add one line object per side, coloured on one scale.

    Parameters
    ----------
    vis : a meshcat visualizer
    root : node above those of the sides
    machine : with drives
    sides : the result first

    Returns
    -------
    W, the power at the end of the scale
    """
    shapes = load_meshcat().geometry
    powers = [cutting_powers(machine, side.motion) for side in sides]
    top = colour_top(*powers)
    for side, power in zip(sides, powers, strict=True):
        name = f"{side.node}/path"
        geometry = _coloured_lines()(_ends(shown_points(side.toolpath)), move_colours(power, top)[1:])
        lines = shapes.LineSegments(geometry, shapes.LineBasicMaterial(vertexColors=True))
        vis[f"{root}/{name}"].set_object(identify(lines, name))
    return top


def shown_points(path: Toolpath) -> Array:
    """Return the points to draw, (n, 3) mm: contacts, slightly lifted, or pivots if a cut has none."""
    lifted: Array = path.contact + LIFT * path.tool.radius * path.normal
    if not np.isfinite(lifted[path.cutting]).all():
        return path.pivot
    return np.where(np.isfinite(lifted).all(axis=1, keepdims=True), lifted, path.pivot)


def _ends(points: Array) -> Array:
    """Return both ends of every move, (2n − 2, 3) mm, rounded to a grid too fine to be seen."""
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    if size > 0.0:
        grain = GRAIN * 2.0 ** np.floor(np.log2(size))
        points = np.round(points / grain) * grain
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3)


@cache
def _coloured_lines() -> Any:
    """Make the class of a line's geometry, whose base is known only once meshcat is loaded."""
    shapes = load_meshcat().geometry

    class ColouredLines(shapes.Geometry):  # type: ignore[misc, name-defined]
        """Moves with a colour each, in bytes, a quarter of the size of meshcat's own colours.

        Parameters
        ----------
        ends : (2m, 3), mm
        colours : (m, 3), RGB
        """

        def __init__(self, ends: Array, colours: ByteArray) -> None:
            super().__init__()
            self.ends, self.colours = ends, colours

        def lower(self, object_data: Any) -> dict[str, Any]:
            position = shapes.pack_numpy_array(np.asarray(self.ends, dtype=np.float32).T)
            colour = shapes.pack_numpy_array(np.repeat(self.colours, 2, axis=0).T)
            attributes = {"position": position, "color": colour | {"normalized": True}}
            return {"uuid": self.uuid, "type": "BufferGeometry", "data": {"attributes": attributes}}

    return ColouredLines


def viridis(shares: Array) -> Array:
    """Map shares, (n,), clipped to 0…1 with NaN as 0, to RGB from 0 to 1, (n, 3)."""
    scale = np.linspace(0.0, 1.0, len(VIRIDIS))
    known = np.nan_to_num(shares, nan=0.0, posinf=1.0, neginf=0.0)
    return np.stack([np.interp(known, scale, channel) for channel in VIRIDIS.T], axis=1)


def cutting_powers(machine: Machine, motion: Motion) -> Array:
    """Compute the power of all feed drives in each cut, at its mean speeds.

    Returns
    -------
    (n,), W, of the move that ends at the row; NaN for the first row, links, rapids and moves without duration
    """
    power = move_powers(machine, motion).sum(axis=1)
    known = motion.cutting & (motion.time > 0.0)
    known[:1] = False
    return np.where(known, power, np.nan)


def colour_top(result: Array, *others: Array) -> float:
    """Choose the power at the end of the scale.

    Parameters
    ----------
    result, others : (n,), W, powers of the result and of its baselines; NaN is ignored

    Returns
    -------
    W, positive even if all powers are 0
    """
    together = np.concatenate([result, *others])
    known = together[np.isfinite(together)]
    usual = result[np.isfinite(result)]
    if not known.size or not known.max() > 0.0:
        return 1.0
    highest = float(np.quantile(known, CLIPPED_AT)) or float(known.max())
    bound = MULTIPLE * float(np.quantile(usual, USUAL)) if usual.size else 0.0
    return min(highest, bound) if bound > 0.0 else highest


def move_colours(powers: Array, top: float) -> ByteArray:
    """Colour moves by power: (n,) W → (n, 3) RGB bytes; moves without a known power are grey."""
    colours = np.where(np.isnan(powers)[:, None], AIR, viridis(powers / top))
    return np.round(255.0 * colours).astype(np.uint8)
