"""The triangles of a mesh file: all that it has, or a refusal.

Binary STL and OBJ are read here, the other formats by trimesh, whose triangles are counted: it reads what a
header states, and drops the rest without a word.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from pathlib import Path

import numpy as np

from fiveaxis.base import MOST_MESH_BYTES, Array, IntArray, MeshError, kept_by_file, read_input
from fiveaxis.cam.mesh.mesh import Mesh

# Bytes of a binary STL: its header, whose last four are the number of triangles, and one triangle.
STL_HEAD, STL_TRIANGLE = 84, 50
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
# Coordinates of bytes that are triangles, by their size: counters lie below, most other bytes above.
_SMALLEST, _LARGEST = 1e-30, 1e6
DAMAGED = "it is damaged, truncated, or of another format; export it again"
# Larger meshes take more than a minute to plan on, and their trees more memory than many computers have.
MOST_TRIANGLES = 4_000_000
# What to do about it: finer triangles than the tolerance of machining show nothing.
SIMPLIFY = (
    "export it with a larger chord tolerance, or simplify it to a tolerance of some micrometres (MeshLab: "
    "Quadric Edge Collapse Decimation; trimesh: simplify_quadric_decimation)"
)
# trimesh logs the tracebacks of what it can't parse; without a handler Python would print them.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


def require_few(count: int, name: str | Path) -> None:
    """Refuse more than `MOST_TRIANGLES` triangles by a `MeshError`."""
    if count > MOST_TRIANGLES:
        raise MeshError(f"has {count:,} triangles, more than {MOST_TRIANGLES:,}; {SIMPLIFY}", file=name)


@kept_by_file(8)
def parse_mesh(file: Path) -> Mesh:
    """Read the triangles of an STL, PLY, OBJ or OFF file, in its own unit; they may be none.

    Raises
    ------
    MeshError
        It can't be parsed, or holds other triangles than it states.
    """
    kind = file.suffix.lower()
    content = read_input(file, MOST_MESH_BYTES, MeshError)
    corners = _binary_triangles(content, file) if kind == ".stl" else None
    if corners is not None:
        faces = np.arange(3 * len(corners)).reshape(-1, 3)
        return Mesh(corners.reshape(-1, 3), faces)
    try:
        if kind == ".obj":
            return Mesh(*_obj_triangles(content, file))
        import trimesh  # slow to load

        with warnings.catch_warnings():
            # numpy only warns of numbers that it can't read.
            warnings.simplefilter("error")
            # Processing would silently drop vertices that aren't finite.
            mesh = Mesh.of(trimesh.load_mesh(io.BytesIO(content), file_type=kind[1:], process=False))
        stated, found, what = _counted(content, kind, len(mesh.faces))
    except MeshError:
        raise
    except ImportError:
        # trimesh guesses other encodings with a library that isn't installed.
        raise MeshError(f"can't be read as {kind}: its text isn't UTF-8", file=file) from None
    except MemoryError:
        raise MeshError(f"can't be read as {kind}: it needs more memory than there is", file=file) from None
    except Exception:
        # On a damaged file trimesh raises errors of all kinds; they are about its arrays and help no user.
        raise MeshError(f"can't be read as {kind}: {DAMAGED}", file=file) from None
    if stated != found:
        raise MeshError(f"states {stated} {what}, and has {found} that can be read: {DAMAGED}", file=file)
    return mesh


def _counted(content: bytes, kind: str, faces: int) -> tuple[int, int, str]:
    """Count what a text file states, what there is (of some kinds the `faces` read), and say of what."""
    if kind == ".stl":
        return len(re.findall(rb"facet\s+normal", content.lower())), faces, "facets"
    lines = [line for line in (row.split(b"#")[0].strip() for row in content.splitlines()) if line]
    if kind == ".off":
        # The counts stand in the line of the word OFF or in the next one.
        head = 0 if len(lines[0].split()) > 1 else 1
        counts = [int(word) for word in lines[head].split() if word.isdigit()]
        return sum(counts[:2]), len(lines) - head - 1, "lines of vertices and faces"
    if b"end_header" not in lines or not any(line.split()[:2] == [b"format", b"ascii"] for line in lines):
        return faces, faces, "faces"  # of a binary PLY, whose length trimesh holds to its header
    head = lines.index(b"end_header")
    elements = [line.split() for line in lines[:head] if line.startswith(b"element")]
    return sum(int(words[2]) for words in elements), len(lines) - head - 1, "lines of vertices and faces"


def _binary_triangles(content: bytes, file: Path) -> Array | None:
    """Read the corners of a binary STL's triangles, (f, 3, 3) mm; None if it is text.

    `MeshError` if it ends before its last triangle, goes on with triangles after it, or has more than
    `MOST_TRIANGLES`. Other bytes after it, such as padding or a comment, are no triangles.
    """
    # Only text has no zero byte: a binary file may begin with "solid" too.
    if len(content) < STL_HEAD or b"\0" not in content[:STL_HEAD]:
        return None
    stated = int.from_bytes(content[STL_HEAD - 4 : STL_HEAD], "little")
    whole = (len(content) - STL_HEAD) // STL_TRIANGLE
    if stated > whole:
        raise MeshError(
            f"is truncated: its header states {stated} triangles, the file has {whole}; copy or export it "
            "again",
            file=file,
        )
    require_few(stated, file)
    one_more = min(whole, stated + 1)
    with np.errstate(invalid="ignore"):  # of a signalling NaN, which is refused with the others
        every = np.frombuffer(content, _TRIANGLE, count=one_more, offset=STL_HEAD)["corners"].astype(float)
    rest = content[STL_HEAD + stated * STL_TRIANGLE :]
    again = int.from_bytes(rest[STL_HEAD - 4 : STL_HEAD], "little")
    if len(rest) == STL_HEAD + again * STL_TRIANGLE and again:
        raise MeshError(
            f"a second STL of {again} triangles follows its {stated}; export both bodies into one mesh",
            file=file,
        )
    text = rest.isascii() and b"\0" not in rest
    if one_more > stated and not text and _is_triangle(every[stated]):
        raise MeshError(
            f"its header states {stated} triangles, and {whole - stated} more follow: only part of it would "
            "be read; export it again",
            file=file,
        )
    return every[:stated]


def _is_triangle(corners: Array) -> bool:
    """Tell whether bytes that were read as corners, (3, 3), can be a triangle; padding can't."""
    size = np.abs(corners)
    plain = (size == 0.0) | ((size > _SMALLEST) & (size < _LARGEST))
    return bool(plain.all() and np.ptp(corners, axis=0).any())


