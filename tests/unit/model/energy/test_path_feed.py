"""The programmed feed of a program's moves."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import Motion, MoveKind, Tool, Toolpath, follow, path_feed

FEED = 500.0 / 60.0


@pytest.fixture(scope="module")
def turned(hayashi) -> Motion:
    """A straight cut of a ball, 20 mm off the table's axis, while both rotary axes turn."""
    contact = np.column_stack([np.full(11, 20.0), np.linspace(0.0, 10.0, 11), np.zeros(11)])
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * 11, Tool.ball(8), feed_mm_min=500.0)
    return follow(path, hayashi, np.radians(np.linspace([0.0, -30.0], [60.0, -20.0], 11)))


def unread(motion: Motion) -> Motion:
    """Set feeds as a reader of inverse-time blocks does, to values of no use."""
    return replace(motion, feed=np.full(len(motion), 1.0))


def test_the_feed_is_that_of_the_tools_centre_however_the_table_turns(hayashi, turned):
    feed, taken_over = path_feed(hayashi, unread(turned), Tool.ball(8))
    np.testing.assert_allclose(feed[1:], FEED, rtol=1e-9)
    assert not taken_over.any()
    # The tip's path is another one, as the ball turns about its centre.
    assert np.abs(path_feed(hayashi, unread(turned))[0][1:] / FEED - 1.0).max() > 0.01


def test_a_turn_on_the_spot_counts_in_degrees(hayashi):
    contact = np.zeros((3, 3))
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * 3, Tool.ball(8), feed_mm_min=500.0)
    motion = follow(path, hayashi, np.radians([[0.0, -30.0], [10.0, -30.0], [10.0, -20.0]]))
    # Rounded as words are, the ball's centre seems to move.
    rounded = replace(unread(motion), positions=motion.positions.round(4))
    feed, _ = path_feed(hayashi, rounded, Tool.ball(8), rounding=1e-3)
    np.testing.assert_allclose(feed[1:], FEED, rtol=1e-3)


def test_a_block_that_an_axis_stretches_takes_the_feed_of_the_cut_before(hayashi):
    contact = np.column_stack([np.full(6, 20.0), np.arange(6.0), np.zeros(6)])
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * 6, Tool.ball(8), feed_mm_min=500.0)
    axes = (replace(a, max_speed=0.3 if a.letter == "A" else a.max_speed) for a in hayashi.axes)
    machine = replace(hayashi, axes=tuple(axes))
    tilts = np.radians([-30.0, -29.0, -28.0, -8.0, -7.0, -6.0])
    motion = follow(path, machine, np.column_stack([np.zeros(6), tilts]))
    assert motion.time[3] > 2.0 * motion.time[2]
    feed, taken_over = path_feed(machine, unread(motion), Tool.ball(8))
    np.testing.assert_allclose(feed[1:], FEED, rtol=1e-9)
    assert taken_over.tolist() == [False, False, False, True, False, False]


def test_rapid_moves_keep_their_own_feed(hayashi, turned):
    kind = turned.kind.copy()
    kind[3] = MoveKind.RAPID
    feed, _ = path_feed(hayashi, replace(unread(turned), kind=kind), Tool.ball(8))
    assert feed[3] == 1.0
    np.testing.assert_allclose(feed[4:], FEED, rtol=1e-9)
