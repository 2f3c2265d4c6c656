"""What F and dwells count on each control, against the numbers that manuals print and LinuxCNC computes."""

import re

import numpy as np
import pytest
from support.rs274 import canonical, needs_rs274

from fiveaxis.base.errors import SettingError
from fiveaxis.nc import find_dialect


def codes(motion):
    return [finding.code for finding in motion.findings]


def test_fanuc_takes_the_time_that_its_manual_prints(read_of):
    # B-63174EN/03, p. 55: G91 G01 X20.0 C40.0 F300.0 is distributed in 0.14907 min.
    motion = read_of("G21 G91 G94\nG01 X20.0 C40.0 F300.0\n", "fanuc")
    assert motion.time[1] / 60.0 == pytest.approx(0.14907, abs=5e-6)
    inches = read_of("G20 G91 G94\nG01 X2.0 C4.0 F30.0\n", "fanuc")
    assert inches.time[1] / 60.0 == pytest.approx(0.14907, abs=5e-6)


@pytest.mark.parametrize(
    ("before", "control", "text"),
    [
        ("(control: fanuc axes)\n", "", "G94\nG1 X20. C40. F300."),
        ("", "fanuc", "G95 S1000 M3\nG1 X20. C40. F.3"),
    ],
    ids=["named in a comment", "feed per revolution"],
)
def test_a_program_is_timed_alike_whoever_names_its_control(read_of, before, control, text):
    motion = read_of(f"{before}G21 G91\n{text}\n", control)
    assert motion.time[1] / 60.0 == pytest.approx(0.14907, abs=5e-6)


def test_sinumerik_takes_the_times_that_its_manual_prints(read_of):
    # 6FC5398-1BP10-2BA0, p. 271: R1 to R9 in s. R8 is 10 mm at 2540 mm/min, 0.236 s: 0.288 is misprinted.
    program = """FGROUP(X,A)
G91 G1 G710 F100
X10
X10 A10
A10
X0.001 A10
G700 F100
X10
X10 A10
A10
X0.001 A10
FGREF[A]=360/(2*3.14159265)
X0.001 A10
M30
"""
    parts = program.split("G700")
    metric = read_of(parts[0] + "M30\n", name="part.mpf").time[1:]
    np.testing.assert_allclose(metric, [6.0, 8.485, 6.0, 6.0], atol=1e-3)
    imperial = read_of("FGROUP(X,A)\nG91 G1 G700" + parts[1], name="part.mpf").time[1:]
    np.testing.assert_allclose(imperial, [6.0, 6.005, 6.0, 0.236, 6.0], atol=1e-3)


def test_sinumerik_without_a_group_counts_the_geometry_axes(read_of):
    motion = read_of(
        "G710 G90 G94\nG1 X10 C90 F1000\nFGROUP(X,Y,Z,C)\nX20 C180\nFGROUP()\nX30 C270\nM30\n", name="a.mpf"
    )
    np.testing.assert_allclose(motion.time[1:], [0.6, 0.06 * np.hypot(10, 90), 0.6], rtol=1e-9)


def test_a_group_holds_under_tcp_too(read_of):
    text = "G710 G90 G94\nTRAORI\n{}G1 X10 Y0 Z0 A0 C0 F1000\nX20 C90\nM30\n"
    alone, grouped = (read_of(text.format(w), name="a.mpf").time.sum() for w in ("", "FGROUP(X,Y,Z,C)\n"))
    assert grouped - alone == pytest.approx(0.06 * (np.hypot(10, 90) - 10), rel=1e-6)


@needs_rs274
def test_linuxcnc_counts_what_its_own_interpreter_does(read_of, tmp_path):
    # It converts inverse time to F: F per minute is the block's length times that of G93.
    moves = ["X20 C40", "C80", "Y3 Z-4 A10", "A20 C100", "X-1 Y-2 Z-3 A4 C5"]
    path = tmp_path / "inverse.ngc"
    path.write_text("\n".join(["G21 G90 G93", *(f"G1 {move} F6" for move in moves), "M2", ""]))
    feeds = [float(f) for f in re.findall(r"SET_FEED_RATE\(([0-9.]+)\)", canonical(path))][: len(moves)]
    lines = "\n".join(f"G1 {move} F{feed}" for move, feed in zip(moves, feeds, strict=True))
    motion = read_of(f"G21 G90 G94\n{lines}\nM2\n", "linuxcnc", name="again.ngc")
    np.testing.assert_allclose(motion.time[1:], 10.0, rtol=1e-5)


