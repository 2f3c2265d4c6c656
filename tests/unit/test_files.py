"""Files appear whole or not at all, and are read once as long as they stay."""

import csv
import errno
import hashlib
import os
import sys
import time
from pathlib import Path

import pytest
from support.killed_writer import leave_behind

from fiveaxis.base import require_folder
from fiveaxis.base.errors import InputError, SettingError
from fiveaxis.base.files import (
    csv_text,
    hash_input,
    kept_by_file,
    read_input,
    remove_leftovers,
    temporary_folder,
    write_atomically,
)


def test_text_is_written_as_it_is_and_nothing_else_is_left(tmp_path):
    target = tmp_path / "part.ngc"
    assert write_atomically(target, "G1 X1\nM2\n") == target
    assert target.read_bytes() == b"G1 X1\nM2\n"
    assert list(tmp_path.iterdir()) == [target]


def test_missing_folders_are_made(tmp_path):
    assert write_atomically(tmp_path / "a" / "b" / "c.txt", b"\x00").read_bytes() == b"\x00"


def test_an_existing_file_is_replaced(tmp_path):
    target = tmp_path / "part.ngc"
    target.write_text("a much longer old program")
    write_atomically(target, "new")
    assert target.read_text() == "new"


def test_a_file_has_the_permissions_of_any_new_file(tmp_path):
    plain = tmp_path / "plain"
    plain.write_text("")
    assert write_atomically(tmp_path / "part.ngc", "").stat().st_mode == plain.stat().st_mode


def test_a_failing_write_leaves_the_old_file_and_no_remains(tmp_path, monkeypatch):
    target = tmp_path / "part.ngc"
    target.write_text("old")

    def fail(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(SettingError, match=r"part\.ngc: can't be written: No space left"):
        write_atomically(target, "new")
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_interrupted_write_leaves_no_remains(tmp_path, monkeypatch):
    def interrupt(_descriptor):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "part.ngc", "new")
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_and_the_file_that_it_leads_to_is_replaced(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "part.ngc").write_text("old")
    link, chain = tmp_path / "part.ngc", tmp_path / "latest"
    link.symlink_to("real/part.ngc")
    chain.symlink_to(link)
    assert write_atomically(chain, "new") == chain
    assert chain.is_symlink()
    assert link.is_symlink()
    assert (tmp_path / "real" / "part.ngc").read_text() == "new"
    assert [p.name for p in (tmp_path / "real").iterdir()] == ["part.ngc"]


def test_a_link_to_nothing_yet_gets_its_file(tmp_path):
    (tmp_path / "part.ngc").symlink_to("later/part.ngc")
    write_atomically(tmp_path / "part.ngc", "new")
    assert (tmp_path / "later" / "part.ngc").read_text() == "new"


def test_what_is_no_file_is_refused_and_stays(tmp_path):
    pipe, circle = tmp_path / "pipe", tmp_path / "circle"
    os.mkfifo(pipe)
    circle.symlink_to(circle)
    for place, reason in (
        (pipe, "no regular file"),
        (circle, "circle|symbolic links"),
        (tmp_path, "a folder"),
    ):
        with pytest.raises(SettingError, match=f"can't be written: .*({reason})"):
            write_atomically(place, "new")
    assert pipe.is_fifo()
    assert circle.is_symlink()


@pytest.mark.parametrize("name", [".", "file/below"])
def test_a_place_that_cannot_hold_a_file_is_refused(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingError, match="can't be written"):
        write_atomically(tmp_path / name, "new")


@pytest.mark.skipif(sys.platform == "win32", reason="a process can't be killed like that there")
def test_what_a_killed_run_has_left_is_removed_by_the_next_and_that_of_one_that_runs_stays(tmp_path):
    for write in (
        lambda: write_atomically(tmp_path / "part.ngc", "new"),
        lambda: require_folder(tmp_path),
        lambda: require_folder(tmp_path / "out"),
    ):
        with temporary_folder(tmp_path) as running:
            left = leave_behind(tmp_path)
            write()
            assert running.is_dir()
        assert [path for path in left if path.exists()] == []


def test_what_another_computer_has_stays_unless_nobody_else_writes_into_the_folder(tmp_path, monkeypatch):
    with temporary_folder(tmp_path) as running:
        monkeypatch.setattr("platform.node", lambda: "elsewhere")
        remove_leftovers(tmp_path)
        assert running.is_dir()
        remove_leftovers(tmp_path, alone=True)
        assert not running.exists()


def test_a_folder_above_is_cleared_too_where_a_killed_run_had_not_made_its_own_yet(tmp_path):
    left = leave_behind(tmp_path)
    (tmp_path / "out").mkdir()
    require_folder(tmp_path / "out")
    assert [path for path in left if path.exists()] == []


