"""Bodies around the tool are validated before anything is checked against them."""

import numpy as np
import pytest
import trimesh

from fiveaxis.base import Workpiece
from fiveaxis.base.errors import InputError, JobError, MeshError, SettingError
from fiveaxis.base.settings import StrictModel, read_settings
from fiveaxis.check import Clearances, ClearanceTable, Fixture, FixtureTable, Surroundings
from fiveaxis.model import Box, Cylinder, MeshShape


class JobLike(StrictModel):
    fixture: tuple[FixtureTable, ...] = ()
    clearance: ClearanceTable = ClearanceTable()


def read(tmp_path, text: str) -> JobLike:
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    return read_settings(tmp_path / "job.toml", JobLike, JobError)


@pytest.fixture
def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(20.0, 30.0, 40.0))


def test_a_mesh_that_is_inside_out_is_refused_with_a_remedy(block):
    block.invert()
    with pytest.raises(MeshError, match=r"part: its normals point into the .*-24000 mm3.*fix_normals"):
        Surroundings(part=block)


def test_a_file_that_is_inside_out_is_refused_and_not_inverted_silently(block, tmp_path):
    block.invert()
    block.export(tmp_path / "part.stl")
    with pytest.raises(MeshError, match=r"part\.stl: its normals point into the material"):
        Surroundings.of(Workpiece(part=tmp_path / "part.stl"))


def test_one_inverted_triangle_is_found(block):
    faces = block.faces.copy()
    faces[0] = faces[0, ::-1]
    with pytest.raises(MeshError, match="stock: neighbouring triangles face opposite sides"):
        Surroundings(stock=trimesh.Trimesh(block.vertices, faces, process=False))


def test_an_open_mesh_is_accepted(block):
    block.update_faces(np.arange(len(block.faces)) != 0)
    assert Surroundings(part=block).meshes == {"part": block}


def test_two_fixtures_of_one_name_are_refused():
    clamp = Fixture("clamp", Box((1.0, 1.0, 1.0)))
    with pytest.raises(SettingError, match="two fixtures are called 'clamp'"):
        Surroundings(fixtures=(clamp, clamp))


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_a_clearance_that_cannot_be_is_refused(value):
    with pytest.raises(SettingError, match="clearance of the holder"):
        Clearances(holder=value)


def test_a_clearance_may_be_zero():
    assert Clearances(0.0, 0.0, 0.0, 0.0).by_kind == dict.fromkeys(
        ("shank", "holder", "cutter", "machine"), 0.0
    )


@pytest.mark.parametrize(
    "shape",
    [Box((1.0, 0.0, 1.0)), Cylinder(-1.0, 2.0), Cylinder(1.0, float("nan")), Box((1, 1, 1), (np.inf, 0, 0))],
)
def test_a_fixture_of_impossible_size_or_position_is_refused(shape):
    with pytest.raises(SettingError, match="fixture 'vice'"):
        Fixture("vice", shape)


def test_fixtures_are_read_from_a_file(tmp_path, block):
    block.export(tmp_path / "jaw.stl")
    job = read(
        tmp_path,
        """
[[fixture]]
name = "clamp"
box = {size = [10, 20, 30], center = [0, 0, 5]}
[[fixture]]
name = "bolt"
cylinder = {radius = 4, height = 20, direction = [0, 0, 2]}
[[fixture]]
name = "jaw"
mesh = "jaw.stl"
scale = 25.4
[clearance]
holder = 3
""",
    )
    built = [table.beside(tmp_path).build() for table in job.fixture]
    assert built == [
        Fixture("clamp", Box((10.0, 20.0, 30.0), (0.0, 0.0, 5.0))),
        Fixture("bolt", Cylinder(4.0, 20.0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
        Fixture("jaw", MeshShape(tmp_path / "jaw.stl", 25.4)),
    ]
    assert job.clearance.build() == Clearances(holder=3.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[fixture]]\nname = 'c'", "must have a box, a cylinder or a mesh; it has none of them"),
        (
            "[[fixture]]\nname = 'c'\nmesh = 'a.stl'\nbox = {size = [1, 1, 1]}",
            "a mesh; it has box and mesh",
        ),
        ("[[fixture]]\nname = 'c'\nscale = 2\nbox = {size = [1, 1, 1]}", "scale is for a mesh"),
        ("[[fixture]]\nname = 'c'\nbox = {size = [1, 1, -1]}", r"must be above 0"),
        ("[[fixture]]\nname = 'c'\nbox = {sise = [1, 1, 1]}", "unknown key.*sise.*size"),
        (
            "[[fixture]]\nname = 'c'\ncylinder = {radius = 1, height = 1, direction = [0, 0, 0]}",
            "direction has length 0",
        ),
        ("[clearance]\nshank = -1", "at least 0"),
    ],
)
def test_a_wrong_table_is_refused_with_its_file(tmp_path, text, message):
    with pytest.raises(InputError, match=rf"job\.toml.*{message}"):
        read(tmp_path, text)


def test_a_mesh_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(JobError, match=r"fixture 'jaw': .*jaw\.stl: no such file"):
        FixtureTable(name="jaw", mesh="jaw.stl").beside(tmp_path).build()
