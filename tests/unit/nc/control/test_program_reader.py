"""Programs of machine-axis words, read as a motion."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import MachineError, SettingError, ToolpathError
from fiveaxis.model import PATH_TOLERANCE, Machine, MoveKind, load_machine, tool_poses
from fiveaxis.nc import compose_program, read_program

CUT, RAPID = MoveKind.CUT, MoveKind.RAPID
MILL = Machine.from_code("0123")

# Table 1 of Edem & Balogun 2018 (../shared/reference/nc_program_energy.md), the Y43 of N16 corrected.
ZIGZAG = """\
N01 G01 Z-0.5 F300
N02 X132 F500
N03 Y68
N04 X18
N05 Y62
N06 X132
N07 Y56
N08 X18
N09 Y50
N10 X132
N11 Y44
N12 X18
N13 Y38
N14 X132
N15 Y32
N16 X18
N17 Y26
N18 X132
N19 G00 Z5
N20 G00 Z50
G90
G28
M30
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text, machine=MILL, **options):
        path = tmp_path / "part.nc"
        path.write_text(text, encoding="utf-8")
        options = {"start": dict.fromkeys(machine.letters, 0.0), "rapid": 6000.0} | options
        return read_program(path, machine, **{"unit": "mm"} | options)

    return read_text


@pytest.fixture
def fault(read):
    """Read a program that must be refused; return the line and the message."""

    def read_badly(text, machine=MILL, **options):
        with pytest.raises(ToolpathError) as caught:
            read(text, machine, **options)
        assert caught.value.file.endswith("part.nc")
        return caught.value.line, caught.value.message

    return read_badly


def rows(motion, machine=MILL):
    return machine.shown(motion.positions)


def codes(motion):
    return [f.code for f in motion.findings]


# The published program


def test_the_published_zigzag_has_the_published_travel_and_times(read):
    machine = load_machine("takisawa-mac-v3")
    motion = read(ZIGZAG, machine, start={"X": 18, "Y": 74, "Z": 0}, rapid=10_000)
    assert motion.source.tolist() == [1, *range(1, 21)]
    assert motion.kind.tolist() == [RAPID, *[CUT] * 18, RAPID, RAPID]
    moves = np.abs(motion.moves)
    np.testing.assert_allclose(moves[2:19:2, 0], 114)
    np.testing.assert_allclose(moves[3:19:2, 1], 6)
    # Printed: 0.10, 13.74, 0.72, 0.03, 0.27 and 129.82 s; the 0.06 s a pass are the axes' acceleration.
    np.testing.assert_allclose(motion.time[[1, 2, 3, 19, 20]], [0.1, 13.68, 0.72, 0.033, 0.27], atol=1e-9)
    assert motion.time.sum() == pytest.approx(129.82, rel=0.01)
    np.testing.assert_allclose(motion.feed[[1, 2, 19]] * 60, [300, 500, 10_000])


def test_a_reference_without_axes_moves_none_with_a_warning(read):
    # The printed table has no row for its G28, though X and Y are far from 0.
    motion = read("G1 X1 F100\nG28\nM30\n")
    assert len(motion) == 2
    assert codes(motion) == ["reference-without-axes"]
    assert motion.findings[0].place.line == 2


# Real programs


def test_an_unknown_rotary_axis_is_refused_with_the_list_of_axes(data, hayashi):
    path = data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc"
    with pytest.raises(ToolpathError) as caught:
        read_program(path, hayashi, unit="inch", rapid=15_000)
    assert caught.value.line == 35
    assert "B0: machine 'hayashi-640123' has the axes X, Y, Z, A, C and no B" in str(caught.value)


def test_an_operation_of_the_haas_program_is_read(data, haas_trunnion):
    path = data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc"
    machine = haas_trunnion
    motion = read_program(path, machine, unit="inch", rapid=15_000, operation=3)
    assert motion.source[0] == motion.operation.first_line == 498
    assert motion.ignored["M6"] == 14
    assert sorted(codes(motion)) == ["feed-meaning", "long-turn", "machine-zero-moves"]
    assert all(498 - 15 < f.place.line <= motion.operation.last_line for f in motion.findings)
    # Line 545: X-.6366 Y1.2554 Z1.5688 A-.531 B287.786.
    [row] = np.flatnonzero(motion.source == 545)
    x, a, b = np.array([-0.6366, 1.2554, 1.5688]), np.radians(0.531), np.radians(287.786)
    tilt = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    turn = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    tip, _ = tool_poses(machine, motion.positions[row : row + 1])
    np.testing.assert_allclose(tip[0], turn @ tilt @ x * 25.4, atol=1e-9)
    assert motion.feed[row] * 60 == pytest.approx(9.8 * 25.4)


