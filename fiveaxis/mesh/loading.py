"""Part meshes: read them, and refuse those that a path can't be planned on."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.errors import MeshError
from fiveaxis.files import MOST_MESH_BYTES, require_size

if TYPE_CHECKING:
    import trimesh

# Bytes of a binary STL: its head, of which the last four are the number of triangles, and one of these.
STL_HEAD, STL_TRIANGLE = 84, 50
DAMAGED = "it is damaged, cut off, or of another format; export it anew"

logger = logging.getLogger(__name__)

SUFFIXES = (".stl", ".ply", ".obj", ".off")


def load_mesh(path: str | Path, *, allow_open: bool = False, turn: bool = True) -> trimesh.Trimesh:
    """Read a part mesh; its coordinates are taken as mm.

    Parameters
    ----------
    path : an STL, PLY, OBJ or OFF file
    allow_open : go on with a mesh that isn't watertight
    turn : turn the normals of a watertight mesh out of the material

    Returns
    -------
    Mesh with merged vertices and, if it is watertight and they are turned, normals out of the material

    Raises
    ------
    MeshError
        Missing file, unknown suffix, a file too large or without triangles, vertices that aren't finite, a
        mesh that isn't watertight.
    """
    file = Path(path)
    if not file.is_file():
        raise MeshError("no such file", file=file)
    if file.suffix.lower() not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise MeshError(f"suffix {file.suffix!r} is not a mesh format read here; known: {known}", file=file)
    require_size(file, file.stat().st_size, MOST_MESH_BYTES, MeshError)
    mesh = check_mesh(_parse(file), name=str(file), allow_open=allow_open, turn=turn)
    logger.info("%s: %d triangles", file.name, len(mesh.faces))
    return mesh


def check_mesh(
    mesh: trimesh.Trimesh, *, name: str, allow_open: bool = False, turn: bool = True
) -> trimesh.Trimesh:
    """Return a copy with merged vertices and outward normals, or say why there can't be one.

    Parameters
    ----------
    mesh : any mesh, mm
    name : what to call it in messages
    allow_open : go on with a mesh that isn't watertight
    turn : turn the normals of a watertight mesh out of the material

    Raises
    ------
    MeshError
        No triangles, vertices that aren't finite, not watertight.
    """
    if len(mesh.faces) == 0:
        raise MeshError("has no triangles", file=name)
    bad = int((~np.isfinite(mesh.vertices).all(axis=1)).sum())
    if bad:
        raise MeshError(f"{bad} vertices have coordinates that aren't finite numbers", file=name)
    checked = mesh.copy()
    checked.merge_vertices(merge_tex=True, merge_norm=True)
    if checked.is_watertight:
        if turn:
            _turn_outward(checked)
    elif not allow_open:
        raise MeshError(
            f"not watertight: {count_open_edges(checked)} of its edges don't join exactly two triangles; "
            "mend the mesh, or use --allow-open to go on",
            file=name,
        )
    return checked


def take_mesh(
    part: str | Path | trimesh.Trimesh, *, name: str = "mesh", allow_open: bool = False
) -> trimesh.Trimesh:
    """Read a mesh's file (`load_mesh`), or check a mesh (`check_mesh`).

    Parameters
    ----------
    part : the file, or the mesh, mm
    name : what to call a mesh without a file in messages
    allow_open : go on with a mesh that isn't watertight

    Raises
    ------
    MeshError
        A mesh that can't be read, or is refused.
    """
    if isinstance(part, str | Path):
        return load_mesh(part, allow_open=allow_open)
    return check_mesh(part, name=name, allow_open=allow_open)


def count_open_edges(mesh: trimesh.Trimesh) -> int:
    """Count the edges that don't join exactly two triangles."""
    _, uses = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    return int((uses != 2).sum())


def _parse(file: Path) -> trimesh.Trimesh:
    import trimesh
    from trimesh.exchange.stl import HeaderError

    if file.suffix.lower() == ".stl":
        _require_whole(file)
    try:
        # Without processing, so that vertices that aren't numbers are seen and not silently dropped.
        return trimesh.load_mesh(file, process=False)
    except ImportError:
        # trimesh guesses the encoding of text that isn't UTF-8 with a library that is not needed otherwise.
        raise MeshError(f"can't be read as {file.suffix}: its text isn't UTF-8", file=file) from None
    except OSError as fault:
        raise MeshError(f"can't be read: {fault.strerror or fault}", file=file) from None
    except MemoryError:
        raise MeshError(f"can't be read as {file.suffix}: {DAMAGED}", file=file) from None
    except (ValueError, LookupError, TypeError, ArithmeticError, HeaderError):
        # The parser's own words are about its arrays, and help nobody.
        raise MeshError(f"can't be read as {file.suffix}: {DAMAGED}", file=file) from None


def _require_whole(file: Path) -> None:
    """Refuse a binary STL that ends before its last triangle.

    Raises
    ------
    MeshError
        It was cut off.
    """
    with file.open("rb") as stream:
        head = stream.read(STL_HEAD)
    size = file.stat().st_size
    # Text has no zero bytes; one that begins with "solid" may be binary all the same.
    if len(head) < STL_HEAD or b"\0" not in head:
        return
    told = int.from_bytes(head[-4:], "little")
    whole = (size - STL_HEAD) // STL_TRIANGLE
    if told > whole:
        raise MeshError(
            f"is cut off: its head tells of {told} triangles, and {whole} are there; copy or export it anew",
            file=file,
        )


def _turn_outward(mesh: trimesh.Trimesh) -> None:
    if not mesh.is_winding_consistent:
        mesh.fix_normals()
    if mesh.volume < 0.0:
        mesh.invert()
