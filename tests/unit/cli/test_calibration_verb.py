"""`fiveaxis calibrate` as its user meets it: a block for the machine file, a figure, JSON, clear errors."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fiveaxis.cli import app
from fiveaxis.energy.calibration import calibrate_drive
from fiveaxis.machine import AffineDrive, load_machine


def run(*words: object) -> Any:
    return CliRunner().invoke(app, ["calibrate", *(str(word) for word in words)])


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Rows of ``P = 0.02·60·|v| + 40`` W with some noise, v in mm/s."""
    rng = np.random.default_rng(12)
    speed = rng.uniform(10.0, 100.0, 120) * rng.choice([-1.0, 1.0], 120)
    power = 1.2 * np.abs(speed) + 40.0 + rng.standard_normal(120)
    rows = [f"{v:.6g},{p:.6g}" for v, p in zip(speed, power, strict=True)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["speed,drive power", *rows]) + "\n")
    return file


UNITS = {"power_unit": "W", "velocity_unit": "mm/s"}
AFFINE = ("--axis", "Y", "--model", "affine", "--power", "drive power", "--power-unit", "W")
AFFINE += ("--velocity", "speed", "--velocity-unit", "mm/s")


def test_without_an_output_the_block_stands_on_stdout_beneath_the_coefficients(log):
    result = run(log, *AFFINE)
    assert result.exit_code == 0, result.output
    assert "plus slope" in result.stdout
    assert "R² " in result.stdout
    found = calibrate_drive(log, axis="Y", model="affine", power="drive power", velocity="speed", **UNITS)
    assert result.stdout.endswith("\n" + found.block)
    assert result.stderr == ""


def test_the_block_goes_to_a_file_that_completes_a_machine_file(log, tmp_path):
    block = tmp_path / "block.toml"
    result = run(log, *AFFINE, "-o", block)
    assert result.exit_code == 0, result.output
    assert "[axes.Y.drive]" not in result.stdout
    assert f"wrote {block}" in result.stderr
    machine = tmp_path / "shop.toml"
    machine.write_text('name = "shop"\ncode = "640123"\n\n' + block.read_text(encoding="utf-8"), "utf-8")
    drive = load_machine(str(machine)).axis("Y").drive
    assert isinstance(drive, AffineDrive)
    assert drive.plus == pytest.approx((1.2, 40.0), rel=0.03)


def test_json_is_one_document_and_nothing_else(log):
    result = run(log, *AFFINE, "--json")
    document = json.loads(result.stdout)
    assert document["model"] == "affine"
    assert document["rows"] == 120
    slope = document["coefficients"]["plus slope"]
    assert slope["unit"] == "W/(mm/min)"
    assert slope["low"] < 0.02 < slope["high"]
    assert document["block"].startswith("[axes.Y.drive]\n")


@pytest.mark.parametrize(("suffix", "magic"), [(".png", b"\x89PNG"), (".svg", b"<?xml")])
def test_the_figure_is_written_and_the_same_each_time(log, tmp_path, suffix, magic):
    figures = [tmp_path / f"{name}{suffix}" for name in ("first", "second")]
    for figure in figures:
        result = run(log, *AFFINE, "--figure", figure)
        assert result.exit_code == 0, result.output
    first, second = (figure.read_bytes() for figure in figures)
    assert first.startswith(magic)
    assert first == second


@pytest.mark.parametrize("axis", ["X", "Y"])
def test_the_umich_log_is_explained_from_the_command_line(data, axis):
    columns = {
        "--power": "OutputPower",
        "--velocity": "ActualVelocity",
        "--acceleration": "ActualAcceleration",
    }
    words = [word for option, name in columns.items() for word in (option, f"{axis}1_{name}")]
    words += ["--axis", axis, "--model", "friction", "--power-unit", "kW", "--max-acceleration", "30"]
    words += ["--velocity-unit", "mm/s", "--acceleration-unit", "mm/s2"]
    result = run(data / "power" / "umich_experiment_01.csv", *words, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["r_squared"] >= 0.95


def test_a_missing_column_is_one_line_on_stderr_that_names_the_nearest(log):
    words = [word if word != "speed" else "sped" for word in AFFINE]
    result = run(log, *words)
    assert result.exit_code == 2
    lines = result.stderr.splitlines()
    assert lines == [f"error: {log}:1: has no column 'sped' for velocity; did you mean speed?"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--moved-mass", "-4"), "moved mass is -4 kg"),
        (("--velocity-unit", "deg/s"), "is deg/s, but the axis is linear"),
        (("--figure", "residuals.gif"), "let it end in .png or .svg"),
        (("--terms", "friction, drag", "--model", "friction", "--moved-mass", "4"), "no term 'drag'"),
    ],
)
def test_a_bad_option_writes_nothing(log, tmp_path, words, message):
    block = tmp_path / "block.toml"
    result = run(log, *AFFINE, *words, "-o", block)
    assert result.exit_code == 2
    assert message in result.stderr
    assert not block.exists()
