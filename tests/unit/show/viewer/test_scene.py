"""What the scene holds: checked on the commands that a browser gets."""

from dataclasses import replace

import numpy as np
import pytest
import umsgpack

from fiveaxis.base.errors import MeshError
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.cam import Mesh
from fiveaxis.check import Fixture, Surroundings
from fiveaxis.model import Box, Cylinder, MoveKind, Tool, parse_tool, tool_poses
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.show.viewer.moves import LIFT, shown_points
from fiveaxis.show.viewer.recorder import Recorder
from fiveaxis.show.viewer.scene import (
    FIXTURE_COLOUR,
    PART_COLOUR,
    STOCK_COLOUR,
    build_scene,
    scatter_marks,
    tool_outlines,
)
from fiveaxis.show.viewer.shown import Beside, shown_of

# mm: single precision, as used by browsers, up to a metre away.
SINGLE = 1e-4
ROOT = "/meshcat/fiveaxis/stage/"


def scene(solution, part=None) -> tuple[dict[str, dict], list[dict]]:
    """Objects by path, and all commands."""
    recorder = Recorder()
    build_scene(recorder, shown_of(solution, Beside(part=part)))
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    return {c["path"]: c["object"] for c in commands if c["type"] == "set_object"}, commands


def floats(attribute: dict) -> np.ndarray:
    return np.frombuffer(attribute["array"].data, dtype=np.float32).reshape(-1, attribute["itemSize"])


def test_the_scene_has_part_tool_and_machine_on_one_stage(solution, part):
    objects, _ = scene(solution, part)
    names = {name.removeprefix(ROOT) for name in objects}
    assert {name for name in names if not name.startswith("links/")} == {
        "workpiece/zero",
        "workpiece/part",
        "tool/cutter",
        "tool/shank",
    }


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


def test_the_part_may_be_a_file_and_a_missing_one_is_an_error(solution, part, tmp_path):
    part.export(tmp_path / "part.stl")
    assert f"{ROOT}workpiece/part" in scene(solution, tmp_path / "part.stl")[0]
    with pytest.raises(MeshError, match="no such file"):
        scene(solution, tmp_path / "absent.stl")


def test_a_turned_outline_is_a_closed_body_of_its_volume():
    outline = parse_tool("bull:16:4").cutter.outline()
    body = Mesh.revolved(np.vstack([outline, [[8.0, 30.0]]]), 360)
    assert body.is_watertight
    assert body.is_winding_consistent
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
    build_scene(recorder, shown_of(solution, Beside(findings=[*findings, *lost])))
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    marks = {c["path"]: c["object"] for c in commands if "/marks/" in c["path"]}
    assert set(marks) == {f"{ROOT}workpiece/marks/{name}" for name in locations}
    for name, rows in locations.items():
        shown = marks[f"{ROOT}workpiece/marks/{name}"]
        assert shown["materials"][0]["depthTest"] is False
        corners = floats(shown["geometries"][0]["data"]["attributes"]["position"]).reshape(-1, 6, 3)
        expected = shown_points(solution.toolpath)[sorted(set(rows))]
        np.testing.assert_allclose(corners.mean(axis=1), expected, atol=SINGLE)


def test_a_mark_is_a_closed_body():
    vertices, faces = scatter_marks(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), 2.0)
    body = Mesh(vertices, faces)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume == pytest.approx(2.0 * 4.0 / 3.0 * 2.0**3)


def test_part_stock_and_fixtures_have_their_colours_and_poses(solution, part):
    post = Cylinder(5.0, 40.0, (0.0, 60.0, -10.0), (1.0, 0.0, 0.0))
    around = Surroundings(
        part=part,
        stock=part,
        fixtures=(Fixture("a/b", Box((1.0, 2.0, 3.0), (60.0, 0, 0))), Fixture("post", post)),
    )
    recorder = Recorder()
    build_scene(recorder, shown_of(solution, Beside(surroundings=around)))
    commands = [umsgpack.unpackb(c) for c in recorder.commands]
    root = f"{ROOT}workpiece/"
    objects = {c["path"]: c["object"] for c in commands if c["type"] == "set_object"}
    colours = {"part": PART_COLOUR, "stock": STOCK_COLOUR}
    colours |= {"fixtures/0": FIXTURE_COLOUR, "fixtures/1": FIXTURE_COLOUR}
    assert {name: objects[root + name]["materials"][0]["color"] for name in colours} == colours
    shown = (objects[f"{root}fixtures/{number}"]["geometries"][0]["data"] for number in range(2))
    corners = [floats(data["attributes"]["position"]) for data in shown]
    ends = [np.stack([each.min(axis=0), each.max(axis=0)]) for each in corners]
    np.testing.assert_allclose(ends[0], [[59.5, -1.0, -1.5], [60.5, 1.0, 1.5]])
    # The post lies along X.
    np.testing.assert_allclose(ends[1][:, 0], [-20.0, 20.0], atol=SINGLE)
    np.testing.assert_allclose(np.ptp(ends[1], axis=0)[1:], 10.0, rtol=1e-2)


def test_the_first_view_holds_fixtures_and_the_whole_tool(solution, part):
    post = Cylinder(5.0, 40.0, (0.0, 90.0, -10.0), (1.0, 0.0, 0.0))
    long = replace(solution, toolpath=replace(solution.toolpath, tool=Tool.ball(10, holder=HOLDER)))
    around = Surroundings(fixtures=(Fixture("post", post),))
    recorder = Recorder()
    extents = build_scene(recorder, shown_of(long, Beside(part=part, surroundings=around))).extents
    box = extents["part"]
    assert box.high[1] >= 95.0
    assert box.low[2] <= -15.0
    tip, axis = tool_poses(solution.machine, solution.motion.positions[:1])
    top = (tip + 90.0 * axis)[0]
    assert (box.low <= top + 1e-9).all()
    assert (box.high >= top - 1e-9).all()
    assert extents["work"].size <= extents["machine"].size


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


def test_a_shank_reaches_to_the_spindle_where_the_tools_length_is_known():
    shown = tool_outlines(parse_tool("ball:10"), 150.0)
    np.testing.assert_allclose(shown["shank"][-1], [5.0, 150.0])
