"""What stands around the tool: part, stock and fixtures, and how near anything may come to them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from fiveaxis.collision.fixtures import Fixture
from fiveaxis.errors import SettingError
from fiveaxis.mesh import read_solid, require_solid
from fiveaxis.settings import StrictModel

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True)
class Clearances:
    """How near bodies may come to each other before it is worth a warning; touching is an error anyhow.

    The defaults are the house's: no standard says them. Zero asks for no more than not touching.

    Parameters
    ----------
    shank : mm, shank and the workpiece side: part, stock, fixtures, bodies of the table. To part and stock it
        counts from half the shank's diameter above the cutter on: below, the shank is as near as the cut
    holder : mm, holder and the workpiece side
    cutter : mm, cutter and everything that it isn't meant to cut: fixtures, bodies of the table
    machine : mm, bodies of the machine, head side, and the workpiece side or each other

    Raises
    ------
    SettingError
        A negative one, or one that isn't a finite number.
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
    """How near bodies may come to each other, mm."""

    shank: float = Field(Clearances.shank, ge=0.0, description="to part, stock, fixtures and table")
    holder: float = Field(Clearances.holder, ge=0.0, description="to part, stock, fixtures and table")
    cutter: float = Field(Clearances.cutter, ge=0.0, description="to fixtures and table")
    machine: float = Field(Clearances.machine, ge=0.0, description="of the head to all else")

    def build(self) -> Clearances:
        """Make the clearances."""
        return Clearances(**self.model_dump())


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the tool and the head must keep away from, beside the machine's own bodies.

    Parameters
    ----------
    part : mesh of the finished part, mm, workpiece frame
    stock : mesh of what it is cut from, mm, workpiece frame
    fixtures : clamps, vices: bodies that stand still in the workpiece frame
    clearances : mm, by kind of body

    Raises
    ------
    MeshError
        A mesh without triangles, with normals that point into the material, or too large.
    SettingError
        Two fixtures of one name.
    """

    part: trimesh.Trimesh | None = None
    stock: trimesh.Trimesh | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances = field(default_factory=Clearances)

    def __post_init__(self) -> None:
        for name, mesh in self.meshes.items():
            require_solid(mesh, name)
        names = [fixture.name for fixture in self.fixtures]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise SettingError(f"two fixtures are called {twice[0]!r}; findings couldn't tell them apart")

    @classmethod
    def load(
        cls,
        part: str | Path | trimesh.Trimesh | None = None,
        stock: str | Path | trimesh.Trimesh | None = None,
        fixtures: tuple[Fixture, ...] = (),
        clearances: Clearances | None = None,
    ) -> Surroundings:
        """Make surroundings of meshes or their files; parameters as for the class.

        Raises
        ------
        MeshError
            A file that can't be read, or a mesh that is refused.
        SettingError
            Two fixtures of one name.
        """
        return cls(
            part=read_solid(part) if isinstance(part, str | Path) else part,
            stock=read_solid(stock) if isinstance(stock, str | Path) else stock,
            fixtures=tuple(fixtures),
            clearances=Clearances() if clearances is None else clearances,
        )

    @property
    def meshes(self) -> dict[str, trimesh.Trimesh]:
        """``part`` and ``stock``, those that there are."""
        given = {"part": self.part, "stock": self.stock}
        return {name: mesh for name, mesh in given.items() if mesh is not None}
