"""Events of a batch: its jobs wait, run and are done."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from fiveaxis.batch.record import Row


@dataclass(frozen=True)
class Event:
    """A change in the state of a job.

    Parameters
    ----------
    name : of the job
    state : ``waiting``, ``running`` or ``done``; a job whose worker died waits again
    row : its result, when it is done
    again : whether an earlier batch had done it
    stage, share : its progress, the share between 0 and 1
    worker, pid : where it runs: number of the worker or name of its computer, and its process
    """

    name: str
    state: str
    row: Row | None = None
    again: bool = False
    stage: str = ""
    share: float = 0.0
    worker: str = ""
    pid: int | None = None

    @classmethod
    def running(cls, name: str, stage: str, done: int, total: int, worker: str, pid: int) -> Event:
        """Make the event of a job's progress from steps done and steps in all."""
        return cls(name, "running", stage=stage, share=done / max(total, 1), worker=worker, pid=pid)


Listener = Callable[[Event], None]


class Relay:
    """Passes events on one at a time, without progress that arrives after the end of its job."""

    def __init__(self, listener: Listener | None) -> None:
        self._listener, self._lock = listener, threading.Lock()
        self._done: set[str] = set()

    def __call__(self, event: Event) -> None:
        """Pass on an event."""
        with self._lock:
            if self._listener is None or event.name in self._done:
                return
            if event.state == "done":
                self._done.add(event.name)
            self._listener(event)
