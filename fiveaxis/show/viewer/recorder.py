"""The scene as the commands that meshcat's page takes: objects, where they are, and properties.

meshcat's own classes would import its server, notebooks and pictures for it, and take identifiers from the
clock; of the library only the page's script is used.
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray

# Identifiers of scene objects follow from this and their name, so a scene always has the same bytes.
NAMESPACE = uuid.UUID("5d0a4f0e-6c1b-5e55-9a0f-640123000000")
# Numbers of a page's typed arrays in MessagePack.
KINDS = {np.dtype(np.float32): ("Float32Array", 0x17), np.dtype(np.uint32): ("Uint32Array", 0x16)}
# Of a material, as three.js names it; both sides are drawn.
LOOK = {"color": 0xFFFFFF, "side": 2}
# Draws with the colours of vertices.
BY_VERTEX = 2


class Recorder:
    """Commands to the page, in order, each as the bytes that it gets."""

    def __init__(self) -> None:
        self.commands: list[bytes] = []

    def add(
        self,
        path: str,
        name: str,
        geometry: Mapping[str, Any],
        look: Mapping[str, object],
        *,
        kind: str = "Mesh",
        material: str = "MeshPhongMaterial",
    ) -> None:
        """Add an object at a path, identified by a name; what isn't opaque is transparent.

        Parameters
        ----------
        geometry : of `triangles` or `segments`
        look : of the material, beside `LOOK`
        kind, material : three.js' classes
        """
        drawn = {**LOOK, "transparent": look.get("opacity", 1.0) != 1.0, **look}
        names = name, f"{name}/geometry", f"{name}/material"
        own, shape, surface = (str(uuid.uuid5(NAMESPACE, text)) for text in names)
        whole = {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": [{"uuid": shape, **geometry}],
            "materials": [{"uuid": surface, "type": material, **drawn}],
            "object": {
                "uuid": own,
                "type": kind,
                "geometry": shape,
                "material": surface,
                "matrix": np.eye(4).ravel().tolist(),
            },
        }
        self._send({"type": "set_object", "object": whole, "path": f"/meshcat/{path}"})

    def place(self, path: str, pose: Array) -> None:
        """Set the pose, (4, 4) mm, of what is at a path."""
        matrix = pose.T.ravel().tolist()
        self._send({"type": "set_transform", "path": f"/meshcat/{path}", "matrix": matrix})

    def set(self, path: str, key: str, value: bool | Sequence[float]) -> None:
        """Set a property of what is at a path, which begins with a slash if it is one of meshcat's own."""
        where = path if path.startswith("/") else f"/meshcat/{path}"
        self._send({"type": "set_property", "path": where, "property": key, "value": value})

    def _send(self, command: Mapping[str, Any]) -> None:
        self.commands.append(import_module("umsgpack").packb(command))


def triangles(vertices: Array, faces: IntArray, colours: Array | None = None) -> dict[str, Any]:
    """Make the geometry of triangles, (v, 3) mm and (f, 3), with colours of vertices, (v, 3) 0…1."""
    data = segments(vertices, colours)["data"]
    return {"type": "BufferGeometry", "data": {**data, "index": _packed(faces.astype(np.uint32))}}


def segments(ends: Array, colours: Array | None = None) -> dict[str, Any]:
    """Make the geometry of lines, two ends each, (2 n, 3) mm, with colours, (2 n, 3) 0…1."""
    attributes = {"position": _packed(ends.astype(np.float32))}
    if colours is not None:
        attributes["color"] = _packed(colours.astype(np.float32))
    return {"type": "BufferGeometry", "data": {"attributes": attributes}}


def _packed(rows: NDArray[Any]) -> dict[str, Any]:
    name, number = KINDS[rows.dtype]
    content = import_module("umsgpack").Ext(number, rows.tobytes())
    return {"itemSize": rows.shape[1], "type": name, "array": content, "normalized": False}
