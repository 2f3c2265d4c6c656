"""Faults planted in programs of every control and mode: those that matter are found, on clean ones none.

What matters is measured apart from the verification, in `planted`; a larger count of faults, as a table, is
printed by ``python tests/benchmarks/faults.py``.
"""

from __future__ import annotations

import numpy as np
import pytest
from planted.trial import CLEAN, GEOMETRIC, MODES, Count, Trial, on_hayashi, on_trunnion, try_program

SOLUTIONS = {"hayashi": on_hayashi, "trunnion": on_trunnion}
# Of each class of faults in the words of moves, in each program.
FAULTS = 2
# A machine whose rotary axes count the other way, with offsets: one program of each kind of words.
ON_TRUNNION = [("linuxcnc", "axes"), ("heidenhain", "tip"), ("sinumerik", "vector")]
PROGRAMS = [
    *(("hayashi", control, mode) for control, mode in MODES),
    *(("trunnion", control, mode) for control, mode in ON_TRUNNION),
]
IN_BLOCKS = {"rapid", "feed", "unit_lost", "unit_inch", "speed_lost", "sense_lost", "sense_wrong"}
IN_LISTS = {"apt": {"rapid", "feed", "unit_lost", "unit_inch"}, "points": {"rapid", "feed"}}


@pytest.fixture(scope="module")
def solutions():
    return {name: make() for name, make in SOLUTIONS.items()}


@pytest.fixture(scope="module", params=PROGRAMS, ids="-".join)
def planted(request, solutions, tmp_path_factory) -> tuple[Trial, dict[str, Count]]:
    """A program, and what was found of the faults in it."""
    name, control, mode = request.param
    trial = Trial(solutions[name], control, mode)
    seed = PROGRAMS.index(request.param)
    return trial, try_program(trial, tmp_path_factory.mktemp("faulty"), count=FAULTS, seed=seed)


def test_nothing_is_found_in_a_clean_program(planted):
    trial, counts = planted
    assert trial.made.ok
    assert not any(trial.measure.matters(text) for text in trial.clean())
    clean = counts[CLEAN]
    assert (clean.by_program, clean.by_read_back) == (0, 0)


def test_every_fault_in_the_words_of_a_move_is_found_in_a_file(planted):
    _, counts = planted
    some = [counts[name] for name in GEOMETRIC if name in counts]
    mattered = sum(count.mattered for count in some)
    # Not every fault matters: a sign may be that of a word near 0, a location may lie on a straight line.
    assert mattered >= 5 * FAULTS
    assert sum(count.by_program for count in some) == mattered, missed(some)


def test_every_fault_is_found_when_the_text_is_read_back(planted):
    trial, counts = planted
    switch = "feed_mode_lost" if trial.mode == "axes" else "tcp_lost"
    assert set(counts) - {CLEAN, *GEOMETRIC} == (IN_LISTS.get(trial.control) or IN_BLOCKS | {switch})
    faults = [count for name, count in counts.items() if name != CLEAN]
    found = sum(count.by_read_back for count in faults)
    assert found == sum(count.mattered for count in faults), missed(faults)


def missed(counts: list[Count]) -> list[str]:
    return [text for count in counts for text in count.missed]


def test_every_class_of_faults_matters_somewhere(solutions):
    """Else nothing would be missed of a class because nothing of it was planted."""
    trial = Trial(solutions["hayashi"], "linuxcnc", "tip")
    faults = trial.geometric(6, np.random.default_rng(20261123))
    assert {name for name, text in faults if trial.measure.matters(text)} == set(GEOMETRIC)