def test_a_rotation_back_through_zero_is_reported_because_controls_differ(data, tmp_path, haas_trunnion):
    # From B359.857 to B7.501 in one feed move: most controls turn by 7.644 deg, the words mean 352.356.
    path = data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc"
    lines = path.read_text(encoding="utf-8").split("\n")[:600]
    milling = tmp_path / "milling.nc"
    milling.write_text("\n".join(lines), encoding="utf-8")
    motion = read_program(milling, haas_trunnion, unit="inch", rapid=15_000, operation=3)
    [turn] = [f for f in motion.findings if f.code == "long-turn"]
    assert turn.place.line == 555
    assert turn.value == pytest.approx(352.356)


@pytest.mark.parametrize("name", ["linuxcnc_impeller_xyzac.ngc", "linuxcnc_boat_xyzac.ngc"])
def test_programs_under_tcp_keep_the_tip_on_its_path(data, trunnion, name):
    path = data / "toolpaths" / name
    motion = read_program(path, trunnion)
    toolpath = fx.read_toolpath(path, machine=trunnion, tool=fx.Tool.ball(6))
    tip, axis = tool_poses(trunnion, motion.positions)
    poses = np.hstack([tip, axis])
    wanted = np.hstack([toolpath.tips(toolpath.axis), toolpath.axis])
    # Every location of the path is where the motion is at some time, in their order.
    place = 0
    for row in range(len(wanted)):
        near = np.abs(poses[place:] - wanted[row]).max(axis=1) < 1e-9
        place += int(np.argmax(near))
        assert near.any()
    # Between two rows the axes run straight: the tip is within tolerance of its line there too.
    middle, _ = tool_poses(trunnion, (motion.positions[1:] + motion.positions[:-1]) / 2.0)
    off = np.linalg.norm(middle - (tip[1:] + tip[:-1]) / 2.0, axis=1)
    assert 0.5 * PATH_TOLERANCE < off.max() <= PATH_TOLERANCE
    cuts = motion.kind == CUT
    duration = (toolpath.lengths / toolpath.feed)[toolpath.cutting].sum()
    assert motion.time[cuts].sum() == pytest.approx(duration)


def test_a_motion_continues_across_the_switch_to_tcp(read, trunnion):
    text = "G0 X0 Y0 Z100 A0 C0\nM428\nG0 X10 Y0 Z50 A-30\nG1 X20 A-40 F600\nM429\nG0 X0 Y0 Z100\n"
    motion = read(text, trunnion, start=None, rapid=None)
    tip, axis = tool_poses(trunnion, motion.positions)
    np.testing.assert_allclose(motion.positions[0], [0, 0, 100, 0, 0])
    [first] = np.flatnonzero(motion.source == 3)
    np.testing.assert_allclose(tip[first], [10, 0, 50], atol=1e-9)
    cut = motion.source == 4
    np.testing.assert_allclose(tip[cut][-1], [20, 0, 50], atol=1e-9)
    assert motion.time[cut].sum() == pytest.approx(1)
    np.testing.assert_allclose(motion.feed[cut], 10)
    np.testing.assert_allclose(motion.positions[-1, :3], [0, 0, 100])
    assert axis[-1, 2] == pytest.approx(np.cos(np.radians(40)))


def test_a_tool_direction_has_no_angles_in_a_motion(fault, trunnion):
    text = "G21 G0 X0 Y0 Z0 A0 C0\nG43.5 H1\nG0 X0 Y0 Z0 I0 J0 K1\nG1 X1 I.6 K.8 F60\n"
    line, message = fault(text, trunnion, start=None)
    assert line == 3
    assert "gives the tool direction" in message


# Moves


