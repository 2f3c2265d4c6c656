"""What job files ask for, and by what a job is recognised."""

import os
import re
import sys
from pathlib import Path

import pytest

from fiveaxis.base.errors import JobError, SettingError
from fiveaxis.job.batch.record import Status
from fiveaxis.job.batch.tasks import QueuedJob, plan_tasks

MACHINES = Path(__file__).parents[4] / "machines"
BALL = 'shape = "ball"\ndiameter = {}\n'
ALL = """tilt = [15, 75]
part = "part.stl"
stock = "stock.stl"
[[fixture]]
name = "vice"
mesh = "vice.stl"
"""


def write_rich(write_job):
    """Write a job that names a file of every kind."""
    file = write_job("rich", ALL)
    head = file.read_text().replace('"hayashi-640123"', '"own.toml"').replace('"ball:10"', '"tool.toml"')
    file.write_text('control = "control.toml"\n' + head)
    folder = file.parent
    (folder / "own.toml").write_bytes((MACHINES / "hayashi-640123.toml").read_bytes())
    (folder / "tool.toml").write_text(BALL.format(10))
    (folder / "control.toml").write_text('based_on = "fanuc"\n')
    for name in ("part", "stock", "vice"):
        (folder / f"{name}.stl").write_text("a mesh")
    return file


def digest(file):
    return QueuedJob(file.stem, file).digest()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("path.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n2,0,0,0,0,1\n"),
        ("part.stl", "another"),
        ("stock.stl", "another"),
        ("vice.stl", "another"),
        ("tool.toml", BALL.format(12)),
        ("control.toml", 'based_on = "fanuc"\nsuffix = ".tap"\n'),
        ("own.toml", None),
        ("rich.toml", None),
    ],
)
def test_the_hash_changes_with_every_file_of_a_job(write_job, name, text):
    file = write_rich(write_job)
    before = digest(file)
    path = file.parent / name
    changed = path.read_text().replace("[15, 75]", "[20, 75]") if text is None else text
    path.write_text("# another word\n" + changed if name == "own.toml" else changed)
    assert digest(file) != before


def test_the_hash_stays_where_nothing_that_counts_changes(write_job):
    first = write_rich(write_job)
    before = digest(first)
    first.write_text("# a comment\n" + first.read_text())
    moved = first.parent.rename(first.parent.parent / "elsewhere")
    assert digest(moved / first.name) == before


def test_the_hash_changes_with_the_version(write_job, monkeypatch):
    file = write_job("a")
    before = digest(file)
    monkeypatch.setattr("fiveaxis.job.digest.__version__", "99.0")
    assert digest(file) != before


def test_each_variant_has_a_hash_of_its_own_that_other_values_dont_change(write_job):
    file = write_job("cup", "[sweep]\ntilt = [[15, 75], [30, 60]]\n")
    before = plan_tasks([file])
    assert len(set(before.digests.values())) == 2
    write_job("cup", "[sweep]\ntilt = [[20, 60], [15, 75], [30, 60]]\n")
    after = plan_tasks([file])
    assert before.digests.items() < after.digests.items()
    assert after.sweeps == {"cup": ["cup/tilt=20,60", "cup/tilt=15,75", "cup/tilt=30,60"]}


def test_two_jobs_of_one_name_are_refused_with_both_files(write_job):
    one, other = write_job("cup"), write_job("Cup", folder="more")
    with pytest.raises(SettingError, match=r"Cup\.toml: is called 'Cup', and so is .*cup\.toml; rename one"):
        plan_tasks([one, other])


@pytest.mark.parametrize(
    "name", ["results.csv", "Results.JSONL", ".hidden", "...", "b\nc", "\x1b[2J", "NUL", "com1.a", "end."]
)
def test_names_that_no_job_can_have_are_refused(write_job, name):
    with pytest.raises(SettingError, match="a job can't be called"):
        plan_tasks([write_job(name)])


