"""Long work of a command: in a thread, so that Ctrl-C ends it at once, with a line that shows what is done.

Python handles Ctrl-C in the main thread, between two of its own steps, and so only after a compiled search or
IPOPT of half a minute. So the main thread only waits, and the work, which writes no file, is abandoned if it
doesn't end by itself.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from fiveaxis.progress import Progress

logger = logging.getLogger(__name__)

T = TypeVar("T")

NAME = "fiveaxis-work"
# s: interval at which the main thread wakes up, which Windows needs for Ctrl-C; time for the work to end.
LOOK = 0.2
GRACE = 0.5

# Pictures per second, and characters of the bar.
PICTURES, WIDTH = 8, 24
# A remaining time is shown once so many steps took so many s, and the slowest quarter of them took at most so
# much longer than the quickest.
LEAST_STEPS, LEAST_TIME, EVEN = 8, 2.0, 1.6


@dataclass(frozen=True, eq=False)
class Stage:
    """What is being done.

    Parameters
    ----------
    name : of the stage, for people
    total : steps in all
    reports : s and steps done then, both increasing; grows
    """

    name: str
    total: int
    reports: list[tuple[float, int]]


class Work:
    """The work of a command: the stage that it is in, how far, and since when.

    Parameters
    ----------
    clock : s
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = clock()
        self._stopped = threading.Event()
        self._stage = Stage("starting", 1, [(self._began, 0)])
        # Draws the line at once.
        self.draw: Callable[[], object] = lambda: None
        self._spinner = Spinner("dots")

    @property
    def elapsed(self) -> float:
        """Time since the work began, s."""
        return self._clock() - self._began

    def step(self, stage: str, done: int, total: int) -> None:
        """Say what is being done, and how many of its steps are done.

        Raises
        ------
        KeyboardInterrupt
            The work was abandoned; this ends it.
        """
        if self._stopped.is_set():
            raise KeyboardInterrupt
        report, now = (self._clock(), done), self._stage
        if (stage, total) == (now.name, now.total) and done > now.reports[-1][1]:
            now.reports.append(report)
            return
        self._stage = Stage(stage, total, [report])
        if stage != now.name:
            logger.info("%s", stage)
            # At once: a library may hold Python's lock for seconds, and the line would show the stage before.
            self.draw()

    def run(self, work: Callable[[Progress], T]) -> T:
        """Do work in a thread.

        Parameters
        ----------
        work : called with a function of a stage's name, steps done and steps in all; writes no file

        Returns
        -------
        What the work returns.

        Raises
        ------
        KeyboardInterrupt
            Ctrl-C. The work may still run: `leave_if_working`.
        Exception
            What the work raises.
        """
        future: Future[T] = Future()

        def run() -> None:
            try:
                future.set_result(work(self.step))
            except BaseException as fault:  # a Ctrl-C that the work itself noticed is a result too
                future.set_exception(fault)

        # A daemon: the command may end without it.
        threading.Thread(target=run, name=NAME, daemon=True).start()
        try:
            while not future.done():
                wait([future], LOOK)
        except KeyboardInterrupt:
            self._stopped.set()
            wait([future], GRACE)
            raise
        return future.result()

    def __rich__(self) -> Table:
        # Copied: the work goes on in another thread.
        stage, reports = self._stage, [*self._stage.reports]
        done, total = reports[-1][1], stage.total
        # What has no steps to be counted has a bar that only moves.
        counted = total > 1
        bar = ProgressBar(total, done, width=WIDTH, pulse=not counted)
        steps = f"{done}/{total}" if counted else ""
        left = remaining_time(reports, total, self._clock())
        more = "" if left is None else f", this stage about {clock_text(left)} more"
        line = Table.grid(padding=(0, 1))
        for _ in range(4):
            line.add_column(no_wrap=True)
        far = Text(f"{steps} {clock_text(self.elapsed)}{more}".strip())
        line.add_row(self._spinner, Text(stage.name), bar, far)
        return line


def clock_text(seconds: float) -> str:
    """Format a time as hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"


def remaining_time(reports: Sequence[tuple[float, int]], total: int, now: float) -> float | None:
    """Estimate how long a stage still takes; None unless its steps have taken about equally long so far.

    Parameters
    ----------
    reports : s and steps done then, both increasing; at least one
    total : steps in all
    now : s

    Returns
    -------
    s
    """
    (began, first), (last, done) = reports[0], reports[-1]
    if done - first < LEAST_STEPS or last - began < LEAST_TIME:
        return None
    counts = [count for _, count in reports]
    # The reports nearest to each quarter of the steps: there may be fewer reports than steps.
    ends = [reports[bisect_left(counts, first + k * (done - first) / 4)] for k in range(5)]
    if len(set(ends)) < len(ends):
        return None
    quarters = [(there - here) / (after - before) for (here, before), (there, after) in pairwise(ends)]
    if max(quarters) > EVEN * min(quarters):
        return None
    left = quarters[-1] * (total - done) - (now - last)
    # A step that takes much longer than those before shows that they weren't equal.
    return left if left > 0.0 and now - last <= LEAST_TIME + 2.0 * quarters[-1] else None


@contextmanager
def shown_work(console: Console, *, hidden: bool = False) -> Iterator[Work]:
    """Begin work, and show on a terminal what it does until the block ends; elsewhere nothing is printed.

    Parameters
    ----------
    console : for people; nothing else may print meanwhile, except on it
    hidden : whether nothing is shown on a terminal either
    """
    work = Work()
    if hidden or console.quiet or not console.is_interactive:
        yield work
        return
    # Output isn't redirected: results may go to a file.
    with Live(
        work,
        console=console,
        refresh_per_second=PICTURES,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    ) as line:
        work.draw = line.refresh
        yield work


def leave_if_working(code: int) -> None:
    """End the process at once if work still runs, since nothing stops a compiled step.

    Parameters
    ----------
    code : of the exit
    """
    if any(thread.name == NAME for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
