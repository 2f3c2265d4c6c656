from pathlib import Path

import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import MeshError
from fiveaxis.cam import load_mesh, read_solid, require_solid
from fiveaxis.cam.mesh.loading import check_mesh
from fiveaxis.cam.mesh.parsing import MOST_TRIANGLES


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
    with pytest.raises(
        MeshError, match=name.replace(".", r"\.") + ": (can't be read|has no triangles|its triangles name)"
    ):
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
    with pytest.raises(MeshError, match=f"not watertight: {opened.open_edges} of its edges"):
        load_mesh(path)
    assert opened.open_edges > 0


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


@pytest.fixture
def bodies() -> list[trimesh.Trimesh]:
    moves = (0.0, 0.0, 5.0), (20.0, 0.0, 5.0)
    return [trimesh.creation.box((10.0, 10.0, 10.0)).apply_translation(move) for move in moves]


def with_count(content: bytes, count: int) -> bytes:
    """State another number of triangles in the header of a binary STL."""
    return content[:80] + count.to_bytes(4, "little") + content[84:]


@pytest.mark.parametrize("count", [0, 12, 23])
@pytest.mark.parametrize("tail", [b"", b"ab"], ids=["alone", "with a tail"])
def test_a_binary_stl_with_more_triangles_than_its_header_states_is_refused(tmp_path, bodies, count, tail):
    content = with_count(trimesh.util.concatenate(bodies).export(file_type="stl"), count)
    with pytest.raises(MeshError, match=f"states {count} triangles, and {24 - count} more follow"):
        load_mesh(write(tmp_path, "half.stl", content + tail))


def test_two_binary_stl_in_one_file_are_refused(tmp_path, bodies):
    content = b"".join(body.export(file_type="stl") for body in bodies)
    with pytest.raises(MeshError, match="a second STL of 12 triangles follows its 12"):
        load_mesh(write(tmp_path, "two.stl", content))


@pytest.mark.parametrize(
    "tail",
    [b"\0", b"\0" * 428, b"exported by a program, in millimetres\n" * 5, b"\0\0\xff\xff" * 25],
    ids=["a byte", "padding", "text", "flags"],
)
def test_bytes_after_the_triangles_that_are_none_are_left_alone(tmp_path, bodies, tail):
    content = trimesh.util.concatenate(bodies).export(file_type="stl")
    assert load_mesh(write(tmp_path, "tail.stl", content + tail)).volume == pytest.approx(2000.0)


def test_a_text_stl_that_ends_in_its_second_solid_is_refused(tmp_path, bodies):
    one, two = (body.export(file_type="stl_ascii") for body in bodies)
    assert len(load_mesh(write(tmp_path, "two.stl", f"{one}\n{two}".encode())).faces) == 24
    with pytest.raises(MeshError, match="states 18 facets, and has 12"):
        load_mesh(write(tmp_path, "cut.stl", f"{one}\n{two[: len(two) // 2]}".encode()))


@pytest.mark.parametrize("count", [12, 23, 25])
def test_a_ply_or_off_whose_header_states_another_number_of_faces_is_refused(tmp_path, bodies, count):
    both = trimesh.util.concatenate(bodies)
    ply = both.export(file_type="ply", encoding="ascii").replace(
        b"element face 24", b"element face %d" % count
    )
    with pytest.raises(MeshError, match=f"states {16 + count} lines of vertices and faces, and has 40"):
        load_mesh(write(tmp_path, "part.ply", ply))
    off = both.export(file_type="off").replace("16 24 0", f"16 {count} 0")
    with pytest.raises(MeshError, match=f"states {16 + count} lines of vertices and faces, and has 40"):
        load_mesh(write(tmp_path, "part.off", off.encode()))


def obj_text(bodies: list[trimesh.Trimesh], corner: str, group: str, backwards: bool) -> str:
    """Write bodies one after the other, each with its vertices; a corner's other numbers are of one row."""
    lines = ["vt 0 0", "vn 0 0 1"]
    for k, body in enumerate(bodies):
        lines += [group.format(k), *(f"v {x} {y} {z}" for x, y, z in body.vertices.tolist())]
        first = -len(body.vertices) if backwards else 1 + k * len(body.vertices)
        lines += ["f " + " ".join(corner.format(first + i) for i in face) for face in body.faces.tolist()]
    return "\n".join(lines)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("group", ["o body{}", "g a{} b", "usemtl steel{}", "s {}"])
@pytest.mark.parametrize("corner", ["{}", "{}/-1", "{}//-1", "{}/1/1"])
def test_faces_of_an_obj_count_from_the_first_vertex_or_back_from_the_last_one(
    tmp_path, bodies, corner, group, backwards
):
    text = obj_text(bodies, corner, group, backwards)
    mesh = load_mesh(write(tmp_path, "two.obj", text.encode()))
    assert len(mesh.faces) == 24
    assert mesh.volume == pytest.approx(2000.0)
    assert mesh.bounds.tolist() == [[-5.0, -5.0, 0.0], [25.0, 5.0, 10.0]]


ANGLE_PIECE = "".join(
    f"v {x} {y} {z}\n" for z in (0, 5) for x, y in [(0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20)]
) + "".join(f"f {i + 1} {(i + 1) % 6 + 1} {(i + 1) % 6 + 7} {i + 7}\n" for i in range(6))


@pytest.mark.parametrize("turn", range(6))
def test_a_polygon_that_bends_inwards_is_divided_inside_it(tmp_path, turn):
    order = [(i + turn) % 6 for i in range(6)]
    faces = "f " + " ".join(str(i + 7) for i in order) + "\nf " + " ".join(str(i + 1) for i in order[::-1])
    mesh = load_mesh(write(tmp_path, "angle.obj", (ANGLE_PIECE + faces + " # bottom\n").encode()))
    assert mesh.volume == pytest.approx(1500.0)
    assert mesh.area == pytest.approx(2 * 300.0 + 80.0 * 5.0), "no triangle lies outside of its polygon"


@pytest.mark.parametrize("face", ["f 0 1 2", "f -13 1 2", "f 1 2"])
def test_a_face_of_an_obj_that_names_no_vertex_is_told_with_its_line(tmp_path, face):
    with pytest.raises(MeshError, match=f"line 19: a face needs three vertices.* {face}:"):
        load_mesh(write(tmp_path, "angle.obj", (ANGLE_PIECE + face).encode()))


def test_a_polygon_that_no_corner_sees_whole_is_refused(tmp_path):
    star = [
        (r * np.cos(a), r * np.sin(a)) for a, r in zip(np.arange(12) * np.pi / 6, [9, 1] * 6, strict=True)
    ]
    text = "".join(f"v {x} {y} 0\n" for x, y in star) + "f " + " ".join(map(str, range(1, 13)))
    with pytest.raises(MeshError, match="1 of its faces of 12 corners can't be divided"):
        load_mesh(write(tmp_path, "star.obj", text.encode()), allow_open=True)