def test_no_files_are_refused():
    with pytest.raises(SettingError, match="no job files"):
        plan_tasks([])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("tilt = [75, 15]\n", r"a\.toml:4: tilt range 75…15 deg is empty"),
        ("stepdwn = 1\n", r"a\.toml:4: unknown key 'stepdwn'; the nearest known one is 'plan.stepdown'"),
        ("tilt = \n", r"a\.toml:4: is not valid TOML"),
        ("[sweep]\ncone = 3\n", r"a\.toml:5: sweep.cone = 3 must be a list"),
        (
            "[sweep]\ncoen = [3]\n",
            r"in the variant a/coen=3: unknown key 'coen'; the nearest known one is 'cone'",
        ),
        ('[sweep]\nmachine = ["gone"]\n', r"in the variant a/machine=gone: .*unknown machine 'gone'"),
        ('[[fixture]]\nname = "v"\nmesh = "gone.stl"\n', r"gone\.stl: no such file"),
    ],
)
def test_a_job_that_cant_be_read_is_a_row_and_the_others_stay(write_job, more, message):
    planned = plan_tasks([write_job("a", more), write_job("b")])
    (row,) = planned.faults
    assert row.status is Status.WRONG_INPUT
    with pytest.raises(JobError, match=message):
        raise JobError(row.message)
    assert list(planned.tasks) == ["b"]


@pytest.mark.parametrize(
    "more",
    [
        pytest.param("deep = " + "[" * 5000 + "]" * 5000, id="nested"),
        pytest.param("deep = " + "{a=" * 5000 + "1" + "}" * 5000, id="tables"),
        pytest.param("[sweep]\nfeed = [" + "[" * 150 + "]" * 150 + "]", id="sweep-nested"),
        pytest.param("feed = " + "9" * 5000, id="digits"),
        pytest.param("[sweep]\nfeed = [" + "9" * 5000 + "]", id="sweep-digits"),
        pytest.param(f'part = "{"x" * 5000}.stl"', id="name"),
        pytest.param(f'machine = "{"x" * 5000}.toml"', id="machine-name"),
        pytest.param('part = "nul\\u0000.stl"', id="null"),
        pytest.param(f'control = "{"c" * 1_000_000}"', id="megabyte"),
    ],
)
def test_whatever_a_job_file_holds_is_a_row_with_a_short_message_and_the_others_stay(write_job, more):
    planned = plan_tasks([write_job("a", more), write_job("b")])
    (row,) = planned.faults
    assert row.status is Status.WRONG_INPUT
    assert 20 < len(row.message) < 3000
    assert list(planned.tasks) == ["b"]


@pytest.mark.skipif(sys.platform == "win32", reason="no such pipes there")
def test_pipes_and_devices_are_rows_too_and_never_waited_for(write_job, tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "null.toml").symlink_to("/dev/null")
    (tmp_path / "folder.toml").mkdir()
    os.mkfifo(write_job("fed").with_name("feed.csv"))
    fed = write_job("fed")
    fed.write_text(fed.read_text().replace("path.csv", "feed.csv"))
    endless = write_job("endless", 'part = "/dev/zero"\n')
    odd = [tmp_path / f"{name}.toml" for name in ("pipe", "null", "folder", "gone", "x" * 5000)]
    planned = plan_tasks([*odd, fed, endless, write_job("b")])
    assert [row.status for row in planned.faults] == [Status.WRONG_INPUT] * 7
    assert list(planned.tasks) == ["b"]


def test_a_fault_of_the_program_in_reading_a_job_is_a_row_too(write_job, monkeypatch):
    def fail(*_):
        raise ZeroDivisionError("x" * 1_000_000)

    monkeypatch.setattr("fiveaxis.job.batch.tasks.digest_job", fail)
    (row,) = plan_tasks([write_job("a")]).faults
    assert row.status is Status.BROKEN
    assert re.match(r"ZeroDivisionError: xxx.* characters.* xxx+ \(test_tasks.py:\d+\)$", row.message)


def test_one_bad_value_of_a_sweep_costs_its_variant_only(write_job):
    planned = plan_tasks([write_job("a", "[sweep]\ntilt = [[15, 75], [75, 15]]\n")])
    assert list(planned.tasks) == ["a/tilt=15,75"]
    assert [row.name for row in planned.faults] == ["a/tilt=75,15"]
