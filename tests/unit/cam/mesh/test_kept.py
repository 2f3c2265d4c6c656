"""What is made of a mesh is made once, until the mesh changes, and goes with it."""

import gc

import pytest
import trimesh

from fiveaxis.cam import kept_by_mesh, tree_of


@pytest.fixture
def counted():
    made = []

    @kept_by_mesh
    def count(mesh):
        made.append(len(mesh.faces))
        return len(made)

    return count


def test_the_same_mesh_is_worked_on_once(counted):
    box, other = trimesh.creation.box(), trimesh.creation.icosphere(subdivisions=1)
    assert [counted(box), counted(other), counted(box), counted(other)] == [1, 2, 1, 2]


def test_a_mesh_that_was_moved_is_another_one(counted):
    box = trimesh.creation.box()
    assert counted(box) == 1
    box.apply_translation([0.0, 0.0, 1.0])
    assert counted(box) == 2
    assert tree_of(box).distances([[0.0, 0.0, 3.0]])[0] == pytest.approx(1.5)
    box.vertices[:, 2] += 1.0
    assert counted(box) == 3
    assert tree_of(box).distances([[0.0, 0.0, 3.0]])[0] == pytest.approx(0.5)


def test_a_mesh_is_not_kept_alive_by_its_tree():
    import weakref

    box = trimesh.creation.box()
    tree_of(box)
    gone = weakref.ref(box)
    del box
    gc.collect()
    assert gone() is None