def _obj_triangles(content: bytes, file: Path) -> tuple[Array, IntArray]:
    """Read all vertices, (v, 3), and faces, (f, 3), of an OBJ file, whatever group or material they are of.

    A face's numbers count from 1 or, negative, back from the last vertex above it (Wavefront, Advanced
    Visualizer, appendix B1). Polygons are divided from the first corner that leaves no triangle reversed.

    Raises
    ------
    MeshError
        A face names a vertex that there isn't, or a polygon can't be divided so.
    """
    require_few(content.count(b"\nf"), file)
    vertices: list[list[str]] = []
    polygons: dict[int, list[list[int]]] = {}
    text = content.decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["f"]:
            named = [int(word.split("/", 1)[0]) for word in words[1:]]
            face = [index - 1 if index > 0 else len(vertices) + index for index in named]
            if len(face) < 3 or 0 in named or min(face) < 0:
                raise MeshError(
                    f"line {number}: a face needs three vertices, counted from 1 or, back from the "
                    f"{len(vertices)} above it, from -1; this is {' '.join(words)}: {DAMAGED}",
                    file=file,
                )
            polygons.setdefault(len(face), []).append(face)
    places = np.array(vertices, dtype=float) if vertices else np.zeros((0, 3))
    faces = [np.zeros((0, 3), dtype=np.int64)]
    for count, listed in polygons.items():
        faces.append(_divided(np.array(listed, dtype=np.int64), places, count, file))
    return places, np.concatenate(faces)


def _divided(polygons: IntArray, places: Array, count: int, file: Path) -> IntArray:
    """Divide polygons, (p, count), into triangles, (p * (count - 2), 3), about one of their corners."""
    fan = np.column_stack([np.zeros(count - 2, np.int64), np.arange(1, count - 1), np.arange(2, count)])
    # Vertices that there aren't, or that aren't finite, are told by the checks of any mesh.
    if count == 3 or polygons.max() >= len(places) or not np.isfinite(places).all():
        return polygons[:, fan].reshape(-1, 3)
    chosen, open_ = polygons[:, fan], np.ones(len(polygons), dtype=bool)
    for first in range(count):
        tried = np.roll(polygons[open_], -first, axis=1)[:, fan]
        corners = places[tried]
        normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
        whole = normals.sum(axis=1)
        along = np.einsum("pti,pi->pt", normals, whole)
        good = (along >= -1e-9 * np.sum(whole**2, axis=1)[:, None]).all(axis=1)
        rows = np.flatnonzero(open_)[good]
        chosen[rows], open_[rows] = tried[good], False
    if open_.any():
        raise MeshError(
            f"{open_.sum()} of its faces of {count} corners can't be divided about one of them, as they bend "
            "inwards; export triangles",
            file=file,
        )
    return chosen.reshape(-1, 3)
