"""From postures to a program: what is verified is the text, whoever asks for it."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import SettingError, ToolpathError, Unverified
from fiveaxis.check import Against, ReadBack
from fiveaxis.job import post_program
from fiveaxis.job.posting import make_of_motion
from fiveaxis.job.program import make_program
from fiveaxis.model import AXIS_TOLERANCE, PATH_TOLERANCE, Constraints, Tool, Toolpath, follow, tool_axes
from fiveaxis.nc import DIALECTS, ProgramSettings, write_motion
from fiveaxis.nc.program_options import ProgramOptions

TILT = (15.0, 75.0)
MODES = [(name, mode) for name, dialect in DIALECTS.items() for mode in dialect.modes]


@pytest.fixture(scope="module")
def wall() -> Toolpath:
    """A pass around a part of an overhanging cone."""
    turn = np.radians(np.linspace(0.0, 90.0, 40))
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full_like(turn, -0.5)])
    contact = np.column_stack([25.0 * np.cos(turn), 25.0 * np.sin(turn), np.full_like(turn, 20.0)])
    return Toolpath.from_contacts(contact, normal, Tool.ball(8), name="wall")


@pytest.fixture(scope="module")
def solution(hayashi, wall) -> fx.Solution:
    return fx.optimise(wall, hayashi, tilt=TILT, effort="quick")


@pytest.mark.parametrize(("control", "mode"), MODES)
def test_every_control_and_mode_holds_path_axis_and_spindle_when_its_text_is_read_back(
    solution, control, mode
):
    sense, direction = ("M4", "left") if MODES.index((control, mode)) % 2 else ("M3", "right")
    turning = ProgramSettings(spindle_rpm=8000, spindle_direction=direction)
    speaks = DIALECTS[control].language == "blocks"
    made = solution.program(
        control=control, coordinates=mode, settings=turning if speaks else ProgramSettings()
    )
    assert made.ok, made.report.findings
    assert not speaks or f"spindle: 8000 rev/min ({sense}) in every cut" in made.report.passed
    figures = made.report.figures
    assert figures["contact_error_mm"] <= PATH_TOLERANCE
    assert figures["tip_deviation_mm"] <= PATH_TOLERANCE
    assert figures["axis_off_plane_deg"] <= np.degrees(AXIS_TOLERANCE)
    header = " ".join(line.strip("();#$ ") for line in made.text.lines).lower()
    assert "verification: no errors in this text, read back" in header


@pytest.mark.parametrize("control", ["fanuc", "heidenhain", "sinumerik"])
def test_directions_where_an_axis_ends_are_not_rounded_past_its_end(trunnion, control):
    """There the control would take the other pair of angles, half a turn of C away."""
    n = 30
    at_end = np.full(n, trunnion.axes[3].limits.low)
    rotary = np.column_stack([np.linspace(0.0, 1.0, n), at_end])
    chain = rotary if trunnion.letters[trunnion.rotary_columns[0]] == "C" else rotary[:, ::-1]
    tip = np.column_stack([20.0 + np.linspace(0.0, 8.0, n), np.zeros(n), np.full(n, 10.0)])
    path = Toolpath.from_tips(tip, tool_axes(trunnion, chain), Tool.ball(6), feed_mm_min=100.0)
    made = make_program(
        follow(path, trunnion, chain),
        trunnion,
        path,
        Constraints(),
        ProgramOptions.of(control=control, coordinates="vector"),
    )
    assert {"jump", "contact-error"}.isdisjoint(made.report.counts)
    assert made.report.figures["contact_error_mm"] < 1e-3


@pytest.mark.parametrize(("control", "mode"), [("linuxcnc", "axes"), ("fanuc", "tip"), ("heidenhain", "tip")])
def test_command_table_and_python_write_the_same_blocks(solution, tmp_path, hayashi, wall, control, mode):
    """The solution, its motion along its path, and the table of that motion become one program."""
    settings = ProgramSettings(name="wall")
    words = {"control": control, "coordinates": mode, "settings": settings}
    first = solution.program(**words).text
    fx.write_program(
        solution.motion,
        tmp_path / "motion.nc",
        hayashi,
        against=Against(wall, constraints=solution.constraints),
        header={"tool": "ball:8"},
        **words,
    )
    assert (tmp_path / "motion.nc").read_text() == first.text
    table = write_motion(solution.motion, tmp_path / "motion.csv", hayashi)
    posted = post_program(
        table, hayashi, against=Against(wall, constraints=solution.constraints), **words
    ).program

    def numbers(text):
        blocks = [line for line in text.lines if line[:1] not in "(;"]
        return len(blocks), [blocks[0], blocks[-1]]

    assert numbers(posted) == numbers(first)


def test_what_the_file_says_is_what_was_verified(solution, tmp_path, hayashi, wall):
    report = solution.write(tmp_path / "wall.ngc")
    assert report.ok
    again = fx.verify_program(tmp_path / "wall.ngc", hayashi, toolpath=wall, tilt=TILT)
    assert again.ok, again.findings
    assert again.figures["off_path_mm"] <= 0.001


def test_a_motion_alone_is_not_verified_and_written_only_on_request(solution, tmp_path, hayashi):
    with pytest.raises(Unverified, match="which path it should follow"):
        fx.write_program(solution.motion, tmp_path / "a.ngc", hayashi)
    assert list(tmp_path.iterdir()) == []
    path = fx.write_program(solution.motion, tmp_path / "a.ngc", hayashi, unverified=True)
    assert "NOT VERIFIED" in path.read_text()


def test_a_bare_motion_keeps_its_tip_straight_between_rows_and_its_time(solution, hayashi):
    bare = make_of_motion(solution.motion, hayashi, ProgramOptions.of())
    assert not bare.ok
    assert len(bare.motion) >= len(solution.motion) + 3
    assert bare.motion.blocks.time.sum() == pytest.approx(solution.motion.time.sum())


def test_a_path_of_another_motion_is_refused_before_anything_is_written(solution, tmp_path, hayashi, wall):
    up = np.array([0.0, 0.0, 1.0])
    shifted = replace(wall, pivot=wall.pivot + up, contact=wall.contact + up)
    against = Against(shifted, constraints=Constraints.of_degrees(tilt=TILT))
    with pytest.raises(ToolpathError, match=r"wall: the motion has the tool 1 mm from location \d+"):
        fx.write_program(solution.motion, tmp_path / "a.ngc", hayashi, against=against)
    fewer = wall.at(np.arange(len(wall) - 5))
    rows = f"35 locations and the motion {len(solution.motion)}"
    with pytest.raises(ToolpathError, match=rows):
        make_program(solution.motion, hayashi, fewer, Constraints(), ProgramOptions.of())
    assert list(tmp_path.iterdir()) == []


def test_a_report_of_another_motion_releases_nothing(solution, tmp_path, hayashi, wall):
    other = fx.optimise(wall, hayashi, tilt=(30.0, 60.0), effort="quick")
    report = fx.verify(other.motion, hayashi, wall, tilt=(30.0, 60.0))
    with pytest.raises(SettingError, match="about another motion"):
        fx.write_program(solution.motion, tmp_path / "a.ngc", hayashi, against=Against(wall), report=report)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_read_back_is_not_written(solution, tmp_path, hayashi):
    """A table of one's own whose moves are words that the readers refuse."""
    table = tmp_path / "mine.toml"
    table.write_text('based_on = "linuxcnc"\nlinear = "G5 {words} F{feed}"\n')
    with pytest.raises(Unverified, match=r"can't be read back.*G5 is a curve"):
        solution.write(tmp_path / "a.ngc", control=table)
    assert not (tmp_path / "a.ngc").exists()


def test_a_spindle_that_was_not_given_is_reported_as_not_checked(solution):
    made = solution.program()
    assert "spindle: no speed was given, and the program switches none on" in made.report.not_checked
    turning = solution.program(settings=ProgramSettings(spindle_rpm=8000, spindle_direction="left"))
    assert "spindle: 8000 rev/min (M4) in every cut" in turning.report.passed
    assert turning.ok


def test_the_text_is_read_back_row_by_row(solution):
    made = solution.program(control="fanuc", coordinates="tip")
    wording = ProgramOptions.of(control="fanuc", coordinates="tip").wording(solution.machine)
    back = ReadBack.of(made.text, made.motion, wording, ProgramSettings())
    np.testing.assert_array_equal(back.written, np.arange(len(made.motion)))
    assert back.read.motion.tcp[back.end[1:]].all()
