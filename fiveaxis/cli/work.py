"""Long work of a command: in a thread, so that Ctrl-C ends it at once, with progress bars.

Python handles Ctrl-C in the main thread, between two of its own steps, and so only after a compiled search or
IPOPT of half a minute. So the main thread only waits, and the work, which writes no file, is abandoned if it
doesn't end by itself.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

logger = logging.getLogger(__name__)

T = TypeVar("T")
Step = Callable[[str, int, int], None]

NAME = "fiveaxis-work"
# s: interval at which the main thread wakes up, which Windows needs for Ctrl-C; time for the work to end.
LOOK = 0.2
GRACE = 0.5

# Start and end of stages as shares of the whole; other stages don't move the total.
TOTAL = "total"
SHARES = {
    "plan": (0.0, 0.1),
    "setup": (0.0, 0.1),
    "refine": (0.1, 0.8),
    "front": (0.1, 0.8),
    "verify": (0.8, 1.0),
}


class Bars:
    """A bar for each stage, and a total that never falls.

    Parameters
    ----------
    display : draws them
    """

    def __init__(self, display: Progress) -> None:
        self.display = display
        self.stopped = threading.Event()
        self._bars: dict[str, TaskID] = {}
        self._whole = display.add_task(TOTAL, total=100)
        self._reached = 0.0

    def step(self, stage: str, done: int, total: int) -> None:
        """Update the bar of a stage.

        Raises
        ------
        KeyboardInterrupt
            The work was abandoned; this ends it.
        """
        if self.stopped.is_set():
            raise KeyboardInterrupt
        if stage not in self._bars:
            logger.info("%s", stage)
            self._bars[stage] = self.display.add_task(stage, total=total)
        self.display.update(self._bars[stage], completed=done, total=total)
        self._reached = max(self._reached, overall(stage, done, total))
        self.display.update(self._whole, completed=100.0 * self._reached)


def overall(stage: str, done: int, total: int) -> float:
    """Compute the share of the whole that is done; 0 for a stage that doesn't move the total."""
    low, high = SHARES.get(stage, (0.0, 0.0))
    return low + (high - low) * min(1.0, done / max(total, 1))


def work_with_bars(work: Callable[[Step], T], console: Console) -> T:
    """Do work that reports its steps, with progress bars on a terminal.

    Parameters
    ----------
    work : called in a thread with a function of a stage's name, steps done and steps in all; writes no file

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
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal or console.quiet) as display:
        bars = Bars(display)
        return _run(lambda: work(bars.step), bars.stopped)


def work_aside(work: Callable[[], T]) -> T:
    """Do work that doesn't report its steps; otherwise as `work_with_bars`."""
    return _run(work, threading.Event())


def _run(work: Callable[[], T], stopped: threading.Event) -> T:
    """Run work in a thread and wait for it; on Ctrl-C set `stopped`, and wait no longer than `GRACE`."""
    future: Future[T] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as fault:  # a Ctrl-C that the work itself noticed is a result too
            future.set_exception(fault)

    # A daemon: the command may end without it.
    threading.Thread(target=run, name=NAME, daemon=True).start()
    try:
        while not future.done():
            wait([future], LOOK)
    except KeyboardInterrupt:
        stopped.set()
        wait([future], GRACE)
        raise
    return future.result()


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
