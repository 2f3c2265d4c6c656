"""Every cutter's depth in a mesh against closed forms."""

import numpy as np
import pytest
import trimesh

from fiveaxis.cam import TriangleTree
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.model import Tool
from fiveaxis.model.toolpath import shapes

UP = np.array([0.0, 0.0, 1.0])
MICRON = 1e-3
EXACT = 1e-8
FAR = -100.0
TOOLS = [
    Tool(shapes.ball(10, length=25)),
    Tool.flat(10),
    Tool(shapes.bull(10, 2, length=20)),
    Tool(shapes.lollipop(8, 4, length=30)),
    Tool(shapes.taper(4, 10, 12, length=40)),
    Tool(shapes.barrel(10, 80, 2)),
    Tool(shapes.drill(6, 118, length=30)),
]


def depth(tool: Tool, triangles: np.ndarray, tip: np.ndarray, axis: np.ndarray = UP) -> float:
    body = CuttingBody.of(tool)
    tree = TriangleTree.build(np.asarray(triangles, dtype=float))
    return float(body.depths(np.array([tip], float), np.array([axis], float), tree, np.array([FAR]))[0])


def plane(normal: np.ndarray, size: float = 200.0) -> np.ndarray:
    """Two triangles through the origin, at right angles to a normal."""
    u = np.cross(normal, [0.3, 0.5, 0.8])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    corners = size * np.array([u + v, v - u, -u - v, u - v])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def leant(degrees: float) -> np.ndarray:
    return np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])


@pytest.mark.parametrize("lift", [-MICRON, 0.0, MICRON])
@pytest.mark.parametrize("tool", TOOLS, ids=str)
def test_a_cutter_upright_over_a_plane_is_as_deep_as_its_tip(tool, lift):
    # The shortest distance out of a drill is sideways through its cone.
    nearer = np.cos(np.radians(31.0)) if tool.cutter.shape == "drill" and lift < 0.0 else 1.0
    assert depth(tool, plane(UP), [3.0, -4.0, lift]) == pytest.approx(-lift * nearer, abs=EXACT)


@pytest.mark.parametrize("shift", [-MICRON, 0.5, 3.0])
def test_a_bull_on_a_ramp_touches_with_its_corner(shift):
    tool, slope = Tool.bull(16, 4), 25.0
    normal = leant(slope)
    # The centre of the corner's arc, 4 mm off the plane, then the tip beside and below it.
    offset, radius = 4.0, 4.0
    tip = radius * normal - np.array([0.0, 0.0, radius]) + offset * np.array([1.0, 0.0, 0.0])
    assert depth(tool, plane(normal), tip - shift * normal) == pytest.approx(shift, abs=EXACT)


def test_a_barrel_lies_against_a_cylinder_along_its_arc():
    """The outside of a cylinder about y, touched by the barrel's arc 60 deg off the tool's axis."""
    tool, angle, radius = Tool.barrel(10, 80, 2), np.radians(88.0), 30.0
    zone = tool.cutter.zones[1]
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    contact = radius * normal
    tip = zone.tip(zone.pivot(contact[None], normal[None]), normal[None], UP[None])[0]
    around = np.linspace(0.0, 2.0 * np.pi, 20001)
    around = np.sort(np.append(around, angle))
    x, z = radius * np.sin(around), radius * np.cos(around)
    near, far = np.column_stack([x, 0 * x - 30.0, z]), np.column_stack([x, 0 * x + 30.0, z])
    strips = np.concatenate(
        [np.stack([near[:-1], near[1:], far[:-1]], axis=1), np.stack([near[1:], far[1:], far[:-1]], axis=1)]
    )
    # Facets lie up to radius·step²/8 inside the cylinder, 4e-7 mm here.
    assert depth(tool, strips, tip) == pytest.approx(0.0, abs=1e-6)
    assert depth(tool, strips, tip - 0.2 * normal) == pytest.approx(0.2, abs=1e-6)


def test_a_lollipop_cuts_an_undercut_that_a_ball_on_a_shank_would_not_clear():
    """A ceiling over the ball, open where the neck is: the cylinder above a ball would cut its edge."""
    tool, ball = Tool(shapes.lollipop(8, 4, length=30)), Tool(shapes.ball(8, length=30))
    edge = 2.5
    ceiling = np.array(
        [
            [[edge, -50, 9], [50, -50, 9], [50, 50, 9]],
            [[edge, -50, 9], [50, 50, 9], [edge, 50, 9]],
        ],
        dtype=float,
    )
    assert depth(tool, ceiling, [0.0, 0.0, 0.0]) == pytest.approx(2.0 - edge, abs=EXACT)
    assert depth(ball, ceiling, [0.0, 0.0, 0.0]) == pytest.approx(4.0 - edge, abs=EXACT)
    # Raised by 1.5 mm, the ball's upper side is in the ceiling.
    reached = 4.0 - np.hypot(edge, 9.0 - (1.5 + 4.0))
    assert depth(tool, ceiling, [0.0, 0.0, 1.5]) == pytest.approx(reached, abs=EXACT)


