"""Passes of cutters that aren't balls: contacts, strips and ridges against closed forms and brute force."""

import numpy as np
import pytest
import trimesh
from support.leaned_paths import leaned

from fiveaxis.base import normalise
from fiveaxis.base.errors import SettingError, ToolError
from fiveaxis.cam import PlanOptions, path_quality, plan_contour, tree_of
from fiveaxis.model import Toolpath, parse_tool

CUTTERS = ["ball:6", "bull:10:2", "bull:10:0.5", "flat:10"]
BOUNDS = {"lead": (4.0, 6.0), "lean": (-0.5, 0.5)}


def width_of_outline(tool: str, lead: float, lean: float, height: float) -> float:
    """Width at a height of the cutter's outline seen along the feed, mm, from its support function."""
    zone = parse_tool(tool).zone
    axis = normalise(np.array([[np.tan(np.radians(lead)), np.tan(np.radians(lean)), 1.0]]))[0]
    angle = np.linspace(-1.4, 1.4, 400_001)
    along = np.sin(angle) * axis[1] - np.cos(angle) * axis[2]
    support = zone.radius + zone.offset * np.sqrt(1.0 - along**2)
    slope = np.gradient(support, angle)
    y = support * np.sin(angle) + slope * np.cos(angle)
    z = slope * np.sin(angle) - support * np.cos(angle)
    middle = len(z) // 2
    z, y = z - z[middle], y - y[middle]
    right, left = np.interp(height, z[middle:], y[middle:]), np.interp(height, z[middle::-1], -y[middle::-1])
    return float(right + left)


def on_wall(tool: str, distance: float) -> Toolpath:
    """Two straight passes at a distance, mm, on the wall x = 0."""
    y = np.arange(-100.0, 100.1, 0.5)
    rows = [np.c_[0.0 * y, y, np.full(len(y), z)] for z in (0.0, distance)]
    normal = np.tile([1.0, 0.0, 0.0], (2 * len(y), 1))
    path = Toolpath.from_contacts(np.vstack(rows), normal, parse_tool(tool))
    return path.with_links(np.arange(2 * len(y)) == len(y))


@pytest.mark.parametrize("tool", CUTTERS)
@pytest.mark.parametrize(("lead", "lean"), [(3.0, 0.0), (10.0, 0.0), (8.0, 4.0), (4.0, 8.0), (40.0, -20.0)])
@pytest.mark.parametrize("height", [0.002, 0.1])
def test_a_strip_has_the_radius_of_the_outline_seen_along_the_feed(tool, lead, lean, height):
    across, ahead = (np.tan(np.radians(angle)) ** 2 for angle in (lean, lead))
    angle = np.arctan(np.sqrt(across + ahead))
    found = parse_tool(tool).zone.strip_radius(angle, across / (across + ahead), 0.0, height)
    half = width_of_outline(tool, lead, lean, height) / 2.0
    assert found == pytest.approx((half**2 + height**2) / (2.0 * height), rel=0.002)


@pytest.mark.parametrize("tool", CUTTERS[1:])
@pytest.mark.parametrize(("lead", "lean"), [(5.0, 0.0), (8.0, 4.0)])
def test_ridges_of_leaned_cutters_are_those_of_their_outlines(tool, lead, lean):
    wall = trimesh.creation.box(extents=[10.0, 220.0, 40.0])
    wall.apply_translation([-5.0, 0.0, 0.0])
    height = 0.02
    path = on_wall(tool, width_of_outline(tool, lead, lean, height))
    found = path_quality(leaned(path, lead, lean), wall)
    # At its ends a pass leaves more: the cutter has not yet gone by there, or no longer.
    assert found.scallop_mean == pytest.approx(height, rel=0.03)


@pytest.mark.parametrize("tool", CUTTERS)
@pytest.mark.parametrize("shape", ["cylinder", pytest.param("sphere", marks=pytest.mark.slow)])
def test_planned_ridges_are_at_most_as_high_as_asked_and_nearly_so(shape, tool):
    if shape == "cylinder":
        part = trimesh.creation.cylinder(radius=20.0, height=60.0, sections=720)
    else:
        part = trimesh.creation.icosphere(subdivisions=6, radius=20.0)
    path = plan_contour(part, parse_tool(tool), scallop=0.02, spacing=2.0, **BOUNDS)
    found = path_quality(leaned(path, 6.0, 0.5), part)
    # The facets' chords lie below the surface.
    sag = 20.0 - np.linalg.norm(part.triangles_center, axis=1).min() if shape == "sphere" else 2e-4
    assert found.scallop_largest <= 0.02 + sag
    assert found.scallop_mean >= 0.7 * 0.02
    assert found.ridges > 500