def test_words_stay_in_force(read):
    motion = read("g1 x1 f60\ny2\n\nN40 z-3\nG0 X0\nY0\n")
    np.testing.assert_allclose(rows(motion)[1:], [[1, 0, 0], [1, 2, 0], [1, 2, -3], [0, 2, -3], [0, 0, -3]])
    assert motion.kind.tolist()[1:] == [CUT] * 3 + [RAPID] * 2
    assert motion.source.tolist() == [1, 1, 2, 4, 5, 6]


@pytest.mark.parametrize(("word", "scale"), [("G20", 25.4), ("G70", 25.4), ("G21", 1), ("G71", 1)])
def test_the_unit_scales_lengths_and_feeds_but_not_angles(read, hayashi, word, scale):
    motion = read(f"{word} G1 X1 A2 F60\nA3\nM30\n", hayashi, unit=None)
    np.testing.assert_allclose(hayashi.shown(motion.positions)[1], [scale, 0, 0, 2, 0])
    np.testing.assert_allclose(motion.feed[1:], [scale, 1])
    np.testing.assert_allclose(motion.time[1:], 1)
    assert codes(motion) == ["feed-meaning"]


def test_an_unstated_unit_is_assumed_with_a_warning(read):
    motion = read("G1 X1 F60\nM30\n", unit=None)
    assert rows(motion)[1, 0] == 1
    assert codes(motion) == ["unit-assumed"]
    assert rows(read("G1 X1 F60\n", unit="inch"))[1, 0] == 25.4


def test_reversed_axes_change_their_sign(read, trunnion):
    motion = read("G1 X1 A2 C-3 F60\n", trunnion)
    np.testing.assert_allclose(trunnion.shown(motion.positions)[1], [1, 0, 0, -2, 3])


def test_machine_coordinates_are_relative_to_the_zero(read):
    # The control shows Z-300 in machine coordinates at Z0 of the program.
    text = "G0 Z10\nG53 Z0\nZ20\nG28 Z30\nM30\n"
    motion = read(text, zero={"Z": -300})
    assert rows(motion)[:, 2].tolist() == [-300, -290, 0, -280, -270, 0]
    assert codes(motion) == []


def test_a_move_in_machine_coordinates_whose_zero_is_unknown_is_no_row(read):
    motion = read("G0 Z10\nG53 Z0\nZ20\nG28 Z30\nM30\n")
    assert rows(motion)[:, 2].tolist() == [0, 10, 20, 30]
    assert {f.code: f.place.line for f in motion.findings} == {"machine-zero-moves": 2, "start-unknown": 3}
    # The way to Z20 isn't known: the motion has no move there.
    assert motion.from_unknown.tolist() == [False, False, True, False]
    assert motion.moves[:, 2].tolist() == [0, 10, 0, 10]


def test_a_retract_in_machine_coordinates_under_tcp_is_no_row_whatever_the_zero(read):
    """Posts write `G53 G0 Z0` before the G49 that cancels the length; controls differ in where the tip is."""
    machine = load_machine("variaxis-630")
    text = "G94\nG0 A0 C0\nG43.4 H1 X0 Y0 Z50\nG1 X10 F600\nG53 G0 Z0\n"
    plain = read(text, machine, zero={"Z": 0.0})
    assert plain.source[-1] == 4
    after = read(text + "G43.4 H1\nG0 X0 Y0 Z60\n", machine, zero={"Z": 0.0})
    assert after.source[-1] == 7
    assert after.from_unknown.tolist() == [*[False] * len(plain), True]
    with pytest.raises(ToolpathError, match="a feed move, and the position of Y, Z isn't in the program"):
        read(text + "G1 X20\n", machine)


def test_a_reference_move_passes_through_its_intermediate_position(read, hayashi):
    motion = read("G0 X5 Y6 A7\nG28 X9 A1\nG91 G28 Y0\n", hayashi, zero={})
    np.testing.assert_allclose(
        hayashi.shown(motion.positions)[2:], [[9, 6, 0, 1, 0], [0, 6, 0, 0, 0], [0, 0, 0, 0, 0]], atol=1e-12
    )
    assert (motion.kind == RAPID).all()


