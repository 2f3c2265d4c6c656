import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between
from fiveaxis.cam.contour.contacts import Sampling, lean_normals, sample_loop, turn_between
from fiveaxis.cam.contour.sections import section_loops
from fiveaxis.cam.mesh.surface import Surface


def contacts_of(mesh: trimesh.Trimesh, *, level: float, radius: float = 3.0, spacing: float = 0.5):
    surface = Surface.from_mesh(mesh)
    (loop,) = section_loops(surface, level)
    return sample_loop(loop, surface, Sampling(radius, spacing))


def test_turning_by_a_share_splits_the_angle():
    a, b = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    third = turn_between(a, b, np.array([1.0 / 3.0]))
    np.testing.assert_allclose(third, [[np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0]])


def test_turning_between_opposite_normals_gives_unit_vectors():
    a = np.array([[1.0, 0.0, 0.0]])
    assert np.linalg.norm(turn_between(a, -a, np.array([0.5]))) == pytest.approx(1.0)


def test_a_normal_leans_no_farther_than_the_limit():
    facet = np.array([[1.0, 0.0, 0.0]])
    leaned = lean_normals(facet, np.array([[2.0, 2.0, 0.0]]), 0.1)
    assert angle_between(leaned, facet) == pytest.approx(0.1)
    near = lean_normals(facet, np.array([[1.0, 0.05, 0.0]]), 0.1)
    assert angle_between(near, facet) == pytest.approx(np.arctan(0.05))


@pytest.mark.parametrize("spacing", [0.2, 0.5, 3.0])
def test_contacts_are_no_farther_apart_than_the_spacing(spacing):
    cylinder = trimesh.creation.cylinder(radius=10.0, height=10.0, sections=200)
    contacts = contacts_of(cylinder, level=1.0, spacing=spacing)
    gaps = np.linalg.norm(np.roll(contacts.points, -1, axis=0) - contacts.points, axis=1)
    assert contacts.closed
    assert gaps.max() <= spacing + 1e-9
    assert gaps.min() > 0.0


def test_wide_spacing_is_refined_until_chords_keep_to_the_arc():
    cylinder = trimesh.creation.cylinder(radius=10.0, height=10.0, sections=400)
    contacts = contacts_of(cylinder, level=1.0, radius=5.0, spacing=10.0)
    centres = contacts.points + 5.0 * contacts.normals
    middles = (centres + np.roll(centres, -1, axis=0)) / 2.0
    assert np.linalg.norm(middles[:, :2], axis=1).min() > 15.0 - 0.015


def test_a_box_is_rolled_about_at_its_corners_and_touched_with_its_own_normals():
    contacts = contacts_of(trimesh.creation.box(extents=[20.0, 20.0, 20.0]), level=1.0)
    touching = contacts.normals[~contacts.rolling]
    assert np.all(np.sort(np.abs(touching), axis=1) == [0.0, 0.0, 1.0])
    rolled = contacts.points[contacts.rolling]
    assert len(rolled) > 0
    np.testing.assert_allclose(np.abs(rolled[:, :2]), 10.0)
