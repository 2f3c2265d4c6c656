"""A batch: plan, hand out, record."""

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
from fiveaxis.batch.worker import run_remotely, sweep_up
from fiveaxis.errors import LostScheduler, SettingError
from fiveaxis.job import require_folder

if TYPE_CHECKING:
    from distributed import Client, Future


logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Event:
    """Something that happened to a job.

    Parameters
    ----------
    name : of the job
    state : ``waiting``, ``running`` or ``done``
    row : what became of it, when it is done
    again : whether it was done by an earlier batch
    stage, share : how far it is, the share between 0 and 1
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
    """What became of the jobs that were asked for.

    Parameters
    ----------
    rows : by name
    resumed : names of those that an earlier batch had done
    comparisons : one a sweep
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
        """Return everything as plain data for JSON; the same whether jobs ran now or earlier."""
        return {
            "jobs": [row.as_dict() for row in self.rows],
            "counts": {str(s): sum(row.status is s for row in self.rows) for s in Status},
            "sweeps": [comparison.as_dict() for comparison in self.comparisons],
        }


Tell = Callable[[Event], None]


def run_batch(
    files: Iterable[str | Path],
    folder: str | Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    tell: Tell | None = None,
) -> Batch:
    """Run many jobs, each into its own folder, and keep one table of what they gave.

    A job that fails costs no other one, and one whose worker dies runs again. What is done stays done, even
    where this call is interrupted: the next one runs only what is missing, was broken, or has other inputs.
    The rows are the same whatever the number of workers. In a script, guard the call with
    ``if __name__ == "__main__":``, as workers are processes of their own.

    Parameters
    ----------
    files : job files; a ``[sweep]`` in one makes many jobs of it
    folder : for the results: ``results.csv``, ``results.jsonl`` and a folder for each job
    scheduler : address of a dask scheduler whose workers see the same folders; by default workers are
        started here
    workers : how many of them, by default one a core
    tell : called with what happens, never by two threads at once

    Raises
    ------
    MissingDependency
        dask.distributed isn't installed.
    SettingError
        Two jobs of one name, a folder that can't be written or that another batch works in, a scheduler that
        doesn't answer.
    LostScheduler
        The scheduler goes away while jobs run; what is done stays done.
    """
    if workers is not None and workers < 1:
        raise SettingError(f"workers is {workers}; it must be at least 1")
    require_distributed()
    planned = plan_tasks(map(Path, files))
    require_folder(Path(folder))
    if scheduler is not None:
        require_scheduler(scheduler)
    place = Path(folder).absolute()
    with locked(place):
        ledger = Ledger(place)
        done = {n: row for n, digest in planned.digests.items() if (row := ledger.done(n, digest))}
        listener = _Listener(tell)
        for name in [*planned.tasks, *(row.name for row in planned.faults)]:
            listener(Event(name, "waiting"))
        for row in done.values():
            listener(Event(row.name, "done", row, again=True))
        for row in planned.faults:
            listener(Event(row.name, "done", row))
        # A sweep that can be read again is its variants, and no job of its own.
        ledger.forget_refused(planned.sweeps)
        ledger.record(*done.values(), *planned.faults)
        missing = [task for name, task in planned.tasks.items() if name not in done]
        figures = len(done), len(planned.faults), len(missing)
        logger.info("%d jobs done before, %d that can't be read, %d to run", *figures)
        sweep_up(place, [task.name for task in missing])
        try:
            _run(missing, ledger, scheduler, workers, listener)
        finally:
            sweep_up(place, [task.name for task in missing])
        return _finish(planned, ledger, frozenset(done))


def _finish(planned: Planned, ledger: Ledger, resumed: frozenset[str]) -> Batch:
    """Put together what was asked for, and compare the variants of each sweep."""
    comparisons = [
        write_comparison(name, [ledger.rows[variant] for variant in variants], ledger.folder)
        for name, variants in planned.sweeps.items()
    ]
    names = sorted([*planned.tasks, *(row.name for row in planned.faults)])
    rows = tuple(ledger.rows[name] for name in names)
    return Batch(rows, resumed, tuple(comparisons), ledger.folder)


def _run(
    tasks: Sequence[Task], ledger: Ledger, scheduler: str | None, workers: int | None, tell: Tell
) -> None:
    if not tasks:
        return
    count = min(workers or count_cores(), len(tasks))
    with open_client(scheduler, count) as client, _progress(client, tell) as topic:
        for row in _results(client, tasks, ledger.folder, topic):
            ledger.record(row)
            tell(Event(row.name, "done", row))


def _results(client: Client, tasks: Sequence[Task], folder: Path, topic: str) -> Iterator[Row]:
    """Hand tasks out, and give the row of each as soon as it is known.

    Raises
    ------
    LostScheduler
        The scheduler is gone.
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
            "lost the scheduler, or somebody cancelled the jobs; see that it runs (`dask scheduler`, `dask "
            "worker`). What is done is kept: the same command does the rest"
        )
    fault = future.exception()
    name = type(fault).__name__
    message = "its workers died, again and again" if name == "KilledWorker" else f"{name}: {fault}"
    return replace(task.blank, message=message)


@contextmanager
def _progress(client: Client, tell: Tell) -> Iterator[str]:
    """Hand on what workers tell about their tasks; gives the topic under which they do."""
    topic = f"fiveaxis-{uuid.uuid4().hex}"  # a scheduler may serve several batches at once

    def hear(event: tuple[float, Mapping[str, Any]]) -> None:
        told = event[1]
        share = told["done"] / max(told["total"], 1)
        tell(Event(told["name"], "running", stage=told["stage"], share=share, pid=told["pid"]))

    client.subscribe_topic(topic, hear)
    try:
        yield topic
    finally:
        client.unsubscribe_topic(topic)


class _Listener:
    """Hands events on: one at a time, and none about a job that is done, as workers' messages may be late."""

    def __init__(self, tell: Tell | None) -> None:
        self._tell, self._lock = tell, threading.Lock()
        self._done: set[str] = set()

    def __call__(self, event: Event) -> None:
        with self._lock:
            if self._tell is None or event.name in self._done:
                return
            if event.state == "done":
                self._done.add(event.name)
            self._tell(event)
