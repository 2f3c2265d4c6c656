"""NC programs, block by block."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError, SettingError, ToolpathError
from fiveaxis.model import Limits, Machine, Motion, MoveKind, linear_positions, tool_poses
from fiveaxis.nc import ProgramSettings, read_program
from fiveaxis.nc import compose_program as compose_with_lead_out

# The lead-out has its own tests: here the last block is the last move.
compose_program = partial(compose_with_lead_out, settings=ProgramSettings(way_out=False))


def motion_of(positions, times=None, letters="XYZAC", kind=MoveKind.CUT):
    """Create a motion from rows of mm and degrees."""
    values = np.array(positions, dtype=float) * [1, 1, 1, np.pi / 180, np.pi / 180]
    n = len(values)
    return Motion(
        letters=letters,
        positions=values,
        feed=np.full(n, 10.0),
        time=np.array([0.0] + [1.0] * (n - 1)) if times is None else np.array(times),
        kind=np.full(n, kind),
        source=np.arange(2, n + 2),
    )


def blocks(program):
    """Return the lines that aren't comments."""
    return [line for line in program.lines if not line.startswith("(")]


def words(block):
    return {w[0]: float(w[1:]) for w in block.split()}


def test_joints_are_those_of_linuxcnc(trunnion):
    # ../shared/reference/machines.md, xyzac-trt's golden table: program X Y Z A C with TCP on, joints X Y Z.
    table = np.array(
        [
            [10, 0, 0, 0, 0, 10, 0, 0],
            [10, 0, 0, 30, 0, 10, 7.679492, -8.660254],
            [10, 5, -3, -45, 90, -5, 3.736544, 7.878680],
            [-20, 15, 8, -30, 200, 23.924155, -4.603511, 21.895442],
        ]
    )
    # Positive A and C turn the table there: tool relative to workpiece it is the opposite.
    rotary = np.radians(-table[:, [4, 3]])
    assert trunnion.rotaries == ("C", "A")
    positions = linear_positions(trunnion, table[:, :3], rotary)
    motion = replace(motion_of(np.zeros((4, 5)), kind=MoveKind.LINK), positions=positions)
    program = compose_program(motion, machine=trunnion)
    moves = [words(b) for b in blocks(program) if b.startswith("G1")]
    expected = table[1:, [5, 6, 7, 3, 4]]
    np.testing.assert_allclose([[m[c] for c in "XYZAC"] for m in moves], expected, atol=2e-6)
    assert [b for b in blocks(program) if b.startswith("G0")] == [
        "G0 A0.000000 C0.000000",
        "G0 X10.000000 Y0.000000",
        "G0 Z0.000000",
    ]


def test_every_timed_block_has_its_inverse_time(hayashi):
    times = [0.0, 0.001, 0.37, 12.0, 4000.0, 1e-7]
    motion = motion_of([[i, 0, 0, 0, 0] for i in range(6)], times)
    moves = [b for b in blocks(compose_program(motion, machine=hayashi)) if b.startswith("G1")]
    assert [b.split()[-1] for b in moves[1:]] == ["F60000", "F162.1622", "F5", "F0.015", "F600000000"]
    np.testing.assert_allclose([60 / words(b)["F"] for b in moves[1:]], times[1:], rtol=1e-6)


def test_turns_of_a_rotary_axis_are_kept(hayashi):
    motion = motion_of([[0, 0, 0, 0, 350], [0, 0, 0, 0, 370], [0, 0, 0, 0, -730]])
    moves = [words(b)["C"] for b in blocks(compose_program(motion, machine=hayashi)) if b.startswith("G1")]
    assert moves[1:] == [370, -730]


def test_no_word_is_a_negative_zero_or_has_an_exponent(hayashi):
    motion = motion_of([[1, 1, 1, 1, 1], [-1e-9, -0.0, -4e-7, -0.0000005, 1e-12]])
    last = [b for b in blocks(compose_program(motion, machine=hayashi)) if b.startswith("G1")][-1]
    assert last == "G1 X0.000000 Y0.000000 Z0.000000 A0.000000 C0.000000 F60"


def test_an_empty_move_is_dropped_and_counted(hayashi):
    motion = motion_of([[0] * 5, [0] * 5, [1e-8, 0, 0, 0, 0], [1, 0, 0, 0, 0]], [0.0, 0.0, 1e-9, 1.0])
    program = compose_program(motion, machine=hayashi)
    assert program.dropped == 2
    assert sum(b.startswith("G1 ") for b in program.lines) == 2


def test_a_rounding_step_without_duration_joins_the_next_move(hayashi):
    motion = motion_of([[0] * 5, [1e-6, 0, 0, 0, 0], [1, 0, 0, 0, 0]], [0.0, 0.0, 1.0])
    assert compose_program(motion, machine=hayashi).dropped == 1


@pytest.mark.parametrize("duration", [0.0, -1.0, 1e-310])
def test_a_move_without_duration_is_refused(hayashi, duration):
    motion = motion_of([[0] * 5, [0, 0, 0, 0.5, 0]], [0.0, duration])
    with pytest.raises(
        ToolpathError, match=f"line 3: location 1: an axis moves by 0.5 mm or deg in {duration:g} s"
    ):
        compose_program(motion, machine=hayashi)


