"""Cones in which a solid is proven clear: what is swept encloses every posture, and answers stay exact."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fiveaxis as fx
from fiveaxis.check.collision.cones import CLEAR, OPEN, WIDE, Coned, swept_in_cone
from fiveaxis.check.collision.obstacles import Obstacle, Solid
from fiveaxis.model.toolpath.tool import SHANK

BALL = 5.0


def _in_frusta(points, frusta):
    out, height = np.hypot(points[:, 0], points[:, 1])[:, None], points[:, 2:]
    z0, r0, z1, r1 = frusta.T
    radius = r0 + (r1 - r0) * (height - z0) / (z1 - z0)
    return ((height >= z0) & (height <= z1) & (out <= radius)).any(axis=1)


@pytest.mark.parametrize("half", [0.1, 0.8, float(WIDE), 1.6])
def test_what_a_solid_sweeps_holds_it_in_every_direction_of_the_cone(half):
    draw = np.random.default_rng(3)
    for number in range(200):
        low, high = np.sort(draw.uniform(-10.0, 30.0, 2))
        frustum = np.array([[low, draw.uniform(0.0, 8.0), high, draw.uniform(0.0, 8.0)]])
        share, turn = draw.uniform(0.0, 1.0, 400), draw.uniform(0.0, 2.0 * np.pi, 400)
        # The corners reach farthest.
        share[:200] = np.round(share[:200])
        radius = frustum[0, 1] + share * (frustum[0, 3] - frustum[0, 1])
        edge = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), low + share * (high - low)])
        across = draw.uniform(0.0, 2.0 * np.pi)
        lean = half * np.array([np.cos(across), np.sin(across), 0.0]) * draw.choice([1.0, draw.uniform()])
        points = Rotation.from_rotvec(lean).apply(edge)
        thin = [high, min(frustum[0, 3], 1.0), high + draw.uniform(1.0, 9.0), 1.0]
        for stack in (frustum, np.vstack([frustum, thin]), np.vstack([[low - 5.0, 1.0, low, 2.0], frustum])):
            assert _in_frusta(points, swept_in_cone(stack, half)).all(), number


def _rough_ground(draw, height):
    """Triangles over a plane through the origin, with bumps that are higher farther out."""
    middle = draw.uniform(-30.0, 30.0, (400, 1, 2))
    corners = middle + draw.normal(size=(400, 3, 2))
    up = height * draw.uniform(0.0, 1.0, (400, 3)) * np.hypot(corners[..., 0], corners[..., 1])
    return np.concatenate([corners, up[..., None]], axis=-1)


@pytest.mark.parametrize("height", [0.0, 0.05, 0.5])
def test_answers_are_those_without_cones(height):
    draw = np.random.default_rng(5)
    tool = fx.Tool.ball(2 * BALL)
    contact = np.column_stack([draw.uniform(-8.0, 8.0, (60, 2)), np.zeros(60)])
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (60, 1)), tool=tool, feed_mm_min=1e3)
    shank = Solid(SHANK, np.array([[BALL, BALL, 10.0, 5.2], [10.0, 5.2, 25.0, 5.2]]))
    plain = Obstacle.build("part", _rough_ground(draw, height), [shank])
    coned = Coned.of(plain, path)
    rows = draw.integers(0, 60, 4000)
    axis = draw.normal(size=(4000, 3))
    axis[:, 2] = np.abs(axis[:, 2])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    tip = path.pivot[rows] - BALL * axis
    hit = plain.hit_by(rows, tip, axis)
    for some in np.split(np.arange(4000), 8):
        assert (coned.hit_by(rows[some], tip[some], axis[some]) == hit[some]).all()
    proven = {0.0: {CLEAR}, 0.05: {CLEAR, OPEN}, 0.5: {OPEN}}[height]
    assert set(coned.proven.tolist()) == proven
    assert hit.any()


def test_a_pivot_off_the_tool_axis_has_no_cones():
    normal, contact = np.tile([0.0, 0.0, 1.0], (2, 1)), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    path = fx.Toolpath.from_contacts(contact, normal, tool=fx.Tool.ball(10), feed_mm_min=1e3)
    plain = Obstacle.build("part", np.eye(3)[None], [Solid(SHANK, np.array([[5.0, 5.0, 25.0, 5.0]]))])
    assert isinstance(Coned.of(plain, path), Coned)
    assert Coned.of(plain, replace(path, touching=replace(path.zone, offset=3.0))) is plain
