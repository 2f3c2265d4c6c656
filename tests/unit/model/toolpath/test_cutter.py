"""Where a cutter touches, against brute force over its body."""

import numpy as np
import pytest
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.base import normalise
from fiveaxis.base.errors import ToolError, ToolpathError
from fiveaxis.model import MoveKind, Tool, Toolpath, parse_tool

SHAPES = ["ball:10", "flat:10", "bull:16:4", "lollipop:8:5", "taper:4:5:10", "barrel:16:85:3", "drill:8:118"]


def directions(tool, rng, n):
    """Tool axes and normals whose angle lies well inside one of the tool's zones."""
    axis = normalise(rng.normal(size=(n, 3)))
    side = normalise(np.cross(axis, rng.normal(size=(n, 3))))
    zones = [tool.cutter.zones[i] for i in rng.integers(len(tool.cutter.zones), size=n)]
    angle = np.array([rng.uniform(z.least + 0.01, z.high - 0.01) for z in zones])
    normal = np.cos(angle)[:, None] * axis + np.sin(angle)[:, None] * side
    return axis, normal


@pytest.mark.parametrize("text", SHAPES)
def test_the_contact_is_the_point_of_the_body_that_goes_deepest(text):
    tool, rng = parse_tool(text), np.random.default_rng(1)
    axis, normal = directions(tool, rng, 8)
    tip = rng.normal(size=(8, 3))
    found = tool.cutter.contacts(tip, normal, axis)
    turn = np.linspace(0.0, 2.0 * np.pi, 1440, endpoint=False)
    fine = np.vstack([zone_points(z) for z in tool.cutter.zones])
    for i in range(8):
        u = normalise(np.cross(axis[i], [0.3, -0.5, 0.8]))
        v = np.cross(axis[i], u)
        ring = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
        body = tip[i] + fine[:, None, 1:] * axis[i] + fine[:, None, :1] * ring
        depth = body @ normal[i]
        # Sampled every quarter degree, the body may miss its deepest point by r (1 − cos 1/8 deg).
        assert found[i] @ normal[i] == pytest.approx(depth.min(), abs=3e-4)
        nearest = np.linalg.norm(body - found[i], axis=-1).min()
        assert nearest < 0.2
        assert (depth >= found[i] @ normal[i] - 1e-9).all()


def zone_points(zone):
    angle = np.linspace(zone.low, zone.high, 721)
    radius, height = zone.offset + zone.radius * np.sin(angle), zone.height - zone.radius * np.cos(angle)
    return np.column_stack([radius, height])


@pytest.mark.parametrize("text", SHAPES)
def test_contact_to_tip_and_back_is_the_same_contact(text):
    tool, rng = parse_tool(text), np.random.default_rng(2)
    axis, normal = directions(tool, rng, 200)
    contact = rng.normal(size=(200, 3)) * 50.0
    tip = tool.cutter.tips(contact, normal, axis)
    np.testing.assert_allclose(tool.cutter.contacts(tip, normal, axis), contact, atol=1e-12)


@pytest.mark.parametrize("text", SHAPES)
def test_zones_follow_each_other_and_their_outline_rises(text):
    cutter = parse_tool(text).cutter
    for below, above in zip(cutter.zones, cutter.zones[1:], strict=False):
        assert above.low == below.high
    outline = cutter.outline()
    np.testing.assert_array_equal(outline[0], [0.0, 0.0])
    assert (np.diff(outline[:, 1]) >= -1e-12).all()
    assert outline[:, 0].max() == pytest.approx(cutter.diameter / 2.0)


def test_nose_and_barrel_are_tangent():
    nose, barrel = Tool.barrel(16, 85, 3).cutter.zones
    ends = []
    for zone, angle in ((nose, nose.high), (barrel, barrel.low)):
        ends.append([zone.offset + zone.radius * np.sin(angle), zone.height - zone.radius * np.cos(angle)])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)


