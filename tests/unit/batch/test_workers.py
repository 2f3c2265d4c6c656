"""Batches on processes of their own: killed, interrupted, or out of reach."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.batch import run_batch
from fiveaxis.batch.cluster import open_client
from fiveaxis.batch.ledger import LINES, LOCK, TABLE
from fiveaxis.batch.tasks import Task
from fiveaxis.batch.worker import run_task
from fiveaxis.errors import SettingError

pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")
posix = pytest.mark.skipif(sys.platform == "win32", reason="a process can't be killed like that there")


@pytest.fixture
def rings(write_job):
    """Three jobs on small overhanging rings."""
    files = [write_job(name, 'tilt = [15, 75]\neffort = "quick"\n') for name in ("r0", "r1", "r2")]
    angle = np.linspace(0.0, 2.0 * np.pi, 40)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(40, -0.3)], axis=1)
    for number, file in enumerate(files):
        r = 20.0 + number
        contact = np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros(40)], axis=1)
        name = f"{file.stem}.csv"
        rows = np.hstack([contact, normal])
        np.savetxt(file.with_name(name), rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
        file.write_text(file.read_text().replace("path.csv", name))
    return files


def contents(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@posix
@pytest.mark.slow
def test_jobs_of_killed_workers_run_again_and_nothing_is_lost_or_doubled(rings, tmp_path):
    killed, ended = [], []

    def kill(event):
        if event.state == "done":
            ended.append(event.name)
        # In the middle of the work, when something is there to be lost.
        if event.stage == "verify" and event.name not in killed and event.name != "r2":
            killed.append(event.name)
            os.kill(event.pid, signal.SIGKILL)

    done = run_batch(rings, tmp_path / "out", workers=2, tell=kill)
    assert sorted(killed) == ["r0", "r1"]
    assert sorted(ended) == [row.name for row in done.rows] == ["r0", "r1", "r2"]
    quiet = [run_task(Task(file.stem, file), tmp_path / "quiet") for file in rings]
    assert [row.as_dict() for row in done.rows] == [row.as_dict() for row in quiet]
    kept = contents(tmp_path / "out")
    lines = kept.pop(LINES).decode().splitlines()
    assert [json.loads(line) for line in lines] == [row.as_dict() for row in quiet]
    assert kept.keys() - contents(tmp_path / "quiet").keys() == {TABLE, LOCK}
    assert kept.items() >= contents(tmp_path / "quiet").items()


@posix
@pytest.mark.slow
def test_ctrl_c_ends_the_workers_and_the_same_command_does_the_rest(rings, tmp_path):
    words = [sys.executable, "-m", "fiveaxis.cli", "batch", *map(str, rings), "-o", str(tmp_path / "out")]
    with subprocess.Popen(
        [*words, "--workers", "1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            first = process.stderr.readline()
            workers = psutil.Process(process.pid).children(recursive=True)
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert (process.returncode, out) == (130, "")
    assert err == "interrupted; what is done is kept, the same command does the rest\n"
    assert workers
    assert psutil.wait_procs(workers, timeout=10)[1] == []
    name = first.partition(":")[0]
    lines = (tmp_path / "out" / LINES).read_text().splitlines()
    assert [f'"name": "{name}"' in line for line in lines] == [True]
    done = run_batch(rings, tmp_path / "out", workers=1)
    assert (done.resumed, done.exit_code, len(done.rows)) == ({name}, 0, 3)


def test_a_scheduler_that_doesnt_answer_is_named(monkeypatch):
    monkeypatch.setattr("fiveaxis.batch.cluster.ANSWER", 0.2)
    begun = time.monotonic()
    with (
        pytest.raises(SettingError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9 .*dask scheduler"),
        open_client("tcp://127.0.0.1:9", 1),
    ):
        pass
    assert time.monotonic() - begun < 30.0


def test_an_address_that_is_none_is_named():
    with pytest.raises(SettingError, match="no scheduler answers at nonsense"), open_client("nonsense", 1):
        pass


@posix
@pytest.mark.slow
def test_jobs_run_on_a_scheduler_that_is_there_already(rings, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        done = run_batch(rings[:1], tmp_path / "out", scheduler=cluster.scheduler_address)
        assert len(cluster.workers) == 1
    assert [str(row.status) for row in done.rows] == ["fine"]
    assert (tmp_path / "out" / TABLE).is_file()
