"""What stands after the cuts: tool changes, machine moves and the end, as the control runs them."""

import pytest

import fiveaxis as fx
from fiveaxis.base.findings import Severity
from fiveaxis.model import Machine, Tool

ERROR, WARNING = Severity.ERROR, Severity.WARNING
BALL = Tool.ball(8)
CUTS = "".join(f"G1 X{x} Y0. Z0. A-{10 + x}. C0. F500.\n" for x in range(5))
ISO = "G21 G90 G17 G94\nG53 G0 Z0.\nT1 M6\nS8000 M3\nG54\nG0 A0. C0.\nG43.4 H1\nG0 X0. Y0. Z50.\n" + CUTS
SINUMERIK = ISO.replace("G21", "G71").replace("G53 G0 Z0.", "SUPA G0 Z0 D0").replace("T1 M6", "T1 D1 M6")
SINUMERIK = SINUMERIK.replace("G43.4 H1", "TRAORI")
LINUXCNC = ISO.replace("G43.4 H1", "G43 H1\nM428")
KLARTEXT = (
    "BEGIN PGM A MM\nTOOL CALL 1 Z S8000\nL Z+0 R0 FMAX M91\nM3\nL A+0 C+0 R0 FMAX\nM128\n"
    "L X+0 Y+0 Z+50 R0 FMAX\n" + CUTS.replace("G1", "L").replace("X", "X+").replace("Y0.", "Y+0")
)
KLARTEXT = KLARTEXT.replace("Z0. A-", "Z+0 A-").replace(". C0. F", " C+0 R0 F").replace("F500.", "F500")


@pytest.fixture(scope="module")
def table() -> Machine:
    return Machine.from_code("640123")


@pytest.fixture(scope="module")
def head() -> Machine:
    return Machine.from_code("012364").with_tool_length(100.0)


def found(folder, machine, text, suffix=".nc", codes=("tcp-state", "no-retract"), **given):
    """What is found of some codes: code and severity."""
    file = folder / f"program{suffix}"
    file.write_text(text)
    report = fx.verify_program(file, machine=machine, tool=BALL, **given)
    return [(f.code, f.severity) for f in report.findings if f.code in codes]


@pytest.mark.parametrize("off", ["", "G0 Z9.\n", "G0 Z200.\n"], ids=["in the cut", "9 mm above", "high"])
@pytest.mark.parametrize(
    ("text", "change", "suffix"),
    [
        (ISO, "T2 M6\n", ".nc"),
        (ISO, "M5\nM9\nT2\nM6\n", ".nc"),
        (SINUMERIK, 'T="MILL_8"\nM6\n', ".mpf"),
        (KLARTEXT, "TOOL CALL 2 Z S900\n", ".h"),
        (KLARTEXT, "L Z+0 R0 FMAX M91\n", ".h"),
    ],
    ids=["ISO", "in parts", "Sinumerik", "Klartext", "M91"],
)
def test_a_tool_change_under_tcp_is_an_error_however_high_it_is(table, tmp_path, text, change, suffix, off):
    klartext = suffix == ".h"
    off = off.replace("G0 Z", "L Z+").replace(".\n", " R0 FMAX\n") if klartext else off
    end = "M30\nEND PGM A MM\n" if klartext else "M30\n"
    assert found(tmp_path, table, text + off + change + end, suffix) == [("tcp-state", ERROR)]


@pytest.mark.parametrize(
    ("text", "after", "suffix"),
    [
        (ISO, "G0 Z200.\nG49\nG53 G0 Z0.\nT2 M6\nM30\n", ".nc"),
        (ISO, "G53 G0 Z0.\nG49\nT2 M6\nM30\n", ".nc"),
        (ISO, "G91 G28 Z0.\nG90\nT2 M6\nG53 G0 X0. Y0.\nM30\n", ".nc"),
        (ISO, "G0 Z200.\nM30\n", ".nc"),
        (SINUMERIK, "G0 Z200.\nTRAFOOF\nSUPA G0 Z0 D0\nT2 D1 M6\nM30\n", ".mpf"),
        (LINUXCNC, "G0 Z200.\nT2 M6\nM2\n", ".ngc"),
        (KLARTEXT, "L Z+200 R0 FMAX\nM129\nL Z+0 R0 FMAX M91\nTOOL CALL 2 Z S900\nM30\nEND PGM A MM\n", ".h"),
    ],
)
def test_a_retract_with_tcp_off_before_the_change_is_clean(table, tmp_path, text, after, suffix):
    assert found(tmp_path, table, text + after, suffix) == []


