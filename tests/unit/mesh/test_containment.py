import numpy as np
import trimesh

from fiveaxis.mesh.containment import encloses


def test_a_point_is_inside_a_mesh_or_it_is_not():
    ring = trimesh.creation.annulus(r_min=10.0, r_max=20.0, height=8.0)
    assert encloses(ring.triangles, np.array([15.0, 0.0, 1.0]))
    assert not encloses(ring.triangles, np.array([0.5, 0.3, 0.0]))
    assert not encloses(ring.triangles, np.array([15.0, 0.0, 4.1]))
