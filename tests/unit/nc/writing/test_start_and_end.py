"""Begin and end of a program: tool length, retract, spindle, home."""

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Machine, Motion
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program

OPEN = Machine.from_code("640123")
MOTION = Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.ones(5), np.zeros(5, int), np.arange(5))
FULL = {"tool_number": 3, "spindle_rpm": 8000.0, "coolant": "flood"}
BLOCKS = [(n, c) for n, d in DIALECTS.items() if d.language == "blocks" for c in d.modes]
LENGTHS = [(n, c) for n, c in BLOCKS if n in ("fanuc", "haas")]


def code_of(control: str, coordinates: str, machine: Machine = OPEN, **asked) -> list[str]:
    """Blocks without numbers and comments."""
    program = compose_program(
        MOTION, machine=machine, control=control, coordinates=coordinates, settings=ProgramSettings(**asked)
    )
    number = DIALECTS[control].numbered
    lines = [line.split(" ", 1)[1] if number else line for line in program.lines]
    return [line for line in lines if line[:1] not in "(;%"]


def place(lines: list[str], *starts: str) -> int:
    """Index of the one block that begins so."""
    found = [i for i, line in enumerate(lines) if line.startswith(starts)]
    assert len(found) == 1, (starts, lines)
    return found[0]


@pytest.mark.parametrize(("control", "coordinates"), LENGTHS)
def test_the_length_comes_with_the_first_move_that_it_counts_in(control, coordinates):
    """A separate block would move Z by the length on a Fanuc, depending on a parameter."""
    lines = code_of(control, coordinates, **FULL)
    on = [line for line in lines if "H3" in line]
    assert len(on) == 1
    assert on[0].startswith("G0 G")
    assert "Z" in on[0]
    moved = next(i for i, line in enumerate(lines) if line.startswith("G0") and "Z" in line)
    assert moved == lines.index(on[0])


@pytest.mark.parametrize("coordinates", ["axes", "tip", "vector"])
def test_a_fanuc_takes_the_length_back_once_the_tool_is_clear(coordinates):
    for asked, clear in (({"retract": -5.0}, "G53 G0 Z-5.0000"), ({"home": "Z XY"}, "G53 G0 Z0.0000")):
        lines = code_of("fanuc", coordinates, **asked)[-8:]
        assert lines.index(clear) + 1 == lines.index("G49") < lines.index("M5")


@pytest.mark.parametrize("coordinates", ["axes", "tip", "vector"])
def test_a_fanuc_that_goes_nowhere_clear_keeps_the_length_and_says_so(coordinates):
    lines = code_of("fanuc", coordinates)
    assert "G49" not in lines
    text = compose_program(MOTION, machine=OPEN, control="fanuc", coordinates=coordinates).text
    assert "NOT WRITTEN: G49 AT THE END" in text
    clear = ProgramSettings(retract=0.0)
    again = compose_program(MOTION, machine=OPEN, control="fanuc", coordinates=coordinates, settings=clear)
    assert "NOT WRITTEN: G49" not in again.text


def test_linuxcnc_is_in_identity_before_the_first_move_of_a_program_under_tcp():
    """Its table kinematics start under TCP, where G53 moves the tip: sideways if the table is tilted."""
    lines = code_of("linuxcnc", "tip", retract=0.0, **FULL)
    assert lines.index("M429") < place(lines[: lines.index("M428")], "G53 G0 Z")
    assert "M429" not in code_of("linuxcnc", "axes", retract=0.0, **FULL)
    assert code_of("linuxcnc-switchkins", "tip", retract=0.0, **FULL).count("M429") == 2


@pytest.mark.parametrize(("control", "coordinates"), BLOCKS)
def test_nothing_is_switched_off_twice_before_the_first_move(control, coordinates):
    lines = code_of(control, coordinates, retract=0.0, **FULL)
    start = lines[: next(i for i, line in enumerate(lines) if " Z" in line)]
    assert len(set(start)) == len(start)


def test_words_that_contain_the_length_have_none_added():
    lines = code_of("fanuc", "axes", OPEN.with_tool_length(100.0), retract=0.0, **FULL)
    assert not any("G43" in line for line in lines)
    assert lines.count("G49") == 2


@pytest.mark.parametrize(("control", "coordinates"), BLOCKS)
@pytest.mark.parametrize("end", [{"retract": 0.0, "home": "XY AC"}, {"home": "Z XY AC"}])
def test_the_spindle_turns_until_the_tool_is_clear_and_then_the_axes_go_home(control, coordinates, end):
    lines = code_of(control, coordinates, **FULL, **end)
    by_machine = [i for i, line in enumerate(lines) if any(w in line for w in ("G53", "SUPA", "M91"))]
    assert len(by_machine[-3:]) == 3
    clear, *home = by_machine[-3:]
    stop = place(lines, "M5", "L M5")
    assert clear < stop < place(lines, "M9", "L M9") < home[0]
    assert "Z" in lines[clear]
    assert [[c for c in "XYZAC" if f"{c}0" in lines[i] or f"{c}+0" in lines[i]] for i in home] == [
        ["X", "Y"], ["A", "C"],
    ]  # fmt: skip


@pytest.mark.parametrize("home", ["XY", "AC XY Z", "XYZ", "ZXY"])
def test_no_axis_goes_home_from_where_the_path_ends(home):
    for control, coordinates in BLOCKS:
        with pytest.raises(SettingError, match=r"home = .* set a retract, or begin with Z alone"):
            code_of(control, coordinates, home=home)
