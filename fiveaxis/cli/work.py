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
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from typing import TypeVar

from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task, TextColumn
from rich.progress import Progress as ProgressLine
from rich.table import Column
from rich.text import Text

from fiveaxis.base import STAGES, Meter, Progress, ProgressReport

logger = logging.getLogger(__name__)

T = TypeVar("T")

NAME = "fiveaxis-work"
# s: interval at which the main thread wakes up, which Windows needs for Ctrl-C; time for the work to end.
LOOK = 0.2
GRACE = 0.5

# Pictures per second, and characters of the bar.
PICTURES, WIDTH = 8, 24


class Times(ProgressColumn):
    """How long the work has taken, and how long it still takes."""

    def __init__(self, work: Work) -> None:
        super().__init__(Column(no_wrap=True))
        self._work = work

    def render(self, _task: Task) -> Text:
        """Draw them; of work whose share isn't known the time alone."""
        left = self._work.left
        more = "" if left is None else f", about {clock_text(left)} more"
        return Text(f"{clock_text(self._work.elapsed)}{more}")


class Work:
    """The work of a command: what it does, how much of it is done, and since when by a clock, s."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = clock()
        self._stopped = threading.Event()
        self._meter = Meter(self._show, clock)
        self._left: tuple[float, float] | None = None
        name, bar = TextColumn("{task.description}", markup=False), BarColumn(bar_width=WIDTH)
        self.line = ProgressLine(SpinnerColumn(), name, bar, Times(self), get_time=clock)
        self._task, self._stage = self.line.add_task("starting", total=None), "starting"
        # Draws the line at once; called once, when the first stage after reading begins.
        self.draw: Callable[[], object] = lambda: None
        self.when_read: Callable[[], object] | None = None

    @property
    def elapsed(self) -> float:
        """Time since the work began, s."""
        return self._clock() - self._began

    @property
    def left(self) -> float | None:
        """Time until its end, s; None where that isn't known."""
        if self._left is None:
            return None
        at, left = self._left
        return max(left - (self._clock() - at), 0.0)

    def step(self, stage: str, done: int, total: int) -> None:
        """Say what is being done, and how much of it is done; `KeyboardInterrupt` ends abandoned work."""
        if self._stopped.is_set():
            raise KeyboardInterrupt
        self._meter(stage, done, total)

    def _show(self, report: ProgressReport) -> None:
        self._left = None if report.left is None else (self._clock(), report.left)
        total = None if report.share is None else 1.0
        self.line.update(self._task, description=report.stage, total=total, completed=report.share or 0.0)
        if report.stage != self._stage:
            self._stage = report.stage
            if self.when_read is not None and report.id != STAGES["read"].id:
                self.when_read()
                self.when_read = None
            logger.info("%s", report.stage)
            # At once: a library may hold Python's lock for seconds, and the line would show the stage before.
            self.draw()

    def run(self, work: Callable[[Progress], T]) -> T:
        """Do work in a thread, and return or raise what it does; it takes a progress, and writes no file.

        After Ctrl-C, a `KeyboardInterrupt`, it may still run: `leave_if_working`.
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


def clock_text(seconds: float) -> str:
    """Format a time as hours, also above 24, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"


@contextmanager
def shown_work(console: Console, *, hidden: bool = False) -> Iterator[Work]:
    """Begin work, and show on a terminal what it does until the block ends; elsewhere nothing is printed.

    Nothing else may print meanwhile, except on the console. `hidden` work isn't shown on a terminal either.
    """
    work = Work()
    if hidden or console.quiet or not console.is_interactive:
        yield work
        return
    # Output isn't redirected: results may go to a file.
    with Live(
        work.line,
        console=console,
        refresh_per_second=PICTURES,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    ) as line:
        work.draw = line.refresh
        yield work


def leave_if_working(code: int) -> None:
    """End the process at once, with an exit code, if work still runs: nothing stops a compiled step."""
    if any(thread.name == NAME for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
