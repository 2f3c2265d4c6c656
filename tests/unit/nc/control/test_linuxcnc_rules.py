"""What a control's table says of arcs, expressions, cycles and slow blocks, in the words of LinuxCNC 2.9.

`tests/property/test_interpreter.py` holds the same to its interpreter where that is installed.
"""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import load_machine
from fiveaxis.nc import read_program
from fiveaxis.nc.languages.block import BlockError
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.writing.table_parts import Arithmetic
from fiveaxis.nc.writing.tables import DIALECTS

MACHINE = load_machine("hayashi-640123")
HEAD = "G21 G90 G17 G94 G98\nG0 X0 Y0 Z5 A0 C0\nF100\n"


@pytest.fixture
def read(tmp_path):
    def read_text(text, control="linuxcnc", **options):
        path = tmp_path / "part.nc"
        path.write_text(f"{text}\nM2\n", encoding="ascii")
        machine = replace(MACHINE, control=control)
        start = dict.fromkeys(MACHINE.letters, 0.0)
        return read_program(path, machine, **{"start": start, "rapid": 6e3} | options)

    return read_text


def test_an_arc_has_the_bounds_of_its_control(read):
    spiral, short = f"{HEAD}G2 X20.028 I10", f"{HEAD}G2 X20.003 R10"
    assert read(spiral).positions[-1, 0] == pytest.approx(20.028)
    with pytest.raises(ToolpathError, match=r"ends 10\.028 mm from it, more than 0\.01003 mm apart"):
        read(spiral, "fanuc")
    assert read(short, "fanuc").positions[-1, 0] == pytest.approx(20.003)
    with pytest.raises(ToolpathError, match=r"R10 is too small for ends 20\.003 mm apart"):
        read(short)


def test_p_counts_the_turns_of_an_arc(read):
    once, thrice = (read(f"{HEAD}G2 X0 Y0 Z2 I5 {turns}") for turns in ("", "P3"))
    assert thrice.time.sum() - once.time[1:2].sum() > 2.9 * 60.0 * 2.0 * np.pi * 5.0 / 100.0
    assert thrice.positions[-1] == pytest.approx(once.positions[-1])
    with pytest.raises(ToolpathError, match="P3: counts the turns of an arc on LinuxCNC"):
        read(f"{HEAD}G2 X0 Y0 Z2 I5 P3", "fanuc")
    with pytest.raises(ToolpathError, match=r"P0\.5: an arc has"):
        read(f"{HEAD}G2 X0 Y0 Z2 I5 P0.5")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 EQ 1.00009", 1.0),
        ("1 EQ 1.00011", 0.0),
        ("1 NE 1.00009", 0.0),
        ("1 LT 1.0000000001", 1.0),
        ("1 LE 1.00001", 1.0),
        ("ATAN[-1]/[-1]", -135.0),
        ("-7 MOD 4", 1.0),
        ("-8 MOD -4", 0.0),
        ("7.5 MOD -2", 1.5),
        ("FIX[-2.8]", -3.0),
        ("FUP[2.0000000001]", 3.0),
        ("2 AND -1", 1.0),
        ("2 XOR 1", 0.0),
    ],
)
def test_expressions_are_linuxcncs(text, value):
    assert evaluate(text, {}.__getitem__, DIALECTS["linuxcnc"].arithmetic) == pytest.approx(value)


def test_a_comparison_on_which_controls_or_versions_decide_otherwise_has_no_value():
    unknown = Arithmetic(doubtful=1e-4)
    known = DIALECTS["linuxcnc"].arithmetic
    for text, rules in [("1 EQ 1.00009", unknown), ("1.00009 LE 1", unknown), ("1.00009 LE 1", known)]:
        with pytest.raises(BlockError, match="depends on the control's rounding"):
            evaluate(text, {}.__getitem__, rules)
    assert evaluate("1 EQ 1.0002", {}.__getitem__, unknown) == 0.0
    assert evaluate("1 LT 1.00009", {}.__getitem__, unknown) == 1.0


def test_where_the_control_is_unknown_a_doubtful_comparison_stops_the_reading(read):
    text = f"{HEAD}#1=1.00009\nIF [#1 EQ 1] GOTO 10\nG1 X1\nN10 G1 X2"
    with pytest.raises(ToolpathError, match="depends on the control's rounding"):
        read(text, "")
    assert len(read(text, "fanuc").time) > len(read(text).time)


def test_blocks_in_inverse_time_are_no_slower_than_the_control_runs_them(read):
    motion = read(f"{HEAD}G93\nG1 X0.01 F1\nG1 C10 F0.001\nG2 X2.01 I1 F0.01\nG1 X3 F1")
    by_line = [motion.time[motion.source == line].sum() for line in (5, 6, 7, 8)]
    np.testing.assert_allclose(by_line, [6.0, 6000.0, 60.0 * np.pi / 0.1, 60.0], rtol=2e-3)
    [finding] = [f for f in motion.findings if f.code == "feed-floor"]
    assert "this one lasts 6 s, not the 60 s of its F" in finding.message
    other = read(f"{HEAD}G93\nG1 X0.01 F1\nG1 X1 F1", "fanuc")
    assert other.time[other.source == 5].sum() == pytest.approx(60.0)


def test_g94_clears_f_where_the_control_does(read):
    assert read(f"{HEAD}G94\nG1 X10", "fanuc").time[-1] == pytest.approx(6.0)
    assert read(f"{HEAD}G94 F50\nG1 X10").time[-1] == pytest.approx(12.0)
    with pytest.raises(ToolpathError, match="clears F even where it is in force"):
        read(f"{HEAD}G94\nG1 X10")


@pytest.mark.parametrize(
    ("block", "fact"),
    [
        ("G81 X1 Z-1 R1 A3", "LinuxCNC refuses a cycle with A"),
        ("G93 G81 X1 Z-1 R1 F1", "LinuxCNC refuses cycles under G93"),
        ("G76 X1 Z-1 R1", "G76 cuts a thread"),
        ("G88 X1 Z-1 R1 P1", "G88 stops the program at the bottom of the hole"),
        ("M94 C", "counts rotary axes from below a turn"),
        ("G92 E0", "sets the extruder of a 3D printer"),
        ("G1 X[ATAN2[1]/[2]]", "ATAN2 is Sinumerik's"),
        ("G1 @1 ^30", "is a polar coordinate of LinuxCNC"),
    ],
)
def test_words_that_are_refused_are_called_by_what_they_are(read, block, fact):
    with pytest.raises(ToolpathError, match=fact):
        read(HEAD + block)


def test_cycles_return_as_their_control_does(read):
    text = f"{HEAD}G85 X1 Z-1 R1\nG89 X2 Z-1 R1 P1\nG80"
    # Z of the moves at feed, of G85 and G89.
    fed = [read(text, control) for control in ("linuxcnc", "fanuc")]
    ends = [motion.positions[motion.kind == 0, 2].round(6).tolist() for motion in fed]
    assert ends[0][-4:] == [-1.0, 1.0, -1.0, 5.0]
    assert ends[1][-4:] == [-1.0, 1.0, -1.0, 1.0]


def test_g53_turns_a_wrapped_axis_by_its_sign(read):
    text = f"{HEAD}G0 C350\nG53 G0 C10\nG1 C20\nG53 G0 C-15\nG1 C5 F9\nG28 C0\nG1 C90"
    turned = read(text, wrap="signed")
    ends = [np.degrees(turned.positions[turned.source == line][-1, 4]) for line in (6, 8, 10)]
    np.testing.assert_allclose(ends, [380.0, 725.0, 1170.0])
