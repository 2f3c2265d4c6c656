"""Programs of several controls: blocks around the moves, feeds, positions, and what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from support.unverified_text import write_text

from fiveaxis.base.errors import MachineError, SettingError, ToolpathError
from fiveaxis.model import Limits, Machine, Motion, MoveKind, Tool, tool_poses
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, read_program, read_toolpath
from fiveaxis.nc.writing.feeds import HELD

# mm/min: rapid moves take no time.
INSTANT = 1e9
OPEN = Machine.from_code("640123")


def motion_of(rows, times=None, letters="XYZAC", kind=MoveKind.LINK) -> Motion:
    """Create a motion from rows of mm and degrees."""
    values = np.array(rows, dtype=float) * [1.0 if c in "XYZ" else np.pi / 180 for c in letters]
    n = len(values)
    return Motion(
        letters=letters,
        positions=values,
        feed=np.full(n, 10.0),
        time=np.array([0.0, *[1.0] * (n - 1)] if times is None else times),
        kind=np.full(n, kind),
        source=np.arange(2, n + 2),
    )


SLOPE = motion_of([[0, 0, 0, 0, 0], [1, 2, 3, 4, 5], [2, 3, 4, 4, 5]])


def blocks(program) -> list[str]:
    return [line for line in program.lines if not line.startswith(("(", ";", "$$", "%"))]


def moves(program) -> list[str]:
    return [line for line in blocks(program) if line.startswith(("G1 ", "L ", "LN "))]


# What stands around the moves


FULL = ProgramSettings(
    tool_number=7,
    length_offset=17,
    spindle_rpm=12000,
    spindle_direction="left",
    coolant="flood",
    work_offset="G55",
    retract=-5.0,
    home="XY AC",
)


def test_klartext_calls_the_tool_and_its_speed_in_its_own_words():
    around = FULL.model_copy(update={"work_offset": "2", "length_offset": None})
    program = compose_program(SLOPE, machine=OPEN, control="heidenhain", settings=around)
    texts = [line.split(" ", 1)[1] for line in program.lines if " ; " not in line[:6]]
    begin = texts.index("L M127")
    assert texts[1:3] == ["FUNCTION RESET TCPM", "PLANE RESET STAY"]
    assert texts[begin + 1 : begin + 10] == [
        "CYCL DEF 32.0 TOLERANCE",
        "CYCL DEF 32.1",
        "CYCL DEF 247 DATUM SETTING ~",
        "   Q339=+2 ; DATUM NUMBER",
        "L Z-5.0000 R0 FMAX M91",
        "TOOL CALL 7 Z",
        "TOOL CALL Z S12000",
        "L M4",
        "L M8",
    ]


def test_the_header_says_what_is_not_written():
    program = compose_program(SLOPE, machine=OPEN)
    assert "(operator: tool change, spindle speed, coolant, safe retract)" in program.lines
    (told,) = (f for f in program.findings if f.code == "operator")
    assert "tool change, spindle speed, coolant, safe retract" in told.message
    full = compose_program(SLOPE, machine=OPEN, control="haas", settings=FULL)
    assert "operator" not in full.text
    assert "operator" not in {f.code for f in full.findings}


def test_an_axis_that_ends_turns_away_from_zero_is_told_with_what_turns_it_back():
    wound = motion_of([[0, 0, 0, 0, -3500], [1, 0, 0, 0, -3560]])
    text = compose_program(wound, machine=OPEN, control="fanuc", coordinates="tip").text
    assert "(ENDS WITH C AT -3560 DEG, FROM WHERE THE NEXT MOVE TURNS IT)" in text
    home = ProgramSettings(retract=0.0, home="C")
    again = compose_program(wound, machine=OPEN, control="fanuc", coordinates="tip", settings=home)
    assert "(ENDS WITH C AT -3560 DEG, FROM WHERE HOME TURNS IT BACK)" in again.text
    assert again.lines[-3] == "G53 G0 C0.0000"


@pytest.mark.parametrize(
    ("control", "home"),
    [
        ("sinumerik", ["SUPA G0 C=DC(0.00000) D0", "M30"]),
        ("heidenhain", ["L C+0.0000 R0 FMAX M91", "L M127", "L M30"]),
    ],
)
def test_an_axis_of_modulo_words_goes_home_the_shorter_way(control, home):
    wound = motion_of([[0, 0, 0, 0, -3500], [1, 0, 0, 0, -3560]])
    settings = ProgramSettings(retract=0.0, home="C")
    lines = compose_program(
        wound, machine=OPEN, control=control, coordinates="tip", winding="modulo", settings=settings
    ).lines
    texts = [re.sub(r"^\d+ ", "", line) for line in lines if "END PGM" not in line]
    assert texts[-len(home) :] == home


def test_numbers_that_are_not_set_are_assumed_and_reported():
    program = compose_program(SLOPE, machine=OPEN, control="haas")
    assert {f.code for f in program.findings} == {"number-assumed", "operator"}
    assert "(assumed: no tool number was given: H1 is written)" in program.lines
    given = ProgramSettings(tool_number=4, number=20)
    found = compose_program(SLOPE, machine=OPEN, control="haas", settings=given).findings
    assert [f.code for f in found] == ["operator"]


def test_a_named_program_takes_the_name_of_its_file(tmp_path):
    path = write_text(SLOPE, tmp_path / "3 wings-é.h", machine=OPEN, control="heidenhain")
    assert path.read_text().startswith("0 BEGIN PGM P3_WINGS__ MM\n")


def test_block_numbers_start_again_after_the_highest(monkeypatch):
    monkeypatch.setitem(DIALECTS, "small", DIALECTS["linuxcnc"].model_copy(update={"most_number": 12}))
    program = compose_program(SLOPE, machine=OPEN, control="small", settings=ProgramSettings(line_numbers=5))
    numbers = [line.split()[0] for line in program.lines if line.startswith("N")]
    assert numbers[:4] == ["N5", "N10", "N5", "N10"]


@pytest.mark.parametrize(
    ("control", "settings", "message"),
    [
        ("fanuc", {"coolant": "through"}, "no coolant 'through'; known: flood, mist"),
        ("fanuc", {"work_offset": "G60"}, "no work offset 'G60'; known ones are like G54"),
        ("fanuc", {"work_offset": "G54\nM0"}, "no work offset"),
        ("heidenhain", {"line_numbers": 10, "home": "U"}, "home"),
        ("apt", {"tool_number": 3}, "control 'apt' has no words for tool_number = 3"),
        ("apt", {"unit": "inch"}, "control 'apt' isn't written in inch; it has mm"),
        ("linuxcnc", {"length_offset": 3}, "control 'linuxcnc' has no words for length_offset = 3"),
        ("sinumerik", {"number": 3}, "control 'sinumerik' has no words for number = 3"),
        ("linuxcnc", {"home": "B"}, "home = 'B' names B, and the machine has X, Y, Z, A, C"),
    ],
)
def test_what_a_control_has_no_words_for_is_refused(control, settings, message):
    with pytest.raises((SettingError, ValueError), match=message):
        compose_program(SLOPE, machine=OPEN, control=control, settings=ProgramSettings(**settings))


# Places and feeds


def test_a_turn_about_the_tip_has_a_feed_in_degrees_and_no_lengths():
    turn = motion_of([[0, 0, 0, 0, 0], [0, 0, 0, 3, 4]], [0.0, 0.5])
    program = compose_program(turn, machine=OPEN, control="fanuc", coordinates="tip")
    assert moves(program) == ["G1 A3.0000 C4.0000 F600.000"]


def test_by_inverse_time_too_a_turn_has_no_lengths():
    turn = motion_of([[0, 0, 0, 0, 0], [0, 0, 1e-6, 3, 4]], [0.0, 0.5])
    assert moves(compose_program(turn, machine=OPEN)) == ["G1 A3.000000 C4.000000 F120"]


@pytest.mark.parametrize(("floor", "most"), [(None, 2e-6), (0.1, HELD)], ids=["rounding", "lowest speed"])
def test_lengths_left_out_beside_turns_never_add_up(floor, most, monkeypatch):
    known = DIALECTS["linuxcnc"]
    timed = known.feed["inverse_time"].model_copy(update={"least_speed": floor})
    other = known.model_copy(update={"feed": known.feed | {"inverse_time": timed}})
    monkeypatch.setitem(DIALECTS, "linuxcnc", other)
    n = 40
    rows = np.column_stack([np.arange(n) * most / 2.0, np.zeros((n, 3)), np.arange(n)])
    program = compose_program(motion_of(rows), machine=OPEN)
    x = 0.0
    for block, row in zip(moves(program), rows[1:], strict=True):
        words = {w[0]: float(w[1:]) for w in block.split()}
        x = words.get("X", x)
        assert abs(x - row[0]) < most + 0.6e-6
    assert any("X" in block for block in moves(program))


def test_moves_too_short_for_the_decimals_leave_their_time_to_the_next():
    rows = np.column_stack([np.arange(4) * 2e-5, np.zeros((4, 4))])
    program = compose_program(motion_of(rows), machine=OPEN, control="fanuc")
    assert moves(program) == ["G1 X0.0001 Y0.0000 Z0.0000 A0.0000 C0.0000 F20.000"]
    assert program.dropped == 2


def test_programs_for_linuxcnc_go_exactly_along_their_blocks_in_both_units():
    """G64 P bounds the deviation of X, Y and Z at corners, not that of the rotary axes."""
    for unit in ("mm", "inch"):
        lines = compose_program(SLOPE, machine=OPEN, settings=ProgramSettings(unit=unit)).lines
        assert "G61" in lines
        assert not any("G64" in line for line in lines)


def test_positions_in_the_machines_frame_are_read_in_it(tmp_path, monkeypatch):
    tip = DIALECTS["fanuc"].modes["tip"].model_copy(update={"positions": "machine"})
    mine = DIALECTS["fanuc"].model_copy(update={"modes": {"tip": tip}})
    monkeypatch.setitem(DIALECTS, "mine", mine)
    motion = motion_of([[10, 0, 0, 0, 0], [10, 2, 3, 40, 50], [20, 3, 4, -40, 150]])
    program = compose_program(motion, machine=OPEN, control="mine")
    path = tmp_path / "p.nc"
    path.write_text(program.text)
    read = read_toolpath(path, tool=Tool.ball(6), machine=OPEN, positions="machine")
    np.testing.assert_allclose(read.tips(read.axis)[-3:], tool_poses(OPEN, motion.positions)[0], atol=2e-4)


@pytest.mark.parametrize("code", ["640123", "601234", "012346"])
def test_a_rewind_leaves_the_linear_axes_where_they_are(tmp_path, code):
    machine = Machine.from_code(code).with_tool_length(100.0)
    rows = [[50, 20, 3, 30, 10], [50, 20, 3, 30, 370], [50, 20, 3, 30, -350], [51, 20, 3, 30, -350]]
    motion = motion_of(rows, [0.0, 2.0, 4.0, 1.0], kind=MoveKind.LINK)
    program = compose_program(motion, machine=machine, control="sinumerik", coordinates="tip")
    path = tmp_path / "p.mpf"
    path.write_text(program.text)
    again = read_program(path, machine, rapid=INSTANT)
    assert program.dropped == 0
    assert again.time.sum() == pytest.approx(7.0, rel=1e-4)
    on_path = (again.positions[:, 0] < 50.5) & (again.kind != MoveKind.RAPID)
    turning = again.positions[on_path]
    np.testing.assert_allclose(turning[:, :3], np.tile([50.0, 20.0, 3.0], (len(turning), 1)), atol=0.02)
    # Positions of axes need no such care.
    assert len(moves(compose_program(motion, machine=machine))) == 3


def test_angles_of_the_shorter_turn_are_dc_on_a_sinumerik():
    turn = motion_of([[0, 0, 0, 0, 350], [1, 0, 0, 0, 370]])
    program = compose_program(turn, machine=OPEN, control="sinumerik", winding="modulo")
    assert moves(program)[-1].split()[-2] == "C=DC(10.00000)"


def test_an_angle_that_wraps_is_switched_on_and_off_again_in_klartext():
    turn = motion_of([[0, 0, 0, 0, 350], [1, 0, 0, 0, 370]])
    lines = compose_program(turn, machine=OPEN, control="heidenhain", winding="modulo").lines[::-1]
    places = [next(i for i, x in enumerate(lines) if w in x) for w in ("L M127", "C+10.0000", "L M126")]
    assert places == sorted(places)


@pytest.mark.parametrize("low", [0, -180])
def test_angles_of_one_turn_are_read_as_the_motion_up_to_whole_turns(tmp_path, monkeypatch, low):
    dialect = DIALECTS["sinumerik"]
    modulo = dialect.modulo.model_copy(update={"low": low, "word": None if low else dialect.modulo.word})
    monkeypatch.setitem(DIALECTS, "mine", dialect.model_copy(update={"modulo": modulo}))
    angles = [350.0, 370.0, 500.0, 340.0, -20.0, -200.0]
    motion = motion_of([[i, 0, 0, 0, c] for i, c in enumerate(angles)])
    program = compose_program(motion, machine=OPEN, control="mine", winding="modulo")
    path = tmp_path / "p.mpf"
    path.write_text(program.text)
    c = np.degrees(read_program(path, OPEN).positions[:, 4])
    assert np.abs(np.remainder(c[-1] - angles[-1] + 1.0, 360.0) - 1.0) < 1e-4
    if low:  # plain words, which the reader takes as they are
        assert (c >= low).all()
        assert (c < low + 360).all()
    else:  # DC, which it reads as the shorter turn
        assert c[-1] - c[0] == pytest.approx(angles[-1] - angles[0], abs=1e-4)


# What is refused before a byte is written


def test_klartext_has_no_machine_coordinates_and_says_why():
    with pytest.raises(SettingError, match="coordinates 'axes': Klartext has no inverse-time feed"):
        compose_program(SLOPE, machine=OPEN, control="heidenhain", coordinates="axes")


def test_coordinates_that_a_control_lacks_are_named():
    with pytest.raises(
        SettingError, match="'linuxcnc' isn't written in coordinates 'vector'; it has axes, tip"
    ):
        compose_program(SLOPE, machine=OPEN, coordinates="vector")


def test_a_machine_without_rotary_axes_needs_no_tip_control():
    mill = Machine.from_code("1203")
    motion = motion_of([[0, 0, 0], [1, 0, 0]], letters="XYZ")
    assert moves(compose_program(motion, machine=mill, control="fanuc"))
    with pytest.raises(MachineError, match="no rotary axis, so it needs no tool centre point control"):
        compose_program(motion, machine=mill, control="fanuc", coordinates="tip")


def test_an_axis_that_the_control_does_not_know_is_named(monkeypatch):
    monkeypatch.setitem(DIALECTS, "mill", DIALECTS["fanuc"].model_copy(update={"axes": "XYZ"}))
    with pytest.raises(MachineError, match="has axis A, and control 'fanuc' knows X, Y, Z"):
        compose_program(SLOPE, machine=OPEN, control="mill")


@pytest.mark.parametrize(
    ("control", "coordinates", "time", "message"),
    [
        ("fanuc", "axes", 0.005, "F12000 1/min of a block of 0.005 s is above the most, 9999.99"),
        ("fanuc", "axes", 200000.0, "F0 1/min of a block of 200000 s is below the least, 0.001"),
        ("fanuc", "tip", 1e-5, r"mm/min of a block of 1e-05 s is above the most, 240000"),
    ],
)
def test_a_feed_that_the_control_does_not_read_is_named(control, coordinates, time, message):
    fast = motion_of([[0, 0, 0, 0, 0], [1, 2, 3, 4, 5]], [0.0, time])
    with pytest.raises(ToolpathError, match=f"line 3: location 1: .*{message}"):
        compose_program(fast, machine=OPEN, control=control, coordinates=coordinates)


def test_an_axis_beyond_its_travel_is_named():
    axes = tuple(replace(a, limits=Limits(-2.0, 1.5)) if a.letter == "X" else a for a in OPEN.axes)
    with pytest.raises(
        ToolpathError, match=r"line 4: location 2: X = 2 mm is above the limit 1.5 mm of machine"
    ):
        compose_program(SLOPE, machine=replace(OPEN, axes=axes))


def test_a_number_beyond_what_the_control_reads_is_named(monkeypatch):
    far = motion_of([[0, 0, 0, 0, 0], [1, 0, 0, 0, 100_001]])
    with pytest.raises(ToolpathError, match=r"location 1: C100001 is beyond 99999, .* unwind the axis"):
        compose_program(far, machine=OPEN, control="fanuc")


def test_a_line_that_is_too_long_is_named(monkeypatch):
    monkeypatch.setitem(DIALECTS, "narrow", DIALECTS["linuxcnc"].model_copy(update={"longest": 60}))
    with pytest.raises(SettingError, match=r"has 1?[0-9]{2} characters, and control 'linuxcnc' reads 60"):
        compose_program(SLOPE, machine=OPEN, control="narrow")


def test_blocks_slower_than_the_control_runs_any_are_counted():
    creep = motion_of([[0, 0, 0, 0, 0], [0.001, 0, 0, 4, 5]], [0.0, 2.0])
    program = compose_program(creep, machine=OPEN)
    assert [(f.code, f.value) for f in program.findings if f.value] == [("feed-floor", 1.0)]


def test_a_refused_motion_leaves_the_old_file(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("old")
    with pytest.raises(SettingError):
        write_text(SLOPE, path, machine=OPEN, control="heidenhain", coordinates="axes")
    assert path.read_text() == "old"
