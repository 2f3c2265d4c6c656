"""The supervisor of workers: whatever happens to them, each job has one row."""

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.light_workers import light_entry

from fiveaxis.base.errors import LostWorkers
from fiveaxis.job import Event, Row
from fiveaxis.job.batch import pool
from fiveaxis.job.batch.pool import Limits, run_on_pool
from fiveaxis.job.batch.tasks import QueuedJob

if sys.platform == "win32":
    pytest.skip("a process can't be killed like that there", allow_module_level=True)

DIE = "os.kill(os.getpid(), signal.SIGKILL)"


@pytest.fixture
def run(tmp_path, monkeypatch, in_time) -> Callable[..., dict[str, Row]]:
    """Give what runs tasks on workers of which each runs a text of Python, in the folder of the test."""
    monkeypatch.chdir(tmp_path)

    def do(
        entry: str,
        names: str = "abc",
        *,
        workers: int = 2,
        limits: Limits | None = None,
        tell: Callable[[Event], Any] = lambda _: None,
    ) -> dict[str, Row]:
        monkeypatch.setattr(pool, "ENTRY", light_entry(entry))
        tasks = [QueuedJob(name, tmp_path / f"{name}.toml") for name in names]
        rows = in_time(lambda: list(run_on_pool(tasks, tmp_path, workers, limits or Limits(), tell)))
        assert sorted(row.name for row in rows) == sorted(names)
        return {row.name: row for row in rows}

    return do


def once(what: str, then: str) -> str:
    """Python that does something at its first go in a folder only."""
    return f"Path({what!r}).exists() or (Path({what!r}).touch(), {then})"


@pytest.mark.parametrize(
    "entry",
    [
        pytest.param(f"{once('gone', DIE)}; work(lambda _: None)", id="at-its-start"),
        pytest.param(f"{once('gone', 'os._exit(1)')}; work(lambda _: None)", id="by-a-fault-at-its-start"),
        pytest.param(
            f"sys.stdin.buffer.peek(); {once('gone', DIE)}; work(lambda _: None)", id="as-it-takes-a-job"
        ),
        pytest.param(f"work(lambda name: {once('gone', DIE)})", id="at-work"),
        pytest.param(
            f"work(lambda _: {once('gone', f'os.write(1, bytes(123)), {DIE}')})", id="within-a-message"
        ),
        pytest.param(f"work(lambda _: {once('gone', 'os.close(1), time.sleep(600)')})", id="dumb"),
        pytest.param(
            f"work(lambda _: {once('gone', 'os.write(1, bytes([10])), time.sleep(600)')})", id="babbling"
        ),
        pytest.param(f"work(lambda _: {once('gone', 'os.close(0)')})", id="deaf"),
    ],
)
def test_a_worker_that_dies_is_replaced_and_its_job_runs_again(run, entry):
    assert [str(row.status) for row in run(entry).values()] == ["fine"] * 3


def test_a_worker_that_stands_still_at_its_start_is_replaced(run, monkeypatch):
    monkeypatch.setattr(pool, "LONGEST_START", 5.0)
    rows = run(f"{once('gone', 'os.kill(os.getpid(), signal.SIGSTOP)')}; work(lambda _: None)")
    assert [str(row.status) for row in rows.values()] == ["fine"] * 3


def test_a_job_that_kills_its_workers_is_told_with_their_last_lines_and_the_others_end(run):
    entry = f"work(lambda name: name == 'b' and (print('much\\nmemory', file=sys.stderr), {DIE}))"
    rows = run(entry)
    assert {name: str(row.status) for name, row in rows.items()} == {"a": "fine", "b": "broken", "c": "fine"}
    assert rows["b"].message == (
        "its workers died 3 times, the last one by SIGKILL; its last lines: much | memory"
    )


def test_what_a_worker_prints_without_end_is_kept_at_its_end_only(run):
    entry = f"work(lambda name: (os.write(2, b'x' * 20_000_000 + b'end'), {DIE}))"
    message = run(entry, "a")["a"].message
    assert message.endswith("xxxend")
    assert len(message) < 2200


def test_workers_that_dont_start_end_the_batch_with_what_they_printed(run):
    with pytest.raises(LostWorkers, match=r"don't start .*: exit code 1; .*no such thing\)\. Fin") as lost:
        run("sys.exit('no such thing')")
    assert lost.value.exit_code == 4


def test_workers_that_somebody_kills_at_their_start_without_end_end_the_batch_too(run, monkeypatch):
    monkeypatch.setattr(pool, "MOST_FAILURES", 5)
    with pytest.raises(LostWorkers, match="SIGKILL; it printed nothing"):
        run(DIE)


def test_a_job_over_its_time_is_stopped_and_the_others_end(run):
    rows = run("work(lambda name: name == 'b' and time.sleep(600))", limits=Limits(timeout=3.0))
    assert rows["b"].message == "ran longer than 3 s and was stopped; allow more (--job-timeout)"
    assert [str(row.status) for row in rows.values()].count("fine") == 2


def test_a_job_over_its_memory_is_stopped_and_doesnt_count_against_the_next(run):
    entry = (
        "hoard = []; work(lambda name: hoard.append(bytearray(b'x') * (50 if name != 'b' else 400) * 10**6)"
        " or time.sleep(600 if name == 'b' else 0.5))"
    )
    rows = run(entry, "acdb", workers=1, limits=Limits(memory=150.0))
    assert re.fullmatch(r"took \d+ MB and was stopped; allow more than 150 MB .*", rows["b"].message)
    assert [str(row.status) for row in rows.values()].count("fine") == 3


def test_events_say_where_a_job_runs(run):
    events: list[Event] = []
    run("work(lambda _: None)", "a", tell=events.append)
    (event,) = events
    assert (event.state, event.stage, event.worker) == ("running", "start", "1")
    assert event.pid


def test_workers_end_with_the_call(run):
    pids = set()

    def interrupt(event: Event) -> None:
        pids.add(event.pid)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("work(lambda _: time.sleep(600))", tell=interrupt)
    (pid,) = pids
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_modules_in_the_folder_of_the_call_arent_imported_by_workers(run, tmp_path):
    Path(tmp_path, "json.py").write_text("raise SystemExit('a stranger')")
    assert [str(row.status) for row in run("work(lambda _: None)", "a").values()] == ["fine"]
