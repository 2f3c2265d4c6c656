"""Bodies of the machine in the scene: poses, visibility and size."""

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import umsgpack

from fiveaxis.errors import MeshError
from fiveaxis.kinematics import link_poses, tool_poses
from fiveaxis.machine import Body, Box, Chain, Cylinder, Line, Machine, MeshShape, parse_code
from fiveaxis.viewer import build_scene, render_page
from fiveaxis.viewer.bodies import MOST_TRIANGLES, add_bodies
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.page import Recorder
from fiveaxis.viewer.scene import ASIDE, RIGHT, SHOWN_SIZE, STEP_BACK
from fiveaxis.viewer.tool_motion import choose_frames

NODE = "/meshcat/fiveaxis/machine"
DIRECTION = (0.6, 0.0, 0.8)
BODIES = (
    Body("C", Cylinder(80.0, 20.0, (0.0, 0.0, -60.0))),
    Body("A", Cylinder(25.0, 120.0, (0.0, 10.0, -90.0), DIRECTION)),
    Body("bed", Box((600.0, 500.0, 100.0), (0.0, 200.0, -400.0))),
    Body("Z", Box((60.0, 80.0, 200.0), (0.0, 0.0, 200.0))),
    Body("Z", Cylinder(20.0, 60.0, (0.0, 0.0, 70.0))),
)
# mm: single precision, as used by browsers, up to a metre away.
SINGLE = 1e-4
SETUP = ((10.0, -20.0, 30.0), (0.0, 0.0, 90.0))


def with_bodies(solution, *bodies: Body):
    return replace(solution, machine=replace(solution.machine, bodies=bodies))


@pytest.fixture(scope="module")
def furnished(solution):
    return with_bodies(solution, *BODIES)


def commands_of(solution, part=None) -> list[dict]:
    recorder = Recorder()
    build_scene(load_meshcat().Visualizer(window=recorder), solution, part)
    return [umsgpack.unpackb(c) for c in recorder.commands]


def objects_of(commands: list[dict]) -> dict[str, dict]:
    """What is under the machine's node, by path."""
    return {
        c["path"]: c["object"] for c in commands if c["type"] == "set_object" and c["path"].startswith(NODE)
    }


def transforms_of(commands: list[dict]) -> dict[str, np.ndarray]:
    chosen = [c for c in commands if c["type"] == "set_transform"]
    return {c["path"]: np.reshape(c["matrix"], (4, 4)).T for c in chosen}


def clips_of(commands: list[dict]) -> dict[str, dict[str, np.ndarray]]:
    """Values of every track, a row per key frame, by node and property."""
    animation = next(c for c in commands if c["type"] == "set_animation")
    return {a["path"]: {t["name"]: rows_of(t) for t in a["clip"]["tracks"]} for a in animation["animations"]}


def rows_of(track: dict) -> np.ndarray:
    times, values = (np.frombuffer(track[name].data, dtype=np.float32) for name in ("times", "values"))
    return values.reshape(len(times), -1).astype(float)


def pose_of(clip: dict[str, np.ndarray], key: int) -> np.ndarray:
    """Pose of an animated node at a key frame, from its position and quaternion."""
    x, y, z, w = clip[".quaternion"][key]
    pose = np.eye(4)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose[:3, :3] += 2.0 * w * cross + 2.0 * cross @ cross
    pose[:3, 3] = clip[".position"][key]
    return pose


def test_every_body_is_one_object_on_the_node_of_its_link(furnished):
    names = {f"{NODE}/{body.link}/{i}" for i, body in enumerate(BODIES)}
    assert set(objects_of(commands_of(furnished))) == names


def test_bodies_are_hidden_at_first_and_can_be_seen_through(furnished):
    commands = commands_of(furnished)
    hidden = {c["path"] for c in commands if c["type"] == "set_property" and c["value"] is False}
    assert NODE in hidden
    for shown in objects_of(commands).values():
        assert shown["materials"][0]["transparent"]
        assert shown["materials"][0]["opacity"] < 0.5


