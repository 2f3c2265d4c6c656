"""The line that shows what a command does, and about how long a stage still takes."""

import io

import pytest
from rich.console import Console

from fiveaxis.base import STAGES
from fiveaxis.cli.work import Work, clock_text, shown_work


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def line(work: Work, width: int = 100) -> str:
    console = Console(file=io.StringIO(), width=width, color_system=None)
    console.print(work.line)
    return console.file.getvalue()


def test_the_line_has_the_stage_and_the_time_since_the_beginning():
    clock = Clock()
    work = Work(clock)
    work.step("reading the input", 0, 1)
    clock.time += 3.0
    work.step("planning passes", 4, 9)
    clock.time += 65.0
    assert "planning passes" in line(work)
    assert "0:01:08" in line(work)
    assert "reading" not in line(work)


def test_a_time_of_days_is_in_hours():
    assert [clock_text(s) for s in (5.4, 3725.0, 90_061.0)] == ["0:00:05", "1:02:05", "25:01:01"]


def test_the_line_tells_how_long_work_of_one_stage_still_takes_and_forgets_it_with_the_stage():
    clock = Clock()
    work = Work(clock)
    for done in range(11):
        work.step("searching", done, 30)
        clock.time += 0.5
    assert "about 0:00:10 more" in line(work)
    work.step("refining", 0, 7)
    assert "more" not in line(work)


def test_what_waits_for_the_input_is_called_once_when_the_next_stage_begins():
    work, said = Work(), []
    work.when_read = lambda: said.append("read")
    work.step(STAGES["read"], 0, 1)
    assert said == []
    work.step(STAGES["plan"], 0, 2)
    work.step(STAGES["search"], 0, 1)
    assert said == ["read"]


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