@pytest.mark.parametrize("text", ["=1+1", "+cmd|' /C calc'!A0", "@SUM(A1)", "-2+3", " \t=1", "\r=1", "＝1"])
def test_text_that_a_spreadsheet_would_take_for_a_formula_is_marked_as_text(text):
    ((cell, number),) = csv.reader([csv_text([[text, -2.5]])])
    assert (cell, number) == (f"'{text.strip()}", "-2.5")


@pytest.mark.parametrize("text", ["a=b", "-2.5", "-1e-3", "", "cup-2"])
def test_other_text_of_one_line_is_written_as_it_is(text):
    assert next(csv.reader([csv_text([[text, "end"]])])) == [text, "end"]


def held(name: str) -> PermissionError:
    """Windows' error for a file that another program has open."""
    fault = PermissionError(errno.EACCES, "it is being used by another process", name)
    fault.winerror = 32
    return fault


@pytest.mark.parametrize("times", [2, 1000])
def test_a_file_that_another_program_holds_is_replaced_once_it_lets_go(tmp_path, monkeypatch, times):
    monkeypatch.setattr("fiveaxis.base.files.PAUSE", 0.0)
    path, replace, refused = tmp_path / "a.csv", Path.replace, []
    path.write_text("old")

    def refusing(self, target):
        if len(refused) < times:
            refused.append(target)
            raise held(str(target))
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", refusing)
    if times == 2:
        write_atomically(path, "new")
    else:
        with pytest.raises(
            SettingError, match=r"a\.csv: can't be written: it is being used by another process"
        ):
            write_atomically(path, "new")
    assert path.read_text() == ("new" if times == 2 else "old")
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]


def test_what_is_moved_out_of_a_temporary_folder_has_the_access_of_any_new_file(tmp_path):
    (tmp_path / "plain").mkdir()
    with temporary_folder(tmp_path) as made:
        assert made.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_file_is_read_once_as_long_as_it_stays_as_it_is(tmp_path):
    file, opened = tmp_path / "mill.toml", []

    @kept_by_file(2)
    def read(path, *, suffix):
        opened.append(path)
        return path.read_text(encoding="utf-8") + suffix

    file.write_text("a", encoding="utf-8")
    os.utime(file, (1, 1))
    assert read(file, suffix="!") == read(file, suffix="!") == "a!"
    assert len(opened) == 1
    assert read(file, suffix="?") == "a?"
    file.write_text("b", encoding="utf-8")  # of the same size
    os.utime(file, (2, 2))
    assert read(file, suffix="!") == "b!"


@pytest.mark.skipif(sys.platform == "win32", reason="its files have no time of their own change")
def test_a_copy_with_size_and_time_of_what_it_replaces_is_read_again(tmp_path):
    """As ``cp -p`` and archives leave it."""
    file = tmp_path / "part.stl"
    read = kept_by_file(2)(Path.read_text)
    for content in ("a", "b"):
        file.write_text(content, encoding="utf-8")
        os.utime(file, (1, 1))
        assert read(file) == content
        assert hash_input(file, InputError) == hashlib.sha256(content.encode()).hexdigest()
        time.sleep(0.05)


def test_where_the_clock_counts_seconds_a_file_is_kept_later(tmp_path):
    file, opened = tmp_path / "mill.toml", []
    read = kept_by_file(2)(opened.append)
    file.write_text("a", encoding="utf-8")
    second = time.time_ns() // 10**9 - 1
    os.utime(file, ns=(second * 10**9, second * 10**9))
    read(file)
    read(file)
    assert len(opened) == 2


def test_a_file_that_was_written_just_now_is_read_each_time(tmp_path):
    """The clock of a file system may be too coarse to tell two changes apart."""
    file, opened = tmp_path / "mill.toml", []
    read = kept_by_file(2)(opened.append)
    file.write_text("a", encoding="utf-8")
    later = time.time_ns() + 10**12
    os.utime(file, ns=(later, later))
    read(file)
    read(file)
    assert len(opened) == 2


def test_the_hash_of_a_file_that_was_read_is_that_of_what_was_read(tmp_path, monkeypatch):
    file = tmp_path / "part.stl"
    file.write_bytes(b"solid")
    os.utime(file, (1, 1))
    assert read_input(file, 10, InputError) == b"solid"
    monkeypatch.setattr(Path, "open", lambda *_, **__: pytest.fail("opened again"))
    assert hash_input(file, InputError) == hashlib.sha256(b"solid").hexdigest()
