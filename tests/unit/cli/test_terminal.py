"""What commands print, and how options are parsed."""

import json
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from fiveaxis.base.errors import Infeasible, SettingError
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.cli.commands import app
from fiveaxis.cli.terminal import FIRST_RUN, errors_explained, parse_positions, print_first_run
from fiveaxis.posture.search.successor_kernel import advance


def test_brackets_in_help_are_no_markup():
    text = " ".join(CliRunner().invoke(app, ["verify", "--help-all"]).stdout.split())
    assert "TOML with [[fixture]] and [clearance]" in text
    assert "box:X:Y:Z or cylinder:DIAMETER:HEIGHT" in text


def test_many_places_of_one_cause_are_one_line_and_json_lists_all(capsys):
    places = [Finding(Severity.ERROR, "no-posture", "why", Place(location=i)) for i in range(300)]
    with pytest.raises(typer.Exit), errors_explained(True):
        raise Infeasible("300 of 300 locations", places)
    said = capsys.readouterr()
    assert said.err.splitlines() == [
        "error: 300 of 300 locations",
        "  error: no-posture (300): why, first at location 0 [no-posture]",
        "  --json lists all 300 findings",
    ]
    document = json.loads(said.out)
    assert len(document["findings"]) == 300
    assert [cause["count"] for cause in document["summary"]] == [300]


def test_the_first_run_says_that_it_compiles_until_something_compiled_is_kept(tmp_path, capsys):
    kernel = SimpleNamespace(py_func=advance.py_func, stats=SimpleNamespace(cache_path=str(tmp_path)))
    print_first_run(kernel)
    assert capsys.readouterr().err.strip() == FIRST_RUN
    (tmp_path / "successor_kernel.advance-59.py311.nbi").touch()
    print_first_run(kernel)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "words", [("optimise", "none.toml"), ("preview", "none.toml"), ("surface", "none.toml")]
)
def test_wrong_input_is_told_before_loops_are_compiled(tmp_path, monkeypatch, words):
    monkeypatch.setattr("fiveaxis.cli.path_verbs.print_first_run", lambda _: pytest.fail("said to compile"))
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert result.stderr == "error: none.toml: no such file\n"


def test_a_compiled_loop_says_where_it_is_kept():
    assert advance.stats.cache_path is not None


@pytest.mark.parametrize(
    ("text", "positions"),
    [
        ("X18,Y74,Z0", {"X": 18, "Y": 74, "Z": 0}),
        (" x-1.5 , c30", {"X": -1.5, "C": 30}),
        ("G55X18,g54.1p3z-2", {"G55X": 18, "G54.1P3Z": -2}),
    ],
)
def test_positions_are_of_axes_or_of_axes_in_a_work_offset(text, positions):
    assert parse_positions("--zero", text) == positions


@pytest.mark.parametrize("text", ["18", "X", "X1;Y2", "", "X1,,Y2"])
def test_what_is_no_position_is_refused_with_the_form(text):
    with pytest.raises(SettingError, match="isn't of the form X18,Y74,Z0"):
        parse_positions("--start", text)


def test_an_axis_is_named_once():
    with pytest.raises(SettingError, match="names an axis twice"):
        parse_positions("--start", "X1,x2")
