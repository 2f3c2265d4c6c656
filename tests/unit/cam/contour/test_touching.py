"""Normals of programmed paths from the part that they cut."""

import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between, normalise
from fiveaxis.base.errors import MeshError, SettingError, ToolpathError
from fiveaxis.cam import find_contacts, on_part
from fiveaxis.model import Tool, Toolpath, parse_tool

SPHERE = trimesh.creation.icosphere(subdivisions=5, radius=20.0)
BOX = trimesh.creation.box((40.0, 40.0, 20.0))


def on_sphere(tool, n=60, lean=0.6, seed=0):
    """Tips of a tool that touches a sphere of radius 20 at random points, tilted by an angle."""
    rng = np.random.default_rng(seed)
    normal = normalise(rng.normal(size=(n, 3)))
    side = normalise(np.cross(normal, rng.normal(size=(n, 3))))
    axis = np.cos(lean) * normal + np.sin(lean) * side
    tip = tool.cutter.tips(20.0 * normal, normal, axis)
    return Toolpath.from_tips(tip, axis, tool), normal


@pytest.mark.parametrize(
    ("text", "lean"),
    [("ball:6", 0.6), ("bull:6:1", 0.6), ("flat:6", 0.6), ("taper:4:5:10", 0.6), ("barrel:16:85:3", 1.4)],
)
def test_normals_of_a_sphere_point_from_its_centre(text, lean):
    path, normal = on_sphere(parse_tool(text), lean=lean)
    found = find_contacts(path, SPHERE, tolerance=0.02)
    assert not found.findings
    # An icosphere of 20 480 facets: their normals are up to 0.02 rad off, and a small ball's less.
    assert np.linalg.norm(found.normal - normal, axis=1).max() < 0.03
    assert np.abs(np.linalg.norm(found.contact, axis=1) - 20.0).max() < 0.02
    np.testing.assert_allclose(found.tips(found.axis), path.tips(path.axis), atol=1e-9)


def test_at_an_edge_the_normal_points_to_the_balls_centre():
    tool = Tool.ball(10)
    lean = normalise(np.array([[0.9, 0.0, 0.1], [0.1, 0.0, 0.9]]))
    centre = np.array([20.0, 0.0, 10.0]) + 5.0 * lean
    path = Toolpath.from_tips(centre - 5.0 * lean, lean, tool)
    np.testing.assert_allclose(find_contacts(path, BOX).normal, lean, atol=1e-12)


