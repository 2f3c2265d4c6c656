"""A batch whose scheduler goes away in mid-run, at a moment that the test chooses."""

import json
import subprocess
import sys
from collections.abc import Iterator

import pytest
from support.patience import PATIENCE

from fiveaxis.base.errors import LostScheduler
from fiveaxis.job import run_batch
from fiveaxis.job.batch.ledger import LINES

pytest.importorskip("distributed")

# A scheduler with one worker, in one process that can be killed. Of the jobs the first alone comes to an end:
# the others wait for what never happens, so that none of them is done by chance before the scheduler is gone.
SCHEDULER = """
import sys, threading
from distributed import LocalCluster
import fiveaxis.job.batch.worker as worker
from fiveaxis.base import Infeasible
def run(job, tell, checkpoint):
    if job.input.name != "path_a.csv":
        threading.Event().wait(600)
    raise Infeasible("an end that the inputs decide", [])
worker.resolve, worker.run_task = (lambda job, tell: job), run
with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", host="127.0.0.1",
                  dashboard_address="127.0.0.1:0") as cluster:
    print(cluster.scheduler_address, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def scheduler() -> Iterator[subprocess.Popen[str]]:
    pipe = subprocess.PIPE
    words = [sys.executable, "-c", SCHEDULER]
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True) as process:
        yield process
        process.kill()


@pytest.mark.slow
def test_what_is_done_is_kept_and_the_same_command_does_the_rest(
    scheduler, jobs, pretended, tmp_path, capfd, in_time
):
    """The scheduler is killed when the first job is told done."""
    there = in_time(scheduler.stdout.readline).strip()
    assert there.startswith("tcp://127.0.0.1:")
    told = []

    def kill(event):
        if event.state == "done":
            told.append(event.name)
            scheduler.kill()
            scheduler.wait(PATIENCE)

    with pytest.raises(LostScheduler, match="the same command does the rest") as lost:
        in_time(lambda: run_batch(jobs, tmp_path / "out", scheduler=there, tell=kill))
    assert lost.value.exit_code == 4
    assert capfd.readouterr().err == ""  # no traceback of dask's beside the error
    assert told == ["a"]
    lines = (tmp_path / "out" / LINES).read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == ["a"]
    done = run_batch(jobs, tmp_path / "out", workers=1)
    assert sorted(pretended.ran) == ["path_b.csv", "path_c.csv", "path_d.csv"]
    assert (done.resumed, done.exit_code) == ({"a"}, 3)
