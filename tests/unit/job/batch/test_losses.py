"""Which jobs kill their workers."""

import random

import pytest

from fiveaxis.job.batch.pool import MOST_KILLS, Losses, ended_by_others


def test_a_job_that_loses_three_workers_kills_them_where_no_others_die():
    losses = Losses()
    for _ in range(100):
        losses.survive(1.0)
    assert [losses.lose("a", 5.0, crashed=False) for _ in range(3)] == [0, 0, MOST_KILLS]


def test_a_crash_is_no_chance_however_many_workers_die():
    losses = Losses()
    for _ in range(100):
        losses.die(1.0)
    assert [losses.lose("a", 1.0, crashed=True) for _ in range(3)] == [0, 0, MOST_KILLS]


@pytest.mark.parametrize("killed", [0.3, 0.8])
def test_where_workers_are_killed_at_random_only_the_job_that_always_kills_its_own_is_found(killed):
    """Simulated: forty jobs of unequal length, each life ended by chance, and one that kills always."""
    chance = random.Random(1)
    wrongly, found = 0, 0
    for _ in range(50):
        losses, waiting = Losses(), [f"job{n}" for n in range(40)] + ["killer"]
        for _life in range(5000):
            if not waiting:
                break
            while chance.random() < killed:
                losses.die(chance.random())
            losses.survive(1.0)
            name = waiting.pop(0)
            seconds = 1.0 + len(name) % 3
            if name != "killer" and chance.random() >= killed:
                losses.finish(name, seconds)
            elif losses.lose(name, seconds * chance.random(), crashed=False):
                wrongly += name != "killer"
                found += name == "killer"
            else:
                waiting.append(name)
    assert wrongly <= 1  # of 2000
    assert found == 50


@pytest.mark.parametrize(
    ("system", "by_others", "of_itself"),
    [("linux", (-9, -15, -2), (-11, -6, 0, 1, 70)), ("win32", (1, 15, 0xC000013A), (0xC0000005, 0, 70))],
)
def test_the_exit_code_says_whether_somebody_ended_a_worker(system, by_others, of_itself):
    assert all(ended_by_others(code, system) for code in by_others)
    assert not any(ended_by_others(code, system) for code in of_itself)
