"""How long moves take."""

import numpy as np
import pytest

from fiveaxis.motion import block_times, follow
from fiveaxis.toolpath import Tool, Toolpath


def at_one_place(n: int) -> Toolpath:
    return Toolpath.from_contacts(np.zeros((n, 3)), np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(6))


def test_a_move_takes_its_way_at_the_feed_whatever_the_posture(hayashi):
    contact = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 20.0, 0]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0, 1.0], (3, 1)), Tool.ball(6), feed_mm_min=600)
    for rotary in (np.zeros((3, 2)), np.array([[0, 0], [1, -1], [2, 0.3]])):
        np.testing.assert_allclose(follow(path, hayashi, rotary).time, [0.0, 1.0, 2.0])


def test_a_turn_on_the_spot_takes_the_number_as_degrees_per_minute(hayashi):
    motion = follow(at_one_place(2), hayashi, np.radians([[0.0, 0.0], [50.0, 20.0]]))
    assert motion.time[1] == pytest.approx(50.0 / (1000.0 / 60.0))


def test_the_slowest_axis_stretches_the_move(trunnion):
    """The simulated trunnion does 20 mm/s and 30 deg/s."""
    contact = np.array([[0.0, 0, 0], [10.0, 0, 0]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0, 1.0], (2, 1)), Tool.ball(6), feed_mm_min=60_000)
    positions = np.array([[0.0, 0, 0, 0, 0], [10.0, 0, 0, 0, 0]])
    assert block_times(path, trunnion, positions)[1] == pytest.approx(0.5)
    positions[1, 4] = np.radians(60.0)
    assert block_times(path, trunnion, positions)[1] == pytest.approx(2.0)
