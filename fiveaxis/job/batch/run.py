"""Run a batch: plan the jobs, distribute them, record their results."""

from __future__ import annotations

import logging
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fiveaxis.base import SettingError, remove_leftovers, require_folder
from fiveaxis.job.batch.cluster import require_scheduler, run_on_scheduler
from fiveaxis.job.batch.comparison import Comparison, write_comparison, write_page
from fiveaxis.job.batch.ledger import TABLE, Ledger, locked
from fiveaxis.job.batch.pool import Limits, run_on_pool
from fiveaxis.job.batch.record import Event, Listener, Relay, Row, Status, worst
from fiveaxis.job.batch.tasks import Planned, QueuedJob, plan_tasks

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Batch:
    """The results of the jobs of a batch.

    Parameters
    ----------
    rows : sorted by name
    resumed : names of the jobs that an earlier batch had done
    comparisons : one per sweep
    folder : of the results
    files : table and page of all results
    """

    rows: tuple[Row, ...]
    resumed: frozenset[str]
    comparisons: tuple[Comparison, ...]
    folder: Path
    files: tuple[Path, ...]

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


def run_batch(
    files: str | Path | Iterable[str | Path],
    folder: str | Path,
    *,
    machines: Sequence[str] = (),
    settings: Mapping[str, Any] | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    job_timeout: float | None = None,
    job_memory: float | None = None,
    tell: Listener | None = None,
) -> Batch:
    """Run many jobs, each into its own folder, and keep one table of their results.

    A job that fails doesn't affect the others. A job whose worker dies runs again; one that kills its workers
    again and again is broken. Results are kept even if this call is interrupted: the next call runs only jobs
    that are missing, were broken, or have other inputs. The rows don't depend on the number of workers.

    Parameters
    ----------
    files : job files, or one; one with a ``[sweep]`` stands for many jobs
    folder : for the results: ``results.html``, ``results.csv``, ``results.jsonl`` and a folder for each job
    machines : on each of which every job runs, in place of its own machine and of a sweep
    settings : of the jobs on these machines, by key of a job
    scheduler : address of a dask scheduler, ``tls://host:8786``, whose workers see the same folders; by
        default workers are processes of this computer, which no other process can reach
    workers : number of local workers; by default one per core
    job_timeout : s, for each job on this computer
    job_memory : MB of resident memory, for each job on this computer
    tell : called with each event, never by two threads at once

    Raises
    ------
    MissingDependency
        A scheduler is given, and dask.distributed isn't installed.
    SettingError
        Two jobs of one name, a folder that can't be written or in which another batch is running, a scheduler
        that doesn't answer.
    LostScheduler, LostWorkers
        The connection to the scheduler is lost, or no worker starts on this computer; finished results are
        kept.
    """
    limits = Limits(job_timeout, job_memory)
    _require_limits(workers, limits, scheduler)
    each = [files] if isinstance(files, str | Path) else files
    planned = plan_tasks(map(Path, each), machines, settings)
    require_folder(Path(folder))
    if scheduler is not None:
        require_scheduler(scheduler)
    results = Path(folder).absolute()
    with locked(results):
        ledger = Ledger(results)
        done = {n: row for n, digest in planned.digests.items() if (row := ledger.done(n, digest))}
        relay = Relay(tell)
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
        try:
            _remove_leftovers(results, planned.tasks)
            _run(missing, ledger, scheduler, workers or count_cores(), limits, relay)
        finally:
            _remove_leftovers(results, planned.tasks)
        return _finish(planned, ledger, frozenset(done))


def _require_limits(workers: int | None, limits: Limits, scheduler: str | None) -> None:
    if workers is not None and workers < 1:
        raise SettingError(f"workers is {workers}; it must be at least 1")
    for name, value in (("timeout", limits.timeout), ("memory", limits.memory)):
        if value is not None and not 0.0 < value < math.inf:
            raise SettingError(f"--job-{name} is {value:g}; it must be above 0")
        if value is not None and scheduler is not None:
            raise SettingError(
                f"--job-{name} is for workers of this computer; give a scheduler's workers their own limits "
                "(`dask worker --memory-limit`)"
            )


def _finish(planned: Planned, ledger: Ledger, resumed: frozenset[str]) -> Batch:
    comparisons = [
        write_comparison(name, [ledger.rows[variant] for variant in variants], ledger.folder)
        for name, variants in planned.sweeps.items()
    ]
    names = sorted([*planned.tasks, *(row.name for row in planned.faults)])
    rows = tuple(ledger.rows[name] for name in names)
    files = (ledger.folder / TABLE, write_page(tuple(ledger.rows.values()), ledger.folder))
    return Batch(rows, resumed, tuple(comparisons), ledger.folder, files)


def _run(
    tasks: Sequence[QueuedJob],
    ledger: Ledger,
    scheduler: str | None,
    workers: int,
    limits: Limits,
    tell: Listener,
) -> None:
    if not tasks:
        return
    if scheduler is None:
        rows = run_on_pool(tasks, ledger.folder, min(workers, len(tasks)), limits, tell)
    else:
        rows = run_on_scheduler(tasks, ledger.folder, scheduler, tell)
    with closing(rows):
        for row in rows:
            ledger.record(row)
            tell(Event(row.name, "done", row))


def count_cores() -> int:
    """Count the cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


def _remove_leftovers(folder: Path, names: Iterable[str]) -> None:
    """Remove what killed workers have left in the folders of some jobs, which are this batch's alone."""
    for place in {folder, *(folder / name for name in names), *((folder / name).parent for name in names)}:
        remove_leftovers(place, alone=True)