def test_shapes_have_their_sizes(furnished):
    shapes = {k.rpartition("/")[2]: v["geometries"][0] for k, v in objects_of(commands_of(furnished)).items()}
    assert [shapes["2"][side] for side in ("width", "height", "depth")] == [600.0, 500.0, 100.0]
    assert (shapes["0"]["radiusTop"], shapes["0"]["radiusBottom"], shapes["0"]["height"]) == (80, 80, 20)


def test_a_cylinder_lies_along_its_direction(furnished):
    frame = transforms_of(commands_of(furnished))[f"{NODE}/A/1"]
    # meshcat's cylinder lies along its own y.
    np.testing.assert_allclose(frame[:3, 1], DIRECTION, atol=1e-12)
    np.testing.assert_allclose(frame[:3, 3], [0.0, 10.0, -90.0], atol=1e-12)


def test_the_table_stands_still_and_the_others_move(furnished):
    moving = {name for name in clips_of(commands_of(furnished)) if "/machine/" in name}
    before = NODE.replace("machine", "before/machine")
    assert moving == {f"{node}/{link}" for node in (NODE, before) for link in ("A", "bed", "Z")}


@pytest.mark.parametrize("setup", [((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), SETUP])
def test_the_spindle_stays_on_the_tool_axis(solution, setup):
    machine = replace(solution.machine.with_setup(*setup), bodies=BODIES)
    commands = commands_of(replace(solution, machine=machine))
    clip, frame = clips_of(commands)[f"{NODE}/Z"], transforms_of(commands)[f"{NODE}/Z/4"]
    rows = choose_frames(solution.motion).rows
    tip, axis = tool_poses(machine, solution.motion.positions[rows])
    assert len(clip[".position"]) == len(rows)
    for key in (0, len(rows) // 3, len(rows) - 1):
        spindle = pose_of(clip, key) @ frame
        np.testing.assert_allclose(spindle[:3, 3], tip[key] + 70.0 * axis[key], atol=SINGLE)
        np.testing.assert_allclose(spindle[:3, 1], axis[key], atol=SINGLE / 100.0)


def test_before_the_show_starts_bodies_are_where_it_starts(furnished):
    recorder = Recorder()
    positions = np.array([[10.0, 20.0, 30.0, 0.4, -0.6], np.zeros(5)])
    moving = add_bodies(
        load_meshcat().Visualizer(window=recorder), "fiveaxis/machine", furnished.machine, positions
    )
    transforms = transforms_of([umsgpack.unpackb(c) for c in recorder.commands])
    for link in ("A", "bed", "Z"):
        position, quaternion = moving[f"fiveaxis/machine/{link}"]
        clip = {".position": position, ".quaternion": quaternion}
        np.testing.assert_allclose(transforms[f"{NODE}/{link}"], pose_of(clip, 0), atol=1e-9)


def test_on_a_machine_whose_table_stands_still_the_bed_does():
    machine = Machine.from_code("012364")
    pivoted = Chain.from_code(parse_code("012364"), {"A": Line((1, 0, 0), (0, 0, 150))})
    machine = replace(machine, chain=pivoted, bodies=(Body("bed", Box((9, 9, 9))), Body("A", Box((5, 5, 5)))))
    vis = load_meshcat().Visualizer(window=Recorder())
    moving = add_bodies(
        vis, "machine", machine, np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 3.0, 0.5, 0.0]])
    )
    assert list(moving) == ["machine/A"]
    position, quaternion = moving["machine/A"]
    turned = [0.0, 150.0 * np.sin(0.5), 150.0 - 150.0 * np.cos(0.5)]
    np.testing.assert_allclose(position[1], np.add([1.0, 2.0, 3.0], turned), atol=1e-9)
    np.testing.assert_allclose(quaternion[1], [np.sin(0.25), 0.0, 0.0, np.cos(0.25)], atol=1e-12)


def test_the_part_alone_governs_the_size_of_the_scene(solution, furnished, part):
    def stage(chosen) -> list[dict]:
        return [
            c for c in commands_of(chosen, part) if "machine" not in c["path"] and c["type"] != "set_object"
        ]

    bare, full = stage(solution), stage(furnished)
    assert [c for c in bare if c["type"] != "set_animation"] == [
        c for c in full if c["type"] != "set_animation"
    ]