def test_the_motion_starts_at_the_end_of_the_first_rapid_moves(read, hayashi):
    motion = read("G0 A1 C2\nX3 Y4\nZ5\nG1 Z0 F60\nM30\n", hayashi, start=None)
    np.testing.assert_allclose(hayashi.shown(motion.positions), [[3, 4, 5, 1, 2], [3, 4, 0, 1, 2]])
    assert motion.source.tolist() == [3, 4]
    assert motion.time.tolist() == [0, 5]
    assert motion.feed.tolist() == [1, 1]
    assert codes(motion) == ["approach-unknown"]
    assert motion.findings[0].message.startswith("3 rapid moves up to this line")


def test_an_incremental_reference_move_makes_an_axis_known_where_the_zero_is(read):
    # How programs for Fanuc controls begin.
    text = "G91 G28 Z0\nG90 G0 X1 Y2\nG1 Z-1 F60\nX5\n"
    motion = read(text, start=None, zero={"Z": -300})
    np.testing.assert_allclose(rows(motion), [[1, 2, 0], [1, 2, -301], [5, 2, -301]])
    # Else the way of the first feed move isn't known.
    unknown = read(text, start=None)
    np.testing.assert_allclose(rows(unknown), [[1, 2, -1], [5, 2, -1]])
    assert {f.code: f.place.line for f in unknown.findings}["start-unknown"] == 3


def test_start_gives_the_axes_that_a_program_never_writes(read, trunnion):
    text = "G0 X1 Y2 Z3\nG1 X2 F60\n"
    motion = read(text, trunnion, start={"A": 10, "C": -20})
    # In the control's sign: this control reverses A and C.
    np.testing.assert_allclose(trunnion.shown(motion.positions)[0], [1, 2, 3, -10, 20])


# Arcs


@pytest.mark.parametrize(
    "text", ["G2 X10 Y10 I10 J0 F600", "G2 X10 Y10 R10 F600", "G02 G91 X10 Y10 I10 F600"]
)
def test_an_arc_becomes_chords_within_the_tolerance(read, text):
    motion = read(text)
    points = rows(motion)
    np.testing.assert_allclose(np.linalg.norm(points[:, :2] - [10, 0], axis=1), 10, atol=1e-12)
    assert points[-1].tolist() == [10, 10, 0]
    middles = (points[1:] + points[:-1]) / 2
    off = 10 - np.linalg.norm(middles[:, :2] - [10, 0], axis=1)
    assert 0.5 * PATH_TOLERANCE < off.max() <= PATH_TOLERANCE
    # F is along the arc, not along the chords.
    assert motion.time.sum() == pytest.approx(np.pi / 2 * 10 / 10, rel=1e-12)
    np.testing.assert_allclose(motion.feed, 10)
    assert set(motion.source) == {1}
    assert set(motion.kind[1:]) == {CUT}


def test_an_arc_may_move_the_third_and_the_rotary_axes(read, hayashi):
    motion = read("G0 X10\nG3 I-10 Z6.28 C36 F600\n", hayashi)
    points = hayashi.shown(motion.positions)[1:]
    share = np.linspace(0, 1, len(points))
    np.testing.assert_allclose(points[:, 2], 6.28 * share, atol=1e-12)
    np.testing.assert_allclose(points[:, 4], 36 * share, atol=1e-12)
    np.testing.assert_allclose(points[-1, :2], [10, 0], atol=1e-12)
    assert points[:, 0].min() == pytest.approx(-10, abs=0.01)
    assert motion.time[2:].sum() == pytest.approx(np.hypot(20 * np.pi, 6.28) / 10)


def test_arcs_in_inches_and_by_inverse_time(read):
    motion = read("G20 G93 G3 X2 Y0 I1 F30\n", unit=None)
    np.testing.assert_allclose(rows(motion)[-1], [50.8, 0, 0])
    assert rows(motion)[:, 1].min() == pytest.approx(-25.4, abs=0.01)
    assert motion.time.sum() == pytest.approx(2)
    np.testing.assert_allclose(motion.feed[1:], np.pi * 25.4 / 2)


# Times


