"""Run one job on a worker, from its file to its folder. Local workers load this module at their start."""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import time
from collections.abc import Mapping
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
from fiveaxis.job.loading import Progress

# s between two messages of one stage, quick enough for a live table.
PAUSE = 0.5
# Libraries that would otherwise use every core in each worker.
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def dask_setup(_worker: object) -> None:
    """Leave Ctrl-C, which a terminal sends to workers too, to the command that started them; end quickly."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Freeing all that the libraries hold takes seconds, for which the batch would wait.
    atexit.register(os._exit, 0)


def run_remotely(task: Task, folder: str, version: str, topic: str) -> dict[str, Any]:
    """Run a task on a dask worker, and send its progress as events of a topic.

    Returns
    -------
    Its row, as plain data.
    """
    if version != __version__:
        message = f"a worker has fiveaxis {__version__} and this command {version}; install one everywhere"
        return replace(task.blank, message=message).as_dict()
    return run_task(task, Path(folder), _Reporter(task.name, topic)).as_dict()


def run_task(task: Task, folder: Path, progress: Progress) -> Row:
    """Run a task; either all of its results are in its folder, or none, and the row says why.

    Parameters
    ----------
    task : what to do
    folder : of the batch; the task's own is inside it
    progress : takes a stage's name, steps done and steps in all
    """
    digest = ""
    try:
        job, digest = task.load()
        own = own_folder(folder, task.name)
        outcome = run_job(job, progress)
        progress("write", 0, 1)
        row = row_of(task.blank, outcome, write_outcome(outcome, own))
    except Exception as fault:  # a fault of one job, of whatever kind, mustn't end the others
        row = row_of_fault(task.blank, fault)
        if row.status is not Status.WRONG_INPUT:
            remove_program(folder, task.name)
    # If the inputs changed during the run, the result belongs to neither: without a hash the job runs again.
    return replace(row, digest=digest if digest and _digest(task) == digest else "")


def _digest(task: Task) -> str:
    try:
        return task.load()[1]
    except FiveAxisError:
        return ""


def remove_program(folder: Path, name: str) -> None:
    """Remove the NC program of an earlier run, which would look like the result of the failed job."""
    with suppress(OSError, SettingError):  # if it stays, the row still says that the job failed
        for program in own_folder(folder, name).glob("program.*"):
            program.unlink()


class _Reporter:
    """Sends a task's progress to the batch, not too often."""

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


def remove_temporary_folders(folder: Path, names: list[str]) -> None:
    """Remove the temporary folders of workers that were killed while they wrote."""
    folders = {folder, *(folder / name for name in names), *((folder / name).parent for name in names)}
    for parent in folders:
        for left in parent.glob(".fiveaxis-*"):
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
