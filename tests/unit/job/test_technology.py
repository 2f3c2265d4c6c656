"""What a program puts in force besides positions, checked against what was asked for."""

import numpy as np
import pytest
from planted.trial import TILT, cone_wall

import fiveaxis as fx
from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.check import verify_program
from fiveaxis.model import Toolpath, parse_tool
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.nc import ProgramSettings

SETTINGS = ProgramSettings(
    spindle_rpm=8000, tool_number=7, length_offset=13, coolant="flood", work_offset="G55", retract=0.0
)


@pytest.fixture(scope="module")
def solution(hayashi):
    return fx.optimise(cone_wall(-0.5), hayashi, tilt=TILT, effort="quick")


@pytest.fixture(scope="module")
def lines(solution):
    """A verified program of a Fanuc control, under TCP."""
    made = solution.program(control="fanuc", coordinates="tip", settings=SETTINGS)
    assert made.ok, made.report.counts
    return list(made.text.lines)


@pytest.fixture
def check(solution, tmp_path):
    """Give what verifies lines beside the path and the settings."""

    def verify(lines, settings=SETTINGS, path=solution.toolpath):
        file = tmp_path / "program.nc"
        file.write_text("\n".join(lines) + "\n")
        words = {"settings": settings, "control": "fanuc"} if settings is not None else {}
        return verify_program(file, solution.machine, toolpath=path, tilt=TILT, **words)

    return verify


def with_word(lines, old, new):
    changed = [line.replace(old, new) for line in lines]
    assert changed != lines
    return changed


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("S8000 M3", "S8000 M4", "spindle-off"),
        ("S8000 M3", "S800 M3", "spindle-off"),
        ("T7 M6", "T8 M6", "wrong-tool"),
        ("T7 M6", "T7", "wrong-tool"),
        ("H13", "H3", "length-offset"),
        ("G43.4 H13", "G43.4", "length-offset"),
        ("G55", "G54", "work-offset"),
        ("M8", "M7", "coolant-off"),
        ("G53 G0 Z0.0000", "(no retract)", "no-retract"),
        ("G53 G0 Z0.0000", "G53 G0 Z-110.", "no-retract"),
        ("G53 G0 Z0.0000", "G53 G0 X0. Z0.0000\nG53 G0 Z-0.1", "no-retract"),
        ("G21 ", "", "unit-assumed"),
    ],
)
def test_what_differs_from_what_was_asked_for_is_found(lines, check, old, new, code):
    assert check(lines).ok
    assert code in check(with_word(lines, old, new)).counts


def test_a_modal_feed_is_not_read_as_the_inverse_of_a_time(lines, check):
    with pytest.raises(ToolpathError, match="a feed move without F; G93 needs F in each one"):
        check(with_word(lines, "G94", "G93"))


def test_what_was_not_asked_for_is_listed_a_line_each(lines, check):
    report = check(lines, settings=None)
    assert report.ok
    for thing in ("tool: no number", "tool length offset: none", "work offset: none", "coolant: none"):
        assert any(line.startswith(thing) for line in report.not_checked), thing
    # Without a speed to compare with, the spindle still has to turn.
    stopped = [line for line in lines if not line.endswith("M3")]
    assert any("switches none on" in line for line in check(stopped, settings=None).not_checked)


