"""What `--help` and `--help-all` show."""

import re

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from fiveaxis.cli.commands import app
from fiveaxis.cli.help import MOST_SHOWN

VERBS = sorted([*get_command(app).commands.keys() - {"machine"}, "machine new"])
OPTION = re.compile(r"^  (?:-\w, )?--([a-z0-9-]+)", re.MULTILINE)


def shown(verb: str, flag: str) -> list[str]:
    told = CliRunner().invoke(app, [*verb.split(), flag])
    assert told.exit_code == 0
    return OPTION.findall(told.stdout)


@pytest.mark.parametrize("verb", VERBS)
def test_help_shows_few_options_and_how_to_see_the_others(verb):
    few, every = shown(verb, "--help"), shown(verb, "--help-all")
    assert few
    assert len(few) <= MOST_SHOWN == 14
    assert few[-2:] == ["help-all", "help"]
    assert set(few) <= set(every)
    assert len(every) == len(set(every))
    text = CliRunner().invoke(app, [*verb.split(), "--help"]).stdout.rstrip()
    left_out = f"--help-all shows all {len(every)} options, in groups."
    assert text.endswith(left_out) is (len(every) > len(few))


def test_the_most_used_options_come_first():
    assert shown("optimise", "--help")[:6] == ["machine", "output", "json", "tool", "control", "tilt"]
    assert shown("verify", "--help")[:2] == ["machine", "path"]


def test_all_options_stand_in_their_groups():
    told = CliRunner().invoke(app, ["optimise", "--help-all"]).stdout
    _, bounds = told.split("Bounds on postures and turns:")
    assert OPTION.findall(bounds)[:3] == ["tilt", "lead", "lean"]
