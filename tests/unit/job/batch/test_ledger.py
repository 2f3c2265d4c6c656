"""The results of a batch on the disk."""

import csv
import datetime
import json
import math
import os
import threading

import pytest

from fiveaxis.base.errors import InputError, SettingError
from fiveaxis.job import Row
from fiveaxis.job.batch.ledger import LINES, TABLE, Ledger, locked, own_folder, read_rows
from fiveaxis.job.batch.record import COLUMNS, Status, row_of_fault, worst


def row(name, status=Status.FINE, **more):
    return Row(name, f"{name}.toml", status, **more)


def test_rows_come_back_as_they_were_sorted_by_name(tmp_path):
    rows = [
        row("b", energy=0.1 + 0.2, values={"tilt": [15, 75]}, counts={"gouge": 2}, files=["report.json"]),
        row("a", Status.NO_POSTURE, message="of\ntwo lines", findings=[{"code": "tilt"}], digest="7" * 64),
    ]
    Ledger(tmp_path).record(*rows)
    back = read_rows(tmp_path / LINES)
    assert [r.as_dict() for r in back] == [r.as_dict() for r in reversed(rows)]


def test_the_table_has_a_line_a_job_and_units_in_its_head(tmp_path):
    Ledger(tmp_path).record(row("b", energy=12.5), row("a,c", message="of\ntwo lines"))
    lines = (tmp_path / TABLE).read_text().splitlines()
    found = list(csv.DictReader(lines))
    assert lines[0] == ",".join(COLUMNS)
    assert [(r["job"], r["energy_J"], r["message"]) for r in found] == [
        ("a,c", "", "of two lines"),
        ("b", "12.5", ""),
    ]


def test_no_cell_of_the_table_is_a_formula(tmp_path):
    Ledger(tmp_path).record(row("=2+3", message="\n@SUM(A1)", energy=-1.5))
    (found,) = csv.DictReader((tmp_path / TABLE).read_text().splitlines())
    assert (found["job"], found["message"], found["energy_J"]) == ("'=2+3", "'@SUM(A1)", "-1.5")


def test_a_message_about_a_file_whose_name_is_no_text_can_be_written(tmp_path):
    Ledger(tmp_path).record(row_of_fault(row("a"), InputError("is wrong", file="b\udcff.csv")))
    (found,) = csv.DictReader((tmp_path / TABLE).read_text().splitlines())
    assert found["message"] == r"b\udcff.csv: is wrong"


def test_a_job_has_one_row_however_often_it_is_recorded(tmp_path):
    ledger = Ledger(tmp_path)
    ledger.record(row("a", Status.BROKEN))
    ledger.record(row("b"))
    ledger.record(row("a"))
    assert [(r.name, r.status) for r in read_rows(tmp_path / LINES)] == [("a", "fine"), ("b", "fine")]


def test_a_reader_never_sees_half_a_line(tmp_path):
    ledger = Ledger(tmp_path)
    ledger.record(row("start"))
    ended, seen, broken = threading.Event(), [], []

    def read():
        while not ended.is_set():
            text = (tmp_path / LINES).read_text()
            table = (tmp_path / TABLE).read_text()
            try:
                seen.append(len([json.loads(line) for line in text.splitlines()]))
                assert text.endswith("\n")
                assert {len(r) for r in csv.reader(table.splitlines())} == {len(COLUMNS)}
            except Exception as fault:
                broken.append(fault)

    reader = threading.Thread(target=read)
    reader.start()
    for number in range(60):
        ledger.record(row(f"job{number}", message="long " * 400))
    ended.set()
    reader.join()
    assert broken == []
    assert seen == sorted(seen)


def test_a_crash_while_writing_loses_nothing_that_was_there(tmp_path, monkeypatch):
    ledger = Ledger(tmp_path)
    ledger.record(row("a"))

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(SettingError, match="No space left"):
        ledger.record(row("b"))
    monkeypatch.undo()
    assert [r.name for r in read_rows(tmp_path / LINES)] == ["a"]
    assert {p.name for p in tmp_path.iterdir()} == {LINES, TABLE}


def test_values_of_a_sweep_that_json_cant_hold_are_kept_as_text(tmp_path):
    values = {"feed": math.inf, "tilt": [datetime.date(1979, 5, 27), math.nan], "setup": {"offset": [1.5]}}
    Ledger(tmp_path).record(row("a", Status.WRONG_INPUT, values=values))
    (back,) = read_rows(tmp_path / LINES)
    assert back.values == {"feed": "inf", "tilt": ["1979-05-27", "nan"], "setup": {"offset": [1.5]}}


@pytest.mark.parametrize(
    "line", ["half a li", "[]", '{"name": "a"}', '{"name":"a","file":"b","status":"good"}']
)
def test_a_line_that_is_no_result_is_named(tmp_path, line):
    Ledger(tmp_path).record(row("a"))
    with (tmp_path / LINES).open("a") as stream:
        stream.write(line + "\n")
    with pytest.raises(SettingError, match=r"results\.jsonl:2: isn't a result of this version"):
        Ledger(tmp_path)


@pytest.mark.parametrize(
    ("status", "again"),
    [
        (Status.FINE, False),
        (Status.ERRORS, False),
        (Status.NO_POSTURE, False),
        (Status.WRONG_INPUT, True),
        (Status.BROKEN, True),
    ],
)
def test_what_the_inputs_decide_isnt_run_again(tmp_path, status, again):
    ledger = Ledger(tmp_path)
    ledger.record(row("a", status, digest="1"))
    assert (ledger.done("a", "1") is None) is again
    assert ledger.done("a", "2") is None
    assert ledger.done("b", "1") is None


def test_a_job_whose_files_are_gone_runs_again(tmp_path):
    ledger = Ledger(tmp_path)
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "report.json").write_text("")
    ledger.record(row("a", digest="1", files=["report.json"]))
    assert ledger.done("a", "1") is not None
    (tmp_path / "a" / "report.json").unlink()
    assert ledger.done("a", "1") is None


def test_files_of_an_earlier_run_dont_stand_beside_a_failure(tmp_path):
    ledger = Ledger(tmp_path)
    (tmp_path / "a").mkdir()
    for name in ("report.json", "notes.txt"):
        (tmp_path / "a" / name).write_text("")
    ledger.record(row("a", files=["report.json"]))
    ledger.record(row("a", Status.NO_POSTURE))
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["notes.txt"]


def test_a_link_out_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a").symlink_to(tmp_path)
    with pytest.raises(SettingError, match="is a link out of the folder"):
        own_folder(tmp_path / "out", "a/b")
    with pytest.raises(SettingError, match="is a link out of the folder"):
        own_folder(tmp_path / "out", "../b")


def test_links_in_a_circle_are_refused(tmp_path):
    (tmp_path / "a").symlink_to("a")
    with pytest.raises(SettingError, match="is a link out of the folder"):
        own_folder(tmp_path, "a")


def test_two_batches_dont_share_a_folder(tmp_path):
    with (
        locked(tmp_path),
        pytest.raises(SettingError, match="another batch is running in this folder"),
        locked(tmp_path),
    ):
        pass
    with locked(tmp_path):
        pass


def test_the_worst_job_decides_the_exit_code():
    order = [Status.FINE, Status.ERRORS, Status.NO_POSTURE, Status.WRONG_INPUT, Status.BROKEN]
    codes = [worst([row("a", status) for status in order[: n + 1]]).exit_code for n in range(5)]
    assert codes == [0, 1, 3, 2, 4]
    assert worst([]).exit_code == 0