@pytest.mark.parametrize(("text", "tilt"), [("bull:16:4", (20, 60)), ("barrel:16:85:3", (72, 88))])
def test_leaning_any_cutter_keeps_its_contact(text, tilt):
    tool, rng = parse_tool(text), np.random.default_rng(3)
    normal = normalise(rng.normal(size=(50, 3)))
    contact = rng.normal(size=(50, 3))
    path = for_tilt(Toolpath.from_contacts(contact, normal, tool), tilt)
    side = normalise(np.cross(normal, rng.normal(size=(50, 3))))
    for degrees in tilt:
        angle = np.radians(degrees)
        axis = np.cos(angle) * normal + np.sin(angle) * side
        touched = tool.cutter.contacts(path.tips(axis), normal, axis)
        np.testing.assert_allclose(touched, contact, atol=1e-12)


def test_the_zone_follows_from_the_tilt_range():
    tool = Tool.barrel(16, 85, 3)
    path = Toolpath.from_contacts([[0.0, 0, 0]], [[0.0, 0, 1]], tool)
    assert path.zone.name == "barrel"
    nose = for_tilt(path, (10, 60))
    assert nose.zone.name == "ball"
    np.testing.assert_allclose(nose.pivot, [[0.0, 0.0, 3.0]])
    with pytest.raises(ToolError, match=r"\(ball\), 69.89…90 deg \(barrel\); the tilt range 60…80"):
        for_tilt(path, (60, 80))


@pytest.mark.parametrize(
    ("text", "tilt"), [("flat:10", (0, 30)), ("ball:10", (30, 100)), ("bull:10:2", (0, 5))]
)
def test_a_tilt_at_which_no_single_part_touches_is_refused(text, tilt):
    path = Toolpath.from_contacts([[0.0, 0, 0]], [[0.0, 0, 1]], parse_tool(text))
    with pytest.raises(ToolError, match="touches with one part of its profile within"):
        for_tilt(path, tilt)


def test_a_tool_on_its_flat_bottom_has_no_single_contact():
    up = np.array([[0.0, 0.0, 1.0]])
    with pytest.raises(ToolError, match="no single contact at 0 deg"):
        Tool.flat(10).cutter.tips(np.zeros((1, 3)), up, up)


def test_a_cone_needs_the_surface_for_any_cutter_but_a_ball():
    tips, axes = [[0.0, 0, 0], [1.0, 0, 0]], [[0.0, 0, 1]] * 2
    for_tilt(Toolpath.from_tips(tips, axes, Tool.ball(10)), cone=20)
    with pytest.raises(ToolpathError, match="bull:10:2 has to be moved about its contact"):
        for_tilt(Toolpath.from_tips(tips, axes, Tool.bull(10, 2)), cone=20)


def test_a_cone_keeps_a_bull_nose_on_its_corner():
    tips, axis, normal = np.zeros((2, 3)), [[0.0, 0, 1]] * 2, np.array([[0.6, 0.0, 0.8]] * 2)
    path = Toolpath.from_tips(tips, axis, Tool.bull(10, 2)).touching_at(normal)
    bounds = tilt_bounds(for_tilt(path, cone=20), cone=20)
    assert [b.name for b in bounds.all] == ["programmed axis", "normal"]
    assert np.degrees([bounds.beside[0].low, bounds.beside[0].high]) == pytest.approx([1.0, 90.0])


def test_a_programmed_tip_is_kept_when_its_surface_becomes_known():
    axis = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    tip = np.array([[1.0, 2, 3], [4.0, 5, 6], [7.0, 8, 9]])
    kind = [MoveKind.CUT, MoveKind.CUT, MoveKind.LINK]
    normal = normalise(np.array([[0.5, 0.1, 0.8], [0.0, 0.7, 0.7], [np.nan, np.nan, np.nan]]))
    for tool in (Tool.ball(8), Tool.bull(8, 1), Tool.flat(8)):
        path = Toolpath.from_tips(tip, axis, tool, kind=kind)
        known = path.touching_at(normal)
        np.testing.assert_allclose(known.tips(axis), tip, atol=1e-12)
        np.testing.assert_allclose(
            known.contact[:2], tool.cutter.contacts(tip[:2], normal[:2], axis[:2]), atol=1e-12
        )
        assert np.isnan(known.contact[2]).all()
