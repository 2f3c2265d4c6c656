"""Who is to blame for workers that die."""

import random

import pytest

from fiveaxis.batch.losses import MOST_KILLS, Losses


def test_a_job_is_to_blame_for_three_deaths_where_no_other_worker_dies():
    losses = Losses()
    for _ in range(100):
        losses.survive(1.0)
    assert [losses.blame("a", 5.0, crashed=False) for _ in range(MOST_KILLS)] == [False, False, True]
    assert losses.count("a") == MOST_KILLS


def test_a_crash_is_no_chance_however_many_workers_die():
    losses = Losses()
    for _ in range(100):
        losses.die(1.0)
    assert [losses.blame("a", 1.0, crashed=True) for _ in range(MOST_KILLS)] == [False, False, True]


@pytest.mark.parametrize("killed", [0.3, 0.6, 0.8])
def test_random_kills_blame_hardly_any_job_and_a_killer_in_the_end(killed):
    """Simulated: forty jobs of unequal length, each life ended by chance, and one that kills always."""
    chance = random.Random(1)
    blamed, told = 0, 0
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
            dies = name == "killer" or chance.random() < killed
            if not dies:
                losses.finish(name, seconds)
            elif losses.blame(name, seconds * chance.random(), crashed=False):
                blamed += name != "killer"
                told += name == "killer"
            else:
                waiting.append(name)
    assert blamed <= 1  # of 2000
    assert told == 50
