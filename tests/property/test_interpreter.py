"""LinuxCNC's interpreter and our reader make the same moves of a program, or the reader refuses it.

Its bounds, floors and comparisons are keys of the control's table: each is tried on both sides.
"""

from dataclasses import replace
from pathlib import Path

import pytest
from support.compared_moves import canonical_moves, compare, compare_lines, difference, read_moves
from support.interpretable_programs import program
from support.rs274 import needs_rs274

from fiveaxis.model import load_machine

pytestmark = needs_rs274

MACHINE = replace(load_machine("hayashi-640123"), control="linuxcnc")
EXAMPLES = Path("/usr/share/linuxcnc/ncfiles")
METRIC, IMPERIAL = (f"{unit} G90 G17 G94 F100\nG0 X0 Y0 Z0 A0 C0\n" for unit in ("G21", "G20"))


def both(text, tmp_path, **reading):
    file = tmp_path / "part.ngc"
    file.write_text(text + "\nM2\n", encoding="ascii")
    return compare(file, MACHINE, **reading)


@pytest.mark.parametrize("seed", range(10))
def test_drawn_programs_are_read_as_they_run(seed, tmp_path):
    found = compare_lines(program(seed), tmp_path / "part.ngc", MACHINE)
    assert [each.fact for each in found if each.verdict == "differs"] == []


def test_another_move_is_a_difference(tmp_path):
    """The comparison finds what differs: a place, a kind of move, an arc's turns, a duration, an end."""
    file = tmp_path / "part.ngc"
    text = f"{METRIC}G1 X5\nG2 X9 I2 F300\nG0 Z4\nG4 P2\nM2\n"
    file.write_text(text, encoding="ascii")
    right = canonical_moves(file).moves
    edits = [
        ("X5", "X5.01"),
        ("G0 Z4", "G1 Z4"),
        ("I2 F", "I2 P2 F"),
        ("F300", "F301"),
        ("P2", "P2.1"),
        ("G0 Z4", ""),
    ]
    assert difference(right, read_moves(file, MACHINE).moves) == ""
    for old, new in edits:
        file.write_text(text.replace(old, new), encoding="ascii")
        assert difference(right, read_moves(file, MACHINE).moves) != "", (old, new)


@pytest.mark.parametrize(
    "name", ["cds", "3dtest", "arcspiral", "daisy", "b-index", "g20sub", "factorial", "tort"]
)
def test_programs_that_come_with_linuxcnc_are_read_as_they_run(name, tmp_path):
    if not (EXAMPLES / f"{name}.ngc").is_file():
        pytest.skip(f"{EXAMPLES} has no {name}.ngc")
    machine = (
        MACHINE if name != "b-index" else replace(load_machine("linuxcnc-xyzbc-trt"), control="linuxcnc")
    )
    file = tmp_path / f"{name}.ngc"
    file.write_bytes((EXAMPLES / file.name).read_bytes())
    assert compare(file, machine).fact == ""


@pytest.mark.parametrize(
    ("head", "block", "runs"),
    [
        (METRIC, "G2 X20.0282 I10", True),
        (METRIC, "G2 X20.0284 I10", False),
        (METRIC, "G2 X200.0999 I100", True),
        (METRIC, "G2 X200.1002 I100", False),
        (METRIC, "G2 X20002.828 I10000", True),
        (METRIC, "G2 X20002.829 I10000", False),
        (METRIC, "G2 X20.00252 R10", True),
        (METRIC, "G2 X20.00256 R10", False),
        (METRIC, "G2 I0.00128", True),
        (METRIC, "G2 I0.00126", False),
        (IMPERIAL, "G2 X0.2028 I0.1", True),
        (IMPERIAL, "G2 X0.2029 I0.1", False),
        (IMPERIAL, "G2 X800.2828 I400", True),
        (IMPERIAL, "G2 X800.2829 I400", False),
        (IMPERIAL, "G2 X2.000098 R1", True),
        (IMPERIAL, "G2 X2.000102 R1", False),
        (METRIC, "G2 X4 Z-3 I2 P3", True),
        (METRIC, "G3 X4 R3 P2", True),
        (METRIC, "G2 X4 I2 P0", False),
        (METRIC, "G2 X4 I2 P1.5", False),
        (METRIC, "G18 G3 X0 Z0 Y3 I4 P2", True),
        (METRIC, "G94\nG1 X1", False),
        (METRIC, "G94 F50\nG1 X1", True),
        (METRIC, "G93 G1 X0.01 F1\nG1 C10 F0.001\nG1 X9 F4", True),
        (IMPERIAL, "G93 G1 X0.01 F1\nG1 C10 F0.001\nG2 X0.02 I0.005 F0.1", True),
        (METRIC, "G93 G81 X1 Z-1 R1 F1", False),
        (METRIC, "G98 G81 X1 Z-1 R1 A3", False),
        (METRIC, "G0 Z5\nG98 G85 X1 Z-1 R1\nX3\nG99 G85 X5 Z-3 R1\nX7", True),
        (METRIC, "G0 Z5\nM3 S100\nG98 G89 X1 Z-1 R1 P1\nX3\nG84 X5 Z-3 R1\nG99 G84 X6 Z-3 R1", True),
        (METRIC, "M3 S100\nG98 G81 X1 Z-1 R1\nG82 X3 Z-1 R2 P1\nG83 X4 Z-3 R1 Q1\nG73 X5 Z-3 R1 Q1", True),
        (METRIC, "G1 X[1 EQ 1.00009] Y[1 EQ 1.00011] Z[1 NE 1.00009]", True),
        (METRIC, "G1 X[1 LT 1.00001] Y[1 GT 0.99999] Z[1 LE 1.00001] A[0.99999 GE 1.5]", True),
        (METRIC, "G1 X[ATAN[-1]/[-1]] Y[-7 MOD 4] Z[FIX[-2.8] + FUP[-2.2]] A[2 AND -1]", True),
        (METRIC, "M94 C", False),
        (METRIC, "G92 E0", False),
    ],
)
def test_the_tables_keys_are_those_of_the_interpreter(head, block, runs, tmp_path):
    found = both(head + block, tmp_path)
    assert (found.verdict, found.fact if runs else "") == ("same" if runs else "refused by both", "")


def test_a_wrapped_axis_goes_where_g53_and_g28_turn_it(tmp_path):
    ini, file = tmp_path / "wrapped.ini", tmp_path / "part.ngc"
    variables = tmp_path / "empty.var"
    variables.write_text("", encoding="ascii")
    ini.write_text(f"[AXIS_C]\nWRAPPED_ROTARY = 1\n[RS274NGC]\nPARAMETER_FILE = {variables}\n")
    turns = "G0 C350\nG53 G0 C10\nG1 C20\nG53 G0 C-15\nG1 C5 F9\nG53 G1 C-300\nG1 X1\nG28 C0\nG1 X3\nM2\n"
    file.write_text(METRIC + turns, encoding="ascii")
    wanted = canonical_moves(file, "-i", str(ini)).moves
    assert difference(wanted, read_moves(file, MACHINE, wrap="signed").moves) == ""
    # Where the zero isn't known the moves to it are no rows, and the angles go on from them.
    ends = [tuple(move.end) for move in read_moves(file, MACHINE, wrap="signed", zero=None).moves]
    assert set(ends) <= {tuple(move.end) for move in wanted}
    assert ends[-1] == tuple(wanted[-1].end)
