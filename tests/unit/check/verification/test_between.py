"""The interpolation between locations that verification assumes, and the motion that a report names."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import SettingError
from fiveaxis.check import Fixture, Surroundings, verify
from fiveaxis.model import Box, Machine, Motion, MoveKind, Tool, Toolpath, follow, motion_digest, tool_poses

# A link across the table's centre while the table turns by half a turn: with TCP the tool passes the
# centre, with axes linear it goes around it.
TIPS = np.array([[60.0, 0, 0], [60, 1, 0], [60, 2, 0], [-60, 2, 0], [-60, 3, 0]])
KINDS = np.array([MoveKind.CUT, MoveKind.CUT, MoveKind.CUT, MoveKind.LINK, MoveKind.CUT])


@pytest.fixture
def path() -> Toolpath:
    axis = np.tile([0.0, 0.0, 1.0], (5, 1))
    return Toolpath.from_tips(TIPS, axis, Tool.ball(6.0), kind=KINDS)


@pytest.fixture
def motion(path: Toolpath, hayashi: Machine) -> Motion:
    rotary = np.zeros((5, 2))
    rotary[3:, list(hayashi.chain.rotaries).index("C")] = np.pi
    return follow(path, hayashi, rotary)


def middle(motion: Motion, machine: Machine) -> np.ndarray:
    """Return the tip halfway through the link, with all axes linear in time."""
    return tool_poses(machine, motion.positions[2:4].mean(axis=0)[None])[0][0]


@pytest.mark.parametrize("between", ["joint", "tcp"])
def test_a_gouge_in_a_link_under_either_interpolation_is_found_by_default(path, motion, hayashi, between):
    x, y = middle(motion, hayashi)[:2] if between == "joint" else (0.0, 2.0)
    post = trimesh.creation.box(bounds=[[x - 2, y - 2, -5], [x + 2, y + 2, 20]])
    report = verify(motion, hayashi, path, part=post)
    assert report.counts["gouge"] == 1
    assert next(f for f in report.findings if f.code == "gouge").place.location == 3
    other = "tcp" if between == "joint" else "joint"
    assert "gouge" in verify(motion, hayashi, path, part=post, between=between).counts
    assert "gouge" not in verify(motion, hayashi, path, part=post, between=other).counts


def test_the_two_interpolations_of_the_link_differ(motion, hayashi):
    assert np.linalg.norm(middle(motion, hayashi)[:2] - [0.0, 2.0]) > 10.0


def test_a_collision_in_a_tcp_move_is_found_with_that_interpolation(path, motion, hayashi):
    around = Surroundings(fixtures=(Fixture("pin", Box((4, 4, 40), (0, 2, 14))),))
    by_axes = verify(motion, hayashi, path, surroundings=around)
    straight = verify(motion, hayashi, path, surroundings=around, between="tcp")
    assert "fixture-collision" not in by_axes.counts
    assert straight.counts["fixture-collision"] == 1


def test_a_digest_depends_on_positions_kinds_and_chain(motion, hayashi):
    digest = motion_digest(motion, hayashi)
    assert digest == motion_digest(replace(motion, time=2.0 * motion.time), hayashi)
    assert digest == motion_digest(replace(motion, positions=motion.positions * 1.0), hayashi)
    others = [
        motion_digest(replace(motion, positions=motion.positions + 1e-9), hayashi),
        motion_digest(replace(motion, kind=np.zeros(5, int)), hayashi),
        motion_digest(motion, hayashi.with_tool_length(1.0)),
    ]
    assert len({digest, *others}) == 4


def test_an_unknown_interpolation_is_refused(path, motion, hayashi):
    with pytest.raises(SettingError, match="write joint or tcp"):
        verify(motion, hayashi, path, between="tips")
