"""The line that shows what a command does, and how long a stage still takes, where that is known."""

from __future__ import annotations

import io
import math
import random

import pytest
from rich.console import Console

from fiveaxis.cli.work import Work, remaining_time, shown_work


def reports(*steps: float) -> list[tuple[float, int]]:
    """Reports after steps that took so many s each."""
    return [(sum(steps[:done]), done) for done in range(len(steps) + 1)]


def test_steps_of_equal_cost_tell_how_long_the_rest_takes():
    steps = reports(*[0.5] * 10)
    assert remaining_time(steps, 30, now=5.0) == pytest.approx(10.0)
    assert remaining_time(steps, 30, now=6.0) == pytest.approx(9.0)


def test_reports_may_leave_steps_out():
    steps = [(0.0, 0), (2.5, 25), (5.0, 50), (7.5, 75), (10.0, 100)]
    assert remaining_time(steps, 200, now=10.0) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("steps", "now"),
    [
        (reports(*[0.5] * 7), 3.5),  # few steps
        (reports(*[0.1] * 12), 1.2),  # a short time
        (reports(*[0.5] * 6, *[1.0] * 6), 9.0),  # they get slower
        (reports(*[1.0] * 6, *[0.2] * 6), 7.2),  # they get quicker
        (reports(*[0.5] * 10), 9.0),  # one takes much longer than those before
        ([(0.0, 0), (10.0, 50)], 10.0),  # told once
        ([(0.0, 0)], 60.0),
    ],
)
def test_no_time_is_told_unless_steps_took_equally_long(steps, now):
    assert remaining_time(steps, 100, now) is None


@pytest.mark.parametrize("seed", range(20))
def test_half_way_through_a_long_stage_the_time_told_is_right_within_a_factor_of_two(seed):
    # A search's locations take as long as their states need, which change along the path.
    draw = random.Random(seed)
    bend, phase = draw.uniform(1.0, 3.0), draw.uniform(0.0, 6.0)
    steps = [2.0 + 0.2 * math.sin(bend * n / 20.0 + phase) + draw.uniform(-0.5, 0.5) for n in range(100)]
    half = reports(*steps[:50])
    told = remaining_time(half, 100, now=half[-1][0])
    assert told is not None
    assert 0.5 < told / sum(steps[50:]) < 2.0


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def line(work: Work, width: int = 100) -> str:
    console = Console(file=io.StringIO(), width=width, color_system=None)
    console.print(work)
    return console.file.getvalue()


def test_the_line_has_the_stage_its_steps_and_the_time_since_the_beginning():
    clock = Clock()
    work = Work(clock)
    work.step("reading the input", 0, 1)
    clock.time += 3.0
    work.step("planning passes", 4, 9)
    clock.time += 65.0
    assert "planning passes" in line(work)
    assert "4/9 0:01:08" in line(work)
    assert "reading" not in line(work)


def test_the_line_tells_how_long_a_stage_of_equal_steps_still_takes_and_forgets_it_with_the_stage():
    clock = Clock()
    work = Work(clock)
    for done in range(11):
        work.step("searching", done, 30)
        clock.time += 0.5
    assert "this stage about 0:00:10 more" in line(work)
    work.step("refining", 0, 7)
    assert "more" not in line(work)


def test_the_line_is_one_line_however_narrow_the_terminal():
    work = Work()
    work.step("solution 12 of 30: front, run 17 of 31: searching postures, 2 of 3", 4, 900)
    assert len(line(work, 40).splitlines()) == 1


@pytest.mark.parametrize(
    ("console", "hidden"),
    [
        ({}, False),
        ({"force_terminal": True, "quiet": True}, False),
        ({"force_terminal": True}, True),
        ({"force_terminal": True, "force_interactive": False}, False),
    ],
)
def test_nothing_is_printed_where_nobody_looks(console, hidden):
    file = io.StringIO()
    with shown_work(Console(file=file, **console), hidden=hidden) as work:
        work.run(lambda step: step("searching", 1, 2))
    assert file.getvalue() == ""


def test_a_terminal_is_left_as_it_was():
    file = io.StringIO()
    with shown_work(Console(file=file, force_terminal=True, width=80)) as work:
        work.step("searching", 1, 2)
    assert "searching" in file.getvalue()
    # The line is erased.
    assert file.getvalue().endswith("\x1b[2K")