def test_a_mesh_is_scaled_to_mm_and_stands_in_the_machine_frame(solution, tmp_path):
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "column.stl")
    machine = solution.machine.with_setup(*SETUP)
    machine = replace(machine, bodies=(Body("bed", MeshShape(tmp_path / "column.stl", 25.4)),))
    commands = commands_of(replace(solution, machine=machine))
    (shown,) = objects_of(commands).values()
    position = shown["geometries"][0]["data"]["attributes"]["position"]
    corners = np.frombuffer(position["array"].data, dtype=np.float32).reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [25.4, 50.8, 76.2], rtol=1e-6)
    np.testing.assert_allclose(transforms_of(commands)[f"{NODE}/bed/0"], machine.machine_frame, atol=1e-12)


def test_a_fine_mesh_is_thinned(solution, tmp_path):
    fine = trimesh.creation.icosphere(subdivisions=6)
    assert len(fine.faces) > MOST_TRIANGLES
    fine.export(tmp_path / "fine.stl")
    (shown,) = objects_of(
        commands_of(with_bodies(solution, Body("Z", MeshShape(tmp_path / "fine.stl"))))
    ).values()
    faces = shown["geometries"][0]["data"]["index"]["array"].data
    assert 1000 < len(faces) / 12 <= MOST_TRIANGLES


def test_a_mesh_that_is_missing_is_an_error(solution, tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        commands_of(with_bodies(solution, Body("bed", MeshShape(tmp_path / "absent.stl"))))


def boxes_of(page: str) -> dict[str, bool]:
    """Boxes of the legend: node -> whether it is ticked."""
    boxes = re.finditer(r'<input type="checkbox" value="([^"]*)"( checked)?', page)
    return {m[1]: bool(m[2]) for m in boxes}


def test_the_page_has_a_box_for_the_machine_if_it_has_bodies(solution, furnished):
    assert boxes_of(render_page(furnished))["machine"] is False
    assert "machine" not in boxes_of(render_page(solution))


def test_the_baselines_machine_is_a_copy_that_moves_on_its_own(furnished):
    recorder = Recorder()
    built = build_scene(load_meshcat().Visualizer(window=recorder), furnished)
    copies = {f"{link}/{i}" for i, link in enumerate(body.link for body in BODIES)}
    assert built.copies == {f"machine/{name}": f"before/machine/{name}" for name in copies}
    clips = clips_of([umsgpack.unpackb(c) for c in recorder.commands])
    baseline = furnished.compared["normal"].motion
    for motion, node in ((furnished.motion, NODE), (baseline, NODE.replace("machine", "before/machine"))):
        expected = link_poses(furnished.machine, motion.positions[-1:])["Z"][0]
        np.testing.assert_allclose(pose_of(clips[f"{node}/Z"], -1), expected, atol=SINGLE)


def test_with_the_machine_the_view_steps_back_and_the_sides_move_apart(furnished):
    built = build_scene(load_meshcat().Visualizer(window=Recorder()), furnished)
    near, far = built.layout, built.layout.with_machine()
    middle = np.append((near.low + near.high) / 2.0, 1.0)
    # Alone, the scene stands to the right of the view's middle, as the legend is on the left.
    aside = np.append(ASIDE * SHOWN_SIZE * RIGHT, 1.0)
    np.testing.assert_allclose(near.together() @ middle, aside, atol=1e-12)
    np.testing.assert_allclose(far.together() @ middle, aside, atol=1e-12)
    assert far.together()[0, 0] == pytest.approx(near.together()[0, 0] / STEP_BACK)
    np.testing.assert_allclose(far.shift()[:3, 3], STEP_BACK * near.shift()[:3, 3])
    # Side by side, both stand as far from the middle.
    for view in (near, far):
        result, baseline = view.apart() @ middle, view.apart() @ view.shift() @ middle
        np.testing.assert_allclose(result[:3], -baseline[:3], atol=1e-12)
