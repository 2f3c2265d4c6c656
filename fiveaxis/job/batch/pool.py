"""Run jobs on processes of this computer, each with one job at a time, and replace processes that die.

A worker is reached through its own pipes alone: no other process can send it anything, and one that dies in
the middle of a message spoils no other's.
"""

from __future__ import annotations

import json
import logging
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import defaultdict, deque
from collections.abc import Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import psutil

from fiveaxis.base import LostWorkers
from fiveaxis.job.batch.record import Event, Listener, Row, bounded
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.job.batch.worker import FAULT, remove_program

# Workers that a job may lose before it counts as their killer, and the largest probability of chance then.
MOST_KILLS, BY_CHANCE = 3, 1e-6
logger = logging.getLogger(__name__)

# What a worker process runs. Linux kills it with the command (PR_SET_PDEATHSIG), within a compiled step too;
# elsewhere it ends when it sees that its stdin is closed. That comes first, as the imports take seconds.
ENTRY = f"""
import ctypes, os, signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal is for the command alone
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
    if os.getppid() != int(sys.argv[1]):
        sys.exit()
if sys.platform == "win32":
    def leave(*fault):
        sys.__excepthook__(*fault)
        os._exit({FAULT})
    sys.excepthook = leave
from fiveaxis.job.batch.worker import main
main()
"""
# Libraries that would otherwise use every core in each worker.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
# s between two checks of limits; s that a worker may take until its job reports first, on a busy computer; s
# to wait for the end of one that the system doesn't let go at once.
INTERVAL, LONGEST_START, LONGEST_END = 0.2, 300.0, 10.0
# Lines that a worker printed last in a message about its death.
LAST_LINES = 5
# Starts in a row that may fail through a fault, and for any reason; the pauses in between grow, in s.
MOST_FAULTS, MOST_FAILURES, PAUSE, LONGEST_PAUSE = 3, 50, 0.1, 5.0
# By these signals somebody ends a process; by others, or of itself, it ends through a fault. On Windows these
# are exit codes: of the task manager, of `os.kill`, and of a console that is closed.
OUTSIDE = {getattr(signal, name, None) for name in ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP")}
OUTSIDE_ON_WINDOWS = {1, 15, 0xC000013A}
# On Windows, Ctrl-C goes to every process of a group.
OWN_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


class Losses:
    """The workers that each job has lost, and how often workers die that no job can have killed.

    A signal doesn't say who sent it: the system kills a worker whose job uses up the memory just as an
    operator does. So a job counts as the killer of its workers after `MOST_KILLS` of them, unless as many are
    likely to die by chance, which is how workers die that are starting, or whose job finishes on another one.
    """

    def __init__(self) -> None:
        self._lives, self._seconds, self._deaths = 0, 0.0, 0
        self._lost: dict[str, list[tuple[float, bool]]] = defaultdict(list)

    def survive(self, seconds: float) -> None:
        """Count a start, or a job, that came to its end."""
        self._lives += 1
        self._seconds += seconds

    def die(self, seconds: float) -> None:
        """Count a worker that no job can have killed."""
        self.survive(seconds)
        self._deaths += 1

    def finish(self, name: str, seconds: float) -> None:
        """Count a job that came to its end: it can't have killed the workers that it lost before."""
        self.survive(seconds)
        for lost, _ in self._lost.pop(name, []):
            self.die(lost)

    def lose(self, name: str, seconds: float, *, crashed: bool) -> int:
        """Count a worker that died after so many seconds of a job; one that crashed did so by no chance.

        Returns
        -------
        How many workers the job has killed; 0 while they may have died by chance.
        """
        lost = self._lost[name]
        lost.append((seconds, crashed))
        chance = math.prod(0.0 if crash else self._probability(lived) for lived, crash in lost)
        return len(lost) if len(lost) >= MOST_KILLS and chance < BY_CHANCE else 0

    def _probability(self, seconds: float) -> float:
        """Compute how likely chance ends a life: longer ones more, none less than one of mean length."""
        if not self._deaths:
            return 0.0
        mean = max(self._seconds / self._lives, 1e-3)
        return -math.expm1(-self._deaths / self._lives * max(1.0, seconds / mean))


@dataclass(frozen=True)
class Limits:
    """What a job may take: s, and MB of its worker's memory, for which each job has a fresh worker."""

    timeout: float | None = None
    memory: float | None = None


def run_on_pool(
    tasks: Sequence[QueuedJob], folder: Path, workers: int, limits: Limits, tell: Listener
) -> Generator[Row]:
    """Run tasks on processes of this computer, and yield the row of each as soon as it is done.

    `LostWorkers` if no worker starts.
    """
    pool = _Pool(tasks, folder, limits, tell)
    try:
        for _ in tasks:
            while (row := pool.advance(workers)) is None:
                pass
            yield row
    finally:
        pool.end()


def ended_by_others(code: int, system: str = sys.platform) -> bool:
    """Tell by its exit code whether somebody ended a process; else it ended through a fault, or of itself."""
    return code in OUTSIDE_ON_WINDOWS if system == "win32" else -code in OUTSIDE


class _Worker:
    """A process that runs one job at a time, and two threads that read what it sends and prints.

    Attributes
    ----------
    task : its job, if it has one
    has_reported : whether the job has reported, so that the worker had started by then
    excess : the limit over which the job was stopped, in words
    """

    def __init__(self, number: int, news: queue.SimpleQueue[_News]) -> None:
        self.number, self._news = number, news
        self.task: QueuedJob | None = None
        self.has_reported, self.excess = False, ""
        self._since = time.monotonic()
        self._last_lines: deque[bytes] = deque(maxlen=LAST_LINES)
        # The same modules as here, whatever lies in the folder in which the command was called.
        paths = os.pathsep.join(path for path in sys.path if path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", ENTRY, str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | THREADS | {"PYTHONPATH": paths},
            creationflags=OWN_GROUP,
        )
        pipes: Any = self._process.stdin, self._process.stdout, self._process.stderr
        self._tasks: BinaryIO
        self._messages: BinaryIO
        self._errors: BinaryIO
        self._tasks, self._messages, self._errors = pipes
        readers = self._read_messages, self._read_errors
        self._readers = [threading.Thread(target=reader, daemon=True) for reader in readers]
        for reader in self._readers:
            reader.start()

    def _read_messages(self) -> None:
        with self._messages as stream, suppress(ValueError):  # half a message, or none
            for line in stream:
                self._news.put((self, json.loads(line)))
        self.kill()
        self._process.wait()
        self._news.put((self, None))

    def _read_errors(self) -> None:
        with self._errors as stream:
            self._last_lines.extend(line for line in stream if line.strip())

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def seconds(self) -> float:
        """How long its job has been running or, before it has reported, starting."""
        return time.monotonic() - self._since

    @property
    def _memory(self) -> float:
        try:
            return float(psutil.Process(self.pid).memory_info().rss) / 1e6
        except psutil.Error:  # it has just died
            return 0.0

    @property
    def crashed(self) -> bool:
        """Whether it died through a fault; else somebody killed it."""
        return not ended_by_others(self._process.returncode)

    @property
    def last_words(self) -> str:
        """How it died, and what it printed last."""
        code = self._process.returncode
        names = {-number: number.name for number in signal.Signals}
        lines = " | ".join(line.decode(errors="replace").strip() for line in self._last_lines)
        printed = bounded(f"its last lines: {lines}" if lines else "it printed nothing")
        return f"{names.get(code, f'exit code {code}')}; {printed}"

    def __str__(self) -> str:
        return f"worker {self.number} (pid {self.pid})"

    def give(self, task: QueuedJob, folder: Path) -> None:
        """Give it a task; if it has died, that is in the news."""
        self.task, self.has_reported, self._since = task, False, time.monotonic()
        self.excess = ""  # of a job that finished just before it was stopped
        with suppress(OSError):
            pickle.dump((task, folder), self._tasks)
            self._tasks.flush()

    def report(self) -> None:
        """Note that its job has reported."""
        self.has_reported, self._since = True, time.monotonic()

    def check(self, limits: Limits) -> None:
        """Kill it if its job is over a limit, or if it doesn't start."""
        timeout, memory = limits.timeout, limits.memory
        if self.task is None or self.excess:
            return
        if not self.has_reported:
            if self.seconds > LONGEST_START:
                self.kill()
        elif timeout is not None and self.seconds > timeout:
            self._stop(f"ran longer than {timeout:g} s and was stopped; allow more (--job-timeout)")
        elif memory is not None and (taken := self._memory) > memory:
            self._stop(f"took {taken:.0f} MB and was stopped; allow more than {memory:g} MB (--job-memory)")

    def _stop(self, excess: str) -> None:
        self.excess = excess
        self.kill()

    def kill(self) -> None:
        """Kill it: nothing else stops a compiled step, and it writes files whole or not at all."""
        self._process.kill()

    def end(self) -> None:
        """Kill it, and wait until it is gone; the readers close their pipes."""
        self.kill()
        for reader in self._readers:
            reader.join(LONGEST_END)
        with suppress(OSError):  # what it hadn't read any more
            self._tasks.close()


# A worker and what it sends; None when it has died.
_News = tuple[_Worker, Mapping[str, Any] | None]


class _Pool:
    """The workers, the tasks that wait, and what is known of workers that died."""

    def __init__(self, tasks: Sequence[QueuedJob], folder: Path, limits: Limits, tell: Listener) -> None:
        self._waiting, self._folder, self._limits, self._tell = deque(tasks), folder, limits, tell
        self._workers: dict[int, _Worker] = {}
        self._news: queue.SimpleQueue[_News] = queue.SimpleQueue()
        self._losses = Losses()
        self._faults = self._failures = 0  # starts in a row that failed through a fault, and for any reason
        self._next_start = 0.0

    def advance(self, workers: int) -> Row | None:
        """Give out tasks, wait for news, and check the limits; return the row that the news brought."""
        for number in range(1, workers + 1):
            if self._waiting and (free := self._free_worker(number)):
                task = self._waiting.popleft()
                logger.info("%s takes %s", free, task.name)
                free.give(task, self._folder)
        row = None
        with suppress(queue.Empty):
            worker, message = self._news.get(timeout=INTERVAL)
            if message is None:
                row = self._lose(worker)
            elif worker.task is not None:
                row = self._receive(worker, worker.task, message)
        for worker in self._workers.values():
            worker.check(self._limits)
        return row

    def end(self) -> None:
        """Kill the workers, and wait until they are gone."""
        for worker in self._workers.values():
            worker.kill()
        for worker in self._workers.values():
            worker.end()

    def _free_worker(self, number: int) -> _Worker | None:
        """Return a worker, started if need be; None where it has a job, or can't be started now."""
        if number not in self._workers and time.monotonic() >= self._next_start:
            try:
                self._workers[number] = _Worker(number, self._news)
                logger.info("%s starts", self._workers[number])
            except (OSError, RuntimeError) as fault:  # no memory, too many processes or threads
                self._fail_to_start(str(fault), crashed=False)
        worker = self._workers.get(number)
        return None if worker is None or worker.task else worker

    def _receive(self, worker: _Worker, task: QueuedJob, message: Mapping[str, Any]) -> Row | None:
        """Pass on the progress of a job, or return its row."""
        if not worker.has_reported:
            self._losses.survive(worker.seconds)
            self._faults = self._failures = 0
            worker.report()
        if "row" not in message:
            self._tell(Event(task.name, "running", **message, worker=str(worker.number), pid=worker.pid))
            return None
        logger.info("%s has done %s", worker, task.name)
        self._losses.finish(task.name, worker.seconds)
        worker.task = None
        if self._limits.memory is not None:  # what it still holds would count against the next job
            self._workers.pop(worker.number).end()
        return Row.from_dict(message["row"])

    def _lose(self, worker: _Worker) -> Row | None:
        """Take a dead worker out; return the row of its job where that is broken, else it runs again."""
        worker.end()
        task, how = worker.task, worker.last_words
        if self._workers.get(worker.number) is worker:
            del self._workers[worker.number]
        if task is None:
            return None
        if worker.excess:
            return self._give_up(task, worker.excess)
        if not worker.has_reported:
            logger.info("%s died before it ran %s (%s)", worker, task.name, how)
            self._losses.die(worker.seconds)
            self._waiting.appendleft(task)
            self._fail_to_start(how, crashed=worker.crashed)
            return None
        kills = self._losses.lose(task.name, worker.seconds, crashed=worker.crashed)
        if kills:
            return self._give_up(task, f"its workers died {kills} times, the last one by {how}")
        logger.warning("%s died at %s (%s); the job runs again", worker, task.name, how)
        self._tell(Event(task.name, "waiting"))
        self._waiting.append(task)  # behind the others: if it does kill its workers, they come first
        return None

    def _give_up(self, task: QueuedJob, message: str) -> Row:
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
