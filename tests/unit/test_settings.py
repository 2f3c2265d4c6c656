"""Settings files: what they may hold, and what is said when they don't."""

from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field, ValidationError

from fiveaxis.base.errors import JobError
from fiveaxis.base.settings import StrictModel, explain, line_of, read_settings


class Inner(StrictModel):
    stepdown: float = Field(1.0, gt=0.0)
    way: Literal["up", "down"] = "up"


class Outer(StrictModel):
    name: str
    range: tuple[float, float] = (0.0, 1.0)
    share: float = Field(0.5, ge=0.0, le=1.0)
    keep: bool = True
    plan: Inner = Inner()


def write(folder: Path, text: str) -> Path:
    path = folder / "settings.toml"
    path.write_text(text, encoding="utf-8")
    return path


def fault_of(folder: Path, text: str) -> JobError:
    with pytest.raises(JobError) as caught:
        read_settings(write(folder, text), Outer, JobError)
    return caught.value


def test_a_good_file_becomes_the_model(tmp_path):
    found = read_settings(write(tmp_path, 'name = "a"\nplan.stepdown = 2'), Outer, JobError)
    assert found == Outer(name="a", plan=Inner(stepdown=2.0))


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ('name = "a"\nshare = 2', 2, "share = 2 must be at most 1"),
        ('name = "a"\n\nshare = -1', 3, "share = -1 must be at least 0"),
        ('name = "a"\nshare = nan', 2, "share = nan must be a finite number"),
        ('name = "a"\nshare = "x"', 2, "share = 'x' must be a number"),
        ("name = 3", 1, "name = 3 must be text in quotes"),
        ('name = "a"\nkeep = "maybe"', 2, "keep = 'maybe' must be true or false"),
        ('name = "a"\nrange = 3', 2, "range = 3 must be a list in square brackets"),
        ('name = "a"\nrange = [3]', 2, "range[1] is missing"),
        ('name = "a"\nrange = [3, "x"]', 2, "range[1] = 'x' must be a number"),
        ('name = "a"\nplan = 3', 2, "plan = 3 must be a table of keys and values"),
        ('name = "a"\n[plan]\nstepdown = 0', 3, "plan.stepdown = 0 must be above 0"),
        ('name = "a"\n[plan]\nway = "left"', 3, "plan.way = 'left' must be 'up' or 'down'"),
        ("share = 1", None, "name is missing"),
        ('name = "a"\nshare = [', 2, "is not valid TOML"),
        ('name = "a"\nname = "b"\nshare = 1', 2, "is not valid TOML"),
    ],
)
def test_a_fault_has_its_line_and_says_what_the_value_must_be(tmp_path, text, line, message):
    fault = fault_of(tmp_path, text)
    assert message in fault.message
    assert (fault.file, fault.line) == (str(tmp_path / "settings.toml"), line)


@pytest.mark.parametrize(
    ("text", "line", "wrong", "near"),
    [
        ('nme = "a"', 1, "nme", "name"),
        ('name = "a"\nstepdwn = 1', 2, "stepdwn", "plan.stepdown"),
        ('name = "a"\n[pln]\nstepdown = 1', 2, "pln", "plan"),
        ('name = "a"\n[plan]\nstepdon = 1', 3, "plan.stepdon", "stepdown"),
    ],
)
def test_an_unknown_key_is_named_first_with_its_nearest(tmp_path, text, line, wrong, near):
    fault = fault_of(tmp_path, text)
    assert fault.message.startswith(f"unknown key {wrong!r}; the nearest known one is {near!r}")
    assert fault.line == line


def test_all_faults_of_a_file_are_in_one_message(tmp_path):
    assert fault_of(tmp_path, "share = 3\nkeep = 7").message.count("; ") == 2


def test_a_missing_file_a_folder_and_bytes_are_refused(tmp_path):
    with pytest.raises(JobError, match=r"gone\.toml: no such file$"):
        read_settings(tmp_path / "gone.toml", Outer, JobError)
    with pytest.raises(JobError, match="is a folder; name a file"):
        read_settings(tmp_path, Outer, JobError)
    (tmp_path / "bytes.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(JobError, match="isn't UTF-8 text"):
        read_settings(tmp_path / "bytes.toml", Outer, JobError)


def test_settings_from_elsewhere_are_explained_in_the_same_words():
    with pytest.raises(ValidationError) as caught:
        Outer.model_validate({"name": "a", "share": 2.0})
    assert explain(caught.value, Outer) == "share = 2.0 must be at most 1"


def test_a_key_in_an_inline_table_is_found_on_the_line_of_the_table():
    assert line_of('name = "a"\nplan = { stepdown = 0 }', ["plan", "stepdown"]) == 2