@pytest.mark.parametrize("tool", CUTTERS)
def test_planned_ridges_on_a_floor_have_the_height_asked_for(tool):
    floor = trimesh.creation.box(extents=[200.0, 60.0, 20.0])
    path = plan_contour(floor, parse_tool(tool), strategy="raster", scallop=0.02, spacing=2.0, **BOUNDS)
    top = np.flatnonzero(path.cutting & (np.abs(path.contact[:, 2] - 10.0) < 1e-6))
    path = path.at(top).with_links(np.append(True, np.diff(top) != 1))
    found = path_quality(leaned(path, 6.0, 0.5), floor, PlanOptions(strategy="raster"))
    assert 0.9 * 0.02 <= found.scallop_mean <= 1.05 * 0.02


@pytest.mark.parametrize("tool", CUTTERS)
def test_contacts_lie_on_the_part_and_pivots_a_corner_radius_above(tool):
    part = trimesh.creation.cylinder(radius=20.0, height=30.0, sections=720)
    path = plan_contour(part, parse_tool(tool), stepdown=5.0, tilt=(10.0, 80.0))
    cuts, zone = path.cutting, parse_tool(tool).zone
    assert tree_of(part).distances(path.contact[cuts]).max() < 1e-3
    np.testing.assert_allclose(
        path.pivot[cuts], path.contact[cuts] + zone.radius * path.normal[cuts], atol=1e-9
    )
    np.testing.assert_allclose(path.normal[cuts][:, 2], 0.0, atol=1e-9)


def test_links_hold_the_whole_profile_off_the_part():
    part = trimesh.creation.box(extents=[20.0, 20.0, 30.0])
    path = plan_contour(part, parse_tool("bull:10:2"), stepdown=5.0)
    air = path.pivot[~path.cutting]
    assert len(air) > 3
    assert tree_of(part).distances(air).min() >= 5.0


def test_a_cutter_other_than_a_ball_stays_in_contact_about_an_edge():
    part = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    path = plan_contour(part, parse_tool("bull:10:2"), stepdown=5.0)
    runs = path.passes(np.flatnonzero(path.cutting))
    assert len(runs) == 4
    turned = np.linalg.norm(np.diff(path.normal[runs[0]], axis=0), axis=1)
    assert turned.max() < np.radians(10.0)


def test_ridges_of_a_cutter_that_may_lean_in_many_ways_are_not_known():
    part = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    path = plan_contour(part, parse_tool("flat:6"), stepdown=2.0)
    found = path_quality(path, part)
    assert np.isnan([found.scallop_largest, found.scallop_mean]).all()
    assert found.chord_largest < 0.02


@pytest.mark.parametrize(
    ("tool", "bounds", "message"),
    [
        ("flat:6", {}, r"flat:6 can cut a strip of radius 0 mm, .* bound lead and lean .* or give stepdown"),
        ("flat:6", {"tilt": (5.0, 60.0)}, "bound lead and lean"),
        ("bull:6:1", {"lead_in": 1.0}, "lead_in and lead_out are arcs of a ball's centre, and bull:6:1"),
    ],
)
def test_what_the_lean_leaves_open_is_asked_for(tool, bounds, message):
    part = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    with pytest.raises(SettingError, match=message):
        plan_contour(part, parse_tool(tool), scallop=0.01, **bounds)


def test_a_drill_and_bounds_across_two_parts_of_a_profile_are_refused():
    part = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    with pytest.raises(ToolError, match="tool drill:6:118: passes aren't planned for a point"):
        plan_contour(part, parse_tool("drill:6:118"))
    with pytest.raises(ToolError, match="isn't within one of these"):
        plan_contour(part, parse_tool("barrel:16:85:3"), tilt=(40.0, 85.0))


def test_barrels_and_tapers_are_planned_with_the_zone_that_the_bounds_name():
    part = trimesh.creation.box(extents=[60.0, 60.0, 60.0])
    nose = plan_contour(part, parse_tool("barrel:16:85:3"), stepdown=10.0, tilt=(10.0, 60.0))
    flank = plan_contour(part, parse_tool("barrel:16:85:3"), scallop=0.01, tilt=(75.0, 85.0))
    assert (nose.zone.name, flank.zone.name) == ("ball", "barrel")
    assert flank.pivot[flank.cutting][:, :2].max() > 100.0