@pytest.mark.parametrize(
    ("name", "value"), [("positions", np.nan), ("time", np.inf), ("feed", np.nan), ("feed", 0.0)]
)
def test_an_invalid_number_is_refused(hayashi, name, value):
    motion = motion_of(np.eye(5))
    values = getattr(motion, name).copy()
    values[3] = value
    with pytest.raises(ToolpathError, match=r"line 5: location 3 has an axis value.*\(1 such locations\)"):
        compose_program(replace(motion, **{name: values}), machine=hayashi)


def test_an_empty_motion_is_refused(hayashi):
    with pytest.raises(ToolpathError, match="no locations"):
        compose_program(motion_of(np.empty((0, 5)), times=[]), machine=hayashi)


def test_a_motion_of_another_machine_is_refused(hayashi):
    with pytest.raises(MachineError, match="axes XYZBC, and machine 'hayashi-640123' has XYZAC"):
        compose_program(motion_of(np.eye(5), letters="XYZBC"), machine=hayashi)


def test_an_unknown_control_names_the_nearest_and_all(hayashi):
    with pytest.raises(
        SettingError,
        match=r"unknown control 'linuxnc'; did you mean 'linuxcnc'[?] known: apt, fanuc, haas, heidenhain, "
        r"heidenhain-m128, linuxcnc, linuxcnc-switchkins, points, sinumerik \(or the path of a .toml file\)",
    ):
        compose_program(motion_of(np.eye(5)), machine=hayashi, control="linuxnc")


# The approach


def approach(motion, machine):
    """Return the words of the approach's rapid moves in order, and those of the first move after it."""
    lines = blocks(compose_program(motion, machine=machine))
    moves = [words(b) for b in lines[lines.index("G93") :] if b.startswith(("G0", "G1 "))]
    return [words(b) for b in lines[: lines.index("G93")] if b.startswith("G0")], moves[0]


@pytest.mark.parametrize("code", ["640123", "601235", "120356", "560312", "123054"])
def test_a_first_cut_is_approached_along_the_tool_axis_at_its_feed(code):
    machine = Machine.from_code(code)
    positions = np.array([[10, 20, 30, 0.4, -0.3], [11, 20, 30, 0.4, -0.3]])
    motion = replace(motion_of(np.zeros((2, 5))), positions=positions, letters=machine.letters)
    rapid, target = approach(motion, machine)
    merged = rapid[0] | rapid[1] | rapid[2]
    start = np.array([merged[c] for c in machine.letters])
    start[3:] = np.radians(start[3:])
    tip, axis = tool_poses(machine, np.array([start, positions[0]]))
    np.testing.assert_allclose(tip[0] - tip[1], 5.0 * axis[1], atol=1e-5)
    np.testing.assert_allclose(axis[0], axis[1], atol=1e-7)
    # 5 mm at 10 mm/s are half a second.
    assert target["F"] == pytest.approx(120.0, rel=1e-6)
    assert [target[c] for c in "XYZ"] == [10, 20, 30]


def test_the_approach_stops_at_an_axis_limit(hayashi):
    axes = tuple(replace(a, limits=Limits(-50, 52)) if a.letter == "Z" else a for a in hayashi.axes)
    rapid, target = approach(motion_of([[0, 0, 50, 0, 0], [1, 0, 50, 0, 0]]), replace(hayashi, axes=axes))
    assert rapid[2]["Z"] == 52
    assert target["F"] == pytest.approx(300)


def test_a_location_on_its_limit_is_approached_in_rapid(hayashi):
    axes = tuple(replace(a, limits=Limits(-50, 50)) if a.letter == "Z" else a for a in hayashi.axes)
    rapid, target = approach(motion_of([[0, 0, 50, 0, 0], [1, 0, 50, 0, 0]]), replace(hayashi, axes=axes))
    assert rapid[2]["Z"] == 50
    assert target["X"] == 1


def test_a_path_that_begins_in_rapid_is_approached_in_rapid(hayashi):
    rapid, target = approach(motion_of(np.eye(5), kind=MoveKind.RAPID), hayashi)
    assert rapid[1]["X"] == 1
    assert target["Y"] == 1


# Tool length and comments


def test_the_control_adds_the_tool_length_only_where_the_tool_keeps_its_direction():
    motion = motion_of(np.eye(5))
    assert "G43" in compose_program(motion, machine=Machine.from_code("640123")).lines
    head = compose_program(motion, machine=Machine.from_code("601234"))
    assert "G49" in head.lines
    assert "G43" not in head.lines


@pytest.mark.parametrize(
    ("value", "comment"),
    [
        ("fräsen (schruppen), Ø10 µm 90° − 3·10³", "(note: frasen [schruppen], d10 um 90 deg - 3*103)"),
        ("a\nG0 Z-100\r\n%", "(note: a G0 Z-100 %)"),
        ("刀", "(note: ?)"),
        ("", "(note:)"),
    ],
)
def test_a_comment_can_neither_end_early_nor_leave_ascii(hayashi, value, comment):
    program = compose_program(motion_of(np.eye(5)), machine=hayashi, header={"note": value})
    assert comment in program.lines


