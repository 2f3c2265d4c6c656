"""What a program states besides its path is kept in the output, unless it is overridden."""

import pytest

import fiveaxis as fx
from fiveaxis.job import make_job, resolve
from fiveaxis.model.machine.files import find_machine

FANUC = """%
O1000
G21 G90 G55
T3 M6
S12000 M4
G0 X30 Y0 B0 C0
G43.4 H13 Z50 M8
G1 Z2 F1500
X28 Y5 B12 C5
X25 Y10 B14 C10
M30
%
"""

NAMED = 'G90 G71 G54\nT="BALL_D6"\nM6\nTRAORI\nG0 X30 Y0 Z50 B0 C0\nG1 Z2 F500\nX28 B12 C5\nM30\n'


@pytest.fixture
def placed(tmp_path):
    def load(text, name="part.nc", **settings):
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        given = {"machine": "dmu50ev", "tool": "ball:6", "tool_length": 100.0} | settings
        return resolve(make_job(input=file, **given))

    return load


def test_tool_spindle_coolant_zero_and_tcp_are_kept(placed):
    job = placed(FANUC, control="fanuc").job
    assert job.coordinates == "tip"
    assert (job.nc.tool_number, job.nc.length_offset, job.nc.work_offset) == (3, 13, "G55")
    assert (job.nc.spindle_rpm, job.nc.spindle_direction, job.nc.coolant) == (12000, "left", "flood")


def test_what_is_given_overrides_what_is_stated(placed):
    job = placed(FANUC, control="sinumerik", nc={"tool_number": 7}).job
    assert (job.control, job.nc.tool_number, job.nc.spindle_rpm) == ("sinumerik", 7, 12000)


def test_a_machine_s_own_control_comes_before_the_input_s_and_after_the_job_s(placed, tmp_path):
    """The program runs on this machine, whatever control the input was written for."""
    mill = tmp_path / "mill.toml"
    text = find_machine("dmu50ev").read_text(encoding="utf-8")
    mill.write_text(f'control = "heidenhain"\n{text}', encoding="utf-8")
    job = placed(FANUC, machine=str(mill)).job
    assert (job.program_options.control, job.coordinates) == ("heidenhain", "tip")
    assert (job.nc.tool_number, job.nc.spindle_rpm, job.nc.work_offset) == (3, 12000, None)
    assert placed(FANUC, machine=str(mill), control="sinumerik").job.program_options.control == "sinumerik"


def test_what_the_control_cannot_be_given_is_a_finding(placed):
    found = placed(NAMED, "part.mpf", control="sinumerik")
    [lost] = [f for f in found.toolpath.findings if f.code == "not-kept"]
    assert "tool_number BALL_D6" in lost.message


def test_what_a_posted_program_cannot_keep_is_the_same_finding(tmp_path):
    file = tmp_path / "part.mpf"
    file.write_text(NAMED, encoding="utf-8")
    machine = fx.load_machine("dmu50ev").with_setup((0.0, 0.0, 100.0)).with_tool_length(100.0)

    def lost(**settings):
        asked = fx.ProgramSettings(**settings)
        posted = fx.post_program(
            file, machine, control="sinumerik", coordinates="tip", rapid=1e4, settings=asked
        )
        return [f.message for f in posted.findings if f.code == "not-kept"]

    assert lost() == [
        "control sinumerik isn't given the input's tool_number BALL_D6; see that it is in force"
    ]
    assert lost(tool_number=6) == []


def test_a_posted_program_keeps_them_too(tmp_path):
    file = tmp_path / "part.nc"
    file.write_text(FANUC, encoding="utf-8")
    machine = fx.load_machine("dmu50ev").with_setup((0.0, 0.0, 100.0)).with_tool_length(100.0)
    posted = fx.post_program(file, machine, control="fanuc", coordinates="tip", rapid=1e4)
    text = posted.program.text
    for word in ("G55", "T3 M6", "S12000 M4", "M8", "H13"):
        assert word in text
