"""Workers on this computer: processes with one job at a time, and a supervisor that replaces those that die.

A worker is reached through its own pipes alone, so that no other process can send it anything. Whatever it
is doing when it dies, its end is news like any other: nothing here waits for one worker.
"""

from __future__ import annotations

import json
import logging
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum, auto
from pathlib import Path
from typing import Any, BinaryIO, cast

import psutil

from fiveaxis.batch.events import Event, Listener
from fiveaxis.batch.losses import Losses
from fiveaxis.batch.record import Row, bounded
from fiveaxis.batch.tasks import Task
from fiveaxis.batch.worker import remove_program
from fiveaxis.errors import LostWorkers

logger = logging.getLogger(__name__)

# What a worker process runs. Linux kills it with the command (PR_SET_PDEATHSIG), within a compiled step too;
# elsewhere it ends when it sees that its stdin is closed. That comes first, as the imports take seconds.
ENTRY = """
import ctypes, os, signal, sys
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
    if os.getppid() != int(sys.argv[1]):
        sys.exit()
from fiveaxis.batch.worker import main
main()
"""
# Libraries that would otherwise use every core in each worker.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
# s between two looks at limits; s that a worker may take to start, or to take a job up, on a busy computer,
# and to end where the system doesn't let it go at once.
LOOK, LONGEST_START, LONGEST_END = 0.2, 300.0, 10.0
# Bytes of a worker's output that are kept, and how many of its last lines a message has.
PRINTED, LAST_LINES = 4000, 5
# Starts in a row that fail before the batch ends: of themselves, and for any reason; pauses in between grow
# up to the longest, in s.
MOST_FAULTS, MOST_FAILURES, PAUSE, LONGEST_PAUSE = 3, 50, 0.1, 5.0
# By these a process ends because somebody wants it to; by others, or of itself, because of a fault.
OUTSIDE = {getattr(signal, name, None) for name in ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP")}


@dataclass(frozen=True)
class Limits:
    """What a job may take.

    Parameters
    ----------
    timeout : s
    memory : MB that stay in its worker's memory; each job then has a fresh worker
    """

    timeout: float | None = None
    memory: float | None = None


def run_on_pool(
    tasks: Sequence[Task], folder: Path, workers: int, limits: Limits, tell: Listener
) -> Generator[Row]:
    """Run tasks on processes of this computer, and yield the row of each as soon as it is done.

    Parameters
    ----------
    tasks : to run
    folder : of the batch
    workers : number of processes
    limits : of each job
    tell : called with each event

    Raises
    ------
    LostWorkers
        No worker starts.
    """
    pool = _Pool(tasks, folder, workers, limits, tell)
    try:
        yield from pool.rows()
    finally:
        pool.end()


class _State(Enum):
    """What a worker does; it has a task where one is given to it, and from when it works on it."""

    STARTING = auto()
    IDLE = auto()
    GIVEN = auto()
    WORKING = auto()
    ENDING = auto()


class _Worker:
    """A process, and threads that pass on what it says and keep the end of what it prints."""

    def __init__(self, number: int, news: queue.SimpleQueue[_News]) -> None:
        self.number = number
        self.state, self.since = _State.STARTING, time.monotonic()
        self.task: Task | None = None
        self.excess = ""  # why its job is stopped
        self._news, self._printed = news, b""
        # The same modules as here, whatever lies in the folder in which the command was called.
        paths = os.pathsep.join(path for path in sys.path if path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", ENTRY, str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | THREADS | {"PYTHONPATH": paths},
            start_new_session=True,  # Ctrl-C in a terminal is for the command alone
        )
        # Each is a pipe, as asked for above.
        pipes = self._process.stdin, self._process.stdout, self._process.stderr
        self._tasks, self._messages, self._errors = cast("tuple[BinaryIO, BinaryIO, BinaryIO]", pipes)
        self._readers = [threading.Thread(target=work, daemon=True) for work in (self._hear, self._keep)]
        self._watch = threading.Thread(target=self._await_end, daemon=True)
        for thread in (*self._readers, self._watch):
            thread.start()

    def _hear(self) -> None:
        """Pass on its messages; kill it where none can follow, since no row would come of it."""
        # ValueError: no message, or the half of one
        with self._messages as stream, suppress(ValueError):
            for line in stream:
                self._news.put((self, json.loads(line)))
        self.kill()

    def _keep(self) -> None:
        with self._errors as stream:
            while printed := stream.read1(PRINTED):  # type: ignore[attr-defined]
                self._printed = (self._printed + printed)[-PRINTED:]

    def _await_end(self) -> None:
        self._process.wait()
        if sys.platform != "win32":
            with suppress(ProcessLookupError):  # processes that it had started; they hold its pipes open
                os.killpg(self.pid, signal.SIGKILL)
        for reader in self._readers:
            reader.join(1.0)  # for what it had said
        self._news.put((self, None))

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def seconds(self) -> float:
        """How long it has been in its state."""
        return time.monotonic() - self.since

    @property
    def memory(self) -> float:
        """Resident memory in MB."""
        try:
            return float(psutil.Process(self.pid).memory_info().rss) / 1e6
        except psutil.Error:  # it has just died
            return 0.0

    @property
    def crashed(self) -> bool:
        """Whether it died of a fault, not by somebody's will."""
        return -self._process.returncode not in OUTSIDE

    @property
    def end(self) -> str:
        """How it died."""
        code = self._process.returncode
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"exit code {code}"

    @property
    def last_lines(self) -> str:
        """What it printed last."""
        lines = [line for line in self._printed.decode(errors="replace").splitlines() if line.strip()]
        return bounded(
            f"its last lines: {' | '.join(lines[-LAST_LINES:])}" if lines else "it printed nothing"
        )

    def __str__(self) -> str:
        return f"worker {self.number} (pid {self.pid})"

    def enter(self, state: _State) -> None:
        """Change its state."""
        self.state, self.since = state, time.monotonic()
        if state is _State.IDLE:
            self.task = None

    def give(self, task: Task, folder: Path) -> None:
        """Give it a task; if it has died, that is told as news."""
        self.enter(_State.GIVEN)
        self.task = task
        with suppress(OSError):
            pickle.dump((task, folder), self._tasks)
            self._tasks.flush()

    def kill(self) -> None:
        """Kill it: nothing else stops a compiled step, and it writes files whole or not at all."""
        self._process.kill()

    def stop(self, why: str) -> None:
        """Kill it because of its job."""
        self.excess = why
        self.kill()

    def close(self) -> None:
        """Wait until it is gone; its readers close the other pipes when nobody can write into them."""
        self._watch.join(LONGEST_END)
        with suppress(OSError):  # what it hadn't read any more
            self._tasks.close()


# A worker and what it says; None when it has died.
_News = tuple[_Worker, Mapping[str, Any] | None]


class _Pool:
    """The supervisor: a loop over what workers say, with a look at their limits now and then."""

    def __init__(
        self, tasks: Sequence[Task], folder: Path, workers: int, limits: Limits, tell: Listener
    ) -> None:
        self._waiting, self._left = deque(tasks), len(tasks)
        self._folder, self._limits, self._tell = folder, limits, tell
        self._seats: dict[int, _Worker | None] = dict.fromkeys(range(1, workers + 1))
        self._news: queue.SimpleQueue[_News] = queue.SimpleQueue()
        self._losses = Losses()
        self._faults = self._failures = 0  # starts in a row that failed of themselves, and for any reason
        self._next_start = 0.0

    @property
    def _crew(self) -> list[_Worker]:
        return [worker for worker in self._seats.values() if worker is not None]

    def rows(self) -> Iterator[Row]:
        """Yield the row of each task as soon as it is known."""
        while self._left:
            self._fill_seats()
            self._give_tasks()
            row = self._await_news()
            if row is not None:
                self._left -= 1
                yield row
            for worker in self._crew:
                self._stop_excess(worker)

    def end(self) -> None:
        """Kill the workers, and wait until they are gone."""
        for worker in self._crew:
            worker.kill()
        for worker in self._crew:
            worker.close()

    def _fill_seats(self) -> None:
        """Start workers while there are tasks for them."""
        for number, worker in self._seats.items():
            if worker is None and len(self._crew) < self._left and time.monotonic() >= self._next_start:
                try:
                    self._seats[number] = _Worker(number, self._news)
                except (OSError, RuntimeError) as fault:  # no memory, too many processes or threads
                    self._fail_to_start(str(fault), crashed=False)

    def _give_tasks(self) -> None:
        for worker in self._crew:
            if worker.state is _State.IDLE and self._waiting:
                task = self._waiting.popleft()
                logger.info("%s takes %s", worker, task.name)
                worker.give(task, self._folder)

    def _await_news(self) -> Row | None:
        """Wait for news, not longer than until the next look; return the row that there may be in it."""
        try:
            worker, message = self._news.get(timeout=LOOK)
        except queue.Empty:
            return None
        if message is None:
            return self._bury(worker)
        if "ready" in message:
            self._losses.survive(worker.seconds)
            self._faults = self._failures = 0
            worker.enter(_State.IDLE)
        elif "row" in message:
            row = Row.from_dict(message["row"])
            logger.info("%s has done %s", worker, row.name)
            self._losses.finish(row.name, worker.seconds)
            worker.enter(_State.IDLE)
            if self._limits.memory is not None:  # what it still holds would count against the next job
                worker.enter(_State.ENDING)
                worker.kill()
            return row
        elif worker.task is not None:
            if worker.state is _State.GIVEN:
                worker.enter(_State.WORKING)
            self._tell(Event.running(worker.task.name, **message, worker=str(worker.number), pid=worker.pid))
        return None

    def _bury(self, worker: _Worker) -> Row | None:
        """Do what the death of a worker asks for; return the row of a job that ends with it."""
        worker.close()
        self._seats[worker.number] = None
        if worker.task is None:
            if worker.state is _State.STARTING:
                self._losses.die(worker.seconds)
                logger.info("%s died at its start (%s)", worker, worker.end)
                self._fail_to_start(f"{worker.end}; {worker.last_lines}", crashed=worker.crashed)
            return None
        task = worker.task
        if worker.excess:
            return self._give_up(task, worker.excess)
        if worker.state is _State.GIVEN and not worker.crashed:
            self._losses.die(worker.seconds)
            self._waiting.appendleft(task)
        elif self._losses.blame(task.name, worker.seconds, crashed=worker.crashed):
            kills = self._losses.count(task.name)
            return self._give_up(
                task, f"its workers died {kills} times, the last one by {worker.end}; {worker.last_lines}"
            )
        else:
            # Behind the others: if it does kill its workers, they come first.
            self._waiting.append(task)
        logger.warning("%s died at %s (%s); the job runs again", worker, task.name, worker.end)
        self._tell(Event(task.name, "waiting"))
        return None

    def _give_up(self, task: Task, message: str) -> Row:
        remove_program(self._folder, task.name)
        return replace(task.blank, message=message)

    def _fail_to_start(self, message: str, *, crashed: bool) -> None:
        self._failures += 1
        self._faults = self._faults + 1 if crashed else 0
        self._next_start = time.monotonic() + min(PAUSE * 2 ** (self._failures - 1), LONGEST_PAUSE)
        if self._faults >= MOST_FAULTS or self._failures >= MOST_FAILURES:
            raise LostWorkers(
                f"workers don't start on this computer (the last one: {message}). Finished jobs are kept: "
                "the same command does the rest"
            )

    def _stop_excess(self, worker: _Worker) -> None:
        """Kill a worker that is over a limit."""
        timeout, memory = self._limits.timeout, self._limits.memory
        if worker.excess or worker.state in (_State.IDLE, _State.ENDING):
            return
        if worker.state is not _State.WORKING:
            if worker.seconds > LONGEST_START:
                worker.kill()
        elif timeout is not None and worker.seconds > timeout:
            worker.stop(f"ran longer than {timeout:g} s and was stopped; allow more (--job-timeout)")
        elif memory is not None and (taken := worker.memory) > memory:
            worker.stop(f"took {taken:.0f} MB and was stopped; allow more than {memory:g} MB (--job-memory)")
