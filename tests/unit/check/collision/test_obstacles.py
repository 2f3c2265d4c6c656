"""Tool of revolution against triangles: the compiled test compared with sampling, coal and closed forms."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from fiveaxis.check.collision.obstacles import Obstacle, Solid
from fiveaxis.model import Tool
from fiveaxis.model.toolpath.tool import HOLDER

MICRON = 1e-3
UPRIGHT = np.array([[0.0, 0.0, 1.0]])


def _hits(obstacle, tip, axis):
    return obstacle.hit_by(np.zeros(len(tip), dtype=np.int64), tip, axis)


def _obstacle(triangles, *frusta, margin=0.0):
    solid = Solid(HOLDER, np.array(frusta, dtype=float))
    return Obstacle.build(
        "part", np.asarray(triangles, dtype=float), [solid.grown(margin) if margin else solid]
    )


def _sampled_gap(triangle, frustum):
    """Least ρ − r(z) over a dense sample of a triangle within a frustum's heights."""
    share = np.linspace(0.0, 1.0, 60)
    a, b = (part.ravel() for part in np.meshgrid(share, share))
    inside = a + b <= 1.0
    points = (
        triangle[0]
        + a[inside, None] * (triangle[1] - triangle[0])
        + b[inside, None] * (triangle[2] - triangle[0])
    )
    z0, r0, z1, r1 = frustum
    radius = r0 + (r1 - r0) * (points[:, 2] - z0) / (z1 - z0)
    gap = np.hypot(points[:, 0], points[:, 1]) - radius
    return gap[(points[:, 2] >= z0) & (points[:, 2] <= z1)].min(initial=np.inf)


def test_random_triangles_meet_a_cone_where_a_dense_sample_of_them_does():
    draw = np.random.default_rng(1)
    hits = 0
    for number in range(600):
        triangle = draw.normal(size=(3, 3)) * draw.uniform(0.3, 3.0) + draw.normal(size=3)
        frustum = np.array(
            [draw.uniform(-1, 0), draw.uniform(0, 1), draw.uniform(0.1, 1), draw.uniform(0, 1)]
        )
        here = _hits(_obstacle(triangle[None], frustum), np.zeros((1, 3)), UPRIGHT)[0]
        turn, shift = Rotation.random(random_state=number).as_matrix(), draw.normal(size=3)
        moved = _obstacle((triangle @ turn.T + shift)[None], frustum)
        assert _hits(moved, shift[None], turn[:, 2][None])[0] == here
        gap = _sampled_gap(triangle, frustum)
        # A sample finds no point that isn't there, and misses a piece no larger than its step.
        assert here if gap < 0.0 else (not here or gap < 0.1)
        hits += int(here)
    assert 50 < hits < 550


def test_cylinders_against_a_mesh_answer_as_coal_does():
    coal = pytest.importorskip("coal")
    draw = np.random.default_rng(2)
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    model = coal.BVHModelOBBRSS()
    vertices, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in mesh.vertices:
        vertices.append(np.array(vertex))
    for face in mesh.faces.tolist():
        faces.append(coal.Triangle(*face))
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(vertices, faces)
    model.endModel()
    cylinder, still = coal.Cylinder(12.0, 50.0), coal.Transform3s()
    turns = Rotation.random(800, random_state=3).as_matrix()
    # Middles between "touches at an end" and "touches with its side" and somewhat beyond.
    middle = turns[:, :, 2] * 0.0 + draw.normal(size=(800, 3))
    middle *= (draw.uniform(35.0, 65.0, 800) / np.linalg.norm(middle, axis=1))[:, None]
    ours = _hits(_obstacle(mesh.triangles, (-25.0, 12.0, 25.0, 12.0)), middle, turns[:, :, 2])
    theirs = [
        coal.collide(
            cylinder,
            coal.Transform3s(turn, place),
            model,
            still,
            coal.CollisionRequest(),
            coal.CollisionResult(),
        )
        > 0
        for turn, place in zip(turns, middle, strict=True)
    ]
    assert 100 < ours.sum() < 700
    assert ours.tolist() == theirs


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_cylinder_beside_a_wall_grazes_it_to_a_micron(side):
    wall = [[[5.0, -50.0, -50.0], [5.0, 50.0, -50.0], [5.0, 0.0, 80.0]]]
    hit = _hits(
        _obstacle(wall, (0.0, 5.0 + side * MICRON, 40.0, 5.0 + side * MICRON)), np.zeros((1, 3)), UPRIGHT
    )
    assert hit[0] == (side > 0.0)