def test_a_thin_edge_is_seen_from_outside():
    wedge = trimesh.Trimesh(
        [[0, -1, -9], [0, 1, -9], [0, 0, 0], [9, -1, -9], [9, 1, -9], [9, 0, 0]],
        [[0, 2, 1], [3, 4, 5], [0, 3, 5], [0, 5, 2], [1, 2, 5], [1, 5, 4], [0, 1, 4], [0, 4, 3]],
    )
    assert wedge.is_watertight
    path = Toolpath.from_tips([[4.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], Tool.ball(4))
    np.testing.assert_allclose(find_contacts(path, wedge).normal, [[0.0, 0.0, 1.0]], atol=1e-12)


def test_moves_off_the_part_become_links_with_a_finding():
    path, _ = on_sphere(Tool.ball(6), n=10)
    lifted = Toolpath.from_tips(
        path.tips(path.axis) + np.where(np.arange(10)[:, None] == 3, 2.0 * path.axis, 0.0),
        path.axis,
        path.tool,
        source=100 + np.arange(10),
        name="p.ngc",
    )
    found = find_contacts(lifted, SPHERE)
    assert found.cutting.tolist() == [i != 3 for i in range(10)]
    (finding,) = found.findings
    assert finding.code == "off-surface"
    assert finding.place.line == 103
    assert str(finding).startswith("p.ngc:103, location 3: 1 feed moves end more than 0.05 mm off the part")


def test_cuts_deep_in_the_part_are_reported_with_their_depth():
    path, _ = on_sphere(Tool.ball(6), n=10)
    deeper = Toolpath.from_tips(0.98 * path.tips(path.axis), path.axis, path.tool)
    (finding,) = find_contacts(deeper, SPHERE).findings
    assert finding.code == "sunk"
    assert 0.3 < finding.value < 0.5
    # Also where the ball's centre is in the part, and the nearest surface on its other side.
    buried = Toolpath.from_tips([[0.0, 0.0, 5.0], [0.0, 0.0, 10.0]], [[0.0, 0.0, 1.0]] * 2, Tool.ball(2))
    (finding,) = find_contacts(buried, BOX).findings
    assert finding.value == pytest.approx(5.0)


def test_a_tool_on_its_flat_bottom_is_reported_and_gets_no_normal():
    tips, axes = [[0.0, 0.0, 10.0], [25.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]] * 2
    found = find_contacts(Toolpath.from_tips(tips, axes, Tool.flat(10)), BOX)
    assert [f.code for f in found.findings] == ["no-single-contact"]
    assert found.cutting.tolist() == [False, True]
    np.testing.assert_allclose(found.normal[1], [1.0, 0.0, 0.0], atol=1e-9)


def test_a_path_of_another_part_is_refused():
    path, _ = on_sphere(Tool.ball(6))
    far = Toolpath.from_tips(path.tips(path.axis) + 100.0, path.axis, path.tool)
    with pytest.raises(ToolpathError, match=r"no cut touches the part within 0\.05 mm"):
        find_contacts(far, SPHERE)


def test_a_tolerance_that_isnt_positive_and_a_missing_part_are_refused():
    path, _ = on_sphere(Tool.ball(6))
    with pytest.raises(SettingError, match="surface tolerance is 0 mm"):
        find_contacts(path, SPHERE, tolerance=0.0)
    with pytest.raises(MeshError, match="no such file"):
        find_contacts(path, "missing.stl")
    blind = Toolpath.from_contacts([[0.0, 0, 0]], [[0.0, 0, 1]], Tool.ball(6))
    with pytest.raises(ToolpathError, match="no tool axes"):
        find_contacts(blind, SPHERE)


@pytest.mark.parametrize("gap", [0.0, 0.0005, 0.01])
def test_a_cutters_edge_on_an_edge_of_the_part_is_reported_or_right(gap):
    tool, rng, n = Tool.flat(6), np.random.default_rng(4), 60
    # The edge x = 20, z = 10 of the box runs along y; the normal at right angles to it and to the rim.
    turn = rng.uniform(0.15, 1.4, n)
    normal = np.column_stack([np.sin(turn), np.zeros(n), np.cos(turn)])
    side = normalise(np.cross(normal, rng.normal(size=(n, 3))))
    lean = rng.uniform(0.1, 1.4, n)[:, None]
    axis = np.cos(lean) * normal + np.sin(lean) * side
    contact = np.column_stack([np.full(n, 20.0), rng.uniform(-10, 10, n), np.full(n, 10.0)]) + gap * normal
    path = Toolpath.from_tips(tool.cutter.tips(contact, normal, axis), axis, tool)
    found = find_contacts(path, BOX)
    kept = found.cutting
    assert np.linalg.norm(found.contact[kept] - contact[kept], axis=1).max() < 0.15
    wrong = kept.sum() < n
    assert wrong == ("no-single-contact" in {f.code for f in found.findings})


def test_a_path_on_the_flat_bottom_only_is_refused():
    flat = Toolpath.from_tips([[0.0, 0.0, 10.0], [3.0, 0.0, 10.0]], [[0.0, 0.0, 1.0]] * 2, Tool.flat(6))
    with pytest.raises(ToolpathError, match="2 cuts touch the part, none with one point of flat:6"):
        find_contacts(flat, BOX)


@pytest.mark.parametrize("tool", [Tool.ball(6), Tool.bull(12, 3)])
def test_normals_found_on_a_coarse_cylinder_are_the_cylinders_own(tool):
    # Facets of 10 degrees, up to 5 degrees off; rows on their edges and within them.
    mesh = trimesh.creation.cylinder(radius=20.0, height=40.0, sections=36)
    turn = np.radians(np.linspace(0.0, 37.0, 75))
    true = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    axis = normalise(true + np.array([0.0, 0.0, 1.0]))
    path = Toolpath.from_tips(tool.cutter.tips(20.0 * true, true, axis), axis, tool)
    found = find_contacts(path, mesh, tolerance=0.2)
    ball = tool.cutter.is_ball
    off = np.degrees(angle_between(found.normal, true))
    assert off.max() < (1.0 if ball else 4.5)
    facets = find_contacts(path, mesh, tolerance=0.2, crease=5.0)
    assert off.mean() < (0.25 if ball else 0.9) * np.degrees(angle_between(facets.normal, true)).mean()
    assert found.normals_from == "of the mesh, smoothed across facets that meet at less than 30 deg"
    np.testing.assert_allclose(found.tips(axis), path.tips(axis), atol=1e-9)


def test_a_ball_that_rolls_about_a_sharp_edge_keeps_the_direction_to_its_centre():
    turn = np.radians(np.linspace(5.0, 85.0, 9))
    true = np.column_stack([np.sin(turn), 0.0 * turn, np.cos(turn)])
    centre = np.column_stack([np.full(9, 20.0), np.linspace(-5.0, 5.0, 9), np.full(9, 10.0)]) + 3.0 * true
    path = Toolpath.from_tips(centre - [0.0, 0.0, 3.0], np.tile([0.0, 0.0, 1.0], (9, 1)), Tool.ball(6))
    np.testing.assert_allclose(find_contacts(path, BOX).normal, true, atol=1e-9)


def around(radius: float, side: float) -> Toolpath:
    """Locations at the edges of a prism of 60 facets, outside it (side 1) or on the wall of its bore (−1)."""
    angle = np.radians(6.0) * np.arange(20)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(20)])
    return Toolpath.from_contacts(radius * out, side * out, Tool.ball(8))


def test_the_facets_of_a_part_have_the_last_word_where_a_curve_would_cut_into_them():
    ring = trimesh.creation.annulus(20.0, 30.0, 40.0, sections=60)
    bore, outside = around(20.0, -1.0), around(30.0, 1.0)
    assert bore.curved[1:].all()
    assert not on_part(bore, ring).curved.any()
    assert on_part(outside, ring) is outside
    assert on_part(bore, None) is bore
    # A finer mesh of the same bore agrees with the curve.
    assert on_part(bore, trimesh.creation.annulus(20.0, 30.0, 40.0, sections=240)).curved[1:].all()
