"""Batches on threads of this process, with what only pretends to optimise."""

import builtins
import json

import pytest
from support.killed_writer import leave_behind

from fiveaxis.base.errors import Infeasible, InputError, MissingDependency, SettingError
from fiveaxis.base.findings import Finding, Severity
from fiveaxis.job import run_batch
from fiveaxis.job.batch.comparison import RESULTS
from fiveaxis.job.batch.ledger import LINES, TABLE
from fiveaxis.job.batch.record import Status


def infeasible():
    found = Finding(Severity.ERROR, "no-posture", "location 1: nothing is admissible")
    return Infeasible("1 of 2 locations have no admissible posture", [found])


def test_jobs_of_every_kind_of_end_are_listed_and_none_stops_the_others(jobs, pretended, tmp_path):
    pretended.faults = {
        "path_a.csv": infeasible(),
        "path_b.csv": InputError("is wrong", file="path_b.csv"),
        "path_c.csv": ZeroDivisionError("by zero"),
    }
    done = run_batch(jobs, tmp_path / "out", workers=2)
    ends = {row.name: (str(row.status), row.message.partition(" (")[0]) for row in done.rows}
    assert ends == {
        "a": ("no posture", "1 of 2 locations have no admissible posture"),
        "b": ("wrong input", "path_b.csv: is wrong"),
        "c": ("broken", "ZeroDivisionError: by zero"),
        "d": ("fine", ""),
    }
    assert done.exit_code == 4
    assert done.rows[0].counts == {"no-posture": 1}
    assert done.rows[3].energy == 1000.0
    assert done.rows[3].saved == pytest.approx(0.5)
    assert sorted(p.name for p in (tmp_path / "out" / "d").iterdir()) == ["program.ngc", "report.json"]
    assert sorted(p.name for p in (tmp_path / "out").iterdir() if p.is_dir()) == ["d"]


def test_one_job_needs_no_list(jobs, pretended, tmp_path):
    assert [row.name for row in run_batch(jobs[0], tmp_path / "out", workers=1).rows] == ["a"]


def test_a_job_with_errors_gives_1_and_no_program(jobs, pretended, tmp_path):
    pretended.unsound = {"path_a.csv"}
    done = run_batch(jobs[:2], tmp_path / "out", workers=1)
    assert [row.status for row in done.rows] == [Status.ERRORS, Status.FINE]
    assert done.exit_code == 1
    assert done.rows[0].files == ["report.json"]


def test_what_is_done_isnt_run_again_and_what_failed_by_chance_is(jobs, pretended, tmp_path, caplog):
    caplog.set_level("INFO", logger="fiveaxis.job.batch")
    pretended.faults = {"path_a.csv": infeasible(), "path_c.csv": ZeroDivisionError("by zero")}
    first = run_batch(jobs, tmp_path / "out", workers=2)
    assert sorted(pretended.ran) == ["path_a.csv", "path_b.csv", "path_c.csv", "path_d.csv"]
    pretended.ran.clear()
    del pretended.faults["path_c.csv"]
    events = []
    second = run_batch(jobs, tmp_path / "out", workers=2, tell=events.append)
    assert pretended.ran == ["path_c.csv"]
    assert (first.exit_code, second.exit_code) == (4, 3)
    assert second.resumed == {"a", "b", "d"}
    assert [e.name for e in events if e.state == "done" and e.again] == ["a", "b", "d"]
    pretended.ran.clear()
    third = run_batch(jobs, tmp_path / "out")
    assert pretended.ran == []
    assert third.as_dict() == second.as_dict()
    told = [m for m in caplog.messages if "to run" in m]
    ends = "0 jobs done before, 0 that can't be read, 4", "3 jobs done before, 0 that can't be read, 1"
    assert told[:2] == [f"{end} to run" for end in ends]


def test_a_job_whose_inputs_changed_runs_again(jobs, pretended, tmp_path):
    run_batch(jobs, tmp_path / "out", workers=1)
    pretended.ran.clear()
    path = jobs[2].with_name("path_c.csv")
    path.write_text(path.read_text() + "2,0,0,0,0,1\n")
    run_batch(jobs, tmp_path / "out", workers=1)
    assert pretended.ran == ["path_c.csv"]