def test_feed_is_along_the_linear_axes_if_any_moves_else_in_degrees(read, hayashi):
    motion = read("G1 X3 Y4 A90 F60\nA87 C4\n", hayashi)
    np.testing.assert_allclose(motion.time, [0, 5, 5])
    np.testing.assert_allclose(motion.feed[1:], 1)


def test_inverse_time_is_the_duration_of_each_block(read):
    motion = read("G93 G1 X5 F60\nX6 F30\nG94 X7 F60\n")
    np.testing.assert_allclose(motion.time, [0, 1, 2, 1])
    np.testing.assert_allclose(motion.feed[1:], [5, 0.5, 1])


def test_feed_per_revolution_uses_the_spindle_speed(read):
    motion = read("S600 M3\nG95 G1 X5 F0.1\n")
    assert motion.feed[1] == pytest.approx(1)
    assert motion.time[1] == pytest.approx(5)


def test_a_rapid_move_takes_as_long_as_its_slowest_axis(read, trunnion):
    # X 166.67 mm/s and A 30 deg/s are in the machine's file, see LinuxCNC's xyzac-trt.ini.
    speeds = [axis.shown(axis.max_speed) for axis in trunnion.axes]
    motion = read("G0 X100 A2\nA50\n", trunnion, rapid=None)
    assert motion.time[1] == pytest.approx(max(100 / speeds[0], 2 / speeds[3]))
    assert motion.feed[1] == pytest.approx(100 / motion.time[1])
    assert motion.feed[2] == pytest.approx(speeds[3])


def test_the_rapid_speed_applies_to_axes_without_max_speed_only(read, hayashi):
    fast = replace(
        hayashi, axes=tuple(replace(a, max_speed=10.0 if a.letter == "X" else None) for a in hayashi.axes)
    )
    motion = read("G0 X100\nY100\nC100\n", fast, rapid=1200)
    np.testing.assert_allclose(motion.time, [0, 10, 5, 5])


def test_a_dwell_is_a_row_at_the_same_position(read):
    motion = read("G1 X1 F60\nG4 P0.5\nX2\n")
    assert motion.time.tolist() == [0, 1, 0.5, 1]
    assert rows(motion)[:, 0].tolist() == [0, 1, 1, 2]
    assert motion.kind.tolist() == [RAPID, CUT, CUT, CUT]
    first = read("G4 P2\nG1 X1 F60\n")
    assert first.time.tolist() == [0, 2, 1]
    assert first.feed.tolist() == [1, 1, 1]


def test_klartext_feeds_in_inch_programs_are_in_tenths(tmp_path):
    path = tmp_path / "part.h"
    text = "BEGIN PGM part INCH\nL X+0 Y+0 Z+0 R0 F100\nL X+1\nEND PGM part INCH\n"
    path.write_text(text, encoding="utf-8")
    motion = fx.read_program(path, Machine.from_code("0123"), start={"X": 0, "Y": 0, "Z": 0}, rapid=1)
    assert motion.time[-1] == pytest.approx(6)
    assert motion.feed[-1] == pytest.approx(254 / 60)


def test_a_dwell_by_x_with_a_decimal_point_is_in_seconds(read):
    motion, same = read("G1 X1 F60\nG04 X1.5\nX2\n"), read("G1 X1 F60\nG4 P1.5\nX2\n")
    np.testing.assert_array_equal(motion.time, same.time)
    np.testing.assert_array_equal(motion.positions, same.positions)
    assert 1.5 in motion.time


def test_a_dwell_that_may_be_in_milliseconds_is_reported(read):
    motion = read("G1 X1 F60\nG4 P500\nM30\n")
    assert motion.time.sum() == 501
    assert codes(motion) == ["long-dwell"]


# Unused words are counted


def test_words_without_effect_are_counted(read):
    text = "O1\nG40 G49 G80\nT1 M6\nG43 H1\nS1000 M3\nG64 P0.01\nG1 X1 F60 M8\nX1\n/Y2\nM30\nX9\nY9\n"
    motion = read(text, block_delete=True)
    assert motion.ignored == {
        "/": 1, "G40": 1, "G43": 1, "G49": 1, "G64": 1, "G80": 1, "H": 1, "M3": 1, "M6": 1, "M8": 1, "O": 1,
        "S": 1, "T": 1, "lines after the end": 2, "no move": 1,
    }  # fmt: skip
    assert len(motion) == 2


