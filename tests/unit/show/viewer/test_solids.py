import numpy as np
import pytest
import trimesh

from fiveaxis.show.viewer.scene import thin_mesh

MOST = 150_000


def test_a_small_mesh_is_not_thinned():
    part = trimesh.creation.icosphere(subdivisions=2)
    vertices, faces = thin_mesh(part.vertices, part.faces, most=MOST)
    assert vertices is part.vertices
    assert faces is part.faces


def test_a_mesh_too_fine_is_thinned_and_keeps_its_shape():
    fine = trimesh.creation.icosphere(subdivisions=7, radius=50.0)
    assert len(fine.faces) > MOST
    vertices, faces = thin_mesh(np.asarray(fine.vertices), np.asarray(fine.faces), most=MOST)
    assert 1000 < len(faces) <= MOST
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 50.0, atol=1e-6)
    assert trimesh.Trimesh(vertices, faces).area == pytest.approx(fine.area, rel=0.02)
