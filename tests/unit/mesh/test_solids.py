"""Meshes that can't tell inside from outside, or are too large, are refused."""

import pytest
import trimesh

from fiveaxis.errors import MeshError
from fiveaxis.mesh.solids import MOST_TRIANGLES, read_solid, require_solid


@pytest.fixture
def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(20.0, 30.0, 40.0))


def test_a_file_is_read_as_it_is_and_one_inside_out_is_refused(block, tmp_path):
    file = tmp_path / "block.stl"
    block.export(file)
    assert read_solid(file).volume == pytest.approx(24_000.0)
    block.invert()
    block.export(file)
    with pytest.raises(MeshError, match="normals point into the material"):
        read_solid(file)


def test_a_mesh_too_large_for_the_trees_is_refused_with_its_size(block):
    class Huge:
        faces = range(MOST_TRIANGLES + 1)
        vertices = block.vertices

    with pytest.raises(MeshError, match=r"big\.stl: has 5,000,001 triangles, more than 5,000,000"):
        require_solid(Huge(), "big.stl")
