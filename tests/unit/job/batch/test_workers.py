"""Batches of the command line whose workers load no module of fiveaxis: interrupted, killed, out of reach."""

import json
import os
import subprocess
import sys

import psutil
import pytest
from support.light_workers import COMMAND, DIGEST
from support.patience import PATIENCE

from fiveaxis.job import run_batch
from fiveaxis.job.batch.ledger import LINES

if sys.platform == "win32":
    pytest.skip("a process can't be killed like that there", allow_module_level=True)

TESTS = __file__.rpartition("/unit/")[0]
# The first job ends at once, and the others never.
ENTRY = "work(lambda name: name == 'a' or time.sleep(600))"
# Ctrl-C, as a terminal sends it to all its processes, as soon as the end of a job is told.
INTERRUPTED = """
import os, signal, sys
import psutil

class Interrupting:
    def __init__(self, stream):
        self.stream, self.sent = stream, False

    def write(self, text):
        if self.sent or " of 4)" not in text:
            return self.stream.write(text)
        self.sent = True
        workers = psutil.Process().children(recursive=True)
        self.stream.write(" ".join(str(worker.pid) for worker in workers) + chr(10))
        written = self.stream.write(text)
        os.killpg(0, signal.SIGINT)
        return written

    def __getattr__(self, name):
        return getattr(self.stream, name)

# A shell that starts the tests in the background lets them, and their children, ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.stderr = Interrupting(sys.stderr)
"""


@pytest.fixture
def start(jobs, tmp_path, monkeypatch):
    """Give what starts a batch of four jobs, and kill it at the end."""
    started = []
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([TESTS, *filter(None, sys.path)]))

    def do(before: str, workers: int) -> subprocess.Popen[str]:
        words = ["batch", *map(str, jobs), "-o", str(tmp_path / "out"), "--workers", str(workers)]
        process = subprocess.Popen(
            [sys.executable, "-c", before + COMMAND, ENTRY, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield do
    for process in started:
        process.kill()
        process.communicate()


def require_end(workers: list[psutil.Process], seconds: float) -> None:
    _, alive = psutil.wait_procs(workers, seconds)
    assert [one for one in alive if one.is_running() and one.status() != psutil.STATUS_ZOMBIE] == []


@pytest.mark.slow
def test_ctrl_c_ends_the_workers_and_the_same_command_does_the_rest(
    start, jobs, tmp_path, pretended, monkeypatch
):
    process = start(INTERRUPTED, workers=1)
    out, err = process.communicate(timeout=PATIENCE)
    *told, last = [line for line in err.splitlines() if "runs on worker" not in line]
    workers = [int(pid) for pid in told.pop(0).split()]
    assert (process.returncode, out) == (130, "")
    assert last == "interrupted; finished jobs are kept, the same command does the rest"
    assert len(workers) == 1
    assert not psutil.pid_exists(workers[0])
    (line,) = (tmp_path / "out" / LINES).read_text().splitlines()
    # The console prints a line anew in which the signal came.
    assert {told_line.partition(":")[0] for told_line in told} == {json.loads(line)["name"]} == {"a"}
    monkeypatch.setattr("fiveaxis.job.batch.tasks.digest_job", lambda *_: DIGEST)
    done = run_batch(jobs, tmp_path / "out", workers=1)
    assert (done.resumed, done.exit_code, len(done.rows)) == ({"a"}, 0, 4)


@pytest.mark.slow
def test_nobody_can_reach_the_workers_and_they_end_with_a_batch_that_is_killed(start):
    process = start("", workers=2)
    next(line for line in process.stderr if "c: runs on worker" in line)  # both have an endless job
    main = psutil.Process(process.pid)
    workers = main.children(recursive=True)
    assert len(workers) == 2
    # No port and no socket: what there is are pipes, which other users can't open.
    assert [one.net_connections("all") for one in (main, *workers)] == [[], [], []]
    if os.getuid() == 0 and sys.platform == "linux":
        knock = ["sh", "-c", f"echo a task > /proc/{workers[0].pid}/fd/0"]
        stranger = subprocess.run(knock, user="nobody", capture_output=True, text=True, check=False)
        assert stranger.returncode != 0
        assert "Permission denied" in stranger.stderr
    process.kill()
    require_end(workers, PATIENCE)
