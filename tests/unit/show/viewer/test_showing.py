"""A program that is shown as it is: all of its operations, what is assumed, and what is found in it."""

from pathlib import Path

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import load_machine, take_machine

HEAD = "(T3 D=6. CR=3. - BALL MILL)\nG21 G90 G17 G94 G54\n"
FACE = "T1 M6\nG0 B0 C0\nS2000 M3\nG0 X-40 Y0\nG43 H1 Z50\nG1 Z0 F500\nX40\nG0 Z50\n"
DRILL = "T2 M6\nS3000 M3\nG0 X20 Y20\nG43 H2 Z50\nG98 G81 X20 Y20 Z-15 R3 F200\nX-20\nG80\n"
FINISH = (
    "T3 M6\nS12000 M3\nG0 X30 Y0 B0 C0\nG43.4 H3 Z50\nG1 X30 Y0 Z2 F1500\nG1 X28 Y5 B12 C5\n"
    "X25 Y10 B14 C10\nG49\nG0 Z100\n"
)
MACHINE = "dmu50ev"


@pytest.fixture
def write(tmp_path: Path):
    def write(*operations: str) -> Path:
        path = tmp_path / "part.nc"
        path.write_text("".join([HEAD, *operations, "M30\n"]))
        return path

    return write


def test_every_operation_is_shown_with_its_lines_and_its_cutter(write):
    program = write(FACE, DRILL, FINISH)
    shown = fx.show_program(program, MACHINE)
    assert "\n".join(shown.lines) == program.read_text()
    lines = [sorted(set(shown.side.line[shown.side.tool == number].tolist())) for number in range(3)]
    assert lines == [[7, 8, 9, 10], [13, 15, 16], [20, 21, 22, 23, 24]]
    assert shown.tools[:2] == (None, None)
    assert str(shown.tools[2]) == "ball:6"
    assert any("tool 1, 2 is drawn as ball:6 and checked against nothing" in said for said in shown.assumed)


def test_cutters_are_named_by_their_numbers(write):
    shown = fx.show_program(write(FACE, DRILL, FINISH), MACHINE, tool="1=flat:50,2=drill:8:118")
    assert [str(tool) for tool in shown.tools] == ["flat:50", "drill:8:118", "ball:6"]
    assert not any("drawn as" in said for said in shown.assumed)
    assert fx.show_program(write(FACE), MACHINE, tool=fx.Tool.flat(20)).tools[0].diameter == 20.0


def test_an_operation_that_cant_be_read_is_left_out_and_said(write):
    shown = fx.show_program(write(FACE, DRILL.replace("G80", "G999"), FINISH), MACHINE)
    assert set(shown.side.line.tolist()) == {7, 8, 9, 10, 21, 22, 23, 24}
    [said] = [said for said in shown.assumed if "not shown" in said]
    assert said.startswith("operation 2, lines 11-17, unread")
    assert "G999" in said
    with pytest.raises(ToolpathError, match="G999"):
        fx.show_program(write(DRILL.replace("G80", "G999")), MACHINE)
    with pytest.raises(ToolpathError, match="has no operation 4; it holds 3"):
        fx.show_program(write(FACE, DRILL, FINISH), MACHINE, operation=4)


def test_rapid_moves_without_a_known_speed_have_one_that_is_said(write):
    said = "rapid moves of X, Y, Z, B, C run at 10,000 mm/min or deg/min"
    assumed = fx.show_program(write(FACE), MACHINE)
    assert any(said in sentence for sentence in assumed.assumed)
    given = fx.show_program(write(FACE), MACHINE, rapid=2000)
    assert not any("rapid" in sentence for sentence in given.assumed)
    assert given.side.motion.time.sum() > assumed.side.motion.time.sum()


def test_a_head_has_a_tool_length_that_is_said_unless_it_is_given(write):
    head = load_machine("dmu80p-duoblock")
    shown = fx.show_program(write(FINISH), head)
    assert any("tools are taken to be 150 mm long" in sentence for sentence in shown.assumed)
    alike = fx.show_program(write(FINISH), head.with_tool_length(150.0))
    np.testing.assert_array_equal(shown.side.motion.positions, alike.side.motion.positions)
    assert not any("long" in sentence for sentence in alike.assumed)


def test_words_of_axes_from_a_zero_that_nobody_states_are_shown_on_the_part(write):
    machine = load_machine("dmu50ev")
    shown = fx.show_program(write(FACE, FINISH), machine)
    assert any("words of the axes count from the part's zero" in sentence for sentence in shown.assumed)
    tip, _ = shown.machine.forward(shown.side.motion.positions)
    face = np.isin(shown.side.line, [9, 10])
    np.testing.assert_allclose(tip[face], [[40, 0, 0], [40, 0, 50]], atol=1e-9)
    first = np.flatnonzero(shown.side.line == 15)[0]
    np.testing.assert_allclose(tip[first], [30, 0, 2], atol=1e-9)


def test_it_has_the_place_time_and_energy_that_look_has(write):
    program = write(FACE, DRILL, FINISH)
    shown, told = fx.show_program(program, MACHINE), fx.look(program, MACHINE)
    assert shown.machine.setup == told.machine.setup
    assert any("part placed at" in sentence for sentence in shown.assumed)
    assert shown.side.time == pytest.approx(sum(each.energy.time for each in told.operations))
    assert shown.side.energy == pytest.approx(sum(each.energy.total for each in told.operations))


def test_what_verification_finds_is_at_the_row_of_its_line(write):
    beyond = FACE.replace("\nX40\n", "\nX4000\nX40\n")
    shown = fx.show_program(write(DRILL, beyond), MACHINE, zero=dict.fromkeys("XYZBC", 0))
    found = [finding for finding in shown.findings if finding.code == "axis-limit"]
    assert found
    assert 16 in {finding.place.line for finding in found}
    for finding in found:
        assert shown.side.line[shown.side.row_of(finding)] == finding.place.line


def test_a_page_is_written_and_other_things_are_refused_in_a_sentence(write, tmp_path):
    program = write(FACE)
    shown = fx.show_program(program, MACHINE)
    page = fx.write_preview(shown, tmp_path / "page.html")
    text = page.read_text(encoding="utf-8")
    assert page == tmp_path / "page.html"
    assert all(f"Assumed: {sentence}" in text.replace("&#x27;", "'") for sentence in shown.assumed)
    assert f"findings: {len(shown.findings)}" in text
    with pytest.raises(SettingError, match=r"this is 'part.nc'; show a program by preview\(show_program"):
        fx.preview("part.nc")
    with pytest.raises(SettingError, match="machine is of type NoneType; give a Machine, or the name"):
        take_machine(None)
    table = tmp_path / "path.csv"
    table.write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    with pytest.raises(ToolpathError, match="is no NC program"):
        fx.show_program(table, MACHINE)
