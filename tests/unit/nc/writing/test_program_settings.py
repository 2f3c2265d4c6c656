"""Settings of a program: how they are written, and what a control can't express."""

import numpy as np
import pytest

from fiveaxis.base.errors import JobError, SettingError
from fiveaxis.base.settings import StrictModel, read_settings
from fiveaxis.model import Machine, Motion
from fiveaxis.nc import DIALECTS, Program, ProgramSettings, compose_program

OPEN = Machine.from_code("640123")
MOTION = Motion("XYZAC", np.eye(5) / 2.0, np.ones(5), np.ones(5), np.zeros(5, int), np.arange(5))


def program_of(control: str, **asked) -> Program:
    return compose_program(MOTION, machine=OPEN, control=control, settings=ProgramSettings(**asked))


@pytest.mark.parametrize(
    ("control", "block"),
    [
        ("fanuc", "S8333 M3"),
        ("haas", "S8333 M3"),
        ("linuxcnc", "S8333.333 M3"),
        ("sinumerik", "S8333.333 M3"),
    ],
)
def test_a_spindle_speed_has_the_decimals_that_the_control_reads(control, block):
    program = program_of(control, spindle_rpm=8333.333)
    assert block in program.lines
    said = [f.message for f in program.findings if "8333.333" in f.message]
    assert bool(said) == (block == "S8333 M3")
    assert all("S8333 is written" in text for text in said)


@pytest.mark.parametrize("rpm", [10.0, 8000.0, 12000.0])
def test_whole_spindle_speeds_keep_their_zeros_and_need_no_note(rpm):
    program = program_of("fanuc", spindle_rpm=rpm, tool_number=3, number=4)
    assert f"S{int(rpm)} M3" in program.lines
    assert [f.code for f in program.findings] == ["operator"]


@pytest.mark.parametrize(
    ("control", "asked", "message"),
    [
        (
            "fanuc",
            {"spindle_rpm": 0.3},
            "spindle_rpm = 0.3 is S0 for control 'fanuc', which reads 0",
        ),
        ("fanuc", {"spindle_rpm": 150000.0}, "spindle_rpm = 150000 is beyond 99999"),
        ("fanuc", {"number": 99999999}, "number = 99999999 is beyond 9999, the most that control 'fanuc'"),
        ("haas", {"number": 100000}, "number = 100000 is beyond 99999"),
        ("fanuc", {"length_offset": 2001}, "length_offset = 2001 is beyond 2000"),
        ("fanuc", {"tool_number": 2001}, "length_offset = 2001 is beyond 2000"),
        ("sinumerik", {"tool_number": 32001}, "tool_number = 32001 is beyond 32000"),
        ("fanuc", {"work_offset": "G54.1 P301"}, "no work offset 'G54.1 P301'"),
        ("fanuc", {"retract": 1e7}, "retract = 10000000 mm is beyond 99999"),
    ],
)
def test_what_a_control_has_no_room_for_is_named_with_its_bound(control, asked, message):
    with pytest.raises(SettingError, match=message):
        program_of(control, **asked)


def test_a_tool_number_is_no_length_where_the_control_takes_it_from_the_tool():
    assert "T5000 M6" in program_of("linuxcnc", tool_number=5000).lines
    assert "T300" in "".join(program_of("sinumerik", tool_number=300).lines)
    assert all(set(d.most) <= set(ProgramSettings.model_fields) for d in DIALECTS.values())


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"spindle_rpm": float("nan")}, "spindle_rpm = nan must be a finite number"),
        ({"retract": float("inf")}, "retract = inf must be a finite number"),
        ({"home": "xy"}, "home = 'xy' must be groups of axis letters, each once, like 'Z XY AC'"),
        ({"toolnumber": 3}, "unknown key 'toolnumber'; the nearest known one is 'tool_number'"),
    ],
)
def test_a_wrong_setting_is_reported_in_one_line(asked, message):
    with pytest.raises(SettingError, match=message) as caught:
        ProgramSettings(**asked)
    assert "\n" not in str(caught.value)


def test_a_file_that_holds_settings_names_the_place_of_a_wrong_one(tmp_path):
    class Holder(StrictModel):
        nc: ProgramSettings

    path = tmp_path / "job.toml"
    path.write_text("[nc]\nname = 'a'\nspindle_rpm = -1\n")
    with pytest.raises(JobError, match=r"job.toml:3: nc.spindle_rpm = -1 must be above 0"):
        read_settings(path, Holder, JobError)
