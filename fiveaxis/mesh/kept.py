"""What is made of a mesh once, and kept for as long as the mesh is there and doesn't change."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    import trimesh

T = TypeVar("T")


def kept_by_mesh(make: Callable[[trimesh.Trimesh], T]) -> Callable[[trimesh.Trimesh], T]:
    """Decorate a function of a mesh so that it runs once per mesh: trees of large meshes take long to build.

    A mesh's hash is that of its arrays, so a mesh that was changed is a new one. What is returned mustn't
    refer to the mesh, which would keep it alive.
    """
    made: WeakKeyDictionary[trimesh.Trimesh, T] = WeakKeyDictionary()

    @wraps(make)
    def kept(mesh: trimesh.Trimesh) -> T:
        if mesh not in made:
            made[mesh] = make(mesh)
        return made[mesh]

    return kept
