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


def test_of_many_places_the_first_are_printed_and_json_lists_all(capsys):
    places = [Finding(Severity.ERROR, "no-posture", "why", Place(location=i)) for i in range(300)]
    with pytest.raises(typer.Exit), errors_explained(True):
        raise Infeasible("300 of 300 locations", places)
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 22
    assert "and 280 more places; --json lists all 300" in said.err
    assert len(json.loads(said.out)["findings"]) == 300
