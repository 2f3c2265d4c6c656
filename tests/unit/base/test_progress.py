"""Stages of long work as one share of the whole, which never goes back, and one remaining time."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.base import CHOOSING, STAGES, Meter, ProgressReport, within


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 7.0

    def __call__(self) -> float:
        return self.time


def metered(clock=None) -> tuple[Meter, list[ProgressReport]]:
    heard: list[ProgressReport] = []
    return Meter(heard.append, clock or Clock()), heard


def test_the_stages_of_a_job_follow_each_other_from_none_of_it_to_all():
    spans = [(stage.begin, stage.end) for stage in STAGES.values()]
    assert spans[0][0] == 0.0
    assert spans[-1][1] == 1.0
    for (_, end), (begin, _) in pairwise(spans):
        assert begin == pytest.approx(end)


def test_a_stage_is_a_text_with_an_identifier():
    meter, heard = metered()
    within(meter, "operation 2 of 3", 1, 3)(STAGES["search"], 3, 4)
    assert heard[0].stage == "operation 2 of 3: searching postures"
    assert heard[0].id == "search"


def test_the_second_of_three_parts_begins_at_a_third():
    meter, heard = metered()
    within(meter, "operation 2 of 3", 1, 3)(STAGES["read"], 0, 1)
    within(meter, "operation 3 of 3", 2, 3)(STAGES["read"], 0, 1)
    assert [report.share for report in heard] == pytest.approx([1 / 3, 2 / 3])


def test_parts_of_a_stretch_of_the_work_stay_in_it():
    meter, heard = metered()
    for number in range(4):
        one = within(meter, "way", number, 4, CHOOSING)
        one(STAGES["clear"], 0, 1)
        one(STAGES["verify"], 0, 1)
    low, high = CHOOSING
    expected = [low + (high - low) * quarter / 4 for quarter in (0, 1, 1, 2, 2, 3, 3, 4)]
    assert [report.share for report in heard] == pytest.approx(expected)


def test_the_remaining_time_goes_by_what_is_past():
    clock = Clock()
    meter, heard = metered(clock)
    meter(STAGES["read"], 0, 1)
    assert heard[-1].left is None
    clock.time += 30.0
    meter(STAGES["verify"], 0, 1)
    share = STAGES["verify"].begin
    assert heard[-1].left == pytest.approx(30.0 * (1.0 - share) / share)


def test_work_of_one_stage_has_the_share_of_its_steps():
    clock = Clock()
    meter, heard = metered(clock)
    meter("starting", 0, 1)
    clock.time += 100.0
    meter("measuring", 0, 10)
    clock.time += 6.0
    meter("measuring", 2, 10)
    assert heard[0].share is None
    assert (heard[-1].share, heard[-1].left) == pytest.approx((0.2, 24.0))


STEP = st.tuples(st.sampled_from(sorted(STAGES)), st.integers(0, 5), st.integers(1, 5))


@given(st.lists(st.tuples(st.integers(0, 2), STEP), max_size=40))
def test_the_share_never_goes_back_and_stays_within_the_whole_in_any_order(steps):
    meter, heard = metered()
    for number, (stage, done, total) in steps:
        within(meter, "part", number, 3)(STAGES[stage], done, total)
    shares = [0.0, *(report.share for report in heard)]
    assert shares == sorted(shares)
    assert shares[-1] <= 1.0


def test_what_is_searched_again_leaves_room_for_what_follows():
    meter, heard = metered()
    for _ in range(30):
        meter(STAGES["search"], 0, 9)
        meter(STAGES["search"], 9, 9)
    assert heard[-1].share < STAGES["verify"].begin
    assert heard[20].share > heard[1].share


def test_a_stage_is_told_as_it_begins_and_then_after_a_pause():
    now, told = [0.0], []
    meter = Meter(lambda report: told.append((report.stage, report.done)), lambda: now[0], pause=1.0)
    for stage, done in (("one", 0), ("one", 1), ("one", 2), ("two", 0), ("two", 1)):
        meter(stage, done, 3)
        now[0] += 0.6
    assert told == [("one", 0), ("one", 2), ("two", 0)]
