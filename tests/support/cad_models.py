"""Models of CAD files, each of which Open Cascade reads once for all tests of a process."""

from functools import cache
from pathlib import Path
from typing import Any

import trimesh

from fiveaxis.cam import Model, load_mesh, model_of


@cache
def mesh(path: Path, **options: Any) -> trimesh.Trimesh:
    """Read a file, closed or not, as a mesh that knows its exact surfaces."""
    return load_mesh(path, allow_open=True, **options)


def model(path: Path, **options: Any) -> Model:
    """Read a file's exact surfaces, closed or not."""
    found = model_of(mesh(path, **options))
    assert found is not None
    return found
