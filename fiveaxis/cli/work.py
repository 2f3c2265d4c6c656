"""Long work behind a verb: in a thread, so that Ctrl-C ends it at once, with bars that tell how far it is.

Python looks at a Ctrl-C in the main thread, and there only between two of its own steps: a compiled search,
or IPOPT, of half a minute would be waited for. So the main thread does nothing but wait, and the work, which
writes no file, is left behind where it doesn't come to an end by itself.
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
# s: how often the main thread looks up, which Windows needs to hear a Ctrl-C; how long work may take to end.
LOOK = 0.2
GRACE = 0.5

# Where stages lie in the whole, as shares of it; others are steps on the way and move no total.
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
    shown : draws them
    """

    def __init__(self, shown: Progress) -> None:
        self.shown = shown
        self.stopped = threading.Event()
        self._bars: dict[str, TaskID] = {}
        self._whole = shown.add_task(TOTAL, total=100)
        self._reached = 0.0

    def step(self, stage: str, done: int, total: int) -> None:
        """Tell how far a stage is.

        Raises
        ------
        KeyboardInterrupt
            The work was given up: what tells its steps ends here.
        """
        if self.stopped.is_set():
            raise KeyboardInterrupt
        if stage not in self._bars:
            logger.info("%s", stage)
            self._bars[stage] = self.shown.add_task(stage, total=total)
        self.shown.update(self._bars[stage], completed=done, total=total)
        self._reached = max(self._reached, overall(stage, done, total))
        self.shown.update(self._whole, completed=100.0 * self._reached)


def overall(stage: str, done: int, total: int) -> float:
    """Give the share of the whole that is done when a stage is so far; 0 for a stage that tells nothing."""
    low, high = SHARES.get(stage, (0.0, 0.0))
    return low + (high - low) * min(1.0, done / max(total, 1))


def work_with_bars(work: Callable[[Step], T], console: Console) -> T:
    """Do work that tells its steps, with bars on a terminal.

    Parameters
    ----------
    work : called in a thread with what takes a stage's name, steps done and steps in all; writes no file

    Returns
    -------
    What the work gives.

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
    with Progress(*columns, console=console, disable=not console.is_terminal or console.quiet) as shown:
        bars = Bars(shown)
        return _await(_begin(lambda: work(bars.step)), bars.stopped)


def work_aside(work: Callable[[], T]) -> T:
    """Do work that tells no steps.

    Parameters
    ----------
    work : called in a thread; writes no file

    Returns
    -------
    What the work gives.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C. The work may still run: `leave_if_working`.
    Exception
        What the work raises.
    """
    return _await(_begin(work), threading.Event())


def _await(future: Future[T], stopped: threading.Event) -> T:
    try:
        while not future.done():
            wait([future], LOOK)
    except KeyboardInterrupt:
        stopped.set()
        wait([future], GRACE)
        raise
    return future.result()


def _begin(work: Callable[[], T]) -> Future[T]:
    future: Future[T] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as fault:  # a Ctrl-C that the work itself noticed is an answer too
            future.set_exception(fault)

    # A daemon: the command may end without it.
    threading.Thread(target=run, name=NAME, daemon=True).start()
    return future


def leave_if_working(code: int) -> None:
    """End the process at once where work still runs, as nothing stops a compiled step.

    Parameters
    ----------
    code : of the exit
    """
    if any(thread.name == NAME for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
