"""Job files explained, and begun."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import trimesh
from typer.testing import CliRunner

from fiveaxis.base import list_entries, to_toml
from fiveaxis.base.errors import SettingError
from fiveaxis.cli.commands import app
from fiveaxis.job.batch.tasks import read_sweep
from fiveaxis.job.description import Job
from fiveaxis.job.guide import list_job_entries, starter_text, write_starter
from fiveaxis.job.reading import read_job
from fiveaxis.model.machine.tables import MachineFile
from fiveaxis.nc.writing.tables import Dialect

# Numbers that count or compare, and directions: they have no unit.
WITHOUT_UNIT = {
    "plane",
    "front",
    "pick",
    "feed_share",
    "process.teeth",
    "factors.price",
    "factors.hour",
    "fixture.cylinder.direction",
}
WITHOUT_UNIT |= {
    "nc.number",
    "nc.tool_number",
    "nc.length_offset",
    "nc.line_numbers",
    "setup.search.tries",
    "steady",
    "program.operation",
    "program.increment",
}


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(word) for word in words])


def commented() -> list[tuple[str, str]]:
    """List (table header or nothing, line of a field) of what the starter has as comments."""
    header, found = "", []
    for line in starter_text().splitlines():
        if re.match(r"# \[", line):
            header = line.removeprefix("# ")
        elif re.match(r"# \w+ = ", line):
            found.append((header, line.removeprefix("# ")))
    return found


def test_every_field_of_the_model_is_explained():
    keys = {entry.key for entry in list_job_entries()}
    assert set(Job.model_fields) <= keys
    assert {"plan.stepdown", "setup.offset", "nc.home", "fixture.box.size", "clearance.holder"} <= keys
    assert not [e.key for e in list_job_entries() if not e.description and not e.unit]


def test_every_number_has_a_unit_or_is_known_to_have_none():
    bare = {e.key for e in list_job_entries() if "number" in e.kind and not e.unit and not e.is_table}
    assert bare <= WITHOUT_UNIT


def test_a_field_is_explained_with_kind_unit_default_and_bounds():
    found = {entry.key: entry.as_dict() for entry in list_job_entries()}
    assert found["cone"]["type"] == "number > 0 and <= 180"
    assert (found["cone"]["unit"], found["cone"]["default"]) == ("deg", "")
    assert (found["max_turn"]["unit"], found["max_turn"]["default"]) == ("deg", "")
    assert found["input"]["default"] is None
    assert found["effort"]["type"] == '"quick" | "normal" | "thorough"'
    assert found["tilt"]["type"] == "[number, number]"


def test_a_sweep_is_explained_and_shown_in_a_new_file(tmp_path):
    told = {entry.key: entry for entry in list_job_entries()}
    assert "10000 at most" in told["sweep"].description
    assert told["sweep.combine"].kind == '"product" | "zip"'
    assert "setup.offset" in told["sweep.KEY"].description
    shown = starter_text().partition("# With a sweep the file is for `fiveaxis batch`:\n")[2]
    text = "".join(line.removeprefix("#   ") + "\n" for line in shown.splitlines())
    variants = read_sweep(tomllib.loads(text), text, tmp_path / "job.toml")
    assert len(variants) == 4


def test_no_field_is_explained_by_its_unit_alone():
    told = {entry.key: entry.description for entry in list_job_entries()}
    assert told["factors.co2"] == "emission of the electricity"
    assert told["fixture.box.size"] == "sides along X, Y and Z"
    assert told["nc.spindle_rpm"] != told["nc.spindle_direction"]


def test_a_field_has_the_whole_text_of_its_docstring():
    found = {entry.key: entry.description for entry in list_job_entries()}
    assert found["nc.home"].endswith("without a retract the first group must be Z alone")


@pytest.mark.parametrize("model", [Dialect, MachineFile], ids=lambda model: model.__name__)
def test_other_files_are_listed_too(model):
    assert set(model.model_fields) <= {entry.key for entry in list_entries(model)}


def test_explain_as_json_is_one_document_on_stdout():
    result = run("job", "--explain", "--json")
    assert result.exit_code == 0
    assert {entry["key"] for entry in json.loads(result.stdout)} == {e.key for e in list_job_entries()}


def test_explain_prints_a_line_for_each_field():
    result = run("job", "--explain")
    assert result.exit_code == 0
    assert all(entry.key in result.stdout for entry in list_job_entries())


def test_a_new_job_file_is_valid_once_its_input_exists(tmp_path):
    path = tmp_path / "new.toml"
    result = run("job", path, "--init")
    assert result.exit_code == 0, result.stderr
    trimesh.creation.box((10, 10, 10)).export(tmp_path / "part.stl")
    job = read_job(path)
    assert job.input == tmp_path / "part.stl"
    assert job.model_fields_set - {"fixture"} == {"input", "machine", "tool", "tilt"}


def test_a_new_job_file_without_its_input_says_what_is_missing(tmp_path):
    path = write_starter(tmp_path / "new.toml")
    with pytest.raises(Exception, match=r"input: .*part\.stl: no such file"):
        read_job(path)


def test_every_commented_field_may_be_uncommented():
    fields = commented()
    needed = {entry.key for entry in list_job_entries() if entry.default is None} | {
        "fixture.box",
        "setup.search.x",
    }
    for header, line in fields:
        table = header.strip("[]")
        required = [text for h, text in fields if h == header and f"{table}.{text.split(' =')[0]}" in needed]
        lines = ['input = "part.stl"', *([header] if header else []), line]
        lines += [text for text in required if text != line]
        Job.model_validate(tomllib.loads("\n".join(lines)))


def test_an_existing_file_is_not_overwritten(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("kept")
    result = run("job", path, "--init")
    assert result.exit_code == 2
    assert "exists already and isn't overwritten" in result.stderr
    assert path.read_text() == "kept"


def test_a_job_file_has_its_suffix(tmp_path):
    with pytest.raises(SettingError, match=r"let it end in \.toml"):
        write_starter(tmp_path / "job.txt")


@pytest.mark.parametrize("words", [(), ("--explain", "--init"), ("mine.toml", "--explain")])
def test_the_command_needs_exactly_one_of_its_options(words):
    assert run("job", *words).exit_code == 2


def test_values_are_written_as_toml():
    for value in ({"X": 1.5, "Y": "a"}, [1, 2.5, "ü"], True, 'a"b', Path("p")):
        read = tomllib.loads(f"v = {to_toml(value)}")["v"]
        assert read == (str(value) if isinstance(value, Path) else value)
