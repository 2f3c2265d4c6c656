"""How much commands tell on stderr, and that nothing of it is on stdout."""

import json
import logging
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import fiveaxis
from fiveaxis.cli.commands import app
from fiveaxis.cli.options import ROOT, ConsoleHandler, set_verbosity

ROOMS = ("nc", "posture", "cli")


@pytest.fixture(autouse=True)
def as_before():
    yield
    set_verbosity(0, False)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    angle = np.linspace(0.0, 2.0 * np.pi, 30)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
    rows = np.hstack([20.0 * around + [0.0, 0.0, 30.0], np.cos(0.5) * around - [0.0, 0.0, np.sin(0.5)]])
    file = tmp_path_factory.mktemp("ring") / "ring.csv"
    np.savetxt(file, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    return file


def optimise(path: Path, *words: object, tilt: str = "15:75") -> Any:
    given = ["optimise", path, "--machine", "hayashi-640123", "--tool", "ball:10", "--tilt", tilt]
    return CliRunner().invoke(app, [str(word) for word in [*given, "--effort", "quick", *words]])


def test_json_is_alone_on_stdout_and_stages_are_logged_as_verbosely_as_asked(path):
    runs = [optimise(path, "--json", *words) for words in (("-q",), (), ("-v",), ("-vv",))]
    assert [json.loads(run.stdout)["locations"] for run in runs] == [30] * 4
    quiet, plain, told, detailed = (run.stderr for run in runs)
    assert quiet == ""
    assert not any(f"{room}: " in plain for room in ROOMS)
    assert all(f"{room}: " in told for room in ROOMS)
    assert "nc: ring.csv: 30 locations" in told
    assert re.search(r"posture: 30 locations on hayashi-640123: \d+\.\d J", told)
    assert len(detailed.splitlines()) > len(told.splitlines())


@pytest.mark.usefixtures("undrawn")
def test_quiet_prints_nothing_about_a_run_without_errors(path, tmp_path):
    result = optimise(path, "-q", "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert result.stderr == ""
    assert result.stdout.startswith("Is it safe to run?")


def test_quiet_still_prints_errors(path):
    result = optimise(path, "-q", tilt="75:15")
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ")


@pytest.mark.usefixtures("undrawn")
def test_one_command_being_quiet_leaves_the_next_as_it_was(path, tmp_path):
    optimise(path, "-q")
    assert "wrote" in optimise(path, "-o", tmp_path / "out").stderr


def test_setting_the_verbosity_again_adds_no_second_handler():
    set_verbosity(1, False)
    set_verbosity(2, False)
    handlers = logging.getLogger(ROOT).handlers
    assert sum(isinstance(handler, ConsoleHandler) for handler in handlers) == 1


def test_every_verb_takes_both_options():
    runner = CliRunner()
    verbs = [c.name or c.callback.__name__ for c in app.registered_commands]
    texts = {verb: runner.invoke(app, [verb, "--help-all"]).stdout for verb in verbs}
    assert [v for v, text in texts.items() if "--verbose" not in text or "--quiet" not in text] == []


def test_no_room_prints():
    package = Path(fiveaxis.__file__).parent
    printing = re.compile(r"^\s*print\(", re.MULTILINE)
    sources = [path for path in package.rglob("*.py") if "cli" not in path.parts]
    assert [path.name for path in sources if printing.search(path.read_text(encoding="utf-8"))] == []