def test_blocks_with_a_slash_move_unless_block_delete_is_on(read):
    assert len(read("G1 X1 F60\n/X2\n")) == 3
    assert len(read("G1 X1 F60\n/X2\n", block_delete=True)) == 2


# Refused programs


@pytest.mark.parametrize(
    ("text", "line", "fact"),
    [
        ("G1 X1\n", 1, "without F in force"),
        ("G1 F0 X1\n", 1, "F0: a feed must be above 0"),
        ("F-5\n", 1, "F-5: a feed must be above 0"),
        ("G1 X1 F60\nG93 X2\n", 2, "G93 needs F in each one"),
        ("G93 G1 X1 F60\nX2\n", 2, "G93 needs F in each one"),
        ("G1 X1 F60\nG95 X2 S100\n", 2, "without F in force for G95"),
        ("G95 G1 X1 F1\n", 1, "without S above 0"),
        ("X1\n", 1, "none of G0, G1, G2, G3 is in force"),
        ("G0 X1\nG80\nX2\n", 3, "none of G0, G1, G2, G3 is in force"),
        ("G0 G1 X1\n", 1, "G0 and G1 in one block"),
        ("G1 G90 G91 X1 F1\n", 1, "G90 and G91 in one block"),
        ("G0 B1\n", 1, "B1: machine '0123' has the axes X, Y, Z and no B"),
        ("G0 U1\n", 1, "and no U"),
        ("G0 X1 I5\n", 1, "I5: belongs to an arc"),
        ("G2 I1 F1\nG28 X0 I5\n", 2, "I5: belongs to an arc"),
        ("G0 X1 Q5\n", 1, "Q5: doesn't belong to anything"),
        ("G0 X1E3\n", 1, "have no exponent"),
        ("G0 X0 Y0 Z0\nG1 X1 E1.2 F60\n", 2, "E1.2: extrusion isn't read"),
        ("G0 X1000001\n", 1, "beyond 1e+06"),
        ("G41 D1 G1 X1 F1\n", 1, "G41 offsets the path by the tool radius"),
        ("G68 X0 Y0 R45\n", 1, "G68 shifts, rotates or scales"),
        ("M98 P100\n", 1, "calls the program O0100"),
        ("G65 P1\n", 1, "calls the program O0001"),
        ("G1 X1 F1\nG91 G30 Z0\nG90 G1 X5\n", 3, "a feed move, and the position of Z isn't"),
        ("G10 L2 P1 X5\n", 1, "set zero (--zero G54X5, in mm and deg)"),
        ("G91 G10 L2 P1 X5\n", 1, "G10 L2 P1 changes the control's data"),
        ("G10 L50\n", 1, "G10 L50 changes the control's data"),
        ("G1234 X1\n", 1, "G1234 is unknown"),
        ("G54 G0 X1\nG55 X2\nG1 X3 F1\n", 3, "a feed move, and the position of Y, Z isn't"),
        ("G4 X1\n", 1, "G4 X1 without a decimal point is in s or ms"),
        ("G4 X1. Y2\n", 1, "G4 takes P in seconds"),
        ("G4 P-1\n", 1, "can't be negative"),
        ("G1 X1 F1\nG91 G53 Z0\nG90 G1 X5\n", 3, "a feed move, and the position of Z isn't"),
        ("M451\n", 1, "M451 switches tool centre point control (TCP) on"),
        ("M128\nM21\n", 2, "M21 mirrors axes"),
        ("G2 X1 F1\n", 1, "an arc in G17 needs I or J, or R alone, and has none"),
        ("G2 X1 K1 F1\n", 1, "and has K"),
        ("G2 X1 I1 R1 F1\n", 1, "and has I, R"),
        ("G2 X1 I5 F1\n", 1, "starts 5 mm from its centre and ends 4 mm"),
        ("G2 X1000.6 Y1000 J1000 F1\n", 1, "starts 1000 mm from its centre"),
        ("G2 X1 I0 J0 F1\n", 1, "starts at its centre"),
        ("G2 X10 R1 F1\n", 1, "R1 is too small"),
        ("G2 X0 R1 F1\n", 1, "a full circle can't be given by R"),
        ("G2 X1 I.5 J9999999 F1\n", 1, "an arc of more than 1e+06 mm"),
        ("G2 X2 I1\n", 1, "without F in force"),
        ("O1\nG1 X1 F1\nO2\n", 3, "a second program begins"),
        ("", None, "no block moves an axis"),
        ("G4 P1\n", None, "no block moves an axis"),
        ("G0 X0\nM30\nX1\n", None, "no block moves an axis"),
    ],
)
def test_unsupported_and_wrong_words_are_refused_with_their_line(fault, text, line, fact):
    found, message = fault(text)
    assert (found, fact in message) == (line, True), message


