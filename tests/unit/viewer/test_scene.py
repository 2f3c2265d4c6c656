"""What the scene holds: checked on the commands that a browser gets."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import umsgpack

from fiveaxis.collision import Fixture, Surroundings
from fiveaxis.errors import MeshError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Box, Cylinder
from fiveaxis.toolpath import MoveKind, Tool, parse_tool
from fiveaxis.toolpath.tool import Holder, Section
from fiveaxis.viewer import build_scene
from fiveaxis.viewer.bodies import FIXTURE_COLOUR, PART_COLOUR, STOCK_COLOUR, tool_outlines
from fiveaxis.viewer.library import load_meshcat
from fiveaxis.viewer.lines import LIFT, shown_points
from fiveaxis.viewer.page import Recorder
from fiveaxis.viewer.solids import revolve, scatter_marks

# mm: single precision, as used by browsers, up to a metre away.
SINGLE = 1e-4


def scene(solution, part=None) -> tuple[dict[str, dict], list[dict]]:
    """Objects by path, and all commands."""
    recorder = Recorder()
    build_scene(load_meshcat().Visualizer(window=recorder), solution, part)
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    return {c["path"]: c["object"] for c in commands if c["type"] == "set_object"}, commands


def floats(attribute: dict) -> np.ndarray:
    return np.frombuffer(attribute["array"].data, dtype=np.float32).reshape(-1, attribute["itemSize"])


def test_the_scene_has_part_paths_and_tools_and_few_objects(solution, part):
    objects, _ = scene(solution, part)
    root = "/meshcat/fiveaxis/"
    names = {"zero", "part"} | {
        f"{m}/{x}" for m in ("after", "before") for x in ("path", "tool/cutter", "tool/shank")
    }
    assert set(objects) == {root + name for name in names}


def test_the_whole_path_is_one_object_with_a_colour_per_move(solution):
    objects, _ = scene(solution)
    lines = objects["/meshcat/fiveaxis/after/path"]
    assert lines["object"]["type"] == "LineSegments"
    attributes = lines["geometries"][0]["data"]["attributes"]
    points = floats(attributes["position"])
    colours = np.frombuffer(attributes["color"]["array"].data, dtype=np.uint8).reshape(-1, 3)
    assert attributes["color"]["normalized"] is True
    moves = len(solution.toolpath) - 1
    assert points.shape == colours.shape == (2 * moves, 3)
    np.testing.assert_array_equal(colours[0::2], colours[1::2])
    np.testing.assert_array_equal(points[1:-1:2], points[2::2])


def test_contacts_are_drawn_a_little_above_the_surface(solution):
    path = solution.toolpath
    gap = np.linalg.norm(shown_points(path) - path.contact, axis=1)
    np.testing.assert_allclose(gap, LIFT * path.tool.radius)


def test_ball_centres_are_drawn_where_contacts_are_unknown(solution):
    unknown = replace(solution.toolpath, contact=np.full_like(solution.toolpath.contact, np.nan))
    np.testing.assert_array_equal(shown_points(unknown), unknown.pivot)


def test_a_link_without_contact_does_not_hide_the_others(solution):
    path = solution.toolpath
    contact = np.where((path.kind == MoveKind.LINK)[:, None], np.nan, path.contact)
    shown = shown_points(replace(path, contact=contact))
    assert np.isfinite(shown).all()
    np.testing.assert_allclose(shown[0], path.contact[0] + LIFT * path.tool.radius * path.normal[0])


def test_the_tool_stands_where_the_motion_puts_it(solution):
    _, commands = scene(solution)
    animation = next(c for c in commands if c["type"] == "set_animation")
    clips = {a["path"]: {t["name"]: t for t in a["clip"]["tracks"]} for a in animation["animations"]}
    tracks = clips["/meshcat/fiveaxis/after/tool"]
    times, positions = (singles(tracks[".position"][name]) for name in ("times", "values"))
    quaternions = singles(tracks[".quaternion"]["values"])
    tip, axis = tool_poses(solution.machine, solution.motion.positions)
    for key, row in ((0, 0), (-1, len(tip) - 1)):
        np.testing.assert_allclose(positions.reshape(-1, 3)[key], tip[row], atol=SINGLE)
        np.testing.assert_allclose(axis_of(quaternions.reshape(-1, 4)[key]), axis[row], atol=SINGLE / 100.0)
    assert times[0] == 0.0


def test_the_show_of_both_postures_ends_at_one_time_and_the_quicker_waits(solution):
    baseline = solution.compared["normal"]
    slow = replace(baseline, motion=replace(baseline.motion, time=1.5 * baseline.motion.time))
    _, commands = scene(replace(solution, compared={"normal": slow}))
    animation = next(c for c in commands if c["type"] == "set_animation")
    clips = {a["path"]: a["clip"]["tracks"][0] for a in animation["animations"]}
    quick, slow_track = (clips[f"/meshcat/fiveaxis/{side}/tool"] for side in ("after", "before"))
    times, positions = singles(quick["times"]), singles(quick["values"]).reshape(-1, 3)
    assert times[-1] == singles(slow_track["times"])[-1] == np.float32(slow.motion.time.sum())
    assert times[-2] == np.float32(solution.motion.time.sum())
    np.testing.assert_array_equal(positions[-2], positions[-1])


def test_a_baseline_with_locations_of_its_own_is_drawn_along_those(solution):
    rows = np.concatenate([[0, 1], np.arange(len(solution.toolpath))])
    baseline, path = solution.compared["normal"], solution.toolpath
    fields = {name: getattr(baseline.motion, name)[rows] for name in ("positions", "feed", "time", "kind")}
    motion = replace(baseline.motion, source=baseline.motion.source[rows], **fields)
    longer = replace(baseline, motion=motion, toolpath=path.at(rows))
    objects, _ = scene(replace(solution, compared={"normal": longer}))
    drawn = [
        floats(objects[f"/meshcat/fiveaxis/{side}/path"]["geometries"][0]["data"]["attributes"]["position"])
        for side in ("after", "before")
    ]
    assert [len(points) for points in drawn] == [2 * (len(path) - 1), 2 * (len(path) + 1)]


def singles(packed) -> np.ndarray:
    return np.frombuffer(packed.data, dtype=np.float32)


def axis_of(quaternion: list[float]) -> list[float]:
    x, y, z, w = quaternion
    return [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)]


def test_the_baseline_is_there_but_hidden(solution):
    _, commands = scene(solution)
    hidden = {c["path"] for c in commands if c["type"] == "set_property" and c["value"] is False}
    assert "/meshcat/fiveaxis/before" in hidden
    assert "/meshcat/fiveaxis/after" not in hidden


def test_without_a_baseline_only_the_result_is_shown(solution):
    objects, _ = scene(replace(solution, compared={}))
    assert not any("before" in name for name in objects)


def test_the_part_may_be_a_file_and_a_missing_one_is_an_error(solution, part, tmp_path):
    part.export(tmp_path / "part.stl")
    assert "/meshcat/fiveaxis/part" in scene(solution, tmp_path / "part.stl")[0]
    with pytest.raises(MeshError, match="no such file"):
        scene(solution, tmp_path / "absent.stl")


def test_a_turned_outline_is_a_closed_body_of_its_volume():
    outline = parse_tool("bull:16:4").outline()
    vertices, faces = revolve(np.vstack([outline, [[8.0, 30.0]]]), sectors=360)
    body = trimesh.Trimesh(vertices, faces)
    body.update_faces(body.nondegenerate_faces())  # at the axis a ring is one point
    assert body.is_volume
    disc, corner = np.pi * 64.0 * 26.0, np.pi * 16.0 * 4.0
    ring = 2.0 * np.pi * (np.pi * 16.0 / 4.0) * (4.0 + 4.0 * 4.0 / (3.0 * np.pi))
    assert body.volume == pytest.approx(disc + corner + ring, rel=2e-3)


def test_marks_are_one_object_per_severity_at_the_findings_locations(solution):
    locations = {"error": [5, 9, 5], "warning": [200]}
    findings = [
        Finding(Severity(severity), "code", "said", Place(row))
        for severity, rows in locations.items()
        for row in rows
    ]
    lost = [Finding(Severity.NOTE, "code", "said", Place(row)) for row in (None, -1, 10_000)]
    recorder = Recorder()
    build_scene(load_meshcat().Visualizer(window=recorder), solution, findings=[*findings, *lost])
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    marks = {c["path"]: c["object"] for c in commands if "/marks/" in c["path"]}
    assert set(marks) == {f"/meshcat/fiveaxis/after/marks/{name}" for name in locations}
    for name, rows in locations.items():
        shown = marks[f"/meshcat/fiveaxis/after/marks/{name}"]
        assert shown["materials"][0]["depthTest"] is False
        corners = floats(shown["geometries"][0]["data"]["attributes"]["position"]).reshape(-1, 6, 3)
        expected = shown_points(solution.toolpath)[sorted(set(rows))]
        np.testing.assert_allclose(corners.mean(axis=1), expected, atol=SINGLE)


def test_a_mark_is_a_closed_body():
    vertices, faces = scatter_marks(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), 2.0)
    body = trimesh.Trimesh(vertices, faces)
    assert body.is_volume
    assert body.volume == pytest.approx(2.0 * 4.0 / 3.0 * 2.0**3)


def test_part_stock_and_fixtures_have_their_colours_poses_and_visibility(solution, part):
    post = Cylinder(5.0, 40.0, (0.0, 60.0, -10.0), (1.0, 0.0, 0.0))
    around = Surroundings(
        part=part,
        stock=part,
        fixtures=(Fixture("a/b", Box((1.0, 2.0, 3.0), (60.0, 0, 0))), Fixture("post", post)),
    )
    recorder = Recorder()
    built = build_scene(load_meshcat().Visualizer(window=recorder), solution, surroundings=around)
    assert built.fixtures == ("a/b", "post")
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    root = "/meshcat/fiveaxis/"
    objects = {c["path"]: c["object"] for c in commands if c["type"] == "set_object"}
    colours = {"part": PART_COLOUR, "stock": STOCK_COLOUR}
    colours |= {"fixtures/0": FIXTURE_COLOUR, "fixtures/1": FIXTURE_COLOUR}
    assert {name: objects[root + name]["materials"][0]["color"] for name in colours} == colours
    placed = {c["path"]: np.reshape(c["matrix"], (4, 4)).T for c in commands if c["type"] == "set_transform"}
    np.testing.assert_allclose(placed[root + "fixtures/0"][:3, 3], [60.0, 0.0, 0.0])
    np.testing.assert_allclose(placed[root + "fixtures/1"][:3, 1], [1.0, 0.0, 0.0], atol=1e-12)
    hidden = {c["path"] for c in commands if c["type"] == "set_property" and c["value"] is False}
    assert root + "stock" in hidden
    assert root + "part" not in hidden
    assert set(built.copies) == {"part", "stock", "fixtures/0", "fixtures/1"}


def test_the_first_view_holds_fixtures_and_the_whole_tool(solution, part):
    post = Cylinder(5.0, 40.0, (0.0, 90.0, -10.0), (1.0, 0.0, 0.0))
    long = replace(solution, toolpath=replace(solution.toolpath, tool=Tool.ball(10, holder=HOLDER)))
    vis = load_meshcat().Visualizer(window=Recorder())
    layout = build_scene(vis, long, part, surroundings=Surroundings(fixtures=(Fixture("post", post),))).layout
    assert layout.high[1] >= 95.0
    assert layout.low[2] <= -15.0
    tip, axis = tool_poses(solution.machine, solution.motion.positions[:1])
    top = (tip + 90.0 * axis)[0]
    assert (layout.low <= top + 1e-9).all()
    assert (layout.high >= top - 1e-9).all()


HOLDER = Holder(60.0, (Section(10.0, 30.0, 40.0), Section(20.0, 50.0)))


@pytest.mark.parametrize("tool", ["ball:10", "bull:16:4", "flat:12", "lollipop:12:6"])
def test_the_tool_that_is_seen_is_the_one_that_collides(tool):
    held = replace(parse_tool(tool), holder=HOLDER, shank_diameter=6.0)
    shown = tool_outlines(held)
    assert list(shown) == ["cutter", "shank", "holder"]
    for part in held.parts():
        np.testing.assert_array_equal(shown[part.name][1:], part.outline)
        np.testing.assert_array_equal(shown[part.name][0], [0.0, part.outline[0, 1]])


@pytest.mark.parametrize(("thick", "radius"), [(None, 5.0), (6.0, 3.0)])
def test_without_a_holder_a_shank_is_drawn_all_the_same(thick, radius):
    shown = tool_outlines(replace(parse_tool("ball:10"), shank_diameter=thick))
    assert list(shown) == ["cutter", "shank"]
    np.testing.assert_allclose(shown["shank"], [[0.0, 5.0], [radius, 5.0], [radius, 45.0]])
