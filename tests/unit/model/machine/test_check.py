"""Findings about machine files: each slip has its code and its line."""

from pathlib import Path

import pytest

from fiveaxis.base.errors import MachineError, UnknownMachine
from fiveaxis.base.findings import Finding, Severity
from fiveaxis.model import check_machine, load_machine, machine_names

GOOD = """name = "m"
code = "640123"
structure = { source = "a manual" }

[axes.X]
limits = { min = -200, max = 200, unit = "mm", source = "a data sheet" }
max_speed = { value = 500, unit = "mm/s", source = "a data sheet" }
max_acceleration = { value = 3, unit = "m/s2", source = "a data sheet" }
moved_mass = { value = 300, unit = "kg", source = "a data sheet" }
line = { direction = [1, 0, 0], source = "a data sheet" }

[axes.A]
limits = { min = -120, max = 30, unit = "deg", source = "a data sheet" }
line = { direction = [1, 0, 0], point = [0, 0, 20], source = "a data sheet" }
max_speed = { value = 50, unit = "rpm", source = "a data sheet" }
carries = "workpiece"
"""


def check(tmp_path: Path, text: str) -> list[Finding]:
    path = tmp_path / "m.toml"
    path.write_text(text, encoding="utf-8")
    return [f for f in check_machine(path) if f.code not in ("no-powers", "no-limits")]


