"""The ball against a mesh."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fiveaxis.kinematics import rotary_angles
from fiveaxis.motion import follow
from fiveaxis.toolpath import MoveKind, Tool, Toolpath
from fiveaxis.verification import verify
from fiveaxis.verification.gouging import sample_ways

RADIUS = 5.0
SIDE = 40.0


@pytest.fixture(scope="module")
def box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(SIDE, SIDE, SIDE))


def along_top(height: float = 0.0, n: int = 30) -> Toolpath:
    """A straight pass over the box's top face, lifted by `height`."""
    contact = np.stack([np.linspace(-15.0, 15.0, n), np.zeros(n), np.full(n, SIDE / 2.0 + height)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(2.0 * RADIUS))


def upright(path: Toolpath, machine):
    return follow(path, machine, np.zeros((len(path), 2)))


def test_a_ball_on_the_surface_passes(hayashi, box):
    path = along_top()
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.ok
    assert report.figures["gouge_depth_mm"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("depth", "fires"), [(0.009, False), (0.011, True)])
def test_a_hundredth_of_a_millimetre_is_the_bound(hayashi, box, depth, fires):
    path = along_top(-depth)
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.ok is not fires
    assert report.figures["gouge_depth_mm"] == pytest.approx(depth, abs=1e-9)


def test_one_location_in_the_part_is_named(hayashi, box):
    path = along_top()
    pivot = path.pivot.copy()
    pivot[12, 2] -= 0.015
    sunk = replace(path, pivot=pivot, contact=np.full_like(pivot, np.nan))
    report = verify(upright(sunk, hayashi), hayashi, sunk, part=box)
    assert [f.place.location for f in report.findings] == [12]
    assert "0.015 mm deep into the part here" in report.findings[0].message


def test_a_link_through_the_part_is_found_between_two_good_locations(hayashi, box):
    pivot = np.array([[-30.0, 0.0, 0.0], [30.0, 0.0, 0.0]])
    path = Toolpath.from_tips(
        pivot - [0.0, 0.0, RADIUS],
        np.tile([0.0, 0.0, 1.0], (2, 1)),
        Tool.ball(2.0 * RADIUS),
        kind=[MoveKind.CUT, MoveKind.RAPID],
    )
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.counts == {"gouge": 1}
    assert "on the way here" in report.findings[0].message


def test_a_path_wholly_inside_the_part_is_no_clearance(hayashi, box):
    path = along_top(-SIDE / 2.0 - RADIUS, n=31)
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.counts == {"gouge": len(path)}
    assert report.figures["gouge_depth_mm"] == pytest.approx(RADIUS + SIDE / 2.0)


def test_an_open_mesh_is_checked_and_what_it_cannot_tell_is_said(hayashi, box):
    lid = box.copy()
    lid.update_faces(np.arange(len(lid.faces)) != 0)
    path = along_top()
    report = verify(upright(path, hayashi), hayashi, path, part=lid)
    assert any("isn't watertight" in sentence for sentence in report.not_checked)


def test_the_part_may_be_a_file(hayashi, box, tmp_path):
    box.export(tmp_path / "box.stl")
    path = along_top(-0.05)
    report = verify(upright(path, hayashi), hayashi, path, part=tmp_path / "box.stl")
    assert report.counts == {"gouge": len(path)}


def test_the_posture_does_not_change_what_the_ball_touches(hayashi, box):
    path = along_top()
    leant = np.tile([0.0, -np.sin(0.5), np.cos(0.5)], (len(path), 1))
    motion = follow(path, hayashi, np.unwrap(rotary_angles(hayashi, leant)[1], axis=0))
    assert verify(motion, hayashi, path, tilt=(15.0, 75.0), part=box).ok


def test_ways_are_sampled_between_their_ends_only():
    points = np.array(
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.4, 0.0], [np.nan, 0.0, 0.0], [0.0, 0.0, 0.0]]
    )
    samples, rows = sample_ways(points)
    np.testing.assert_allclose(samples[:, 0], [0.5, 1.0, 1.5])
    assert rows.tolist() == [1, 1, 1]
