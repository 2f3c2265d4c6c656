"""Bodies around the tool: part, stock and fixtures, and the clearances to them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from fiveaxis.base import (
    Array,
    CadFile,
    JobError,
    SettingError,
    StrictModel,
    Workpiece,
    normalise,
    product,
    require_file,
)
from fiveaxis.cam import Mesh, load_mesh, read_solid, require_solid
from fiveaxis.check.stock.cutting import Blank
from fiveaxis.check.stock.display import mesh_of
from fiveaxis.check.stock.sources import load_stock, names_mesh
from fiveaxis.model import Box, Cylinder, MeshShape, Shape, Triple, as_triple

# Sides of the prism around a cylinder; its edges lie up to 0.12 % of the radius outside.
SIDES = 64
Positive = Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True)
class Fixture:
    """A clamp, vice or other body that is fixed in the workpiece frame.

    Parameters
    ----------
    name : for findings, e.g. ``left clamp``
    shape : box, cylinder or mesh, placed in the workpiece frame instead of the machine frame

    Raises
    ------
    SettingError
        No name, or a dimension that isn't a number above 0.
    """

    name: str
    shape: Shape

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise SettingError("a fixture has no name; give it one, for the findings")
        for key in ("size", "radius", "height", "scale"):
            values = np.atleast_1d(getattr(self.shape, key, 1.0))
            if not (np.isfinite(values) & (values > 0.0)).all():
                text = ", ".join(f"{value:g}" for value in values)
                raise SettingError(f"fixture {self.name!r}: {key} is {text}; it must be above 0")
        if not np.isfinite(self.shape.frame).all():
            raise SettingError(f"fixture {self.name!r}: its position or direction isn't finite")


class BoxSides(StrictModel):
    """A box along the axes of the workpiece frame."""

    size: tuple[Positive, Positive, Positive] = Field(description="sides along X, Y and Z, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="centre in the workpiece frame, mm")


class CylinderSides(StrictModel):
    """A cylinder."""

    radius: float = Field(gt=0.0, description="of the cylinder, mm")
    height: float = Field(gt=0.0, description="length along the axis, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="centre in the workpiece frame, mm")
    direction: Triple = Field((0.0, 0.0, 1.0), description="of its axis in the workpiece frame")

    @model_validator(mode="after")
    def _points_somewhere(self) -> CylinderSides:
        if not any(self.direction):
            raise ValueError("direction has length 0; give three numbers, not all zero")
        return self


class FixtureTable(StrictModel):
    """A clamp, vice or other body that is fixed in the workpiece frame."""

    name: str = Field(min_length=1, description="for findings", examples=["vice"])
    box: BoxSides | None = Field(None, examples=[{"size": [40, 20, 30], "center": [60, 0, 15]}])
    cylinder: CylinderSides | None = None
    mesh: str | None = Field(None, min_length=1, description="file, relative to this one")
    scale: float = Field(1.0, gt=0.0, description="mm in one unit of the mesh file")

    @model_validator(mode="after")
    def _has_one_shape(self) -> FixtureTable:
        given = [key for key in ("box", "cylinder", "mesh") if getattr(self, key) is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none of them"
            raise ValueError(f"fixture {self.name!r} must have a box, a cylinder or a mesh; it has {found}")
        if "scale" in self.model_fields_set and self.mesh is None:
            raise ValueError(f"fixture {self.name!r}: scale is for a mesh only")
        return self

    @property
    def file(self) -> Path | None:
        """The mesh's file, None for a box or cylinder."""
        return None if self.mesh is None else Path(self.mesh)

    def beside(self, folder: Path) -> FixtureTable:
        """Return the table with its mesh file joined to a folder."""
        return self if self.mesh is None else self.model_copy(update={"mesh": str(folder / self.mesh)})

    def build(self) -> Fixture:
        """Build the fixture; `JobError` if there is no such mesh file."""
        if self.box is not None:
            return Fixture(self.name, Box(self.box.size, self.box.center))
        if self.cylinder is not None:
            sides = self.cylinder
            along = np.array(sides.direction)
            # Scaled first: the squares of 1e200 are infinite.
            direction = as_triple(normalise(along / np.abs(along).max()))
            return Fixture(self.name, Cylinder(sides.radius, sides.height, sides.center, direction))
        file = Path(str(self.mesh))
        try:
            require_file(file, JobError)
        except JobError as fault:
            raise JobError(f"fixture {self.name!r}: {fault}") from None
        return Fixture(self.name, MeshShape(file, self.scale))