def test_a_sound_file_has_no_findings_but_the_unknown_powers(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(GOOD)
    findings = check_machine(path)
    assert [f.code for f in findings] == ["no-limits", "no-limits", "no-powers"]
    assert {f.severity for f in findings} == {Severity.NOTE}


@pytest.mark.parametrize(
    ("old", "new", "code", "line", "message"),
    [
        ("min = -200, max = 200", "min = -10000, max = 10000", "unit-slip", 6, "travel of X is 20000 mm"),
        ("value = 500", "value = 30000", "unit-slip", 7, "is it in mm/min?"),
        ("value = 3, ", "value = 300, ", "unit-slip", 8, "max_acceleration of X is 300000 mm/s2"),
        ("value = 300", "value = 300000", "unit-slip", 9, "mass of X is 300000 kg"),
        ("value = 50,", "value = 5000,", "unit-slip", 15, "max_speed of A is 30000 deg/s"),
        ("min = -120, max = 30", "min = -2.0944, max = 0.5236", "unit-slip", 13, "look like radians"),
        ('max = 30, unit = "deg"', 'max = 30, unit = "rad"', "unit-slip", 13, "look like degrees"),
        ("[1, 0, 0], source", "[1, 0.1, 0], source", "non-orthogonal", 10, "X and Y are at 84.29 deg"),
        ("[1, 0, 0], point", "[-1, 0, 0], point", "against-letter", 14, "reversed = true"),
        ("[1, 0, 0], source", "[1, 0, 0], point = [1, 2, 3], source", "unread-key", 10, "no effect here"),
        ('structure = { source = "a manual" }', "", "missing-source", 2, "code 640123 has no source"),
    ],
)
def test_what_looks_like_a_slip_is_a_warning_on_its_line(tmp_path, old, new, code, line, message):
    assert old in GOOD
    [finding] = check(tmp_path, GOOD.replace(old, new, 1))
    assert (finding.code, finding.severity, finding.place.line) == (code, Severity.WARNING, line)
    assert message in finding.message
    load_machine(tmp_path / "m.toml")  # it may be meant


@pytest.mark.parametrize(
    ("old", "new", "code", "line", "message"),
    [
        ("min = -200, max = 200", "min = 200, max = -200", "reversed-limits", 6, "exchange them"),
        ("[1, 0, 0], point", "[0, 0, 0], point", "zero-direction", 14, "length 0"),
        ("max_speed", "maxspeed", "unknown-key", 7, "the nearest known one is 'max_speed'"),
        (
            'unit = "kg", source = "a data sheet"',
            'unit = "kg"',
            "missing-source",
            9,
            "assumed = true with a note",
        ),
        ('max = 30, unit = "deg"', "max = 30", "missing-unit", 13, "'deg' or 'rad'"),
        ('name = "m"\n', "", "missing-key", None, "name is missing"),
        ("value = 3, ", "value = -3, ", "invalid-value", 8, "must be above 0"),
        ('"640123"', '"64123"', "invalid-code", 2, "has no bed"),
        ('"640123"', '"650123"', "unknown-axis", 12, "[axes.A] is not an axis of code 650123"),
        ('carries = "workpiece"', 'carries = "tool"', "wrong-side", 16, "write for example 604123"),
        ('unit = "rpm"', 'unit = "mm/s"', "wrong-unit", 15, "axis A is rotary"),
        ("[1, 0, 0], source", "[0, 1, 0], source", "flat-axes", 10, "lie in one plane"),
        ('"640123"', '"460123"', "no-orientation", 2, "only spins the tool"),
    ],
)
def test_what_keeps_a_machine_from_use_is_an_error_on_its_line(tmp_path, old, new, code, line, message):
    assert old in GOOD
    [finding] = [f for f in check(tmp_path, GOOD.replace(old, new, 1)) if f.severity is Severity.ERROR]
    assert (finding.code, finding.place.line) == (code, line)
    assert message in finding.message
    assert finding.place.file == str(tmp_path / "m.toml")


def test_all_faults_of_a_file_are_named_at_once(tmp_path):
    text = GOOD.replace("min = -200, max = 200", "min = 1, max = 0").replace(
        "[1, 0, 0], point", "[0, 0, 0], point"
    )
    assert [f.code for f in check(tmp_path, text)] == ["reversed-limits", "zero-direction"]


def test_errors_come_before_warnings_and_notes(tmp_path):
    text = (
        GOOD.replace("640123", "460123")
        .replace("min = -200", "min = -90000")
        .replace('source = "a manual"', 'assumed = true, note = "as built"')
    )
    severities = [f.severity for f in check(tmp_path, text)]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_bodies_are_checked_too(tmp_path):
    body = '\n[[bodies]]\nlink = "{}"\nshape = "{}"\nsource = "s"\n'
    box = "size = [1, 2, 3]\n"
    assert check(tmp_path, GOOD + body.format("A", "box") + box) == []
    [finding] = check(tmp_path, GOOD + body.format("Q", "box") + box)
    assert (finding.code, finding.place.line) == ("unknown-link", 18)
    [finding] = check(tmp_path, GOOD + body.format("A", "mesh") + 'file = "no.stl"\n')
    assert finding.code == "no-such-file"
    faulty = body.format("A", "box") + "size = [1, 0, 3]\n"
    first, third = check(tmp_path, GOOD + faulty + body.format("A", "box") + box + faulty)
    assert (first.code, first.place.line, third.place.line) == ("invalid-value", 22, 34)
    assert "bodies[2].size[1] = 0 must be above 0" in third.message


def test_a_squareness_error_in_location_error_is_no_slip(tmp_path):
    square = '[axes.Y.location_error]\ntilt = [0, 0, 0.2]\ntilt_unit = "deg"\nsource = "measured"\n'
    assert check(tmp_path, GOOD + square) == []
    [finding] = check(tmp_path, GOOD + square.replace("0.2", "40"))
    assert (finding.code, finding.severity) == ("unit-slip", Severity.WARNING)
    assert "is it in arcsec?" in finding.message
    [finding] = check(tmp_path, GOOD + square.replace("tilt =", "offset = [0.1, 0, 0]\ntilt ="))
    assert finding.code == "unread-key"


def test_a_spindle_that_points_to_the_part_is_found(tmp_path):
    spindle = '[spindle]\ndirection = [0, 0, -1]\nsource = "s"\n'
    [finding] = check(tmp_path, GOOD + spindle)
    assert (finding.code, finding.place.line) == ("against-letter", 18)


def test_a_table_of_no_axis_names_the_axes(tmp_path):
    [finding] = check(tmp_path, GOOD.replace("[axes.A]", "[axes.a]"))
    assert finding.code == "unknown-key"
    assert "unknown table 'axes.a'" in finding.message
    assert "'X', 'Y', 'Z', 'A', 'B' or 'C'" in finding.message


def test_the_library_has_notes_only_one_for_each_assumed_figure():
    for name in machine_names():
        findings = check_machine(name)
        assert {f.severity for f in findings} <= {Severity.NOTE}, name
        assumed = sum(p.assumed for p in load_machine(name).provenance)
        assert sum(f.code == "assumed-figure" for f in findings) == assumed, name


def test_a_linuxcnc_configuration_can_be_checked(data):
    findings = check_machine(data / "machines" / "linuxcnc_xyzac-trt.ini")
    assert {f.severity for f in findings} == {Severity.NOTE}


def test_a_file_that_is_no_machine_file_is_an_error_and_not_a_finding(tmp_path):
    (tmp_path / "m.toml").write_text("name = ")
    with pytest.raises(MachineError, match="is not valid TOML"):
        check_machine(tmp_path / "m.toml")
    with pytest.raises(MachineError, match="no such file"):
        check_machine(tmp_path / "none.toml")
    with pytest.raises(UnknownMachine):
        check_machine("nothing-like-it")
