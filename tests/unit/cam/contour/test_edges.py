"""Normals at edges: a sharp one keeps the normals of both its walls, a rounded one turns smoothly."""

import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between, normalise
from fiveaxis.cam import facet_normals, plan_contour, tree_of
from fiveaxis.cam.contour.contacts import LEAN_DEPTH
from fiveaxis.model import Tool, Toolpath


def prism(outline: np.ndarray, height: float = 12.0) -> trimesh.Trimesh:
    """An outline, (n, 2) mm, anticlockwise and star-shaped about the origin, as a prism about z = 0."""
    n = len(outline)
    k, after = np.arange(n), (np.arange(n) + 1) % n
    low, high = np.c_[outline, np.full(n, -height / 2)], np.c_[outline, np.full(n, height / 2)]
    faces = [np.c_[k, after, after + n], np.c_[k, after + n, k + n]]
    faces += [np.c_[after, k, np.full(n, 2 * n)], np.c_[k + n, after + n, np.full(n, 2 * n + 1)]]
    ends = [[0.0, 0.0, -height / 2], [0.0, 0.0, height / 2]]
    return trimesh.Trimesh(np.vstack([low, high, ends]), np.vstack(faces), process=False)


def wedge(angle: float) -> trimesh.Trimesh:
    """Two walls of 20 mm that turn by an angle in degrees at an edge on x = 10, and a back."""
    half = np.radians(angle / 2.0)
    far = np.array([10.0 - 20.0 * np.sin(half), 20.0 * np.cos(half)])
    return prism(np.array([[10.0, 0.0], far, [-12.0, far[1]], [-12.0, -far[1]], [far[0], -far[1]]]))


def filleted(radius: float, facets: int) -> trimesh.Trimesh:
    """A square of 24 mm whose corners are quarters of circles."""
    corner = np.linspace(0.0, np.pi / 2.0, facets + 1)
    outline = []
    for quarter in range(4):
        turn = quarter * np.pi / 2.0
        middle = (12.0 - radius) * np.array([[1.0, 1.0]])
        arc = middle + radius * np.c_[np.cos(corner), np.sin(corner)]
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        outline.append(arc @ rotation)
    return prism(np.vstack(outline))


def cuts(path: Toolpath) -> tuple[np.ndarray, np.ndarray]:
    return path.contact[path.cutting], path.normal[path.cutting]


@pytest.mark.parametrize("strategy", ["waterline", "raster"])
def test_a_cube_is_touched_with_the_normals_of_its_faces_only(strategy):
    cube = trimesh.creation.box(extents=[12.0, 12.0, 12.0])
    _, normal = cuts(plan_contour(cube, Tool.ball(6), strategy=strategy))
    assert np.all(np.sort(np.abs(normal), axis=1) == [0.0, 0.0, 1.0])


@pytest.mark.parametrize("strategy", ["waterline", "raster"])
def test_each_wall_of_a_cube_is_touched_up_to_a_step_from_its_edges(strategy):
    cube = trimesh.creation.box(extents=[12.0, 12.0, 12.0])
    contact, normal = cuts(plan_contour(cube, Tool.ball(6), strategy=strategy))
    for axis in np.unique(np.abs(normal).argmax(axis=1)):
        on_face = contact[np.abs(normal[:, axis]) > 0.5]
        reach = np.abs(np.delete(on_face, axis, axis=1)).max()
        assert 6.0 - 0.5 <= reach <= 6.0 + 1e-9


@pytest.mark.parametrize("angle", [35.0, 60.0, 120.0])
def test_a_wedge_keeps_the_normals_of_both_its_walls(angle):
    contact, normal = cuts(plan_contour(wedge(angle), Tool.ball(6), stepdown=3.0))
    front = contact[:, 0] > 10.0 - 20.0 * np.sin(np.radians(angle / 2.0)) + 1e-6
    turned = np.degrees(np.arctan2(normal[front, 1], normal[front, 0]))
    # The back's corners are on the same heights, the front's walls have just two normals.
    on_front = np.abs(turned) < 89.0
    np.testing.assert_allclose(np.abs(turned[on_front]), angle / 2.0, atol=1e-6)