def test_where_no_control_is_known_both_times_are_told(read_of):
    motion = read_of("G21 G91 G94\nG1 X20. C40. F300\nX20.\nC40.\nM30\n")
    [finding] = [f for f in motion.findings if f.code == "feed-meaning"]
    assert (finding.place.line, codes(motion)) == (2, ["feed-meaning"])
    assert "4 s where F is along X, Y and Z alone" in finding.message
    assert "8.944 s where a degree counts as a mm" in finding.message
    assert "machine file (control)" in finding.message
    assert motion.time[1] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("text", "control", "name"),
    [
        ("G21 G91 G93\nG1 X20. C40. F3\n", "", "part.nc"),
        ("G21 G91 G94\nG1 X20. F3\nC10. F3\n", "", "part.nc"),
        ("G21 G91 G94\nG1 X20. C40. F3\n", "", "part.ngc"),
        ("(control: fanuc axes)\nG21 G91 G94\nG1 X20. C40. F3\n", "haas", "part.nc"),
    ],
    ids=["inverse time", "one kind of axes", "a suffix of one control", "the header"],
)
def test_nothing_is_told_where_f_is_known(read_of, text, control, name):
    assert "feed-meaning" not in codes(read_of(text, control, name))


@pytest.mark.parametrize("control", ["haas", "heidenhain"])
def test_the_reason_of_the_table_is_told(read_of, control):
    motion = read_of("G21 G91 G94\nG1 X20. C40. F300\n", control)
    [finding] = [f for f in motion.findings if f.code == "feed-meaning"]
    assert find_dialect(control).mixed_feed.unknown in finding.message


@pytest.mark.parametrize(
    ("word", "reason"), [("FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS", "F CONT"), ("L M116", "M116")]
)
def test_klartext_that_makes_f_one_of_the_axes_is_told(read_of, word, reason):
    text = f"BEGIN PGM A MM\n{word}\nL X+0 Y+0 Z+0 A+0 C+0 FMAX\nL X+10 C+90 F1000\nEND PGM A MM\n"
    findings = [f for f in read_of(text, name="a.h").findings if f.code == "feed-meaning"]
    assert any(reason in f.message and f.place.line == 2 for f in findings)


@pytest.mark.parametrize(
    ("control", "word", "time"),
    [
        ("fanuc", "P50", 0.05),
        ("haas", "P50", 0.05),
        ("haas", "P.5", 0.5),
        ("linuxcnc", "P2", 2.0),
        ("fanuc", "X1.5", 1.5),
    ],
)
def test_dwells_count_as_the_table_says(read_of, control, word, time):
    assert read_of(f"G21 G94\nG1 X1. F60\nG4 {word}\nX2.\n", control).time[2] == pytest.approx(time)


def test_a_table_that_writes_f_of_axes_says_what_it_counts(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('based_on = "haas"\n[modes.axes]\nfeed = "per_minute"\n')
    with pytest.raises(SettingError, match=r"mixed_feed\.degree doesn't say what F counts"):
        find_dialect(path)
    path.write_text('based_on = "fanuc"\n[mixed_feed]\nsource = ""\n')
    with pytest.raises(SettingError, match="needs a source"):
        find_dialect(path)


@pytest.mark.parametrize(
    ("words", "turn"), [("L C+180 F1000", -358.0), ("L C+180 F1000 M94", 2.0), ("M94 C\nL C+180 F1000", 2.0)]
)
def test_m94_counts_a_rotary_axis_from_below_a_turn(read_of, words, turn):
    # TNC 407, 5-43: from 538 to 180 deg the axis goes by -358 deg, and by 2 deg with M94.
    text = f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 A+0 C+538 FMAX\n{words}\nL C+181\nEND PGM A MM\n"
    angles = -np.degrees(read_of(text, name="a.h").positions[-2:, -1])  # this machine's control counts C so
    np.testing.assert_allclose(angles, [538.0 + turn, 539.0 + turn])
