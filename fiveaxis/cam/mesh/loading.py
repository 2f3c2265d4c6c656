"""Mesh files: reading them, refusing those that can't be used, and whether their unit can be right."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import (
    CAD_SUFFIXES,
    MESH_SUFFIXES,
    MESH_TOLERANCE,
    Array,
    Finding,
    MeshError,
    MeshSource,
    Place,
    SettingError,
    Severity,
    Unit,
    require_file,
)
from fiveaxis.cam.mesh.cad.loading import FACTORS, load_model
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.cam.mesh.parsing import DAMAGED, parse_mesh, require_few

if TYPE_CHECKING:
    import trimesh

# mm: products of three larger coordinates, as in volumes, lose their last digit that matters.
FARTHEST = 1e7

logger = logging.getLogger(__name__)
# mm: parts of five-axis machines are larger than the first, and smaller than the second.
SMALLEST_PART, LARGEST_PART = 5.0, 5000.0


def load_mesh(
    path: str | Path,
    *,
    unit: Unit | None = None,
    allow_open: bool = False,
    turn: bool = True,
    mesh_tolerance: float = MESH_TOLERANCE,
    body: str | None = None,
) -> Mesh:
    """Read a part: a mesh, or the mesh of a CAD file, whose exact surfaces it knows.

    Parameters
    ----------
    path : an STL, PLY, OBJ or OFF file, or a STEP or IGES file
    unit : of the file's coordinates: ``mm``, ``inch`` or ``m``; by default what a CAD file states, or mm
    allow_open : accept a mesh that isn't watertight
    turn : turn the normals of a watertight mesh outward; those of CAD solids always are
    mesh_tolerance : mm, chords of the mesh of a CAD file
    body : of a CAD file, the one that is taken, by name or number from 1; by default all

    Returns
    -------
    Mesh in mm with merged vertices

    Raises
    ------
    SettingError
        An unknown unit.
    MeshError
        The file is missing, too large, of an unknown suffix, or can't be parsed; or `check_mesh` refuses it.
        What a file refers to, such as materials and textures, isn't opened.
    """
    file = Path(path)
    require_file(file, MeshError)
    if file.suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join(MESH_SUFFIXES)
        raise MeshError(f"suffix {file.suffix!r} is not a mesh format read here; known: {known}", file=file)
    if unit is not None and unit not in FACTORS:
        raise SettingError(f"unit = {unit!r} must be {', '.join(FACTORS)}")
    if body is not None and file.suffix.lower() not in CAD_SUFFIXES:
        raise MeshError(f"body = {body!r} is for CAD files, and this is a mesh; leave body out", file=file)
    if file.suffix.lower() in CAD_SUFFIXES:
        model = load_model(file, unit=unit, mesh_tolerance=mesh_tolerance, body=body)
        if model.meeting and not allow_open:
            one, two = (f"{number} {model.bodies[number]!r}" for number in model.meeting[0])
            raise MeshError(
                f"bodies {one} and {two} touch or reach into each other, so they aren't one solid; choose "
                "one (--body), unite them where they were made, or take them as they are (--allow-open)",
                file=file,
            )
        parsed = model.mesh()
    else:
        parsed = parse_mesh(file)
        if unit not in (None, "mm"):
            parsed = Mesh(FACTORS[unit] * parsed.vertices, parsed.faces)
    mesh = check_mesh(parsed, name=str(file), allow_open=allow_open, turn=turn)
    logger.info("%s: %d triangles, %s", file.name, len(mesh.faces), size_text(mesh.extents))
    return mesh


def check_mesh(
    given: Mesh | trimesh.Trimesh, *, name: str, allow_open: bool = False, turn: bool = True
) -> Mesh:
    """Return a copy of a mesh in mm with merged vertices; `name` is used in messages.

    Raises
    ------
    MeshError
        No triangles or more than `MOST_TRIANGLES`, triangles of vertices that it doesn't have, vertices that
        aren't finite or too far away, not watertight.
    """
    mesh = Mesh.of(given)
    _require_sound(mesh, name)
    checked = mesh.merged()
    if checked.is_watertight:
        return checked.turned_outward() if turn else checked
    if not allow_open:
        raise MeshError(
            f"not watertight: {checked.open_edges} of its edges don't join exactly two triangles; "
            "repair the mesh, or accept it as it is (--allow-open)",
            file=name,
        )
    return checked


def take_mesh(
    part: MeshSource,
    *,
    name: str = "mesh",
    unit: Unit | None = None,
    allow_open: bool = False,
    mesh_tolerance: float = MESH_TOLERANCE,
    body: str | None = None,
) -> Mesh:
    """Read a part's file (`load_mesh`), or check a mesh in mm (`check_mesh`)."""
    if isinstance(part, str | Path):
        return load_mesh(part, unit=unit, allow_open=allow_open, mesh_tolerance=mesh_tolerance, body=body)
    return check_mesh(part, name=name, allow_open=allow_open)