def test_a_job_whose_input_changes_while_it_runs_isnt_taken_for_done(jobs, pretended, tmp_path, monkeypatch):
    def edited(job, tell=None, checkpoint=None, run=pretended.run):
        job.input.write_text(job.input.read_text() + "2,0,0,0,0,1\n")
        return run(job, tell)

    monkeypatch.setattr("fiveaxis.job.batch.worker.run_task", edited)
    assert run_batch(jobs[:1], tmp_path / "out", workers=1).rows[0].digest == ""


def test_a_slip_in_a_job_file_costs_nothing_that_was_done(jobs, pretended, tmp_path):
    out = tmp_path / "out"
    first = run_batch(jobs[:1], out, workers=1)
    kept = {file.name: file.read_bytes() for file in (out / "a").iterdir()}
    right = jobs[0].read_text()
    pretended.ran.clear()
    for wrong in ("input = 3", "tlit = [15, 75]\n" + right):
        jobs[0].write_text(wrong)
        slipped = run_batch(jobs[:1], out, workers=1)
        assert [row.status for row in slipped.rows] == [Status.WRONG_INPUT]
        assert {file.name: file.read_bytes() for file in (out / "a").iterdir()} == kept
    jobs[0].write_text(right)
    again = run_batch(jobs[:1], out, workers=1)
    assert (pretended.ran, again.resumed, again.rows) == ([], {"a"}, first.rows)
    (line,) = (out / LINES).read_text().splitlines()
    assert json.loads(line)["status"] == "fine"


def test_an_input_that_is_away_for_a_moment_costs_nothing_that_was_done(jobs, pretended, tmp_path):
    out = tmp_path / "out"
    run_batch(jobs[:1], out, workers=1)
    kept = {file.name: file.read_bytes() for file in (out / "a").iterdir()}
    path = jobs[0].with_name("path_a.csv")
    path.rename(path.with_suffix(".away"))
    assert [row.status for row in run_batch(jobs[:1], out, workers=1).rows] == [Status.WRONG_INPUT]
    assert {file.name: file.read_bytes() for file in (out / "a").iterdir()} == kept
    path.with_suffix(".away").rename(path)
    assert run_batch(jobs[:1], out, workers=1).resumed == {"a"}


def test_the_files_are_the_same_whatever_the_number_of_workers_and_the_order(jobs, pretended, tmp_path):
    run_batch(jobs, tmp_path / "one", workers=1)
    run_batch(jobs[::-1], tmp_path / "three", workers=3)
    for name in (LINES, TABLE, RESULTS):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "three" / name).read_bytes()


def test_results_of_other_jobs_in_the_folder_stay(jobs, pretended, tmp_path):
    run_batch(jobs[:2], tmp_path / "out", workers=1)
    done = run_batch(jobs[2:3], tmp_path / "out", workers=1)
    assert [row.name for row in done.rows] == ["c"]
    lines = (tmp_path / "out" / LINES).read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == ["a", "b", "c"]


def test_an_interrupted_batch_keeps_what_is_done_and_the_next_does_the_rest(jobs, pretended, tmp_path):
    def press(event):
        if event.state == "done":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_batch(jobs, tmp_path / "out", workers=1, tell=press)
    (line,) = (tmp_path / "out" / LINES).read_text().splitlines()
    done = run_batch(jobs, tmp_path / "out", workers=1)
    assert done.resumed == {json.loads(line)["name"]}
    assert done.exit_code == 0


def test_what_killed_workers_left_is_removed_also_of_jobs_that_are_done(jobs, pretended, tmp_path):
    out = tmp_path / "out"
    run_batch(jobs[:1], out, workers=1)
    left = [*leave_behind(out), *leave_behind(out / "a")]
    run_batch(jobs[:1], out, workers=1)
    assert [path for path in left if path.exists()] == []


