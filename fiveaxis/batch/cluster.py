"""Connect to the workers that run jobs: on this computer, or of a running scheduler."""

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
# Modules that a worker imports at its start.
PRELOAD = ("fiveaxis.batch.worker",)
# A worker isn't considered dead while a compiled step keeps it from answering. It gets one job at a time, so
# that a job that kills its worker takes no other job with it.
LOCAL = {
    "distributed.scheduler.worker-ttl": None,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.profile.enabled": False,
}


@contextmanager
def open_client(scheduler: str | None, workers: int) -> Iterator[Client]:
    """Connect to a scheduler, or start one on this computer, with workers that end with the context.

    Parameters
    ----------
    scheduler : its address, ``tcp://host:8786``; None starts one that only this computer reaches
    workers : number of local processes, of one thread each

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
            _warn_without_workers(client, scheduler)
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


def _warn_without_workers(client: Client, scheduler: str) -> None:
    """Warn where jobs would wait until somebody starts a worker."""
    count = len(client.nthreads())
    if count:
        logger.info("%s: %d workers", scheduler, count)
    else:
        logger.warning(
            "%s has no workers, so the jobs wait; start one with `dask worker %s`", scheduler, scheduler
        )


def _end_workers(cluster: Any) -> None:
    """Kill the workers: nothing else stops a compiled step, and they write files whole or not at all."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        if nanny.process is not None and nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)


def require_distributed() -> None:
    """Raise, before any work, if dask.distributed is missing.

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
    """Raise, before anything is written, if no scheduler answers at an address.

    Raises
    ------
    SettingError
        No scheduler at that address.
    """
    # A client without an answer would print a traceback once more when it is garbage-collected.
    with _quiet(), ThreadPoolExecutor(1) as aside, _answering(scheduler):
        aside.submit(asyncio.run, _ask(scheduler)).result()


@contextmanager
def _answering(scheduler: str) -> Iterator[None]:
    try:
        yield
    # An address without a port is a ValueError; another server may announce a message of enormous length.
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
