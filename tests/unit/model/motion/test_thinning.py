"""Removal of redundant blocks."""

from dataclasses import replace

import numpy as np
import pytest
from support.driven_motion import driven

from fiveaxis.model import MoveKind, Tool, Toolpath, follow, load_machine, tool_poses
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.motion.thinning import thinned


def line(n: int, tool: str | None = None) -> Toolpath:
    contact = np.column_stack([np.linspace(10.0, 40.0, n), np.zeros(n), np.full(n, 5.0)])
    cutter = Tool.ball(6) if tool is None else Tool.flat(6)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), cutter)


def still(path: Toolpath) -> np.ndarray:
    return np.tile([0.3, -0.5], (len(path), 1))


def arc(n: int, radius: float = 20.0) -> Toolpath:
    angle = np.linspace(0.0, np.pi / 2.0, n)
    contact = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(n)])
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(6))


@pytest.mark.parametrize("tcp", [False, True])
def test_a_straight_line_of_many_points_is_one_move(hayashi, tcp):
    path = line(1000)
    motion = follow(path, hayashi, still(path))
    few, kept = thinned(path, hayashi, motion, tcp=tcp)
    assert kept.tolist() == [0, 999]
    assert few.time.sum() == pytest.approx(motion.time.sum(), rel=1e-12)
    np.testing.assert_allclose(driven(hayashi, motion, kept, tcp).positions, motion.positions, atol=1e-9)


def test_an_arc_keeps_as_many_rows_as_its_sagitta_needs(hayashi):
    path = arc(2001)
    few, _ = thinned(path, hayashi, follow(path, hayashi, still(path)))
    angle = np.pi / 2.0 / (len(few) - 1)
    # Times count besides positions, so spans are a little shorter than the sagitta alone would allow.
    sagitta = 20.0 * (1.0 - np.cos(angle / 2.0))
    assert 0.002 < sagitta <= 0.005


def test_a_table_that_turns_with_an_arc_needs_few_blocks(hayashi):
    path = arc(2001)
    # C carries the arc past a tool that stands still.
    turning = np.column_stack([-np.linspace(0.0, np.pi / 2.0, 2001), np.zeros(2001)])
    if np.ptp(follow(path, hayashi, turning).positions[:, 0]) > 1e-6:
        turning = -turning
    motion = follow(path, hayashi, turning)
    assert np.ptp(motion.positions[:, hayashi.linear_columns], axis=0).max() < 1e-6
    assert thinned(path, hayashi, motion)[1].tolist() == [0, 2000]
    narrow, _ = thinned(path, hayashi, motion, max_turn=np.radians(15.1))
    assert len(narrow) == 7
    assert np.abs(narrow.moves[:, hayashi.rotary_columns]).max() <= np.radians(15.1)


@pytest.mark.parametrize("kind", [MoveKind.LINK, MoveKind.RAPID])
def test_no_block_holds_moves_of_two_kinds(hayashi, kind):
    path = line(30)
    kinds = np.zeros(30, dtype=np.int64)
    kinds[10:20] = kind
    path = replace(path, kind=kinds)
    few, kept = thinned(path, hayashi, follow(path, hayashi, still(path)))
    assert kept.tolist() == [0, 9, 19, 29]
    assert few.kind.tolist() == [0, 0, kind, 0]


def test_no_block_holds_moves_of_two_feeds(hayashi):
    path = line(30)
    path = replace(path, feed=np.where(np.arange(30) < 12, path.feed, 0.999 * path.feed))
    assert thinned(path, hayashi, follow(path, hayashi, still(path)))[1].tolist() == [0, 11, 29]


def test_no_block_holds_moves_of_two_speeds(hayashi):
    path = line(30)
    motion = follow(path, hayashi, still(path))
    slow = replace(motion, time=np.where(np.arange(30) < 12, motion.time, 1.02 * motion.time))
    assert thinned(path, hayashi, slow)[1].tolist() == [0, 11, 29]


def test_rows_that_are_needed_stay(hayashi):
    path = line(30)
    needed = np.zeros(30, dtype=bool)
    needed[[7, 8]] = True
    _, kept = thinned(path, hayashi, follow(path, hayashi, still(path)), needed=needed)
    assert kept.tolist() == [0, 7, 8, 29]


def test_a_turn_on_the_spot_stays_a_block_of_its_own(hayashi):
    path = line(30).at(np.repeat(np.arange(30), np.where(np.arange(30) == 14, 2, 1)))
    rotary = still(path)
    rotary[15:, 0] -= 2.0 * np.pi
    _, kept = thinned(path, hayashi, follow(path, hayashi, rotary))
    assert kept.tolist() == [0, 14, 15, 30]


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt", "dmu50ev"])
def test_no_two_neighbouring_blocks_could_be_one(name):
    machine = load_machine(name)
    path = arc(100)
    rotary = np.column_stack([np.linspace(0.3, 0.9, 100), 0.2 + 0.2 * np.sin(np.linspace(0.0, 3.0, 100))])
    filled, motion, _ = fill_in(path, machine, rotary)
    kept = thinned(filled, machine, motion)[1]
    assert 2 < len(kept) < len(filled)
    for row in kept[1:-1]:
        others = np.isin(np.arange(len(filled)), kept[kept != row])
        assert row in thinned(filled, machine, motion, needed=others)[1]


def test_a_flat_ends_contact_stays_though_the_tool_turns(hayashi):
    path = line(200, "flat")
    rotary = np.column_stack([np.linspace(0.0, 0.2, 200), np.full(200, -0.4)])
    filled, motion, _ = fill_in(path, hayashi, rotary)
    _, kept = thinned(filled, hayashi, motion)
    assert len(kept) < len(filled) - 100
    tip, axis = tool_poses(hayashi, driven(hayashi, motion, kept).positions)
    known = np.isfinite(filled.contact).all(axis=1)
    reached = path.tool.cutter.contacts(tip[known], filled.normal[known], axis[known])
    assert np.linalg.norm(reached - filled.contact[known], axis=1).max() <= 0.005


def test_motions_of_one_and_two_rows_stay_as_they_are(hayashi):
    for n in (1, 2):
        path = line(2).at(np.arange(n))
        motion = follow(path, hayashi, still(path))
        few, kept = thinned(path, hayashi, motion)
        assert len(kept) == len(path)
        np.testing.assert_array_equal(few.positions, motion.positions)
        np.testing.assert_array_equal(few.time, motion.time)