def read_solid(
    file: str | Path,
    unit: Unit | None = None,
    *,
    mesh_tolerance: float = MESH_TOLERANCE,
    body: str | None = None,
) -> Mesh:
    """Read a part for collision checks (`load_mesh`): normals of meshes aren't turned, holes are allowed.

    Raises
    ------
    MeshError
        The file can't be read, or `require_solid` refuses the mesh.
    """
    mesh = load_mesh(file, unit=unit, allow_open=True, turn=False, mesh_tolerance=mesh_tolerance, body=body)
    require_solid(mesh, str(file))
    return mesh


def require_solid(mesh: Mesh, name: str) -> None:
    """Refuse a mesh in mm that is too large, or closed without consistent outward normals.

    `MeshError` is raised as by `check_mesh`, except that it may be open; and in a closed mesh for normals
    that point into the material, or neighbouring triangles that face opposite sides.
    """
    _require_sound(mesh, name)
    if not mesh.is_watertight:
        return
    remedy = "turn them outwards where the mesh was made (Flip or Harmonise normals; in trimesh fix_normals)"
    if not mesh.is_winding_consistent:
        raise MeshError(f"neighbouring triangles face opposite sides; {remedy}", file=name)
    if mesh.volume < 0.0:
        raise MeshError(
            f"its normals point into the material: its volume is {mesh.volume:.6g} mm3; {remedy}", file=name
        )


def _require_sound(mesh: Mesh, name: str) -> None:
    if len(mesh.faces) == 0:
        raise MeshError("has no triangles", file=name)
    require_few(len(mesh.faces), name)
    if mesh.vertices.shape[1] != 3 or mesh.faces.shape[1] != 3:
        raise MeshError(f"its vertices aren't X, Y and Z: {DAMAGED}", file=name)
    bad = int((~np.isfinite(mesh.vertices).all(axis=1)).sum())
    if bad:
        raise MeshError(f"{bad} vertices have coordinates that aren't finite numbers", file=name)
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise MeshError(
            f"its triangles name vertices {mesh.faces.min()} to {mesh.faces.max()}, and it has "
            f"{len(mesh.vertices)}; {DAMAGED}",
            file=name,
        )
    farthest = float(np.abs(mesh.vertices).max())
    if farthest > FARTHEST:
        raise MeshError(
            f"has a coordinate of {farthest:g} mm, beyond {FARTHEST:g} mm; check its unit (unit, --unit)",
            file=name,
        )


def size_text(size: Array) -> str:
    """Write extents, (3,) mm: ``50.8 × 50.8 × 25.4 mm``."""
    return " × ".join(f"{extent:.4g}" for extent in size) + " mm"


def other_sizes(size: Array, unit: Unit) -> str:
    """Write what extents, (3,) mm, that were read in a unit are in the other units."""
    return ", ".join(
        f"{other} makes it {size_text(size * FACTORS[other] / FACTORS[unit])}"
        for other in FACTORS
        if other != unit
    )


def body_findings(mesh: Mesh, name: str) -> tuple[Finding, ...]:
    """Return the finding that several bodies of a CAD file are taken together as the part."""
    model = mesh.model
    if model is None or len(model.bodies) < 2:
        return ()
    listed = ", ".join(f"{number} {text!r}" for number, text in list(model.bodies.items())[:10])
    message = (
        f"its {len(model.bodies)} bodies together are the part ({listed}); choose one with body (--body)"
    )
    return (Finding(Severity.NOTE, "several-bodies", message, Place(file=name)),)


def size_findings(size: Array, *, unit: Unit, diameter: float, name: str) -> tuple[Finding, ...]:
    """Return the finding on a part whose size, (3,) mm, is implausible, with its sizes in the other units.

    `unit` is that in which its coordinates were read, `name` the file; a part is hardly ever smaller than two
    diameters, mm, of the cutter.
    """
    extent = float(size.max())
    usual = (SMALLEST_PART, "parts of 5-axis machines"), (2.0 * diameter, "twice the cutter's diameter")
    least, what = max(usual)
    if least <= extent <= LARGEST_PART:
        return ()
    side = f"below {least:g} mm ({what})" if extent < least else f"above {LARGEST_PART:g} mm"
    message = (
        f"the part measures {size_text(size)}, read in {unit}, and its longest side is {side}; if its file "
        f"has another unit, say which (unit for an input, part_unit for a part): {other_sizes(size, unit)}"
    )
    return (Finding(Severity.WARNING, "part-size", message, Place(file=name), extent),)
