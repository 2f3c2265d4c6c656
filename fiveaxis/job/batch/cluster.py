"""The workers of a dask scheduler, for batches on many computers. It runs only with the extra `cluster`."""

from __future__ import annotations

import asyncio
import logging
import os
import platform
import uuid
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis import __version__
from fiveaxis.base import LostScheduler, MissingDependency, SettingError
from fiveaxis.job.batch.record import Event, Listener, Row, row_of_fault
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.job.batch.worker import run_queued, throttled

if TYPE_CHECKING:
    from distributed import Client, Future

logger = logging.getLogger(__name__)

# s to wait for a scheduler's answer.
ANSWER = 10.0


def run_on_scheduler(
    tasks: Sequence[QueuedJob], folder: Path, scheduler: str, tell: Listener
) -> Generator[Row]:
    """Run tasks on a scheduler's workers, which see the folder under the same name; yield each row once done.

    Certificates for an address ``tls://`` are those of dask's configuration. `SettingError` without a
    scheduler, `LostScheduler` when the connection to it is lost.
    """
    from distributed import as_completed

    with _open_client(scheduler) as client, _progress(client, tell) as topic:
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


def _row(future: Future, task: QueuedJob) -> Row:
    from distributed import CancelledError, KilledWorker

    # A future's status can change between two looks at it, so that the result alone is asked for.
    try:
        return Row.from_dict(future.result())
    except CancelledError:
        raise LostScheduler(
            "lost the scheduler, or somebody cancelled the jobs; check that it runs (`dask scheduler`, `dask "
            "worker`). Finished jobs are kept: the same command does the rest"
        ) from None
    except KilledWorker:
        return replace(task.blank, message="its workers died repeatedly")
    except Exception as fault:  # of dask: a worker on which this package is missing, for one
        return row_of_fault(task.blank, fault)


def run_remotely(task: QueuedJob, folder: str, version: str, topic: str) -> dict[str, Any]:
    """Run a task on a dask worker, send its progress as events of a topic; return its row as plain data."""
    from distributed import get_worker

    if version != __version__:
        message = f"a worker has fiveaxis {__version__} and this command {version}; install one everywhere"
        return replace(task.blank, message=message).as_dict()
    worker, place = get_worker(), {"name": task.name, "worker": platform.node(), "pid": os.getpid()}

    def tell(stage: str, share: float) -> None:
        worker.log_event(topic, place | {"stage": stage, "share": share})

    return run_queued(task, Path(folder), throttled(tell)).as_dict()


@contextmanager
def _progress(client: Client, tell: Listener) -> Iterator[str]:
    """Pass the workers' progress on; yield the topic under which they send it."""
    topic = f"fiveaxis-{uuid.uuid4().hex}"  # a scheduler may serve several batches at once
    client.subscribe_topic(topic, lambda event: tell(Event(state="running", **event[1])))
    try:
        yield topic
    finally:
        client.unsubscribe_topic(topic)


@contextmanager
def _open_client(scheduler: str) -> Iterator[Client]:
    from distributed import Client

    with _quiet(), _answering(scheduler):
        there = Client(scheduler, timeout=ANSWER, set_as_default=False)
    with _quiet(), there as client:
        if count := len(client.nthreads()):
            logger.info("%s: %d workers", scheduler, count)
        else:
            message = "%s has no workers, so the jobs wait; start one with `dask worker %s`"
            logger.warning(message, scheduler, scheduler)
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the traceback of a client that loses its scheduler: the batch says what to do."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    try:
        for theirs in loggers:
            theirs.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for theirs, level in zip(loggers, levels, strict=True):
            theirs.setLevel(level)


def require_scheduler(scheduler: str) -> None:
    """Raise, before anything is written, unless dask.distributed is there and a scheduler answers."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise MissingDependency(
            "dask.distributed", "--scheduler", "install it with `pip install 'fiveaxis[cluster]'`"
        ) from None
    # A client without an answer would print a traceback once more when it is garbage-collected.
    with _quiet(), ThreadPoolExecutor(1) as aside, _answering(scheduler):
        aside.submit(asyncio.run, _ask(scheduler)).result()


@contextmanager
def _answering(scheduler: str) -> Iterator[None]:
    try:
        yield
    # An address without a port is a ValueError, TLS without certificates a TypeError; another server may
    # announce a message of enormous length.
    except (OSError, ValueError, TypeError, MemoryError) as fault:
        raise SettingError(
            f"no scheduler answers at {scheduler} ({fault}); start one with `dask scheduler`, or leave "
            "--scheduler out"
        ) from None


async def _ask(scheduler: str) -> None:
    from distributed import Security, rpc

    arguments = Security().get_connection_args("client")
    async with rpc(scheduler, timeout=ANSWER, connection_args=arguments) as far:
        await asyncio.wait_for(far.identity(), ANSWER)
