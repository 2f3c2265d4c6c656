"""Run one job from its file to its folder, and be a process that does so for a batch."""

from __future__ import annotations

import faulthandler
import json
import os
import pickle
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

from fiveaxis.base import Meter, Progress, SettingError, resumable
from fiveaxis.job.batch.ledger import own_folder
from fiveaxis.job.batch.record import Row, Status, row_of, row_of_fault
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.job.digest import digest_job
from fiveaxis.job.results import withdraw_programs, write_outcome
from fiveaxis.job.setup_choice import run_task
from fiveaxis.job.task import resolve

# s between two messages of one stage, quick enough for a live table.
PAUSE = 0.5
# Exit code of a worker that ends through a fault: not 1, with which Windows ends what somebody kills.
FAULT = 70


def run_queued(task: QueuedJob, folder: Path, progress: Progress) -> Row:
    """Run a task; all of its results are in its folder, inside the batch's, or none, and the row says why."""
    digest = ""
    try:
        job, whole = task.read()
        resolved = resolve(job, progress)
        # Only now: what is hashed is what was read.
        digest = digest_job(job, whole)
        own = own_folder(folder, task.name)
        with resumable(digest, own) as checkpoint:
            outcome = run_task(resolved, progress, checkpoint)
            files = write_outcome(outcome, own, progress)
        row = row_of(task.blank, outcome, files)
    except Exception as fault:  # a fault of one job, of whatever kind, mustn't end the others
        row = row_of_fault(task.blank, fault)
        if row.status is not Status.WRONG_INPUT:
            remove_program(folder, task.name)
        digest = digest or _digest(task)
    # If the inputs changed during the run, the result belongs to neither: without a hash the job runs again.
    return replace(row, digest=digest if digest and _digest(task) == digest else "")


def _digest(task: QueuedJob) -> str:
    try:
        return task.digest()
    except Exception:  # what can't be read now isn't what was read
        return ""


def remove_program(folder: Path, name: str) -> None:
    """Remove the NC program of an earlier run, which would look like the result of the failed job."""
    with suppress(OSError, SettingError):  # if it stays, the row still says that the job failed
        withdraw_programs(own_folder(folder, name))


def throttled(tell: Callable[[str, float], None]) -> Progress:
    """Return a progress that tells each new stage of a job, and its share of the whole not too often."""
    meter = Meter(lambda report: tell(report.stage, report.share or 0.0), pause=PAUSE)
    meter("starting", 0, 1)
    return meter


def main() -> None:
    """Run the tasks from stdin, and write their progress and rows to stdout, until stdin is closed.

    A task is a pickle, a message a line of JSON: what comes from a worker is data and never code.
    """
    faulthandler.enable()
    send = _take_stdout()
    tasks: queue.SimpleQueue[tuple[QueuedJob, Path]] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(_take_stdin(), tasks), daemon=True).start()
    while True:
        task, folder = tasks.get()
        progress = throttled(lambda stage, share: send(stage=stage, share=share))
        send(row=run_queued(task, folder, progress).as_dict())


def _take_stdin() -> BinaryIO:
    """Keep stdin for tasks, and give libraries an empty one.

    On Windows, loading a library asks for the kind of stdin, and waits while a thread reads it (numpy#24290).
    """
    stream = os.fdopen(os.dup(0), "rb")
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    return stream


def _take_stdout() -> Callable[..., None]:
    """Keep stdout for messages, send what libraries print there to stderr; return what sends a message."""
    stream = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)

    def send(**message: Any) -> None:
        stream.write(json.dumps(message) + "\n")
        stream.flush()

    return send


def _receive(stream: BinaryIO, tasks: queue.SimpleQueue[tuple[QueuedJob, Path]]) -> None:
    """Receive tasks; end the process at once when the command that sends them has ended."""
    try:
        while True:
            tasks.put(pickle.load(stream))
    except BaseException as fault:
        os._exit(0 if isinstance(fault, EOFError) else FAULT)
