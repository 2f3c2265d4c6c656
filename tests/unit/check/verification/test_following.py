import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.check import PathConstraints
from fiveaxis.check.verification import following
from fiveaxis.check.verification.check_context import DEFAULT_TOLERANCES, make_context
from fiveaxis.model import Tool, Toolpath, follow

COUNT, FIRST = 600, 200
LIFT = 0.3


def lifted_arc(machine, tool, missed):
    """A program that misses this many of an arc's locations, which it passes too high."""
    turn = np.linspace(0.0, 5.0, COUNT)
    contact = np.stack([20.0 * np.cos(turn), 20.0 * np.sin(turn), np.zeros(COUNT)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (COUNT, 1)), tool)
    motion = follow(path, machine, np.zeros((COUNT, 2)))
    positions = motion.positions.copy()
    positions[FIRST : FIRST + missed, machine.column("Z")] += LIFT
    motion = replace(motion, positions=positions)
    return make_context(motion, machine, path, PathConstraints(), DEFAULT_TOLERANCES), path


@pytest.mark.parametrize("tool", [Tool.ball(8.0), Tool.bull(10.0, 2.0)], ids=["ball", "bull"])
def test_distances_are_those_of_few_chords_at_a_time(hayashi, tool, monkeypatch):
    context, path = lifted_arc(hayashi, tool, 20)
    whole = following.follow(context, path)
    assert np.flatnonzero(whole.row < 0).tolist() == list(range(FIRST, FIRST + 20))
    assert np.nanmax(whole.off) == pytest.approx(LIFT, abs=0.01)
    monkeypatch.setattr(following, "MOST_CHORDS", 50)
    np.testing.assert_array_equal(following.follow(context, path).off, whole.off)


def test_many_missed_locations_take_little_memory(hayashi):
    context, path = lifted_arc(hayashi, Tool.ball(8.0), 200)
    following.follow(context, path)
    tracemalloc.start()
    following.follow(context, path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # About 800 points have 200 chords each: all of them at once take several times this.
    assert peak < 15e6
