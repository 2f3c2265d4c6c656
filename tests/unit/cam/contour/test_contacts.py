import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between
from fiveaxis.cam.contour.contacts import Sampling, lean_normals, sample_loop
from fiveaxis.cam.contour.sections import section_loops
from fiveaxis.cam.mesh.surface import Surface


def contacts_of(mesh: trimesh.Trimesh, *, level: float, radius: float = 3.0, spacing: float = 0.5):
    surface = Surface.from_mesh(mesh)
    (loop,) = section_loops(surface, level)
    return sample_loop(loop, surface, Sampling(radius, spacing))


def test_a_normal_leans_no_farther_than_the_limit():
    facet = np.array([[1.0, 0.0, 0.0]])
    leaned = lean_normals(facet, np.array([[2.0, 2.0, 0.0]]), 0.1)
    assert angle_between(leaned, facet) == pytest.approx(0.1)
    near = lean_normals(facet, np.array([[1.0, 0.05, 0.0]]), 0.1)
    assert angle_between(near, facet) == pytest.approx(np.arctan(0.05))


def test_wide_spacing_is_refined_until_chords_keep_to_the_arc():
    cylinder = trimesh.creation.cylinder(radius=10.0, height=10.0, sections=400)
    contacts = contacts_of(cylinder, level=1.0, radius=5.0, spacing=10.0)
    centres = contacts.points + 5.0 * contacts.normals
    middles = (centres + np.roll(centres, -1, axis=0)) / 2.0
    assert np.linalg.norm(middles[:, :2], axis=1).min() > 15.0 - 0.015
