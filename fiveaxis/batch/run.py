"""Run a batch: plan the jobs, distribute them, record their results."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis import __version__
from fiveaxis.batch.cluster import count_cores, open_client, require_distributed, require_scheduler
from fiveaxis.batch.comparison import Comparison, write_comparison
from fiveaxis.batch.ledger import Ledger, locked
from fiveaxis.batch.record import Row, Status, worst
from fiveaxis.batch.tasks import Planned, Task, plan_tasks
from fiveaxis.batch.worker import remove_temporary_folders, run_remotely
from fiveaxis.errors import LostScheduler, SettingError
from fiveaxis.job import require_folder

if TYPE_CHECKING:
    from distributed import Client, Future


logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Event:
    """A change in the state of a job.

    Parameters
    ----------
    name : of the job
    state : ``waiting``, ``running`` or ``done``
    row : its result, when it is done
    again : whether an earlier batch had done it
    stage, share : its progress, the share between 0 and 1
    pid : of the worker's process
    """

    name: str
    state: str
    row: Row | None = None
    again: bool = False
    stage: str = ""
    share: float = 0.0
    pid: int | None = None


@dataclass(frozen=True)
class Batch:
    """The results of the jobs of a batch.

    Parameters
    ----------
    rows : sorted by name
    resumed : names of the jobs that an earlier batch had done
    comparisons : one per sweep
    folder : of the results
    """

    rows: tuple[Row, ...]
    resumed: frozenset[str]
    comparisons: tuple[Comparison, ...]
    folder: Path

    @property
    def exit_code(self) -> int:
        """Exit code of the worst job."""
        return worst(self.rows).exit_code

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain data for JSON, the same whether jobs ran now or earlier."""
        return {
            "jobs": [row.as_dict() for row in self.rows],
            "counts": {str(s): sum(row.status is s for row in self.rows) for s in Status},
            "sweeps": [comparison.as_dict() for comparison in self.comparisons],
        }


Listener = Callable[[Event], None]


def run_batch(
    files: Iterable[str | Path],
    folder: str | Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    tell: Listener | None = None,
) -> Batch:
    """Run many jobs, each into its own folder, and keep one table of their results.

    A job that fails doesn't affect the others, and a job whose worker dies runs again. Results are kept even
    if this call is interrupted: the next call runs only jobs that are missing, were broken, or have other
    inputs. The rows don't depend on the number of workers. In a script, guard the call with
    ``if __name__ == "__main__":``, since workers are separate processes.

    Parameters
    ----------
    files : job files; one with a ``[sweep]`` stands for many jobs
    folder : for the results: ``results.csv``, ``results.jsonl`` and a folder for each job
    scheduler : address of a dask scheduler whose workers see the same folders; by default workers are
        started on this computer
    workers : number of local workers; by default one per core
    tell : called with each event, never by two threads at once

    Raises
    ------
    MissingDependency
        dask.distributed isn't installed.
    SettingError
        Two jobs of one name, a folder that can't be written or in which another batch is running, a scheduler
        that doesn't answer.
    LostScheduler
        The connection to the scheduler is lost while jobs run; finished results are kept.
    """
    if workers is not None and workers < 1:
        raise SettingError(f"workers is {workers}; it must be at least 1")
    require_distributed()
    planned = plan_tasks(map(Path, files))
    require_folder(Path(folder))
    if scheduler is not None:
        require_scheduler(scheduler)
    results = Path(folder).absolute()
    with locked(results):
        ledger = Ledger(results)
        done = {n: row for n, digest in planned.digests.items() if (row := ledger.done(n, digest))}
        relay = _Relay(tell)
        for name in [*planned.tasks, *(row.name for row in planned.faults)]:
            relay(Event(name, "waiting"))
        for row in done.values():
            relay(Event(row.name, "done", row, again=True))
        for row in planned.faults:
            relay(Event(row.name, "done", row))
        # A sweep that can be read again has rows for its variants, and none of its own.
        ledger.forget_refused(planned.sweeps)
        ledger.record(*done.values(), *planned.faults)
        missing = [task for name, task in planned.tasks.items() if name not in done]
        figures = len(done), len(planned.faults), len(missing)
        logger.info("%d jobs done before, %d that can't be read, %d to run", *figures)
        remove_temporary_folders(results, [task.name for task in missing])
        try:
            _run(missing, ledger, scheduler, workers, relay)
        finally:
            remove_temporary_folders(results, [task.name for task in missing])
        return _finish(planned, ledger, frozenset(done))


def _finish(planned: Planned, ledger: Ledger, resumed: frozenset[str]) -> Batch:
    """Collect the rows of the batch, and compare the variants of each sweep."""
    comparisons = [
        write_comparison(name, [ledger.rows[variant] for variant in variants], ledger.folder)
        for name, variants in planned.sweeps.items()
    ]
    names = sorted([*planned.tasks, *(row.name for row in planned.faults)])
    rows = tuple(ledger.rows[name] for name in names)
    return Batch(rows, resumed, tuple(comparisons), ledger.folder)


def _run(
    tasks: Sequence[Task], ledger: Ledger, scheduler: str | None, workers: int | None, listener: Listener
) -> None:
    if not tasks:
        return
    count = min(workers or count_cores(), len(tasks))
    with open_client(scheduler, count) as client, _progress(client, listener) as topic:
        for row in _results(client, tasks, ledger.folder, topic):
            ledger.record(row)
            listener(Event(row.name, "done", row))


def _results(client: Client, tasks: Sequence[Task], folder: Path, topic: str) -> Iterator[Row]:
    """Submit the tasks, and yield the row of each as soon as it is done.

    Raises
    ------
    LostScheduler
        The connection to the scheduler is lost.
    """
    from distributed import as_completed

    futures = {
        client.submit(
            run_remotely, t, str(folder), __version__, topic, key=f"{topic}/{t.name}", pure=False
        ): t
        for t in tasks
    }
    try:
        for future in as_completed(list(futures), loop=client.loop):
            yield _row(future, futures[future])
            future.release()
    finally:
        for future in futures:
            future.cancel()


def _row(future: Future, task: Task) -> Row:
    if future.status == "finished":
        return Row.from_dict(future.result())
    if future.status == "cancelled":
        raise LostScheduler(
            "lost the scheduler, or somebody cancelled the jobs; check that it runs (`dask scheduler`, `dask "
            "worker`). Finished jobs are kept: the same command does the rest"
        )
    fault = future.exception()
    name = type(fault).__name__
    message = "its workers died repeatedly" if name == "KilledWorker" else f"{name}: {fault}"
    return replace(task.blank, message=message)


@contextmanager
def _progress(client: Client, listener: Listener) -> Iterator[str]:
    """Pass the workers' progress to a listener; yield the topic under which they send it."""
    topic = f"fiveaxis-{uuid.uuid4().hex}"  # a scheduler may serve several batches at once

    def receive(event: tuple[float, Mapping[str, Any]]) -> None:
        message = event[1]
        share = message["done"] / max(message["total"], 1)
        listener(Event(message["name"], "running", stage=message["stage"], share=share, pid=message["pid"]))

    client.subscribe_topic(topic, receive)
    try:
        yield topic
    finally:
        client.unsubscribe_topic(topic)


class _Relay:
    """Passes events on one at a time, and drops late messages of workers about a job that is done."""

    def __init__(self, listener: Listener | None) -> None:
        self._listener, self._lock = listener, threading.Lock()
        self._done: set[str] = set()

    def __call__(self, event: Event) -> None:
        with self._lock:
            if self._listener is None or event.name in self._done:
                return
            if event.state == "done":
                self._done.add(event.name)
            self._listener(event)
