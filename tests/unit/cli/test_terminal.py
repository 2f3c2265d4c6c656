"""What verbs print and how."""

import json

import pytest
import typer
from typer.testing import CliRunner

from fiveaxis.cli import app
from fiveaxis.cli.terminal import errors_explained
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Place, Severity


def test_brackets_in_help_are_no_markup():
    text = CliRunner().invoke(app, ["verify", "--help"], env={"COLUMNS": "200"}).stdout
    assert "TOML with [[fixture]] and [clearance]" in text


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
