"""The verb: exit codes, what it prints where, and what it leaves; on threads that pretend to optimise."""

import csv
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from fiveaxis.base.errors import Infeasible
from fiveaxis.base.findings import Finding, Severity
from fiveaxis.cli.commands import app

SWEEP = "[sweep]\ntilt = [[15, 75], [30, 60]]\n"
# What each job ends as; the exit code of a batch is that of its worst.
ENDS = {
    "broken": "broken",
    "cup/tilt=15,75": "fine",
    "cup/tilt=30,60": "fine",
    "fine": "fine",
    "none": "no posture",
    "unsound": "errors",
    "wrong": "wrong input",
}


def run(files: list[Path], out: Path, *words: str) -> Any:
    given = ["batch", *map(str, files), "-o", str(out), "--workers", "2", *words]
    return CliRunner().invoke(app, given)


@pytest.fixture(scope="module")
def lot(tmp_path_factory, pretending, writing) -> SimpleNamespace:
    """Jobs of every kind of end and a sweep, run once by the verb."""
    folder = tmp_path_factory.mktemp("lot")
    names = ("broken", "fine", "none", "unsound")
    files = {name: writing(folder / "jobs", name) for name in names}
    files["wrong"] = writing(folder / "jobs", "wrong", "tilt = [75, 15]\n")
    files["cup"] = writing(folder / "jobs", "cup", SWEEP)
    found = Finding(Severity.ERROR, "no-posture", "nothing is admissible", value=float("inf"))
    with pretending() as stand_in:
        stand_in.faults = {"path_none.csv": Infeasible("no way", [found])}
        stand_in.faults |= {"path_broken.csv": ZeroDivisionError("by zero")}
        stand_in.unsound = {"path_unsound.csv"}
        result = run(list(files.values()), folder / "out", "--json")
    return SimpleNamespace(folder=folder, out=folder / "out", files=files, result=result)


def test_json_is_one_document_alone_on_stdout(lot):
    document = json.loads(lot.result.stdout)
    assert {job["name"]: job["status"] for job in document["jobs"]} == ENDS
    assert document["counts"]["fine"] == 3
    assert [sweep["sweep"] for sweep in document["sweeps"]] == ["cup"]
    (found,) = next(job for job in document["jobs"] if job["name"] == "none")["findings"]
    assert found["value"] is None  # JSON knows no infinite number


def test_the_faults_of_a_job_are_listed_by_cause(lot, pretending):
    rows = {job["name"]: job for job in json.loads(lot.result.stdout)["jobs"]}
    (cause,) = rows["unsound"]["summary"]
    assert (cause["code"], cause["count"], rows["unsound"]["errors"]) == ("axis-limit", 1, 1)
    assert [cause["code"] for cause in rows["none"]["summary"]] == ["no-posture"]
    with pretending():
        told = run([lot.files["unsound"], lot.files["none"]], lot.out)
    assert "unsound: error: axis-limit (1): A is too far, at location 1 [axis-limit]" in told.stdout
    assert "none: error: no-posture (1): nothing is admissible [no-posture]" in told.stdout


def test_where_estimates_leave_open_whether_a_job_saves_no_share_is_told(lot, pretending, tmp_path):
    with pretending() as stand_in:
        stand_in.to_measure = "measure the drives of X"
        told = run([lot.files["fine"]], tmp_path)
    assert "fine: fine, 1000 J, saving not known (1 of 1)" in told.stderr
    assert re.search(r"^ *fine +fine +1000 +not known +9.5 ", told.stdout, re.M)
    (row,) = csv.DictReader((tmp_path / "results.csv").read_text().splitlines())
    assert (row["saved"], row["baseline_J"]) == ("", "2000.0")


def test_each_job_is_a_line_on_stderr_where_that_is_no_terminal(lot):
    lines = [line for line in lot.result.stderr.splitlines() if line.endswith(f" of {len(ENDS)})")]
    assert sorted(line.partition(": ")[0] for line in lines) == list(ENDS)
    assert lines[-1].endswith(f"({len(ENDS)} of {len(ENDS)})")
    assert "\x1b" not in lot.result.stderr


def test_a_failing_job_costs_the_others_nothing(lot):
    assert lot.result.exit_code == 4
    left = {place.parent.relative_to(lot.out).as_posix() for place in lot.out.rglob("report.json")}
    assert left == {name for name, end in ENDS.items() if end in ("fine", "errors")}
    rows = list(csv.DictReader((lot.out / "results.csv").read_text().splitlines()))
    assert {row["job"]: row["status"] for row in rows} == ENDS


def test_the_tables_have_the_starts_and_reversals_of_each_job(lot):
    table = list(csv.DictReader((lot.out / "results.csv").read_text().splitlines()))
    (fine,) = [row for row in table if row["job"] == "fine"]
    names = ("starts", "reversals", "baseline_starts", "baseline_reversals")
    assert [fine[name] for name in names] == ["51", "62", "15", "291"]
    page = (lot.out / "results.html").read_text("utf-8")
    for name in ("starts", "reversals", "starts, baseline", "reversals, baseline"):
        assert f'<button type="button">{name}</button>' in page
    words = run([lot.files["fine"]], lot.out).stdout
    assert re.search(r"^ *job +state +J +saved +s +starts +reversals *$", words, re.M)
    assert re.search(r"^ *fine +fine .* 51 +62 *$", words, re.M)


def test_a_sweep_ends_in_a_page_a_table_and_a_figure_and_each_is_named(lot):
    result = run([lot.files["cup"]], lot.out)
    assert "sweep cup" in result.stdout
    assert "against the first" in result.stdout
    comparisons = (f"cup/comparison.{kind}" for kind in ("html", "csv", "svg"))
    for name in ("results.csv", "results.html", *comparisons):
        assert f"wrote {lot.out / name}" in result.stderr
    rows = list(csv.DictReader((lot.out / "cup" / "comparison.csv").read_text().splitlines()))
    assert [row["tilt"] for row in rows] == ["[15, 75]", "[30, 60]"]
    picture = ElementTree.parse(lot.out / "cup" / "comparison.svg")
    assert picture.getroot().tag.endswith("svg")


def test_quiet_leaves_the_table_and_nothing_else(lot):
    result = run([lot.files["fine"]], lot.out, "-q")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "energy of the feed drives" in result.stdout


@pytest.mark.parametrize(
    ("files", "words", "message"),
    [
        ([], (), "Missing argument"),
        (["fine", "more/Fine"], (), "is called 'Fine', and so is"),
        (["fine"], ("--workers", "0"), "--workers"),
        (["fine"], ("--scheduler", "nonsense"), "no scheduler answers at nonsense"),
        (["fine"], ("-o", "jobs/fine.toml"), "is a file; name a folder"),
    ],
)
def test_bad_input_is_refused_before_anything_is_written(
    lot, writing, tmp_path, monkeypatch, files, words, message
):
    for file in ("jobs/fine", "jobs/more/Fine"):
        writing((tmp_path / file).parent, Path(file).name)
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    result = run([Path("jobs", f"{name}.toml") for name in files], Path("out"), *words)
    assert result.exit_code == 2
    assert message in result.stderr
    assert sorted(tmp_path.rglob("*")) == before
