"""`fiveaxis calibrate` as its user meets it: a block for the machine file, a figure, JSON, clear errors."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fiveaxis.cli.commands import app
from fiveaxis.lab.calibration.calibration import calibrate_drive
from fiveaxis.model import AffineDrive, load_machine


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


def test_a_log_that_isnt_there_is_told_before_options_that_dont_fit_it(tmp_path):
    result = run(tmp_path / "none.csv", "--axis", "Q", "--model", "none", *AFFINE[4:])
    assert result.exit_code == 2
    assert result.stderr.strip() == f"error: {tmp_path / 'none.csv'}: no such file"


def test_json_is_one_document_and_nothing_else(log):
    result = run(log, *AFFINE, "--json")
    document = json.loads(result.stdout)
    assert document["model"] == "affine"
    assert document["rows"] == 120
    slope = document["coefficients"]["plus slope"]
    assert slope["unit"] == "W/(mm/min)"
    assert slope["low"] < 0.02 < slope["high"]
    assert document["block"].startswith("[axes.Y.drive]\n")


@pytest.mark.parametrize(("suffix", "magic"), [(".svg", b"<?xml"), (".html", b"<!DOCTYPE html>")])
def test_the_figure_is_written_and_the_same_each_time(log, tmp_path, suffix, magic):
    figures = [tmp_path / f"{name}{suffix}" for name in ("first", "second")]
    for figure in figures:
        result = run(log, *AFFINE, "-o", figure)
        assert result.exit_code == 0, result.output
    first, second = (figure.read_bytes() for figure in figures)
    assert first.startswith(magic)
    assert first == second


def test_a_missing_column_is_one_line_on_stderr_that_names_the_nearest(log):
    words = [word if word != "speed" else "sped" for word in AFFINE]
    result = run(log, *words)
    assert result.exit_code == 2
    lines = result.stderr.splitlines()
    assert lines == [f"error: {log}:1: has no column 'sped' for velocity; did you mean speed?"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--moved-mass", "-4"), "moved_mass = -4 kg is out of range"),
        (("--velocity-unit", "deg/s"), "is deg/s, but the axis is linear"),
        (("-o", "residuals.gif"), "let it end in .toml, .csv, .svg or .html"),
        (("--terms", "friction, drag", "--model", "friction", "--moved-mass", "4"), "no term 'drag'"),
    ],
)
def test_a_bad_option_writes_nothing(log, tmp_path, words, message):
    block = tmp_path / "block.toml"
    result = run(log, *AFFINE, *words, "-o", block)
    assert result.exit_code == 2
    assert message in result.stderr
    assert not block.exists()


UMICH = ("01", "04", "05", "06", "11", "16")


def umich(data: Path, axis: str, fitted: str, *words: object) -> Any:
    """Fit the drive of an axis of the public mill to one run, and hold out the other five."""
    runs = {number: data / "power" / f"umich_experiment_{number}.csv" for number in UMICH}
    held = [word for number, run in runs.items() if number != fitted for word in ("--hold-out", run)]
    columns = {"power": ("OutputPower", "kW"), "position": ("ActualPosition", "mm")}
    columns |= {"velocity": ("ActualVelocity", "mm/s"), "acceleration": ("ActualAcceleration", "mm/s2")}
    for quantity, (name, unit) in columns.items():
        held += [f"--{quantity}", f"{axis}1_{name}", f"--{quantity}-unit", unit]
    settings = ["--axis", axis, "--model", "friction", "--rate", 10, "--max-acceleration", 30]
    return run(runs[fitted], *held, *settings, *words)


@pytest.mark.parametrize("axis", ["X", "Y"])
def test_the_umich_runs_that_were_held_out_are_within_five_percent(data, axis):
    result = umich(data, axis, "11", "--json")
    assert result.exit_code == 0, result.output
    fitted, *held = json.loads(result.stdout)["runs"]
    assert (fitted["held_out"], len(held)) == (False, 5)
    for one in held:
        assert one["held_out"]
        assert one["fitted_J"] == pytest.approx(one["measured_J"], rel=0.05), one
        assert one["r_squared"] > 0.95
    for rows in ("", "whole_"):
        drawn, given = (sum(one[f"{rows}{kind}_J"] for one in held) for kind in ("measured", "fitted"))
        assert given == pytest.approx(drawn, rel=0.02)
    gaps = json.loads(result.stdout)["gaps"]
    assert gaps["jumps of position that the velocity doesn't explain"] > 100


def test_held_out_runs_are_a_table(data, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "120")
    figure = tmp_path / "x.svg"
    result = umich(data, "X", "11", "-o", figure, "-o", tmp_path / "x.toml")
    rows = [line.split() for line in result.stdout.splitlines() if line.startswith(" umich_")]
    assert [row[0] for row in rows] == [
        f"umich_experiment_{n}.csv" for n in ("11", "01", "04", "05", "06", "16")
    ]
    assert rows[0][1] == "fitted"
    assert all(row[1:3] == ["held", "out"] and row[-1].endswith("%") for row in rows[1:])
    assert "held-out runs together: " in result.stdout
    assert "umich_experiment_04.csv: 32 gaps: jumps of position" in result.stdout
    drawn = figure.read_text()
    assert "umich_experiment_04" in drawn
    assert "umich_experiment_11 (fitted)" in drawn


def test_shares_of_a_load_are_printed(tmp_path):
    rng = np.random.default_rng(1)
    speed = np.repeat([0.0, 1.0, -1.0], 50) * rng.uniform(10.0, 100.0, 150)
    load = np.where(speed == 0.0, 36.0, 40.0) + rng.integers(-1, 2, 150)
    rows = [f"{v:.6g},{p:.6g}" for v, p in zip(speed, load, strict=True)]
    log = tmp_path / "x.csv"
    log.write_text("\n".join(["speed,Xload", *rows]) + "\n")
    words = [log, "--axis", "X", "--model", "directional", "--power", "Xload", "--power-unit", "%"]
    words += ["--velocity", "speed", "--velocity-unit", "mm/s"]
    refused = run(*words)
    assert refused.exit_code == 2
    assert "the load is 36 % standing (median of 50 rows) and 40 % moving" in refused.stderr
    result = run(*words, "--nominal-power", 1500)
    assert "of 1500 W: 36.0% standing, 40.0% moving" in result.stdout