def test_a_header_has_at_most_17_lines_and_keeps_what_is_read_back(hayashi):
    header = {"tool": "ball:10"} | {f"source {i}": "part.apt" for i in range(40)}
    program = compose_program(motion_of(np.eye(5)), machine=hayashi, header=header)
    comments = [line for line in program.lines if line[0] == "("]
    assert len(comments) == 17
    assert "(tool: ball:10)" in comments
    assert comments[-1] == "(further comments are in the report)"


def test_per_cent_is_a_word_where_the_sign_ends_a_program(hayashi):
    for control, text in (("linuxcnc", "(saved: 21 %)"), ("haas", "(saved: 21 per cent)")):
        machine = hayashi if control == "linuxcnc" else Machine.from_code("640123")
        program = compose_program(
            motion_of(np.eye(5)), machine=machine, control=control, header={"saved": "21 %"}
        )
        assert text in program.lines


@pytest.mark.parametrize("name", ["MSG,stop", " debug, x", "logopen,file"])
def test_a_comment_does_not_act_on_the_control(hayashi, name):
    header = {name: "x", "long": "y " * 60 + "MSG, " * 60}
    for line in compose_program(motion_of(np.eye(5)), machine=hayashi, header=header).lines:
        assert not re.match(r"\(\s*(msg|debug|logopen)\s*,", line, re.IGNORECASE)


def test_no_line_is_longer_than_the_control_reads():
    header = {"source": "/a/very/long/name" * 40}
    motion = motion_of([[0] * 5, [-199999.123456] * 5], [0.0, 1e-9])
    machine = Machine.from_code("640123")
    assert max(map(len, compose_program(motion, machine=machine, header=header).lines)) <= 120


# The lead-out


@pytest.mark.parametrize(
    ("control", "coordinates", "block"),
    [
        ("linuxcnc", "axes", "G1 X1.000000 Y2.000000 Z8.000000 F120"),
        ("fanuc", "tip", "G1 X1.0000 Y2.0000 Z8.0000 F600.000"),
        ("fanuc", "vector", "G1 X1.0000 Y2.0000 Z8.0000 I0.0000000 J0.0000000 K1.0000000 F600.000"),
        ("heidenhain", "tip", "L X+1.0000 Y+2.0000 Z+8.0000 R0 F600.000"),
        ("sinumerik", "tip", "G1 X1.00000 Y2.00000 Z8.00000 F600.000"),
    ],
)
def test_a_last_cut_is_left_along_the_tool_before_anything_is_switched_off(
    hayashi, control, coordinates, block
):
    motion = motion_of([[0, 2, 3, 0, 0], [1, 2, 3, 0, 0]])
    around = ProgramSettings(retract=50.0, spindle_rpm=1000.0)
    lines = compose_with_lead_out(
        motion, machine=hayashi, control=control, coordinates=coordinates, settings=around
    ).lines
    bare = [re.sub(r"^[0-9]+ ", "", line) for line in lines]
    at = bare.index(block)
    after = " ".join(bare[at + 1 :])
    assert re.search(r"(SUPA|G53|M91).*M5|M91.*M5", after)
    assert not re.search("[XY][-+0-9]", after)
    said = " ".join(line.strip("(); ").upper() for line in bare[:at])
    assert "LEAD OUT: THE PROGRAM LEADS THE TOOL 5 MM OFF ITS LAST CUT" in said


def test_a_redundant_or_disabled_lead_out_is_not_written(hayashi):
    motion = motion_of([[0, 2, 3, 0, 0], [1, 2, 3, 0, 0]])
    assert "Z8." not in compose_program(motion, machine=hayashi).text.replace("Z8.000000\n", "")
    up = replace(motion, kind=np.array([MoveKind.CUT, MoveKind.RAPID]))
    program = compose_with_lead_out(up, machine=hayashi)
    moves = blocks(program)[blocks(program).index("G93") :]
    assert [b[:3] for b in moves if b.startswith(("G0", "G1"))] == ["G1 ", "G0 "]
    assert "lead out" not in program.text


def test_the_lead_out_ends_at_an_axis_limit(hayashi):
    low, high = Limits(-100.0, 100.0), Limits(-100.0, 6.0)
    axes = tuple(replace(a, limits=high if a.letter == "Z" else low) for a in hayashi.axes)
    motion = motion_of([[0, 2, 3, 0, 0], [1, 2, 3, 0, 0]])
    lines = blocks(compose_with_lead_out(motion, machine=replace(hayashi, axes=axes)))
    assert [b.rpartition(" ")[0] for b in lines if b[:2] == "G1"][-1] == "G1 X1.000000 Y2.000000 Z6.000000"


def test_a_program_that_was_read_keeps_its_end(hayashi, tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text(compose_with_lead_out(motion_of(np.eye(5)), machine=hayashi).text)
    motion = read_program(path, hayashi)
    once = blocks(compose_with_lead_out(motion, machine=hayashi))
    assert len([b for b in once if b.startswith("G1")]) == len(motion) - 1


# Files