def test_a_machine_move_of_linuxcnc_under_tcp_is_an_error_where_the_table_is_tilted(table, head, tmp_path):
    """It moves the tip along the part's axes."""
    tilted, upright = LINUXCNC + "G0 Z200.\n", LINUXCNC + "G0 Z200. A0. C0.\n"
    for move in ("G53 G0 Z0.\n", "G53 G0 X0. Y0.\n", "G28 Z0.\n"):
        assert found(tmp_path, table, tilted + move + "M429\nM2\n", ".ngc") == [("tcp-state", ERROR)]
        assert found(tmp_path, table, tilted + "M429\n" + move + "M2\n", ".ngc") == []
    # Where Z of the part is that of the machine, as with rotary axes in the head, Z goes up.
    up = "G53 G0 Z0.\nM429\nM2\n"
    assert found(tmp_path, table, upright + up, ".ngc") == found(tmp_path, head, tilted + up, ".ngc") == []
    # Other controls' machine moves are those of the axes.
    assert found(tmp_path, table, ISO + "G0 Z200.\nG53 G0 Z0.\nG49\nM30\n") == []


@pytest.mark.parametrize(
    ("after", "severity"),
    [
        ("G49\nT2 M6\nM30\n", WARNING),  # the control's own change may retract
        ("M30\n", WARNING),
        ("G4 P500\nM30\n", WARNING),
        ("G1 Z9.\nX-40.\nM30\n", WARNING),  # it isn't known to be off its cut
        ("G49\nG53 G0 X0. Y0.\nM30\n", ERROR),
        ("G49\nG91 G28 A0. C0.\nM30\n", ERROR),
        ("G49\nG91 G28 X0. Y0. Z0.\nM30\n", WARNING),
        ("G49\nG53 G0 Z0.\nG53 G0 X0. Y0.\nM30\n", None),
    ],
)
def test_what_begins_where_the_last_cut_has_ended_is_told(table, tmp_path, after, severity):
    expected = [] if severity is None else [("no-retract", severity)]
    assert found(tmp_path, table, ISO + after) == expected


def test_a_retract_at_feed_along_the_tool_leaves_the_cut(table, head, tmp_path):
    last = "G1 X0. Y0. Z0. A0. C0.\n"
    assert found(tmp_path, table, ISO + last + "G1 Z9.\nM30\n") == []
    assert found(tmp_path, table, ISO + last + "G1 Z0.5\nM30\n") == [("no-retract", WARNING)]


def test_z_alone_leaves_the_cut_only_along_the_tool(table, head, tmp_path):
    after = "G49\nG53 G0 Z0.\nM30\n"
    assert found(tmp_path, table, ISO + after) == []
    assert found(tmp_path, head, ISO + after) == [("no-retract", WARNING)]
    upright = "G1 X0. Y0. Z0. A0. C0.\n"
    assert found(tmp_path, head, ISO + upright + after) == []


def test_each_operation_answers_for_the_change_after_it(table, tmp_path):
    second = CUTS.replace("Z0.", "Z-5.")
    good = "G0 Z200.\nG49\nG53 G0 Z0.\n"
    begin = "T2 M6\nS900 M3\nG43.4 H2\nG0 X0. Y0. Z50.\n"
    for first, last in (("", good), (good, "")):
        text = ISO + first + begin + second + last + "M30\n"
        told = [found(tmp_path, table, text, operation=number) for number in (1, 2)]
        assert [bool(each) for each in told] == [not first, not last]


@pytest.mark.parametrize(
    ("length", "rise", "warned"), [(None, 400, True), (100.0, 90, True), (100.0, 110, False)]
)
def test_g49_alone_is_told_where_a_setting_moves_z_by_the_tool_s_length(
    table, tmp_path, length, rise, warned
):
    machine = table if length is None else table.with_tool_length(length)
    end = f"G0 Z{rise}.\nG49\nG53 G0 Z0.\nM30\n"
    of = {"codes": ("length-off",)}
    assert found(tmp_path, machine, ISO + end, **of) == [("length-off", WARNING)] * warned
    assert found(tmp_path, machine, ISO + "G53 G0 Z0.\nG49\nM30\n", **of) == []
    other = LINUXCNC + end.replace("G49", "M429\nG49").replace("M30", "M2")
    assert found(tmp_path, machine, other, ".ngc", **of) == []
