"""Paths in the scene: one line object each, coloured by power."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath
from fiveaxis.viewer.colours import ByteArray, colour_top, cutting_powers, move_colours
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.sides import Side

# Paths of contacts are lifted by this share of the tool's radius, or the part would hide half of every line.
LIFT = 0.04
# Points are drawn to this share of the path's size: nothing to see, and a third of the bytes.
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
    The power that takes the last colour, W.
    """
    shapes = load_meshcat().geometry
    powers = [cutting_powers(machine, side.motion) for side in sides]
    top = colour_top(*powers)
    for side, power in zip(sides, powers, strict=True):
        name = f"{side.node}/path"
        lines = _coloured_lines()(_ends(shown_points(side.toolpath)), move_colours(power, top)[1:])
        way = shapes.LineSegments(lines, shapes.LineBasicMaterial(vertexColors=True))
        vis[f"{root}/{name}"].set_object(identify(way, name))
    return top


def shown_points(path: Toolpath) -> Array:
    """Give the line to draw, (n, 3) mm: contacts, a little lifted, or ball centres if one is unknown."""
    lifted: Array = path.contact + LIFT * path.tool.radius * path.normal
    if not np.isfinite(lifted[path.cutting]).all():
        return path.pivot
    return np.where(np.isfinite(lifted).all(axis=1, keepdims=True), lifted, path.pivot)


def _ends(points: Array) -> Array:
    """Give both ends of every move, (2n − 2, 3) mm, on a grid too fine to be seen."""
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    if size > 0.0:
        grain = GRAIN * 2.0 ** np.floor(np.log2(size))
        points = np.round(points / grain) * grain
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3)


@cache
def _coloured_lines() -> Any:
    """Make the class of a line's geometry; its base is known only once meshcat is loaded."""
    shapes = load_meshcat().geometry

    class ColouredLines(shapes.Geometry):  # type: ignore[misc, name-defined]
        """Moves with a colour each; bytes, as meshcat's own colours take four times as many.

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
