from pathlib import Path

import numpy as np
import pytest
import trimesh

from fiveaxis.errors import MeshError
from fiveaxis.mesh import load_mesh, read_solid, require_solid
from fiveaxis.mesh.loading import MOST_TRIANGLES, check_mesh, count_open_edges


def write(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeshError, match=r"gone\.stl: no such file"):
        load_mesh(tmp_path / "gone.stl")


def test_a_folder_is_not_a_mesh(tmp_path):
    with pytest.raises(MeshError, match="is a folder"):
        load_mesh(tmp_path)


def test_an_unknown_suffix_lists_the_known_ones(tmp_path):
    with pytest.raises(MeshError, match=r"suffix '\.x_t'.*known: \.stl, \.ply, \.obj, \.off, \.step"):
        load_mesh(write(tmp_path, "part.x_t", b"ISO-10303-21;"))


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("empty.stl", b""),
        ("words.stl", b"this is not a mesh"),
        ("hollow.stl", b"solid x\nendsolid x\n"),
        ("cut.ply", b"ply\nxx"),
        ("noise.ply", b"\xff\xfe" * 50),
        ("noise.obj", b"\xff\xfe" * 50),
        ("words.obj", b"hello"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("short.off", b"OFF\n3 1"),
    ],
)
def test_a_broken_file_gives_one_clear_message(tmp_path, name, data):
    with pytest.raises(MeshError, match=name.replace(".", r"\.") + ": (can't be read|has no triangles)"):
        load_mesh(write(tmp_path, name, data))


def test_vertices_that_are_not_numbers_are_refused(tmp_path):
    facet = b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 nan 0\nvertex 0 1 0\nendloop\nendfacet\n"
    with pytest.raises(MeshError, match=r"1 vertices .* aren't finite"):
        load_mesh(write(tmp_path, "nan.stl", b"solid x\n" + facet + b"endsolid x\n"))


def test_an_open_mesh_is_refused_with_its_open_edges_counted():
    box = trimesh.creation.box()
    box.update_faces(np.arange(len(box.faces)) > 0)
    with pytest.raises(
        MeshError,
        match=r"not watertight: 3 of its edges .*; repair the mesh, or accept it as it is \(--allow-open\)",
    ):
        check_mesh(box, name="box")
    assert len(check_mesh(box, name="box", allow_open=True).faces) == 11


def test_normals_point_out_of_the_material_whatever_the_winding():
    sphere = trimesh.creation.icosphere(radius=5.0)
    sphere.invert()
    turned = check_mesh(sphere, name="sphere")
    assert turned.volume > 0.0
    assert sphere.volume < 0.0, "the caller's mesh must not change"


def test_mixed_winding_is_repaired():
    box = trimesh.creation.box()
    box.faces[3] = box.faces[3][::-1]
    assert check_mesh(box, name="box").volume == pytest.approx(1.0)


def test_the_bunny_is_refused_until_open_meshes_are_allowed(data):
    path = data / "meshes" / "bunny_not_watertight.ply"
    opened = load_mesh(path, allow_open=True)
    with pytest.raises(MeshError, match=f"not watertight: {count_open_edges(opened)} of its edges"):
        load_mesh(path)
    assert count_open_edges(opened) > 0


@pytest.fixture
def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(20.0, 30.0, 40.0))


def test_a_solid_inside_out_is_refused(block, tmp_path):
    file = tmp_path / "block.stl"
    block.export(file)
    assert read_solid(file).volume == pytest.approx(24_000.0)
    block.invert()
    block.export(file)
    with pytest.raises(MeshError, match="normals point into the material"):
        read_solid(file)


def test_a_mesh_too_large_is_refused_with_its_size_and_what_to_do(block):
    class Huge:
        faces = range(MOST_TRIANGLES + 1)
        vertices = block.vertices

    with pytest.raises(
        MeshError, match=r"big\.stl: has 4,000,001 triangles, more than 4,000,000; .*or simplify"
    ):
        require_solid(Huge(), "big.stl")


def test_a_binary_stl_too_large_is_refused_by_its_header(tmp_path):
    file = tmp_path / "big.stl"
    with file.open("wb") as stream:
        stream.write(b"\0" * 80 + (MOST_TRIANGLES + 1).to_bytes(4, "little"))
        stream.truncate(84 + 50 * (MOST_TRIANGLES + 1))  # a file of holes: nothing is written or read
    with pytest.raises(MeshError, match=r"4,000,001 triangles"):
        load_mesh(file)


def test_vertices_that_differ_by_the_sign_of_zero_or_by_rounding_are_merged(block):
    corners = block.triangles.reshape(-1, 3) - block.bounds[0]
    corners[::2] += 1e-13
    corners[corners == 0.0] = -0.0
    soup = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    assert len(check_mesh(soup, name="soup").vertices) == 8