@dataclass(frozen=True)
class Clearances:
    """Clearances: bodies that come nearer get a warning; bodies that touch get an error in any case.

    The defaults are this project's choice: no standard gives any. Zero requires only that bodies don't touch.

    Parameters
    ----------
    shank : mm, between shank and workpiece side: part, stock, fixtures, bodies of the table. To part and
        stock it applies from half the shank's diameter above the cutter: below, the shank is beside the cut
    holder : mm, between holder and workpiece side
    cutter : mm, between cutter and what it isn't meant to cut: fixtures, bodies of the table
    machine : mm, between the head's bodies and the workpiece side, and among the machine's bodies

    Raises
    ------
    SettingError
        A clearance that is negative or not finite.
    """

    shank: float = 0.2
    holder: float = 1.0
    cutter: float = 0.5
    machine: float = 2.0

    def __post_init__(self) -> None:
        for name, value in self.by_kind.items():
            if not (np.isfinite(value) and value >= 0.0):
                raise SettingError(f"clearance of the {name} is {value:g} mm; it must be 0 or more")

    @property
    def by_kind(self) -> dict[str, float]:
        """Kind of body → mm."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}


class ClearanceTable(StrictModel):
    """Clearances between bodies, mm."""

    shank: float = Field(Clearances.shank, ge=0.0, description="to part, stock, fixtures and table")
    holder: float = Field(Clearances.holder, ge=0.0, description="to part, stock, fixtures and table")
    cutter: float = Field(Clearances.cutter, ge=0.0, description="to fixtures and table")
    machine: float = Field(Clearances.machine, ge=0.0, description="of the head to all else")

    def build(self) -> Clearances:
        """Build the clearances."""
        return Clearances(**self.model_dump())


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the tool and the head must keep away from, besides the machine's own bodies.

    Parameters
    ----------
    part : mesh of the finished part, mm, workpiece frame
    stock : mesh of the stock, mm, workpiece frame
    fixtures : bodies that are fixed in the workpiece frame
    clearances : mm, by kind of body
    blank : the stock that a program cuts, with a closed part in it
    above_table : mm, how high the lowest point of part, stock and fixtures is over the table's face, where
        the machine has no bodies there; None where nobody stated it

    Raises
    ------
    MeshError
        A mesh without triangles, with normals that point into the material, or too large.
    SettingError
        Two fixtures of one name; a height that is negative or not finite.
    """

    part: Mesh | None = None
    stock: Mesh | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances = field(default_factory=Clearances)
    blank: Blank | None = None
    above_table: float | None = None

    def __post_init__(self) -> None:
        if self.above_table is not None and not 0.0 <= self.above_table < np.inf:
            raise SettingError(f"above_table is {self.above_table:g} mm; it must be 0 or more")
        for name, mesh in self.meshes.items():
            require_solid(mesh, name)
        names = [fixture.name for fixture in self.fixtures]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise SettingError(f"two fixtures are called {twice[0]!r}; give each a name of its own")

    @classmethod
    def of(
        cls,
        workpiece: Workpiece,
        cad: CadFile = CadFile(),
        fixtures: tuple[Fixture, ...] = (),
        clearances: Clearances | None = None,
    ) -> Surroundings:
        """Load part and stock as options give them, and the part's CAD file as `cad` says.

        Raises
        ------
        MeshError
            A file that can't be read, or a mesh that is refused; with a closed part, an open mesh of a stock.
        SettingError
            Two fixtures of one name; a stock that is unknown, takes too much memory, or refers to no part.
        JobError
            A stock that doesn't contain the part.
        """
        part, solid = workpiece.part, None
        if isinstance(part, str | Path):
            solid = read_solid(part, workpiece.part_unit, mesh_tolerance=cad.mesh_tolerance, body=cad.body)
        elif part is not None:
            solid = Mesh.of(part)
        stock, blank = _take_stock(workpiece, solid)
        clearances = Clearances() if clearances is None else clearances
        return cls(solid, stock, tuple(fixtures), clearances, blank, workpiece.above_table)

    @cached_property
    def points(self) -> Array:
        """(p, 3), mm, workpiece frame: corners of part, stock and fixtures; a prism contains a cylinder."""
        corners = [mesh.vertices for mesh in self.meshes.values()]
        corners += [shape_triangles(fixture.shape).reshape(-1, 3) for fixture in self.fixtures]
        return np.concatenate([np.empty((0, 3)), *corners])

    @property
    def meshes(self) -> dict[str, Mesh]:
        """``part`` and ``stock``, without those that are None."""
        given = {"part": self.part, "stock": self.stock}
        return {name: mesh for name, mesh in given.items() if mesh is not None}


def _take_stock(workpiece: Workpiece, part: Mesh | None) -> tuple[Mesh | None, Blank | None]:
    """Load a stock: as a mesh, which nothing cuts, and as rays with the part in them, if that is closed."""
    given = workpiece.stock
    if given is None:
        return None, None
    mesh = None if isinstance(given, str | Path) else Mesh.of(given)
    if isinstance(given, str | Path) and names_mesh(given):
        mesh = read_solid(given, workpiece.part_unit)
    if part is None or not part.is_watertight:
        if mesh is None:
            raise SettingError(f"stock {given} is cut down to a part: give the part's closed mesh (part)")
        return mesh, None
    rays = load_stock(given if mesh is None else mesh, part, workpiece.stock_resolution)
    blank = replace(Blank.of(rays, part), tolerance=workpiece.stock_tolerance)
    return (mesh_of(rays) if mesh is None else mesh), blank


def shape_triangles(shape: Box | Cylinder | MeshShape) -> Array:
    """Triangulate a shape, (f, 3, 3) mm, in the frame that it is placed in; a prism contains a cylinder."""
    if isinstance(shape, MeshShape):
        triangles = shape.scale * load_mesh(shape.file, allow_open=True).triangles
    elif isinstance(shape, Box):
        triangles = Mesh.box(np.array(shape.size)).triangles
    else:
        outside, half = shape.radius / np.cos(np.pi / SIDES), shape.height / 2.0
        outline = np.array([[0.0, -half], [outside, -half], [outside, half]])
        triangles = Mesh.revolved(outline, SIDES).triangles
    frame = shape.frame
    return np.asarray(product(triangles, frame[:3, :3].T) + frame[:3, 3])
