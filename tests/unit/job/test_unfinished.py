"""A job that is interrupted goes on from what it has found, and ends as if nothing had happened."""

import logging
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base import resumable
from fiveaxis.base.errors import AlreadyBetter, Infeasible
from fiveaxis.base.interrupted import Kept
from fiveaxis.job import Job, digest_job, make_job, run_job, write_outcome


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """A lobed wall that overhangs, searched twice, in threads and one after the other."""
    file = tmp_path / "path.csv"
    angle = np.linspace(0.0, 6.0, 12)
    radius = 30.0 + 2.0 * np.cos(3.0 * angle)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(12, -0.5)], axis=1) / np.hypot(1.0, 0.5)
    contact = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.1 * angle], axis=1)
    rows = np.hstack([contact, normal])
    np.savetxt(file, rows, "%.7f", ",", header="x,y,z,nx,ny,nz", comments="")
    return make_job(input=file, machine="hayashi-640123", tool="ball:10", tilt=(15, 75), effort="normal")


@pytest.fixture(autouse=True)
def every_step_is_long(monkeypatch):
    monkeypatch.setattr("fiveaxis.base.interrupted.LONG", 0.0)


def finish(job: Job, folder: Path) -> dict[str, bytes]:
    """Run a job to its end; return the program and the motion in its folder."""
    with resumable(digest_job(job), folder) as checkpoint:
        write_outcome(run_job(job, checkpoint=checkpoint), folder)
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".csv", ".ngc")}


def kept(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.npy"))


@pytest.mark.slow
def test_a_job_interrupted_after_each_of_its_steps_does_each_once_and_gives_the_same_files(
    job, tmp_path, monkeypatch
):
    with monkeypatch.context() as no_step_is_long:
        no_step_is_long.setattr("fiveaxis.base.interrupted.LONG", np.inf)
        uninterrupted, done = finish(job, tmp_path / "whole"), []

    def interrupted(self: Kept, find: Callable, found: Callable = Kept.found) -> object:
        def step() -> object:
            if len(done) > before:
                raise KeyboardInterrupt
            result = find()
            done.append(find)
            return result

        return found(self, step)

    monkeypatch.setattr(Kept, "found", interrupted)
    results, before = None, 0
    while results is None:
        before = len(done)
        try:
            results = finish(job, tmp_path / "out")
        except KeyboardInterrupt:
            assert len(kept(tmp_path / "out")) == len(done) > before
    assert len(done) > 15
    assert results == uninterrupted
    assert not kept(tmp_path / "out")


def stop(job: Job, folder: Path, work: Callable, fault: type = KeyboardInterrupt) -> None:
    """End a job with a fault after some work."""
    with suppress(fault), resumable(digest_job(job), folder) as checkpoint:
        work(checkpoint)
        raise Infeasible("no posture", []) if fault is Infeasible else fault


def test_what_cant_be_read_is_said_and_done_again(job, tmp_path, caplog):
    whole, out = finish(job, tmp_path / "whole"), tmp_path / "out"
    stop(job, out, lambda checkpoint: run_job(job, checkpoint=checkpoint))
    first, second, *_ = kept(out)
    first.write_bytes(first.read_bytes()[:100])
    second.write_bytes(b"")
    with caplog.at_level(logging.WARNING):
        assert finish(job, out) == whole
    assert [record.message.count("can't be read") for record in caplog.records] == [0, 1, 1]


def test_what_other_options_found_is_ignored_and_removed(job, tmp_path, caplog):
    other = job.model_copy(update={"tilt": (20.0, 75.0)})
    stop(other, tmp_path, lambda checkpoint: checkpoint.found(lambda: np.zeros((12, 2))))
    assert len(kept(tmp_path)) == 1
    with caplog.at_level(logging.WARNING):
        finish(job, tmp_path)
    assert "belongs to other inputs" in caplog.text
    assert not kept(tmp_path)


@pytest.mark.parametrize("fault", [Infeasible("no posture", []), AlreadyBetter("it stays", {})])
def test_a_job_without_a_result_leaves_no_folder(job, tmp_path, fault):
    out = tmp_path / "new"
    with suppress(type(fault)), resumable(digest_job(job), out) as checkpoint:
        checkpoint.found(lambda: np.zeros((12, 2)))
        assert kept(out)
        raise fault
    assert not out.exists()


def test_that_nothing_was_found_is_kept_and_nothing_stays_of_an_infeasible_job(job, tmp_path):
    finds = iter([None, np.zeros((12, 2))])
    for fault, count in ((KeyboardInterrupt, 1), (KeyboardInterrupt, 1), (Infeasible, 0)):
        stop(job, tmp_path, lambda checkpoint: checkpoint.found(lambda: next(finds)), fault)
        assert len(kept(tmp_path)) == count
    assert next(finds) is not None


def test_what_was_found_of_another_path_isnt_taken(tmp_path):
    """A program's files are hashed, those that it calls aren't."""

    def find(path: np.ndarray, found: float) -> float:
        kept = Kept(tmp_path)
        kept.about(path)
        return float(kept.found(lambda: np.array([found]))[0])

    path, other = np.zeros((5, 3)), np.ones((5, 3))
    assert [find(path, 1.0), find(other, 2.0), find(path, 3.0), find(other, 4.0)] == [1.0, 2.0, 1.0, 2.0]


def test_steps_that_threads_do_later_arent_taken_for_those_that_they_did_before(tmp_path):
    whole = Kept(tmp_path)
    found = [float(whole.part().found(lambda step=step: np.array([step]))[0]) for step in range(4)]
    assert found == [0.0, 1.0, 2.0, 3.0]


def test_a_job_is_the_same_wherever_its_files_lie(job, tmp_path):
    moved = tmp_path / "moved.csv"
    moved.write_bytes(job.input.read_bytes())
    elsewhere = job.model_copy(update={"input": moved})
    assert digest_job(elsewhere) == digest_job(job)
    moved.write_bytes(job.input.read_bytes().replace(b"0.1", b"0.2"))
    assert digest_job(elsewhere) != digest_job(job)


def test_what_a_job_beside_keeps_meanwhile_stays(job, tmp_path):
    other = job.model_copy(update={"tilt": (20.0, 75.0)})
    with resumable(digest_job(other), tmp_path) as beside:
        beside.found(lambda: np.zeros((12, 2)))
        with resumable(digest_job(job), tmp_path):
            beside.found(lambda: np.zeros((12, 2)))
        assert len(kept(tmp_path)) == 2
    assert not kept(tmp_path)
