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

from fiveaxis.batch import cluster, run_batch
from fiveaxis.batch.cluster import require_scheduler
from fiveaxis.batch.ledger import LINES, LOCK, TABLE
from fiveaxis.batch.tasks import Task
from fiveaxis.batch.worker import run_task
from fiveaxis.errors import SettingError

pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")
posix = pytest.mark.skipif(sys.platform == "win32", reason="a process can't be killed like that there")


# The command line that gets Ctrl-C, as a terminal sends it to all its processes, as soon as a job is told.
INTERRUPTED = """
import os, signal, sys
import psutil
from fiveaxis.cli import main

class Interrupting:
    def __init__(self, stream):
        self.stream, self.sent = stream, False

    def write(self, text):
        if self.sent or not text.strip():
            return self.stream.write(text)
        self.sent = True
        workers = psutil.Process().children(recursive=True)
        self.stream.write(" ".join(str(worker.pid) for worker in workers) + chr(10))
        written = self.stream.write(text)
        os.killpg(0, signal.SIGINT)
        return written

    def __getattr__(self, name):
        return getattr(self.stream, name)

if __name__ == "__main__":
    # A shell that starts the tests in the background lets them, and their children, ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.stderr = Interrupting(sys.stderr)
    main()
"""


# What workers import after their own module: at its first go a job stands still before it is verified, when
# something is there to be lost, and says so, so that it can't be done before its worker is killed.
HOLDING = """
import time
import fiveaxis.batch.worker as worker

def run(job, tell, whole=worker.run_job):
    held = job.input.with_suffix(".held")
    def step(stage, done, total):
        tell(stage, done, total)
        if stage == "verify" and job.input.stem != "r2" and not held.exists():
            held.touch()
            tell("held", 0, 1)
            time.sleep(600)
    return whole(job, step)

worker.run_job = run
"""


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
def test_jobs_of_killed_workers_run_again_and_nothing_is_lost_or_doubled(
    rings, tmp_path, monkeypatch, in_time
):
    killed, ended = [], []
    holding = tmp_path / "holding.py"
    holding.write_text(HOLDING)
    monkeypatch.setattr(cluster, "PRELOAD", (*cluster.PRELOAD, str(holding)))

    def kill(event):
        if event.state == "done":
            ended.append(event.name)
        if event.stage == "held":
            killed.append(event.name)
            os.kill(event.pid, signal.SIGKILL)

    done = in_time(lambda: run_batch(rings, tmp_path / "out", workers=2, tell=kill), 300)
    assert sorted(killed) == ["r0", "r1"]
    assert sorted(ended) == [row.name for row in done.rows] == ["r0", "r1", "r2"]
    quiet = [run_task(Task(file.stem, file), tmp_path / "quiet", lambda *_: None) for file in rings]
    assert [row.as_dict() for row in done.rows] == [row.as_dict() for row in quiet]
    kept = contents(tmp_path / "out")
    lines = kept.pop(LINES).decode().splitlines()
    assert [json.loads(line) for line in lines] == [row.as_dict() for row in quiet]
    assert kept.keys() - contents(tmp_path / "quiet").keys() == {TABLE, LOCK}
    assert kept.items() >= contents(tmp_path / "quiet").items()


def is_alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@posix
@pytest.mark.slow
def test_ctrl_c_ends_the_workers_and_the_same_command_does_the_rest(rings, tmp_path):
    words = ["batch", *map(str, rings), "-o", str(tmp_path / "out"), "--workers", "1"]
    with subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            out, err = process.communicate(timeout=400)  # compiles first where nothing is cached
        finally:
            process.kill()
    workers, *told, last = err.splitlines()
    assert (process.returncode, out) == (130, "")
    assert last == "interrupted; finished jobs are kept, the same command does the rest"
    assert workers.split()
    ends = time.monotonic() + 30.0
    while alive := [pid for pid in workers.split() if is_alive(int(pid))]:
        assert time.monotonic() < ends, f"still there: {alive}"
        time.sleep(0.05)
    # Another job may have ended before the signal came through, and the console begins the line in which it
    # came anew; what was told is what is kept.
    names = list(dict.fromkeys(line.partition(":")[0] for line in told))
    lines = (tmp_path / "out" / LINES).read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == names
    assert 1 <= len(names) < len(rings)
    done = run_batch(rings, tmp_path / "out", workers=1)
    assert (done.resumed, done.exit_code, len(done.rows)) == (set(names), 0, 3)


def test_a_scheduler_that_doesnt_answer_is_named(monkeypatch, in_time):
    monkeypatch.setattr("fiveaxis.batch.cluster.ANSWER", 0.5)
    with pytest.raises(SettingError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9 .*dask scheduler"):
        in_time(lambda: require_scheduler("tcp://127.0.0.1:9"), 60)


def test_an_address_that_is_none_is_named():
    with pytest.raises(SettingError, match="no scheduler answers at nonsense"):
        require_scheduler("nonsense")


@posix
@pytest.mark.slow
def test_jobs_run_on_a_scheduler_that_is_there_already(rings, tmp_path, in_time):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0"
    ) as there:
        address = there.scheduler_address
        done = in_time(lambda: run_batch(rings[:1], tmp_path / "out", scheduler=address), 300)
        assert len(there.workers) == 1
    assert [str(row.status) for row in done.rows] == ["fine"]
    assert (tmp_path / "out" / TABLE).is_file()
