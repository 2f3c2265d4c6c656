"""The data sheet of a machine: figures in the units of machine files."""

import tomllib
from pathlib import Path

import pytest

from fiveaxis.model import load_machine
from fiveaxis.show.report.sheet import describe_machine

MACHINES = Path(__file__).parents[4] / "machines"


def test_powers_are_those_of_the_machine_file():
    written = tomllib.loads((MACHINES / "hayashi-640123.toml").read_text())["axes"]
    for letter, power in describe_machine(load_machine("hayashi-640123"))["powers"].items():
        drive = written[letter]["drive"]
        assert [power["model"], power["unit"]] == [drive["model"], drive["unit"]]
        assert [power["plus"], power["minus"]] == pytest.approx([drive["plus"], drive["minus"]])


def test_a_slope_of_power_is_per_unit_and_minute():
    z = describe_machine(load_machine("takisawa-mac-v3"))["powers"]["Z"]
    assert (z["model"], z["unit"]) == ("affine", "W/(mm/min)")
    # 8540 W/(m/s) + 88.82 W in its file.
    assert z["plus"] == pytest.approx([8540.0 / 60_000.0, 88.82])


def test_an_unknown_drive_is_null():
    assert describe_machine(load_machine("umc-750"))["powers"]["X"] is None


def test_pivots_that_are_missing_are_listed_with_a_drawing():
    missing = describe_machine(load_machine("umc-750"))["to_measure"]
    assert missing["zero"] == "the centre of the table's surface, on C's line"
    assert [d["key"] for d in missing["dimensions"]][:2] == ["axes.B.line.point[0]", "axes.B.line.point[2]"]
    assert any("B's line" in line for line in missing["drawing"])
    assert describe_machine(load_machine("variaxis-630"))["to_measure"] is None