def test_a_holder_leans_against_a_wall_at_the_angle_that_trigonometry_gives():
    # The wall is the plane x = 30. The holder's lower edge, 20 from the axis at height 40, reaches it at an
    # angle t towards the wall with 40 sin t + 20 cos t = 30.
    wall = [[[30.0, -500.0, -500.0], [30.0, 500.0, -500.0], [30.0, 0.0, 900.0]]]
    holder = _obstacle(wall, (40.0, 20.0, 40.0 + 1e-6, 20.0))
    edge = np.degrees(np.arcsin(30.0 / np.hypot(40.0, 20.0)) - np.arctan2(20.0, 40.0))
    lean = np.radians(np.arange(0.0, 45.0, 0.01))
    axis = np.column_stack([np.sin(lean), np.zeros_like(lean), np.cos(lean)])
    hit = _hits(holder, np.zeros_like(axis), axis)
    first = np.degrees(lean[np.argmax(hit)])
    assert hit.any()
    assert hit[np.argmax(hit) :].all()
    assert first == pytest.approx(edge, abs=0.02)


def test_a_cone_in_a_bore_meets_it_at_the_depth_where_it_is_as_wide():
    bore = trimesh.creation.annulus(r_min=10.0, r_max=15.0, height=20.0, sections=720)
    inner = 10.0 * np.cos(np.pi / 720)  # the middle of a facet is nearer than its corners
    # A cone of slope 1 whose radius is its height: at depth d it is d + 10 wide where the bore ends.
    cone = _obstacle(bore.triangles, (0.0, 0.0, 30.0, 30.0))
    for depth, is_hit in ((20.0 + inner - 2 * MICRON, False), (20.0 + inner + 2 * MICRON, True)):
        tip = np.array([[0.0, 0.0, 10.0 - (depth - 20.0)]])
        assert _hits(cone, tip, UPRIGHT)[0] == is_hit


def test_a_margin_is_kept_in_every_direction():
    """A cone grown by a margin meets what is nearer than that and nothing much farther."""
    draw = np.random.default_rng(4)
    frustum = (10.0, 6.0, 30.0, 12.0)
    profile = np.array([[0.0, 10.0], [6.0, 10.0], [12.0, 30.0], [0.0, 30.0]])
    points = np.column_stack([draw.uniform(0.0, 20.0, 400), draw.uniform(5.0, 35.0, 400)])
    inside = (
        (points[:, 1] > 10.0) & (points[:, 1] < 30.0) & (points[:, 0] < 6.0 + 0.3 * (points[:, 1] - 10.0))
    )
    gaps = [np.linalg.norm(points - _nearest(points, a, b), axis=1) for a, b in pairwise(profile)]
    gap = np.where(inside, 0.0, np.min(gaps, axis=0))
    for point, distance in zip(points, gap, strict=True):
        speck = np.array(
            [[[point[0], 0.0, point[1]], [point[0] + 1e-6, 0.0, point[1]], [point[0], 1e-6, point[1]]]]
        )
        hit = _hits(_obstacle(speck, frustum, margin=2.0), np.zeros((1, 3)), UPRIGHT)[0]
        if distance < 2.0 - 1e-5:
            assert hit
        if distance > 2.0 * 1.9:  # sharp ends in place of round ones
            assert not hit


def test_a_grown_ball_is_a_larger_ball():
    """Nearly flat segments at the bottom of its sampled profile must not run far out."""
    ball = Solid.of_outline("cutter", Tool.ball(8.0).cutter.outline()).grown(0.5)
    points = np.random.default_rng(7).uniform([-6.0, -6.0, -2.0], [6.0, 6.0, 4.0], (3000, 3))
    away = np.linalg.norm(points - [0.0, 0.0, 4.0], axis=1)
    specks = points[:, None] + 1e-6 * np.eye(3)[None]
    hit = np.array(
        [
            _hits(Obstacle.build("speck", speck[None], [ball]), np.zeros((1, 3)), UPRIGHT)[0]
            for speck in specks
        ]
    )
    # The profile's chords lie inside of the ball by up to 4 (1 − cos 2.5 deg).
    assert hit[away < 4.5 - 0.005].all()
    assert not hit[away > 4.5 + 0.3].any()


def test_a_mesh_is_the_obstacle_that_its_triangles_are_and_all_its_solids_count():
    mesh = trimesh.creation.icosphere(radius=5.0)
    thin, wide = (Solid(HOLDER, np.array([[low, 1.0, low + 10.0, 1.0]])) for low in (3.0, 20.0))
    draw = np.random.default_rng(3)
    tip, axis = draw.uniform(-20.0, 20.0, (2000, 3)), draw.normal(size=(2000, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    both = Obstacle.build("part", mesh, [thin, wide])
    alone = [
        _hits(Obstacle.build("part", np.asarray(mesh.triangles), [one]), tip, axis) for one in (thin, wide)
    ]
    assert min((~alone[0] & alone[1]).sum(), (alone[0] & ~alone[1]).sum()) > 10
    assert np.array_equal(_hits(both, tip, axis), alone[0] | alone[1])
    assert Obstacle.build("stock", mesh, [thin]).nodes is both.nodes


def _nearest(points, a, b):
    edge = b - a
    share = np.clip((points - a) @ edge / (edge @ edge), 0.0, 1.0)
    return a + share[:, None] * edge