def test_of_several_units_before_the_first_coordinate_the_last_one_holds(read):
    motion = read("G20\nG21\nG0 X1\nG1 X2 F60\n", unit=None)
    np.testing.assert_allclose(motion.positions[:, 0], [0.0, 1.0, 2.0])
    assert read("G21\nG20\nG0 X1\nG1 X2 F60\n", unit=None).positions[-1, 0] == pytest.approx(50.8)


def test_units_may_not_change_in_a_program(fault):
    assert fault("G20\nG0 X1\nG21\nX2\n", unit=None) == (
        3,
        "mixed units: mm here, and inch from line 1 on; write one file for each unit",
    )


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("G1 X1 F60\n", "the position of Y, Z isn't in the program yet; set start"),
        ("G0 X0 Y0\nG1 Z1 F60\n", "only moves to its start"),
        ("G91 G0 X1\n", "X by an increment (G91)"),
        ("G0 X1\n", "never gives the position of Y, Z"),
        ("G0 X1 Y1 Z1\n", "only moves to its start"),
    ],
)
def test_a_move_from_an_unknown_position_is_refused(fault, text, fact):
    assert fact in fault(text, start=None)[1]


def test_a_rapid_move_of_unknown_speed_is_refused_with_axis_and_remedy(fault, hayashi):
    line, message = fault("G1 X1 F1\nG0 C5\n", hayashi, rapid=None)
    assert line == 2
    assert message == (
        "a rapid move of C, which has no max_speed in machine 'hayashi-640123'; set rapid "
        "(--rapid), or max_speed in the machine file"
    )


def test_options_are_checked(read, hayashi):
    with pytest.raises(SettingError, match="unit = 'cm' is unknown; give 'mm' or 'inch'"):
        read("G0 X1\n", unit="cm")
    with pytest.raises(SettingError, match="rapid = -1 mm/min is out of range; give more than 0"):
        read("G0 X1\n", rapid=-1)
    with pytest.raises(SettingError, match="start of X is nan"):
        read("G0 X1\n", start={"X": float("nan")})
    with pytest.raises(MachineError, match="no axis 'B'"):
        read("G0 X1\n", hayashi, zero={"B": 1})


# Use of the motion


def test_a_program_that_was_read_can_be_used_as_a_motion(read, trunnion):
    text = "G0 X0 Y0 Z10 A0 C0\nG1 Z0 F600\nX10 A-20 C30\nM30\n"
    motion = read(text, trunnion, start=None, rapid=None)
    assert isinstance(motion, fx.Motion)
    program = compose_program(motion, machine=trunnion)
    assert program.lines[-5] == "G1 X10.000000 Y0.000000 Z0.000000 A-20.000000 C30.000000 F60"
    assert fx.read_program is read_program


def test_wrapped_rotary_words_without_a_rule_are_refused(tmp_path, trunnion):
    path = tmp_path / "modulo.ngc"
    path.write_text("(needs WRAPPED_ROTARY = 1)\nG21 G90 G0 X0 Y0 Z0 A0 C359\nG1 C1 F100\n")
    with pytest.raises(ToolpathError, match=r"modulo.ngc:1: .*set wrap=signed \(--wrap signed\) if they are"):
        read_program(path, trunnion)
    turned = {
        wrap: np.degrees(np.ptp(read_program(path, trunnion, wrap=wrap).positions[:, 4]))
        for wrap in ("signed", "shorter", "unwound")
    }
    assert turned == pytest.approx({"signed": 2.0, "shorter": 2.0, "unwound": 358.0})
