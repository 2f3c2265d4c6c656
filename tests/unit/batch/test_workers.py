"""Batches on processes of their own: killed, interrupted, and out of everybody's reach."""

import json
import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
from soaking.rings import contents, write_ring_jobs

from fiveaxis.batch import pool, run_batch
from fiveaxis.batch.ledger import LINES, LOCK, TABLE
from fiveaxis.batch.tasks import Task
from fiveaxis.batch.worker import run_task

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
        if self.sent or " of 3)" not in text:
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


# What workers run before their own module: at its first go a job stands still before it is verified, when
# something is there to be lost, and says so, so that it can't be done before its worker is killed.
HOLDING = """
import time
import fiveaxis.batch.worker as worker

def run(job, tell, whole=worker.run_job):
    held = job.input.with_suffix(".held")
    def step(stage, done, total):
        tell(stage, done, total)
        if "verifying" in stage and job.input.stem != "r2" and not held.exists():
            held.touch()
            tell("held", 0, 1)
            time.sleep(600)
    return whole(job, step)

worker.run_job = run
"""


@pytest.fixture
def rings(tmp_path):
    """Three jobs on small overhanging rings."""
    return write_ring_jobs(tmp_path / "jobs", 3)


@posix
@pytest.mark.slow
def test_jobs_of_killed_workers_run_again_and_nothing_is_lost_or_doubled(
    rings, tmp_path, monkeypatch, in_time
):
    killed, ended = [], []
    monkeypatch.setattr(pool, "ENTRY", HOLDING + pool.ENTRY)

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
    assert kept.keys() - contents(tmp_path / "quiet").keys() == {TABLE, LOCK, "results.html"}
    assert kept.items() >= contents(tmp_path / "quiet").items()


def is_alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def require_end(pids: list[int], seconds: float) -> None:
    ends = time.monotonic() + seconds
    while alive := [pid for pid in pids if is_alive(pid)]:
        assert time.monotonic() < ends, f"still there: {alive}"
        time.sleep(0.05)


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
    *told, last = [line for line in err.splitlines() if "runs on worker" not in line]
    workers = told.pop(0)
    assert (process.returncode, out) == (130, "")
    assert last == "interrupted; finished jobs are kept, the same command does the rest"
    assert workers.split()
    require_end([int(pid) for pid in workers.split()], 30.0)
    # Another job may have ended before the signal came through, and the console begins the line in which it
    # came anew; what was told is what is kept.
    names = list(dict.fromkeys(line.partition(":")[0] for line in told))
    lines = (tmp_path / "out" / LINES).read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == names
    assert 1 <= len(names) < len(rings)
    done = run_batch(rings, tmp_path / "out", workers=1)
    assert (done.resumed, done.exit_code, len(done.rows)) == (set(names), 0, 3)


@pytest.fixture
def running(rings, tmp_path):
    """A batch by the command line that has just told which worker runs its first job."""
    words = ["batch", *map(str, rings), "-o", str(tmp_path / "out"), "--workers", "2"]
    with subprocess.Popen(
        [sys.executable, "-m", "fiveaxis.cli", *words], stderr=subprocess.PIPE, text=True
    ) as process:
        assert "runs on worker" in process.stderr.readline()
        yield process
        process.kill()


@posix
@pytest.mark.slow
def test_nobody_can_reach_the_workers_and_they_end_with_a_batch_that_is_killed(running):
    main = psutil.Process(running.pid)
    workers = main.children(recursive=True)
    assert len(workers) == 2
    # No port and no socket: what there is are pipes, which other users can't open.
    assert [one.net_connections("all") for one in (main, *workers)] == [[], [], []]
    if os.getuid() == 0 and sys.platform == "linux":
        knock = ["sh", "-c", f"echo a task > /proc/{workers[0].pid}/fd/0"]
        stranger = subprocess.run(knock, user="nobody", capture_output=True, text=True, check=False)
        assert stranger.returncode != 0
        assert "Permission denied" in stranger.stderr
    running.kill()
    require_end([worker.pid for worker in workers], 2.0)