def test_a_tool_change_and_a_stop_between_cuts_are_found(lines, check):
    cuts = [i for i, line in enumerate(lines) if line.startswith("G1")]
    middle = cuts[len(cuts) // 2]
    assert "change-in-cut" in check([*lines[:middle], "T7 M6", *lines[middle:]], settings=None).counts
    assert "spindle-off" in check([*lines[:middle], "M5", *lines[middle:]], settings=None).counts


def middle(lines, *texts):
    """Put lines between two cuts."""
    cuts = [i for i, line in enumerate(lines) if line.startswith("G1")]
    at = cuts[len(cuts) // 2]
    return [*lines[:at], *texts, *lines[at:]]


@pytest.mark.parametrize("word", ["G5.1 Q1", "M77", "G10 L10 P7 R5.", "#5223=-5.", "M0"])
def test_a_word_that_the_table_does_not_write_is_an_error_with_a_job_and_a_warning_without(
    lines, check, word
):
    for settings, severity in ((SETTINGS, "error"), (None, "warning")):
        found = [f for f in check(middle(lines, word), settings).findings if f.code == "word-in-cut"]
        assert {f.severity for f in found} == {severity}
        assert word.rstrip(".") in found[0].message
        assert not any("word between the cuts" in line for line in check(middle(lines, "M0")).passed)


def test_a_word_in_force_before_the_cuts_counts_until_another_of_its_group(lines, check):
    cut = next(i for i, line in enumerate(lines) if line.startswith("G1"))
    smooth = [*lines[:cut], "G5.1 Q1", *lines[cut:]]
    assert check(smooth).counts["word-in-cut"] > 20
    assert check([*lines[:cut], "G5.1 Q1", "G5.1 Q0", *lines[cut:]]).ok
    # A word that acts once, before the cuts, is the head's.
    assert check([*lines[:cut], "M77", *lines[cut:]]).ok


def test_a_table_of_ones_own_says_what_else_is_harmless(solution, lines, tmp_path):
    table, file = tmp_path / "mine.toml", tmp_path / "program.nc"
    file.write_text("\n".join(middle(lines, "M77")) + "\n")
    for patterns, ok in (("['M77']", True), ("['M7']", False)):
        table.write_text(f"based_on = 'fanuc'\nharmless = {patterns}\n")
        report = verify_program(
            file, solution.machine, toolpath=solution.toolpath, tilt=TILT, settings=SETTINGS, control=table
        )
        assert report.ok is ok
    table.write_text("based_on = 'fanuc'\nharmless = ['M(7']\n")
    with pytest.raises(SettingError, match="harmless"):
        verify_program(file, solution.machine, tool=solution.toolpath.tool, settings=SETTINGS, control=table)


def test_a_machine_move_between_cuts_is_an_error_unless_the_way_back_is_rapid(
    solution, lines, check, tmp_path
):
    file = tmp_path / "own.nc"
    away = middle(lines, "G53 G0 Z0.")
    (found,) = [f for f in check(away).findings if f.code == "rapid-in-cut"]
    assert f"line {1 + away.index('G53 G0 Z0.')}" in found.message
    assert not any(line.startswith("no rapid move") for line in check(away).passed)
    # Where the zero is stated the move is one of the program's, and checked as such.
    made = solution.program(control="fanuc", coordinates="axes", settings=SETTINGS)
    lines = list(made.text.lines)
    file.write_text("\n".join(middle(lines, "G53 G0 X0. Y0.")) + "\n")
    zero = dict.fromkeys("XYZAC", 0.0)
    report = verify_program(file, solution.machine, toolpath=solution.toolpath, tilt=TILT, zero=zero)
    assert "where the path cuts" in next(f.message for f in report.findings if f.code == "rapid-in-cut")
    # By way of a point of the program it goes to the reference all the same.
    cut = next(i for i, line in enumerate(lines) if line.startswith("G1 "))
    file.write_text("\n".join([*lines[:cut], "G28 X0. Y0.", *lines[cut:]]) + "\n")
    report = verify_program(file, solution.machine, toolpath=solution.toolpath, tilt=TILT)
    assert any(f"line {cut + 1}: G28 moves X, Y" in f.message for f in report.findings)
    # Without a path a retract from which the tool comes back at rapid may be that of another operation.
    heights = [word for line in lines for word in line.split() if word[0] == "Z"]
    for back, told in ((), True), ((f"G0 {heights[-1]}",), False):
        file.write_text("\n".join(middle(lines, "G53 G0 Z0.", *back)) + "\n")
        report = verify_program(file, solution.machine, tool=solution.toolpath.tool)
        assert ("rapid-in-cut" in report.counts) is told


@pytest.mark.parametrize("word", ["G268", "G12.1", "G112", "G7.1", "G107", "G100", "G151"])
def test_an_unknown_word_is_to_be_looked_up_and_not_to_be_taken_out(lines, check, word):
    with pytest.raises(ToolpathError, match=f"{word} .*look up what it does on this control") as refusal:
        check(middle(lines, word))
    assert "remove" not in str(refusal.value)


def test_rotary_axes_that_move_once_z_is_down_are_found(lines, check):
    turn = next(i for i, line in enumerate(lines) if line.startswith("G0 A"))
    # Under TCP the tool goes to above the path first, then down.
    swapped = [*lines[:turn], *lines[turn + 1 : turn + 3], lines[turn], *lines[turn + 3 :]]
    assert "approach-order" in check(swapped).counts


def test_an_approach_below_the_surface_is_found_without_a_mesh_of_the_part(solution, check):
    made = solution.program(control="fanuc", coordinates="axes", settings=SETTINGS)
    lines = list(made.text.lines)
    first = next(
        i for i, line in enumerate(lines) if line.startswith("G0") and " Z" in line and "G53" not in line
    )
    words = lines[first].split()
    z = next(word for word in words if word.startswith("Z"))
    deep = lines[first].replace(z, f"Z{float(z[1:]) - 30.0:.4f}")
    assert check(lines).ok
    assert "approach-deep" in check([*lines[:first], deep, *lines[first + 1 :]]).counts


def test_inserted_blocks_of_a_bull_nose_keep_the_feed_of_the_whole_move(hayashi):
    angle = np.linspace(0.0, 2.0, 11)
    around = np.stack([np.cos(angle), np.sin(angle), 0.2 + 0.0 * angle], axis=1)
    path = Toolpath.from_contacts(20.0 * around, around, parse_tool("bull:12:2"))
    rotary = np.column_stack([np.full(11, -0.8), angle])
    _, motion, row = fill_in(path, hayashi, rotary)
    assert len(row) > len(path)
    wanted = path.lengths[1:] / path.feed[1:]
    taken = np.bincount(np.ceil(row).astype(int), motion.time)[1:]
    np.testing.assert_allclose(taken, wanted, rtol=1e-9)
