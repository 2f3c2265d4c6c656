"""Jobs for batches: small files, and workers that are threads and only pretend to optimise."""

import faulthandler
import json
import os
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed, wait
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.patience import PATIENCE

from fiveaxis.base.findings import Finding, Place, Severity, group_findings
from fiveaxis.job import Event, Job, Row
from fiveaxis.job.batch.record import Listener
from fiveaxis.job.batch.tasks import QueuedJob
from fiveaxis.job.batch.worker import run_queued

POINTS = "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n"
JOB = 'input = "path.csv"\nmachine = "hayashi-640123"\ntool = "ball:10"\n'


def write_in(folder: Path, name: str, more: str = "tilt = [15, 75]\n") -> Path:
    """Write a job file beside its path, which has its name."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.toml"
    (folder / f"path_{name}.csv").write_text(POINTS)
    path.write_text(JOB.replace("path.csv", f"path_{name}.csv") + more)
    return path


@pytest.fixture(scope="session")
def writing() -> Callable[..., Path]:
    """Give `write_in`, for fixtures that several tests share."""
    return write_in


@pytest.fixture
def write_job(tmp_path: Path) -> Callable[..., Path]:
    """Give what writes a job file beside its path."""

    def write(name: str, more: str = "tilt = [15, 75]\n", folder: str = "jobs") -> Path:
        place = tmp_path / folder
        place.mkdir(exist_ok=True)
        (place / "path.csv").write_text(POINTS)
        path = place / f"{name}.toml"
        path.write_text(JOB + more)
        return path

    return write


@pytest.fixture
def in_time() -> Callable[..., Any]:
    """Give what does work that waits for other processes, and says where it stands if that takes for ever."""

    def do(work: Callable[[], Any]) -> Any:
        future: Future[Any] = Future()

        def run() -> None:
            try:
                future.set_result(work())
            except BaseException as fault:
                future.set_exception(fault)

        threading.Thread(target=run, daemon=True).start()
        if not wait([future], PATIENCE).done:
            with tempfile.TemporaryFile("w+") as stream:
                faulthandler.dump_traceback(stream)
                stream.seek(0)
                pytest.fail(f"not done in {PATIENCE:g} s; the threads stand at\n{stream.read()}")
        return future.result()

    return do


@pytest.fixture
def jobs(tmp_path: Path) -> list[Path]:
    """Four jobs, each with a path of its own."""
    return [write_in(tmp_path / "jobs", name) for name in "abcd"]


class Pretended:
    """Stands for the optimiser: notes what was run, and fails where it is told to."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.faults: dict[str, Exception] = {}
        self.unsound: set[str] = set()
        self.to_measure = ""

    def run(self, job: Job, _tell: object = None, _checkpoint: object = None) -> Any:
        self.ran.append(job.input.name)
        if job.input.name in self.faults:
            raise self.faults[job.input.name]
        joules = 1000.0 + sum(job.setup.offset)
        spent = SimpleNamespace(total=joules, travel=2.0 * joules, base=None, time=9.5)
        spent.starts, spent.reversals = 51, 62
        sound = job.input.name not in self.unsound
        (limit,) = group_findings([Finding(Severity.ERROR, "axis-limit", "A is too far", Place(1))])
        baselines = {"normal": SimpleNamespace(total=2000.0, starts=15, reversals=291)}
        report = SimpleNamespace(
            locations=2,
            solution=SimpleNamespace(
                energy=spent,
                baselines=baselines,
                energy_range=lambda: (0.9 * joules, 1.2 * joules),
                cheapest=lambda: "normal",
                to_measure=lambda _: self.to_measure,
                savings=lambda: {"normal": 1.0 - joules / 2000.0},
            ),
            summary=[] if sound else [limit],
            verdict=SimpleNamespace(counts={} if sound else {"axis-limit": 1}),
        )
        return SimpleNamespace(job=job, report=report, gate=SimpleNamespace(is_open=sound))

    def write(self, outcome: Any, folder: Path, _tell: object = None) -> list[Path]:
        folder.mkdir(parents=True, exist_ok=True)
        names = ("report.json", "program.ngc") if outcome.gate.is_open else ("report.json",)
        for name in names:
            (folder / name).write_text(json.dumps(self._document(outcome)))
        return [folder / name for name in names]

    def _document(self, outcome: Any) -> dict[str, Any]:
        spent = vars(outcome.report.solution.energy) | {"with_base": None, "travel_by_axis": {}}
        spent["by_axis"] = {"X": spent["total"]}
        setup = {"offset": list(outcome.job.setup.offset), "rotation_deg": list(outcome.job.setup.rotation)}
        return {
            "energy": spent,
            "budget": None,
            "rates": {},
            "axes": {"X": {"travel": 30.0, "margin": 100.0, "unit": "mm"}},
            "machine": {"setup": setup, "bands": {"X": [0.5, 2.0]}},
            "program": {"run_time": {"basis": "programmed"}},
        }


@contextmanager
def pretend() -> Iterator[Pretended]:
    """Let batches run on threads of this process, with what only pretends to optimise."""
    stand_in = Pretended()

    def run_on_threads(
        tasks: Sequence[QueuedJob], folder: Path, workers: int, _limits: object, tell: Listener
    ) -> Iterator[Row]:
        def run(task: QueuedJob) -> Row:
            def step(stage: str, _done: int, _total: int) -> None:
                tell(Event(task.name, "running", stage=stage, share=0.5, worker="1", pid=os.getpid()))

            return Row.from_dict(run_queued(task, folder, step).as_dict())

        with ThreadPoolExecutor(workers) as threads:
            rows = [threads.submit(run, task) for task in tasks]
            try:
                yield from (row.result() for row in as_completed(rows))
            finally:
                threads.shutdown(cancel_futures=True)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fiveaxis.job.batch.run.run_on_pool", run_on_threads)
        patch.setattr("fiveaxis.job.batch.worker.resolve", lambda job, _tell: job)
        patch.setattr("fiveaxis.job.batch.worker.run_task", stand_in.run)
        patch.setattr("fiveaxis.job.batch.worker.write_outcome", stand_in.write)
        yield stand_in


@pytest.fixture(scope="session")
def pretending() -> Callable[[], Any]:
    """Give `pretend`, for fixtures that several tests share."""
    return pretend


@pytest.fixture
def pretended() -> Iterator[Pretended]:
    with pretend() as stand_in:
        yield stand_in