def test_a_sweep_ends_in_a_page_a_table_and_a_figure_of_its_variants(write_job, pretended, tmp_path):
    file = write_job(
        "cup", "tilt = [15, 75]\n[sweep]\nsetup.offset = [[0, 0, 0], [0, 0, 100], [0, 0, -50]]\n"
    )
    done = run_batch([file], tmp_path / "out", workers=2)
    own = tmp_path / "out" / "cup"
    assert (own / "comparison.csv").read_text().splitlines() == [
        "job,setup.offset,status,energy_J,travel_metric_J,base_J,time_s,starts,reversals,baseline,baseline_J,"
        "saved,baseline_starts,baseline_reversals,against_first",
        '"cup/setup.offset=0,0,0","[0, 0, 0]",fine,1000.0,2000.0,,9.5,51,62,normal,2000.0,0.5,15,291,0.0',
        '"cup/setup.offset=0,0,100","[0, 0, 100]",fine,1100.0,2200.0,,9.5,51,62,normal,2000.0,'
        "0.44999999999999996,15,291,0.10000000000000009",
        '"cup/setup.offset=0,0,-50","[0, 0, -50]",fine,950.0,1900.0,,9.5,51,62,normal,2000.0,0.525,15,291,'
        "-0.050000000000000044",
    ]
    figure = (own / "comparison.svg").read_text()
    words = ("1\u2009000 J", "1\u2009100 J", "950 J", "no base load (J)", "optimised")
    assert all(said in figure for said in words)
    names = ("comparison.html", "comparison.csv", "comparison.svg")
    assert done.comparisons[0].files == tuple(own / name for name in names)
    run_batch([file], tmp_path / "again", workers=1)
    for name in names:
        assert (tmp_path / "again" / "cup" / name).read_bytes() == (own / name).read_bytes()


def test_a_sweep_that_could_not_be_read_for_once_leaves_no_row_of_its_own(write_job, pretended, tmp_path):
    file = write_job("cup", "[sweep]\ntilt = [[15, 75], [15, 60]]\n")
    right = file.read_text()
    for text, names in (("[[[", ["cup"]), (right, ["cup/tilt=15,75", "cup/tilt=15,60"])):
        file.write_text(text)
        run_batch([file], tmp_path / "out", workers=1)
        rows = (tmp_path / "out" / LINES).read_text().splitlines()
        assert sorted(json.loads(line)["name"] for line in rows) == sorted(names)


def test_a_sweep_whose_variants_fail_is_compared_all_the_same(write_job, pretended, tmp_path):
    pretended.faults = {"path.csv": infeasible()}
    file = write_job("cup", "[sweep]\ntilt = [[15, 75], [75, 15]]\n")
    done = run_batch([file], tmp_path / "out", workers=1)
    assert [row.status for row in done.comparisons[0].rows] == [Status.NO_POSTURE, Status.WRONG_INPUT]
    assert "no posture" in (tmp_path / "out" / "cup" / "comparison.svg").read_text()


def test_without_dask_a_scheduler_says_what_to_install(jobs, tmp_path, monkeypatch):
    def lacking(name, *rest, find=builtins.__import__):
        if name == "distributed":
            raise ImportError(name)
        return find(name, *rest)

    monkeypatch.setattr(builtins, "__import__", lacking)
    with pytest.raises(MissingDependency, match=r"pip install 'fiveaxis\[cluster\]'"):
        run_batch(jobs, tmp_path / "out", scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"job_timeout": 0.0}, "--job-timeout is 0; it must be above 0"),
        ({"job_memory": float("nan")}, "--job-memory is nan; it must be above 0"),
        ({"job_memory": 1.0, "scheduler": "tcp://host:1"}, "--job-memory is for workers of this computer"),
    ],
)
def test_limits_are_above_0_and_for_workers_of_this_computer(jobs, tmp_path, given, message):
    with pytest.raises(SettingError, match=message):
        run_batch(jobs, tmp_path / "out", **given)


def test_workers_are_counted_from_one(jobs, tmp_path):
    with pytest.raises(SettingError, match="workers is 0"):
        run_batch(jobs, tmp_path / "out", workers=0)
