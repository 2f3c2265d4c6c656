"""What runs on a worker: one job, from its file to its folder. Local workers load this at their start."""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from fiveaxis import __version__
from fiveaxis.batch.ledger import own_folder
from fiveaxis.batch.record import Row, Status, row_of, row_of_fault
from fiveaxis.batch.tasks import Task
from fiveaxis.errors import FiveAxisError, SettingError
from fiveaxis.job import run_job, write_outcome

Tell = Callable[[str, int, int], None]

# s between two messages of one stage: enough for a table that people look at.
PAUSE = 0.5
# Libraries that would otherwise take every core for each worker.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def dask_setup(_worker: object) -> None:
    """Leave Ctrl-C to the command that started this worker, as a terminal sends it to both; end quickly."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Clearing away all that the libraries hold takes seconds, for which the batch would wait.
    atexit.register(os._exit, 0)


def run_remotely(task: Task, folder: str, version: str, topic: str) -> dict[str, Any]:
    """Run a task on a worker of dask, and tell its progress as events of a topic.

    Returns
    -------
    Its row, as plain data.
    """
    if version != __version__:
        message = f"a worker has fiveaxis {__version__} and this command {version}; install one everywhere"
        return replace(task.blank, message=message).as_dict()
    return run_task(task, Path(folder), _Reporter(task.name, topic)).as_dict()


def run_task(task: Task, folder: Path, tell: Tell | None = None) -> Row:
    """Run a task; its results are all in its folder, or none are and the row says why.

    Parameters
    ----------
    task : what to do
    folder : of the batch; the task's own is inside it
    tell : takes a stage's name, steps done and steps in all
    """
    digest = ""
    try:
        job, digest = task.load()
        own = own_folder(folder, task.name)
        outcome = run_job(job, tell)
        if tell is not None:
            tell("write", 0, 1)
        row = row_of(task.blank, outcome, write_outcome(outcome, own))
    except Exception as fault:  # one job's fault, of whatever kind, mustn't cost the others
        row = row_of_fault(task.blank, fault)
        if row.status is not Status.WRONG_INPUT:
            clear_program(folder, task.name)
    # What changed while it was at work isn't what was asked for: without a hash the job runs again.
    return replace(row, digest=digest if digest and _digest(task) == digest else "")


def _digest(task: Task) -> str:
    try:
        return task.load()[1]
    except FiveAxisError:
        return ""


def clear_program(folder: Path, name: str) -> None:
    """Take an earlier run's NC program away: beside a job that failed it would look like its result."""
    with suppress(OSError, SettingError):  # where it stays, the row still tells that the job failed
        for program in own_folder(folder, name).glob("program.*"):
            program.unlink()


class _Reporter:
    """Sends a task's progress to whoever listens, not too often."""

    def __init__(self, name: str, topic: str) -> None:
        from distributed import get_worker

        self._worker, self._topic, self._name = get_worker(), topic, name
        self._stage, self._sent = "", 0.0
        self("start", 0, 1)

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if stage == self._stage and now - self._sent < PAUSE:
            return
        self._stage, self._sent = stage, now
        message: Mapping[str, Any] = {
            "name": self._name,
            "stage": stage,
            "done": done,
            "total": total,
            "pid": os.getpid(),
        }
        self._worker.log_event(self._topic, message)


def sweep_up(folder: Path, names: list[str]) -> None:
    """Remove the temporary folders of workers that were killed while they wrote."""
    places = {folder, *(folder / name for name in names), *((folder / name).parent for name in names)}
    for place in places:
        for left in place.glob(".fiveaxis-*"):
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