def test_flutes_above_the_ball_are_checked_up_to_the_cutting_length():
    beside = np.array([[[4.9, -50, 15], [4.9, 50, 15], [4.9, 0, 60]]], dtype=float)
    assert depth(Tool(shapes.ball(10, length=25)), beside, [0.0, 0.0, 0.0]) == pytest.approx(0.1, abs=EXACT)
    assert depth(Tool(shapes.ball(10, length=14)), beside, [0.0, 0.0, 0.0]) < 0.0
    assert depth(Tool.ball(10), beside, [0.0, 0.0, 0.0]) < 0.0


@pytest.mark.parametrize("gap", [-MICRON, MICRON])
def test_a_ball_in_a_bore_is_off_its_wall_by_the_difference_of_the_radii(gap):
    mesh = trimesh.creation.cylinder(radius=5.0 + gap, height=60.0, sections=2048)
    sag = (5.0 + gap) * (1.0 - np.cos(np.pi / 2048))
    found = depth(Tool(shapes.ball(10, length=20)), mesh.triangles, [0.0, 0.0, -10.0])
    assert found == pytest.approx(-gap + sag, abs=1e-7)


@pytest.mark.parametrize("tool", TOOLS, ids=str)
def test_no_sampled_point_of_the_surface_is_deeper_than_the_depth_and_one_is_as_deep(tool):
    from fiveaxis.check.verification import gouge_kernel

    rng = np.random.default_rng(7)
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    tree, body = TriangleTree.build(np.asarray(mesh.triangles, dtype=float)), CuttingBody.of(tool)
    directions = rng.normal(size=(6, 3))
    tips = directions / np.linalg.norm(directions, axis=1)[:, None] * rng.uniform(25.0, 33.0, (6, 1))
    axes = directions + rng.normal(size=(6, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    found = body.depths(tips, axes, tree, np.full(6, FAR))
    places, _ = trimesh.sample.sample_surface(mesh, 40000, seed=3)
    for tip, axis, depth in zip(tips, axes, found, strict=True):
        off = places - tip
        heights = off @ axis
        rho = np.linalg.norm(off - heights[:, None] * axis, axis=1)
        best = -np.inf
        for piece in body.pieces:
            within = (heights >= piece.low) & (heights <= piece.high)
            values = [
                gouge_kernel.inside(r, z, piece.zones)[0]
                for r, z in zip(rho[within], heights[within], strict=True)
            ]
            best = max(best, max(values, default=-np.inf))
        assert best <= depth + EXACT
        # 40 000 points on the sphere lie about half a millimetre apart.
        assert depth < 0.0 or depth - best < 0.5


def test_coal_agrees_whether_a_flat_end_and_a_ball_touch():
    """A cylinder and a sphere of coal against a BVH of the same triangles, at poses near the surface."""
    coal = pytest.importorskip("coal")
    rng = np.random.default_rng(11)
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    bvh = coal.BVHModelOBBRSS()
    bvh.beginModel(len(mesh.faces), len(mesh.vertices))
    bvh.addVertices(np.asarray(mesh.vertices))
    bvh.addTriangles(np.asarray(mesh.faces))
    bvh.endModel()
    tree = TriangleTree.build(np.asarray(mesh.triangles, dtype=float))
    height, radius, count = 25.0, 5.0, 150
    flat, ball = (CuttingBody.of(t) for t in (Tool(shapes.flat(10, length=height)), Tool.ball(10)))
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    out = rng.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    tips = out * rng.uniform(26.0, 40.0, size=(count, 1))
    floors = np.full(count, FAR)
    both = [flat.depths(tips, axes, tree, floors), ball.depths(tips, axes, tree, floors)]
    shapes_of = [(coal.Cylinder(radius, height), height / 2.0), (coal.Sphere(radius), radius)]
    for depths, (shape, centre) in zip(both, shapes_of, strict=True):
        touching = []
        for tip, axis in zip(tips, axes, strict=True):
            across = np.cross(axis, [0.3, 0.5, 0.8])
            across /= np.linalg.norm(across)
            turn = np.column_stack([across, np.cross(axis, across), axis])
            pose = coal.Transform3s(turn, tip + centre * axis)
            found = coal.CollisionResult()
            coal.collide(bvh, coal.Transform3s.Identity(), shape, pose, coal.CollisionRequest(), found)
            touching.append(found.isCollision())
        near = np.abs(depths) < 1e-4
        assert near.sum() < 3
        np.testing.assert_array_equal((depths > 0.0)[~near], np.array(touching)[~near])
        assert 20 < sum(touching) < count - 20
