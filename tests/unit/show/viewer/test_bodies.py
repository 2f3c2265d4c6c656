"""Bodies of the machine in the scene: places, sizes and a scheme where there are none."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import umsgpack

from fiveaxis.base.errors import MeshError
from fiveaxis.model import Body, Box, Cylinder, MeshShape
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.recorder import Recorder
from fiveaxis.show.viewer.scene import MOST_TRIANGLES, build_scene
from fiveaxis.show.viewer.shown import Beside, shown_of

NODE = "/meshcat/fiveaxis/stage/links"
DIRECTION = (0.6, 0.0, 0.8)
BODIES = (
    Body("C", Cylinder(80.0, 20.0, (0.0, 0.0, -60.0))),
    Body("A", Cylinder(25.0, 120.0, (0.0, 10.0, -90.0), DIRECTION)),
    Body("bed", Box((600.0, 500.0, 100.0), (0.0, 200.0, -400.0))),
    Body("Z", Box((60.0, 80.0, 200.0), (0.0, 0.0, 200.0))),
    Body("Z", Cylinder(20.0, 60.0, (0.0, 0.0, 70.0))),
)
SETUP = ((10.0, -20.0, 30.0), (0.0, 0.0, 90.0))


def with_bodies(solution, *bodies: Body):
    return replace(solution, machine=replace(solution.machine, bodies=bodies))


@pytest.fixture(scope="module")
def furnished(solution):
    return with_bodies(solution, *BODIES)


def commands_of(solution) -> list[dict]:
    recorder = Recorder()
    build_scene(recorder, shown_of(solution, Beside()))
    return [umsgpack.unpackb(c) for c in recorder.commands]


def objects_of(commands: list[dict]) -> dict[str, dict]:
    """What is under the machine's node, by path."""
    return {
        c["path"]: c["object"] for c in commands if c["type"] == "set_object" and c["path"].startswith(NODE)
    }


def transforms_of(commands: list[dict]) -> dict[str, np.ndarray]:
    chosen = [c for c in commands if c["type"] == "set_transform"]
    return {c["path"]: np.reshape(c["matrix"], (4, 4)).T for c in chosen}


def test_every_body_is_one_object_on_the_node_of_its_link(furnished):
    names = {f"{NODE}/{body.link}/{i}" for i, body in enumerate(BODIES)}
    assert set(objects_of(commands_of(furnished))) == names


def test_bodies_can_be_seen_through(furnished):
    for shown in objects_of(commands_of(furnished)).values():
        assert shown["materials"][0]["transparent"]
        assert shown["materials"][0]["opacity"] < 0.5


def corners_of(shown: dict) -> np.ndarray:
    position = shown["geometries"][0]["data"]["attributes"]["position"]
    return np.frombuffer(position["array"].data, dtype=np.float32).reshape(-1, 3)


def test_shapes_have_their_sizes(furnished):
    shapes = {k.rpartition("/")[2]: corners_of(v) for k, v in objects_of(commands_of(furnished)).items()}
    np.testing.assert_allclose(np.ptp(shapes["2"], axis=0), [600.0, 500.0, 100.0], rtol=1e-6)
    # A prism contains the cylinder.
    np.testing.assert_allclose(np.ptp(shapes["0"], axis=0), [160.0, 160.0, 20.0], rtol=1e-2)


def test_a_cylinder_lies_along_its_direction(furnished):
    shown = corners_of(objects_of(commands_of(furnished))[f"{NODE}/A/1"])
    along = (shown - [0.0, 10.0, -90.0]) @ DIRECTION
    np.testing.assert_allclose([along.min(), along.max()], [-60.0, 60.0], rtol=1e-6)
    aside = np.linalg.norm(shown - [0.0, 10.0, -90.0] - along[:, None] * DIRECTION, axis=1)
    assert aside.max() == pytest.approx(25.0, rel=1e-2)


def test_a_mesh_is_scaled_to_mm_and_stands_in_the_machine_frame(solution, tmp_path):
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "column.stl")
    machine = solution.machine.with_setup(*SETUP)
    machine = replace(machine, bodies=(Body("bed", MeshShape(tmp_path / "column.stl", 25.4)),))
    commands = commands_of(replace(solution, machine=machine))
    (shown,) = objects_of(commands).values()
    np.testing.assert_allclose(np.ptp(corners_of(shown), axis=0), [25.4, 50.8, 76.2], rtol=1e-6)
    np.testing.assert_allclose(transforms_of(commands)[f"{NODE}/bed/0"], machine.machine_frame, atol=1e-12)


def test_a_fine_mesh_is_thinned(solution, tmp_path):
    fine = trimesh.creation.icosphere(subdivisions=6)
    assert len(fine.faces) > MOST_TRIANGLES
    fine.export(tmp_path / "fine.stl")
    (shown,) = objects_of(
        commands_of(with_bodies(solution, Body("Z", MeshShape(tmp_path / "fine.stl"))))
    ).values()
    data = shown["geometries"][0]["data"]
    assert 1000 < len(data["index"]["array"].data) / 12 <= MOST_TRIANGLES
    corners = np.frombuffer(data["attributes"]["position"]["array"].data, dtype=np.float32).reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 1.0, atol=1e-6)


def test_a_mesh_that_is_missing_is_an_error(solution, tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        commands_of(with_bodies(solution, Body("bed", MeshShape(tmp_path / "absent.stl"))))


def test_a_machine_without_bodies_is_drawn_from_its_chain_and_the_page_says_so(solution, furnished):
    links = {name.split("/")[-2] for name in objects_of(commands_of(solution))}
    assert links == {"C", "A", "bed", "X", "Y", "Z"}
    assert "The machine is a scheme" in render_page(solution)
    assert "The machine is a scheme" not in render_page(furnished)
