"""A program as it is: its operations' time and energy, and where it is slow and why."""

import json

import pytest

import fiveaxis as fx
from fiveaxis.base import ToolpathError

MACHINE = "linuxcnc-xyzac-trt"
# C turns by 30 deg in 10 mm: at F600 that is 1 s, and C takes 1 s at least (30 deg/s); at F1200 it is 0.5 s.
HEAD = "G21 G90 G54\n(T3 ball 8)\nT3 M6\nS9000 M3\nG43 H3\nM428\n"
TAIL = "M429\nG0 Z100\nM30\n"


def turning(feed: float, count: int = 12) -> str:
    lines = [f"G1 X{10 * k} Y5 Z5 A-20 C{30 * k} F{feed:g}" for k in range(1, count + 1)]
    return HEAD + "G0 X0 Y5 Z50 A-20 C0\nG1 Z5 F600\n" + "\n".join(lines) + "\n" + TAIL


@pytest.fixture
def program(tmp_path):
    def written(text: str):
        path = tmp_path / "part.ngc"
        path.write_text(text)
        return path

    return written


def test_time_and_energy_are_those_of_the_priced_program(program):
    path = program(turning(300))
    seen = fx.look(path, MACHINE, drives="estimated")
    priced = fx.program_energy(path, fx.look(path, MACHINE).machine, operation=1)
    assert [each.energy.total for each in seen.operations] == [priced.energy.total]
    assert seen.operations[0].energy.time == priced.energy.time


def test_a_slow_place_has_its_lines_its_cause_and_what_was_lost(program):
    text = turning(2400)
    (seen,) = fx.look(program(text), MACHINE).operations
    lines = [number for number, line in enumerate(text.splitlines(), start=1) if "F2400" in line]
    first, *_ = seen.slow
    assert (first.first, first.last) == (lines[0], lines[-1])
    assert first.cause == "C speed"
    # F asks each of the twelve blocks to take 0.25 s, C takes 1 s for each.
    assert first.lost == pytest.approx(12 * 0.75, rel=0.2)
    assert first.asked == pytest.approx(2400, rel=0.01)
    assert first.got == pytest.approx(600, rel=0.2)


def test_what_is_lost_in_places_is_no_more_than_what_is_lost_in_all(program):
    (seen,) = fx.look(program(turning(900) + turning(2400)), MACHINE, operation=1).operations
    assert 0.0 < sum(place.lost for place in seen.slow) <= seen.lost <= seen.energy.time


def test_where_no_axis_is_too_slow_nothing_is_told(program):
    (seen,) = fx.look(program(turning(100)), MACHINE).operations
    assert not seen.slow


def test_places_apart_are_told_apart_the_costliest_first(program):
    quick = [f"G1 X{120 + 10 * k} C360 F500" for k in range(1, 20)]
    more = [f"G1 X{320 - 10 * k} C{360 + 30 * k} F2400" for k in range(1, 4)]
    text = turning(2400).replace(TAIL, "\n".join([*quick, *more]) + "\n" + TAIL)
    (seen,) = fx.look(program(text), MACHINE).operations
    assert len(seen.slow) == 2
    assert seen.slow[0].lost > seen.slow[1].lost
    assert seen.slow[0].last < seen.slow[1].first


def test_only_what_turns_the_tool_while_it_cuts_can_be_improved(program):
    flat = "T1 M6\nS3000 M3\nG43 H1\nG0 X0 Y0 Z50\nG1 Z0 F300\nG1 X50 F800\nG1 Y50\nG0 Z50\n"
    path = program("G21 G90 G54\n" + flat + turning(300).replace("G21 G90 G54\n", ""))
    seen = fx.look(path, MACHINE).operations
    assert [each.facts.operation.kind for each in seen] == ["3-axis", "simultaneous"]
    assert "never leaned" in seen[0].stays
    assert "tool isn't known" in seen[1].stays
    named = fx.look(path, MACHINE, tool="3=ball:8").operations
    assert named[1].stays == ""


def test_what_the_machine_does_not_state_is_listed_and_what_was_taken_is_said(program):
    path = program(turning(300).replace("M428\n", "").replace("M429\n", ""))
    seen = fx.look(path, "variaxis-730")
    names = [each.name for each in seen.missing]
    assert names == ["A.points", "A.speeds", "C.speeds"]
    assert any("estimated" in text for text in seen.assumed)
    assert not any("rapid" in text for text in seen.assumed)
    given = fx.load_machine("variaxis-730", {"A.points": "0,0,50", "A.speeds": "30", "C.speeds": "50"})
    assert not fx.look(path, given).missing


def test_it_is_plain_data_for_json(program):
    plain = fx.look(program(turning(2400)), MACHINE)
    seen = json.loads(json.dumps(plain.as_dict()))
    assert seen["operations"][0]["slow"][0]["cause"] == "C speed"
    assert seen["operations"][0]["energy"]["time"] == plain.operations[0].energy.time


def test_a_file_that_is_no_program_is_refused(tmp_path):
    path = tmp_path / "part.nc"
    path.write_bytes(b"\x7fELF\x02\x01\x01\x00" + bytes(200))
    with pytest.raises(ToolpathError, match=r"part\.nc"):
        fx.look(path, MACHINE)
