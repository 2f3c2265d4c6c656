"""Faults planted in programs of every control and mode, and in motion.csv: those that matter are found.

What matters is measured apart from the verification, in `planted`; many more of them, as a table, are printed
by ``python tests/benchmarks/faults.py``.
"""

from functools import cache

import numpy as np
import pytest
from planted.fault import Fault
from planted.jobs import jobs, of_job, of_settings
from planted.registry import FAULTS
from planted.tables import TABLE_FAULTS, TableTrial
from planted.trial import CLEAN, MODES, PARTS, Count, Trial, try_program
from support.pairwise_cases import Case, pairwise_cover

# A program of each kind of words on each part: one part's machine has rotary axes that count the other way,
# another has links.
SAMPLE = [
    ("hayashi", "fanuc", "axes"),
    ("hayashi", "heidenhain", "tip"),
    ("trunnion", "linuxcnc", "axes"),
    ("trunnion", "sinumerik", "tip"),
    ("passes", "haas", "tip"),
    ("passes", "heidenhain", "vector"),
    ("passes", "apt", "vector"),
]
# Each control and mode on one part, each control on several.
EVERY = [(list(PARTS)[number % len(PARTS)], *mode) for number, mode in enumerate(MODES)]
TABLES = [("linuxcnc", "axes", True), ("heidenhain", "tip", False)]
SEED = 20261123


@cache
def trial_of(part: str, control: str, mode: str) -> Trial:
    return Trial.of(PARTS[part], PARTS[part].solve(), control, mode)


def require_found(counts: dict[str, Count]) -> None:
    """Hold both checks to all faults that matter, and to none in what is clean."""
    missed = [text for count in counts.values() for text in count.missed]
    assert not missed, missed


@pytest.mark.parametrize("place", SAMPLE, ids="-".join)
def test_a_part_of_all_classes_is_found_in_each_program_and_nothing_in_a_clean_one(place, tmp_path):
    """Each program has its share of the classes, so that together they have all of them."""
    number = SAMPLE.index(place)

    def in_turn(fault: Fault) -> bool:
        return FAULTS.index(fault) % len(SAMPLE) == number

    require_found(try_program(trial_of(*place), tmp_path, 1, SEED, in_turn))


@pytest.fixture(scope="module")
def covering() -> set[Case]:
    """Give each class once to each part, each control and each mode in which it matters, with its program.

    ``python tests/benchmarks/faults.py`` gives each to every program.
    """
    matter = {
        (fault.name, *place)
        for place in EVERY
        for trial in [trial_of(*place)]
        for fault, text in trial.faults(1, np.random.default_rng(SEED))
        if fault.matters(trial.subject, text)
    }
    # Of programs that serve alike, the one of the part that is verified sooner.
    parts = list(PARTS)
    return set(pairwise_cover(sorted(matter, key=lambda case: (parts.index(case[1]), case))))


@pytest.mark.slow
@pytest.mark.release
@pytest.mark.parametrize("place", EVERY, ids="-".join)
def test_every_class_is_found_in_programs_of_every_control_and_of_every_mode(place, covering, tmp_path):
    def given(fault: Fault) -> bool:
        return (fault.name, *place) in covering

    require_found(try_program(trial_of(*place), tmp_path, 1, SEED, given))


@pytest.mark.parametrize(("control", "mode", "beside_path"), TABLES)
def test_every_class_is_found_in_the_table_of_a_motion(control, mode, beside_path, tmp_path):
    trial = TableTrial(PARTS["passes"].solve(), control, mode, beside_path)
    require_found(try_program(trial, tmp_path, 1, SEED))


def test_every_class_is_planted_and_matters_somewhere():
    """Else nothing would be missed of a class because nothing of it was planted."""
    places = [("trunnion", "fanuc", "axes"), ("hayashi", "linuxcnc", "axes"), ("passes", "heidenhain", "tip")]
    rng = np.random.default_rng(SEED)
    matter = {
        fault.name
        for trial in (trial_of(*place) for place in places)
        for fault, text in trial.faults(3, rng)
        if fault.matters(trial.subject, text)
    }
    assert {fault.name for fault in FAULTS} <= matter
    table = TableTrial(PARTS["passes"].solve(), "linuxcnc", "axes")
    some = {fault.name for fault, text in table.faults(3, rng) if fault.matters(table.subject, text)}
    assert {fault.name for fault in TABLE_FAULTS} - some == {"other source", "row doubled"}


def test_a_rapid_matters_in_a_cut_and_not_in_the_air():
    trial = trial_of("passes", "fanuc", "tip")
    rapid = next(fault for fault in FAULTS if fault.name == "rapid, one block")
    texts = [text for _ in range(3) for text in rapid.plant(trial.subject, np.random.default_rng(SEED))]
    assert {rapid.matters(trial.subject, text) for text in texts} == {True, False}
    assert not rapid.matters(trial.subject, trial.text)


def test_nothing_is_found_in_a_program_whatever_the_job_asks_of_it(tmp_path):
    for control, mode in (("linuxcnc", "axes"), ("sinumerik", "tip"), ("heidenhain", "tip")):
        count = of_settings(PARTS["trunnion"].solve(), control, mode, tmp_path)
        require_found({CLEAN: count})
        assert count.made > 6


@pytest.mark.slow
@pytest.mark.parametrize("job", jobs(pairwise_cover), ids=lambda job: job.name)
def test_nothing_is_found_in_what_was_written_for_a_job(job, tmp_path):
    require_found({CLEAN: of_job(job, tmp_path)})