@pytest.mark.parametrize("radius", [1.5, 3.0, 6.0])
def test_an_edge_as_blunt_as_a_tessellation_never_sinks_the_ball(radius):
    # 25 degrees: the normals of both walls are smoothed to one, but the ball stands on the walls.
    part = wedge(25.0)
    path = plan_contour(part, Tool.ball(2.0 * radius), stepdown=3.0)
    centre, contact, normal = path.pivot[path.cutting], path.contact[path.cutting], path.normal[path.cutting]
    depth = radius - tree_of(part).distances(centre)
    assert depth.max() <= LEAN_DEPTH + 1e-9
    turned = np.degrees(np.arctan2(normal[:, 1], normal[:, 0]))
    front = (contact[:, 0] > 6.0) & (np.abs(turned) < 80.0)
    assert np.abs(turned[front]).min() < 1.0
    assert np.abs(np.diff(turned[front])).max() < 30.0


def test_a_fillet_turns_smoothly_from_wall_to_wall():
    path = plan_contour(filleted(4.0, 12), Tool.ball(6), stepdown=3.0)
    contact, normal = cuts(path)
    in_corner = (np.abs(contact[:, :2]) > 8.0 + 1e-6).all(axis=1)
    middle = np.sign(contact[in_corner, :2]) * 8.0
    radial = contact[in_corner, :2] - middle
    radial = np.c_[radial / np.linalg.norm(radial, axis=1, keepdims=True), np.zeros(len(radial))]
    assert np.degrees(angle_between(normal[in_corner], radial)).max() < 0.5
    both = path.cutting[1:] & path.cutting[:-1]
    assert np.degrees(angle_between(path.normal[1:][both], path.normal[:-1][both])).max() < 10.0


def test_flat_walls_beside_a_fillet_keep_their_normals():
    contact, normal = cuts(plan_contour(filleted(4.0, 12), Tool.ball(6), stepdown=3.0))
    flat = (np.abs(contact[:, :2]) < 7.5).any(axis=1)
    off = np.degrees(np.arccos(np.clip(np.abs(normal[flat]).max(axis=1), -1.0, 1.0)))
    # The wall's facet is much larger than the fillet's first one, with which it shares its corners.
    assert off.max() < 0.1


def test_a_chamfer_has_its_own_normal_and_its_neighbours_keep_theirs():
    _, normal = cuts(plan_contour(filleted(4.0, 1), Tool.ball(6), stepdown=3.0))
    eighths = np.degrees(np.arctan2(normal[:, 1], normal[:, 0])) / 45.0
    np.testing.assert_allclose(eighths, np.round(eighths), atol=1e-9)
    assert len(np.unique(np.round(eighths) % 8)) == 8


@pytest.mark.parametrize("diameter", [4.0, 10.0])
def test_normals_on_a_coarse_sphere_are_off_by_tenths_and_the_ball_stays_on_the_facets(diameter):
    # Facets of 10 degrees, 0.08 mm from the sphere, and up to 5 degrees off its normals.
    sphere = trimesh.creation.uv_sphere(radius=20.0, count=[18, 36])
    path = plan_contour(sphere, Tool.ball(diameter), stepdown=2.3)
    centre = path.pivot[path.cutting]
    off = np.degrees(angle_between(path.normal[path.cutting], normalise(centre)))
    assert off.max() < 0.9
    assert off.mean() < 0.25
    _, triangle, distance = tree_of(sphere).nearest(centre)
    facets = facet_normals(np.asarray(sphere.triangles))[triangle]
    assert np.degrees(angle_between(facets, normalise(centre))).max() > 4.0
    assert (diameter / 2.0 - distance).max() <= LEAN_DEPTH + 1e-9
    # Tilt is held to the normal that the ball's centre and contact imply.
    np.testing.assert_allclose(
        path.contact[path.cutting] + diameter / 2.0 * path.normal[path.cutting], centre, atol=1e-12
    )
