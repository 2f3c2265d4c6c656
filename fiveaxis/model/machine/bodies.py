"""Shapes of a machine's links for preview and collision checks, positioned with every axis at 0."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fiveaxis.base import Array, frame_along, translation
from fiveaxis.model.machine.chain import Triple


@dataclass(frozen=True)
class Box:
    """A box along the machine's axes at home.

    Parameters
    ----------
    size : (3,), mm
    center : (3,), mm, machine frame
    """

    size: Triple
    center: Triple = (0.0, 0.0, 0.0)

    @property
    def frame(self) -> Array:
        """(4, 4), mm, the box's own frame, at its centre."""
        return translation(self.center)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder.

    Parameters
    ----------
    radius, height : mm
    center : (3,), mm, middle of its axis, machine frame
    direction : (3,), unit vector along its axis
    """

    radius: float
    height: float
    center: Triple = (0.0, 0.0, 0.0)
    direction: Triple = (0.0, 0.0, 1.0)

    @property
    def frame(self) -> Array:
        """(4, 4), mm, the cylinder's own frame: its centre, z along its axis."""
        return frame_along(self.direction, self.center)


@dataclass(frozen=True)
class MeshShape:
    """A mesh in a file, in the machine frame.

    Parameters
    ----------
    file : STL or another kind that trimesh reads
    scale : mm in one unit of the file
    """

    file: Path
    scale: float = 1.0

    @property
    def frame(self) -> Array:
        """(4, 4), mm, the mesh's own frame: the machine's."""
        return translation((0.0, 0.0, 0.0))


Shape = Box | Cylinder | MeshShape


@dataclass(frozen=True)
class Body:
    """One shape on one link.

    Parameters
    ----------
    link : ``bed``, or the letter of the axis that carries it: the next one towards the bed
    shape : positioned in the machine frame, every axis at 0
    assumed : what it is, where nobody described it; empty for a body of the machine's file
    """

    link: str
    shape: Shape
    assumed: str = ""
