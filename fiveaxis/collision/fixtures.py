"""What holds the workpiece: clamps, vices and other bodies that stand still beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from fiveaxis.errors import JobError, SettingError
from fiveaxis.geometry import normalise
from fiveaxis.machine.bodies import Box, Cylinder, MeshShape, Shape
from fiveaxis.machine.chain import Triple, as_triple
from fiveaxis.settings import StrictModel

Positive = Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True)
class Fixture:
    """A body that stands still in the workpiece frame.

    Parameters
    ----------
    name : by which findings call it, e.g. ``left clamp``
    shape : box, cylinder or mesh; what `machine.bodies` calls the machine frame is the workpiece frame here

    Raises
    ------
    SettingError
        No name, or a dimension that isn't a number above 0.
    """

    name: str
    shape: Shape

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise SettingError("a fixture has no name; give it one, findings call it by that")
        shape = self.shape
        figures: dict[str, tuple[float, ...]] = {}
        if isinstance(shape, Box):
            figures = {"size": shape.size}
        elif isinstance(shape, Cylinder):
            figures = {"radius": (shape.radius,), "height": (shape.height,)}
        else:
            figures = {"scale": (shape.scale,)}
        for key, values in figures.items():
            if not all(np.isfinite(value) and value > 0.0 for value in values):
                shown = ", ".join(f"{value:g}" for value in values)
                raise SettingError(f"fixture {self.name!r}: {key} is {shown}; it must be above 0")
        if not np.isfinite(shape.frame).all():
            raise SettingError(f"fixture {self.name!r}: its place holds a number that isn't finite")


class BoxSides(StrictModel):
    """A box along the axes of the workpiece frame."""

    size: tuple[Positive, Positive, Positive] = Field(description="sides along X, Y and Z, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="its middle in the workpiece frame, mm")


class CylinderSides(StrictModel):
    """A cylinder."""

    radius: float = Field(gt=0.0, description="half its diameter, mm")
    height: float = Field(gt=0.0, description="length along its axis, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="the middle of its axis in the workpiece frame, mm")
    direction: Triple = (0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _points_somewhere(self) -> CylinderSides:
        if not any(self.direction):
            raise ValueError("direction has length 0; give three numbers, not all zero")
        return self


class FixtureTable(StrictModel):
    """A clamp, vice or other body beside the workpiece, in the workpiece frame."""

    name: str = Field(min_length=1, description="by which findings call it")
    box: BoxSides | None = None
    cylinder: CylinderSides | None = None
    mesh: str | None = Field(None, min_length=1, description="file, relative to this one")
    scale: float = Field(1.0, gt=0.0, description="mm in one unit of the mesh file")

    @model_validator(mode="after")
    def _has_one_shape(self) -> FixtureTable:
        given = [key for key in ("box", "cylinder", "mesh") if getattr(self, key) is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none of them"
            raise ValueError(f"fixture {self.name!r} is a box, a cylinder or a mesh; it has {found}")
        if "scale" in self.model_fields_set and self.mesh is None:
            raise ValueError(f"fixture {self.name!r}: scale is for a mesh")
        return self

    @property
    def file(self) -> Path | None:
        """The mesh's file, None for a box or cylinder."""
        return None if self.mesh is None else Path(self.mesh)

    def beside(self, folder: Path) -> FixtureTable:
        """Return the table with its mesh's file named as seen from a folder."""
        return self if self.mesh is None else self.model_copy(update={"mesh": str(folder / self.mesh)})

    def build(self, folder: Path) -> Fixture:
        """Make the fixture.

        Parameters
        ----------
        folder : to which a mesh file's name is relative

        Raises
        ------
        JobError
            No such mesh file.
        """
        if self.box is not None:
            return Fixture(self.name, Box(self.box.size, self.box.center))
        if self.cylinder is not None:
            sides = self.cylinder
            direction = as_triple(normalise(np.array(sides.direction)))
            return Fixture(self.name, Cylinder(sides.radius, sides.height, sides.center, direction))
        file = folder / str(self.mesh)
        if not file.is_file():
            raise JobError(f"fixture {self.name!r}: no such file: {file}")
        return Fixture(self.name, MeshShape(file, self.scale))
