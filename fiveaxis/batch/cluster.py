"""Where jobs run: workers on this computer, or those of a scheduler that runs already."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from fiveaxis.batch.worker import THREADS
from fiveaxis.errors import MissingDependency, SettingError

if TYPE_CHECKING:
    from distributed import Client

logger = logging.getLogger(__name__)

# s to wait for a scheduler's answer.
ANSWER = 10.0
# What a worker imports at its start.
PRELOAD = ("fiveaxis.batch.worker",)
# A worker isn't taken for dead because a compiled step keeps it from answering, and is handed one job at a
# time, so that a job that kills its worker takes no other one with it.
LOCAL = {
    "distributed.scheduler.worker-ttl": None,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.profile.enabled": False,
}


@contextmanager
def open_client(scheduler: str | None, workers: int) -> Iterator[Client]:
    """Connect to a scheduler, or start one with workers on this computer, which end with the block.

    Parameters
    ----------
    scheduler : its address, ``tcp://host:8786``; None starts one that only this computer reaches
    workers : processes of one thread each, where they are started here

    Raises
    ------
    MissingDependency
        dask.distributed isn't installed.
    SettingError
        No scheduler at that address.
    """
    require_distributed()
    import dask
    from distributed import Client, LocalCluster

    if scheduler is not None:
        with _quiet(), _answering(scheduler):
            there = Client(scheduler, timeout=ANSWER, set_as_default=False)
        with _quiet(), there as client:
            _look_for_workers(client, scheduler)
            yield client
        return
    with (
        dask.config.set(LOCAL),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            memory_limit=None,
            silence_logs=logging.CRITICAL,
            env=THREADS,
            preload=list(PRELOAD),
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        try:
            yield client
        except BaseException:
            _end_workers(cluster)
            raise


@contextmanager
def _quiet() -> Iterator[None]:
    """Let a client that loses its scheduler print no traceback: the batch says what to do."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    try:
        for theirs in loggers:
            theirs.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for theirs, level in zip(loggers, levels, strict=True):
            theirs.setLevel(level)


def _look_for_workers(client: Client, scheduler: str) -> None:
    """Warn where jobs would wait for ever, or until somebody starts a worker."""
    count = len(client.nthreads())
    if count:
        logger.info("%s: %d workers", scheduler, count)
    else:
        logger.warning(
            "%s has no workers, so the jobs wait; start one with `dask worker %s`", scheduler, scheduler
        )


def _end_workers(cluster: Any) -> None:
    """End the workers at once: nothing else stops a compiled step, and what they write is whole or absent."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        if nanny.process is not None and nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)


def require_distributed() -> None:
    """Refuse, before any work, to go on without dask.distributed.

    Raises
    ------
    MissingDependency
        It isn't installed.
    """
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise MissingDependency(
            "dask.distributed", "a batch", "install it with `pip install 'fiveaxis[cluster]'`"
        ) from None


def require_scheduler(scheduler: str) -> None:
    """Refuse, before anything is written, an address at which no scheduler answers.

    Raises
    ------
    SettingError
        No scheduler at that address.
    """
    # A client that isn't answered would say so once more, with a traceback, when it is thrown away.
    with _quiet(), ThreadPoolExecutor(1) as aside, _answering(scheduler):
        aside.submit(asyncio.run, _ask(scheduler)).result()


@contextmanager
def _answering(scheduler: str) -> Iterator[None]:
    try:
        yield
    # An address without a port is a ValueError; what isn't a scheduler may tell an enormous length.
    except (OSError, ValueError, MemoryError) as fault:
        raise SettingError(
            f"no scheduler answers at {scheduler} ({fault}); start one with `dask scheduler`, or leave "
            "--scheduler out"
        ) from None


async def _ask(scheduler: str) -> None:
    from distributed import rpc

    async with rpc(scheduler, timeout=ANSWER) as far:
        await asyncio.wait_for(far.identity(), ANSWER)


def count_cores() -> int:
    """Count the cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1
