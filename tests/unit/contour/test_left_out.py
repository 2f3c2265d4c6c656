"""Contacts that no pass reaches are a finding with their number, the highest one and the reason."""

import re

import numpy as np
import pytest
import trimesh

from fiveaxis.contour import plan_contour
from fiveaxis.contour.ball_space import GOUGE, BallSpace
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Severity
from fiveaxis.mesh import tree_of
from fiveaxis.toolpath import Tool


def tube(inside: float, outside: float) -> trimesh.Trimesh:
    return trimesh.creation.annulus(r_min=inside, r_max=outside, height=8.0, sections=64)


def test_a_plan_that_reaches_every_contact_has_no_finding():
    assert plan_contour(tube(3.0, 15.0), Tool.ball(4), stepdown=2.0).findings == ()


def test_contacts_in_a_hole_narrower_than_the_ball_are_a_warning_with_the_room_there():
    path = plan_contour(tube(3.0, 15.0), Tool.ball(8), stepdown=2.0)
    (found,) = path.findings
    assert (found.severity, found.code) == (Severity.WARNING, "contacts-left-out")
    lost, of = map(int, re.search(r"reaches (\d+) of (\d+)", found.message).groups())
    assert lost == path.ignored["contacts where the ball would gouge"] == found.value
    assert of == lost + int(path.cutting.sum())
    assert "the highest at X3 Y0 Z3: " in found.message
    # The hole's diameter.
    assert "half of them have room for a ball of at most 6 mm" in found.message


def test_more_than_half_of_the_contacts_left_out_are_an_error():
    tubes = [tube(1.5, 4.0) for _ in range(3)]
    for number, one in enumerate(tubes):
        one.apply_translation([10.0 * number, 0.0, 0.0])
    path = plan_contour(trimesh.util.concatenate(tubes), Tool.ball(8), stepdown=2.0)
    (found,) = path.findings
    assert (found.severity, found.code) == (Severity.ERROR, "contacts-left-out")
    assert found.value > int(path.cutting.sum())


def test_a_part_that_the_ball_reaches_nowhere_is_infeasible_and_says_where():
    wide = tube(3.0, 200.0)
    pocket = wide.submesh([np.linalg.norm(wide.triangles_center[:, :2], axis=1) < 190.0], append=True)
    with pytest.raises(Infeasible) as caught:
        plan_contour(pocket, Tool.ball(20), allow_open=True)
    (found,) = caught.value.findings
    assert caught.value.exit_code == 3
    assert (found.severity, found.code) == (Severity.ERROR, "contacts-left-out")


def test_passes_that_are_too_short_as_was_asked_for_are_no_finding():
    path = plan_contour(tube(3.0, 15.0), Tool.ball(4), stepdown=2.0, min_length=30.0)
    assert path.ignored == {"passes shorter than the minimum length": 4}
    assert path.findings == ()


def test_the_room_in_a_corner_is_that_of_the_ball_in_it():
    # Two planes at right angles: a ball that touches one of them s from the edge has the radius s.
    corner = trimesh.Trimesh(
        [[0, -50, 0], [50, -50, 0], [50, 50, 0], [0, 50, 0], [0, -50, 50], [0, 50, 50]],
        [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4]],
    )
    away = np.array([0.5, 2.0, 7.0, 30.0])
    points = np.c_[away, 0.0 * away, 0.0 * away]
    room = BallSpace(tree_of(corner), 10.0).rooms(points, np.tile([0.0, 0.0, 1.0], (4, 1)))
    np.testing.assert_allclose(room, [0.5, 2.0, 7.0, 10.0], atol=GOUGE)
