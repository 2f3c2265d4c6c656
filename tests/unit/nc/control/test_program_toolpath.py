"""NC programs of any control, read as toolpaths."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from support.whole_files import each_path

import fiveaxis as fx
from fiveaxis.base import angle_between
from fiveaxis.base.errors import ToolError, ToolpathError
from fiveaxis.base.findings import Severity
from fiveaxis.model import PATH_TOLERANCE, Machine, MoveKind, load_machine, tool_axes
from fiveaxis.nc.control.moves import MACHINE_MOVES

CUT, RAPID = MoveKind.CUT, MoveKind.RAPID
BALL = fx.Tool.ball(6)
NUTATING = Machine.from_code("650123")
WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G54.1P1", "G54.1P2", "G54.1P3")


@pytest.fixture
def read(tmp_path):
    def read_text(text, machine=None, suffix=".nc", **options):
        path = tmp_path / f"part{suffix}"
        path.write_text(text, encoding="utf-8")
        return fx.read_toolpath(path, **{"tool": BALL, "machine": machine, "unit": "mm"} | options)

    return read_text


@pytest.fixture
def fault(read):
    """Read a program that must be refused; return the line and the message."""

    def read_badly(text, machine=None, **options):
        with pytest.raises(ToolpathError) as caught:
            read(text, machine, **options)
        assert caught.value.file.endswith("part.nc")
        return caught.value.line, caught.value.message

    return read_badly


def tips(path):
    return path.tips(path.axis)


def codes(path):
    return [f.code for f in path.findings]


def motion_lines(path, words=r"[XYZABC] *[-+.\d]"):
    """Lines with a motion word, counted apart from the reader."""
    text = path.read_text(encoding="latin-1")
    code = [re.sub(r"\([^)]*\)|;.*", "", line) for line in text.split("\n")]
    return [i for i, line in enumerate(code, start=1) if re.search(words, line)]


# Real programs, to their last block


def test_the_impeller_has_its_4492_poses_and_one_rewind(data, trunnion):
    path = fx.read_toolpath(data / "toolpaths" / "linuxcnc_impeller_xyzac.ngc", machine=trunnion, tool=BALL)
    assert len(path) == 4492
    assert path.cutting.sum() == 4306
    turns = [f for f in path.findings if f.code == "long-turn"]
    [unwinding] = [f for f in turns if f.value > 360.0]
    assert unwinding.value == pytest.approx(399.805)
    assert unwinding.message == "C turns by 399.8 deg, from -399.805 to 0, in a rapid move"
    assert unwinding.place.line == 4504
    # Two more of less than a turn, between operations.
    assert [f.place.line for f in turns] == [3401, 4146, 4504]
    # Line 10: X 6.302 Y -11.560 Z 27.743 A -71.841 C -35.930 F 318, inverse time.
    [row] = np.flatnonzero(path.source == 10)
    np.testing.assert_allclose(tips(path)[row], [6.302, -11.560, 27.743], atol=1e-12)
    a, c = np.radians([71.841, 35.930])  # this control reverses both axes
    along = [np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)]
    np.testing.assert_allclose(path.axis[row], along, atol=1e-9)
    assert path.lengths[row] / path.feed[row] == pytest.approx(60 / 318)
    assert sorted(set(codes(path))) == ["approach-unknown", "long-turn", "unit-assumed"]


def test_the_boat_is_read_to_its_last_move(data, trunnion):
    file = data / "toolpaths" / "linuxcnc_boat_xyzac.ngc"
    path = fx.read_toolpath(file, machine=trunnion, tool=BALL)
    lines = motion_lines(file)
    assert len(lines) == 1832
    # The first move has Z only, and seven blocks repeat the position.
    assert path.ignored["no move"] == 7
    assert len(set(path.source)) == len(lines) - 1 - 7
    assert set(path.source) < set(lines)
    assert path.source[-1] == lines[-1]
    np.testing.assert_allclose(tips(path)[-1], [0, 0, 10], atol=1e-12)
    approach = next(f for f in path.findings if f.code == "approach-unknown")
    assert approach.message.startswith("2 rapid moves up to this line")


def test_the_haas_program_is_read_to_its_last_block(data, haas_trunnion):
    file = data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc"
    # Its cycles have neither G98 nor G99: a Haas begins in G98.
    machine = replace(haas_trunnion, control="haas")
    paths = each_path(file, machine=machine, tool=BALL, unit="inch")
    path, sources = paths[-1], {line for path in paths for line in path.source.tolist()}
    lines = motion_lines(file)
    assert len(lines) == 939
    assert path.ignored[MACHINE_MOVES] == 16
    assert path.ignored["no move"] == 21
    # In the first operation X, Y, Z come before the angles, so the first line gives no position yet.
    assert sources < set(lines)
    assert len(lines) - len(sources) == 16 + 21 + 1
    assert path.source[-1] == 1079
    turns = [f for path in paths for f in path.findings if f.code == "long-turn" and "feed" in f.message]
    assert [f.place.line for f in turns] == [555, 607, 667, 732, 802, 884]
    assert "machine-zero-moves" in codes(path)
    assert any("cycle-simplified" in codes(path) for path in paths)
    tools = [path.operation.tool for path in paths]
    assert len(tools) == 14
    assert all(tool != after for tool, after in itertools.pairwise(tools))
    assert [path.operation.kind for path in paths][:3] == ["3-axis", "3+2", "simultaneous"]
    assert paths[1].operation.first_line > 371


def test_a_program_without_a_unit_is_read_in_mm_with_a_warning(data, haas_trunnion):
    file = data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc"
    path = fx.read_toolpath(file, machine=haas_trunnion, tool=BALL, operation=3)
    [finding] = [f for f in path.findings if f.code == "unit-assumed"]
    assert "set unit=inch" in finding.message


def nmv(data, **options):
    zeros = {f"{frame}{axis}": 0.0 for frame in WORK_OFFSETS for axis in "XYZBC"}
    return each_path(
        data / "toolpaths" / "nx_nmv5000_fanuc_mm.nc",
        machine=NUTATING,
        tool=BALL,
        zero=zeros,
        start={"C": 0.0},
        **options,
    )


def test_a_fanuc_program_of_nine_work_offsets_is_read_to_its_last_block(data):
    paths = nmv(data)
    path, sources = paths[-1], {line for path in paths for line in path.source.tolist()}
    lines = motion_lines(data / "toolpaths" / "nx_nmv5000_fanuc_mm.nc")
    assert len(lines) == 564
    assert path.source[-1] == 749
    assert sources < set(lines)
    # In some blocks the axes are already home at G28; the position of G30 is unknown.
    assert path.ignored[MACHINE_MOVES] == 14


def test_positions_in_the_machine_frame_are_reported(data):
    """The NMV's post keeps the frame in the machine: read like that, the tip path is half as long."""
    [doubt] = [f for path in nmv(data) for f in path.findings if f.code == "positions-doubtful"]
    assert "over the 9 cuts that turn the table the tip path is 184.512 mm long" in doubt.message
    assert "in the frame of the machine 80.4616 mm" in doubt.message
    assert doubt.place.line == 351
    for path in nmv(data, positions="machine"):
        assert "positions-doubtful" not in codes(path)


def test_a_millplus_program_is_read_to_its_last_block(data):
    file = data / "toolpaths" / "nx_dmc160u_millplus.nc"
    paths = each_path(file, machine=NUTATING, tool=BALL)
    path, sources = paths[-1], {line for path in paths for line in path.source.tolist()}
    lines = motion_lines(file, words=r"[XYZABC](?:5=)? *[-+.\d]")
    # These move nothing: tilted planes, zero shifts, and the definition of a cycle.
    text = file.read_text(encoding="latin-1").split("\n")
    still = [i for i in lines if re.search(r"G(7 |93|81|84)", text[i - 1])]
    moving = set(lines) - set(still)
    retractions = [i for i in moving if "G74" in text[i - 1]]
    assert (len(lines), len(retractions)) == (2405, 51)
    assert path.ignored[MACHINE_MOVES] == 51
    silent = moving - set(retractions) - sources
    assert sources < moving
    # The rest are moves with angles only, and repeated positions.
    approach = next(f for f in paths[0].findings if f.code == "approach-unknown")
    rapids = int(approach.message.split()[0]) + path.ignored["rapid moves to an unknown position"]
    assert len(silent) <= rapids + path.ignored["no move"]
    assert path.source[-1] == 2687


# Other languages, through the same interpreter


def test_klartext_gives_angles_or_directions(read):
    text = (
        "0 BEGIN PGM part MM\n1 TOOL CALL 1 Z S1000\n2 L X+0 Y+0 Z+50 R0 FMAX M3\n3 L M128\n"
        "4 L X+1 Y+2 Z+3 B+0 C+0 FMAX\n5 L X+5 B+90 F500\n6 L M129\n7 END PGM part MM\n"
    )
    path = read(text, NUTATING, suffix=".h", unit=None)
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [5, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0, 1], [1, 0, 0]], atol=1e-12)
    vectors = (
        "0 BEGIN PGM part MM\n1 L M128\n2 LN X+1 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0 TY+0.6 TZ+0.8 F500\n"
        "3 LN X+2 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1\n4 END PGM part MM\n"
    )
    path = read(vectors, suffix=".h", unit=None)
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [2, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0.6, 0.8], [0, 0, 1]])
    assert path.has_normals
    # The ball's centre is 3 mm up its axis, and touches 3 mm below that.
    np.testing.assert_allclose(path.contact[0], [1, 2 + 3 * 0.6, 3 + 3 * 0.8 - 3], atol=1e-12)


def test_klartext_inch_programs_have_feeds_in_tenths(read, trunnion):
    """F100 is 10 inch/min: TNC 640 and TNC7 manuals. Moves of rotary axes only are in degrees as usual."""
    text = (
        "0 BEGIN PGM part INCH\n1 M128\n2 L X+0 Y+0 Z+0 A+0 C+0 R0 FMAX\n3 L X+1 F100\n4 CC X+1 Y+1\n"
        "5 C X+2 Y+1 DR+\n6 L A-60 F600\n7 END PGM part INCH\n"
    )
    path = read(text, trunnion, suffix=".h", unit=None)
    assert path.feed[1] == pytest.approx(254 / 60)
    # Chords are slightly shorter than their arc, and take the same time.
    np.testing.assert_allclose(path.feed[2:-1], 254 / 60, rtol=1e-4)
    assert path.source[-1] == 7
    assert path.lengths[-1] / path.feed[-1] == pytest.approx(6)
    [note] = [f for f in path.findings if f.code == "feed-unit-assumed"]
    assert note.message.startswith("F is in units of 0.1 inch/min")
    metric = read(text.replace("INCH", "MM"), trunnion, suffix=".h", unit=None)
    assert metric.feed[1] == pytest.approx(100 / 60)
    assert "feed-unit-assumed" not in codes(metric)


def test_a_sinumerik_frame_rotates_positions_and_directions(read):
    text = (
        "N10 G71 G90 G54\nN20 TRAORI\nN30 TRANS X10\nN40 AROT X90\nN50 G0 X1 Y2 Z3 A3=0 B3=0 C3=1\n"
        "N60 G1 X2 F600\nN70 TRAFOOF\n"
    )
    path = read(text, suffix=".mpf", unit=None)
    np.testing.assert_allclose(tips(path), [[11, -3, 2], [12, -3, 2]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, -1, 0]] * 2, atol=1e-12)


# Coordinates


def test_a_program_of_three_axes_needs_no_machine(read):
    path = read("G0 X0 Y0 Z5\nG1 Z0 F600\nX10\nM30\n")
    np.testing.assert_allclose(tips(path), [[0, 0, 5], [0, 0, 0], [10, 0, 0]])
    np.testing.assert_allclose(path.axis, [[0, 0, 1]] * 3)
    assert path.kind.tolist() == [RAPID, CUT, CUT]
    np.testing.assert_allclose(path.feed, 10)
    assert path.source.tolist() == [1, 2, 3]
    assert codes(path) == ["approach-unknown", "no-simultaneous-path"]


def test_a_rotary_word_without_a_machine_is_an_error_that_names_the_option(fault):
    assert fault("G0 X0 Y0 Z5 A10\n") == (
        1,
        "A10: is a rotary axis, and no machine is given; give the one of the program (--machine)",
    )


def test_a_program_states_no_tool(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("G21 G0 X0 Y0 Z0\nG1 X1 F1\n", encoding="utf-8")
    with pytest.raises(ToolError, match="the file states no tool"):
        fx.read_toolpath(path)


def test_machine_coordinates_become_tips_by_forward_kinematics(read, haas_trunnion):
    machine = haas_trunnion
    path = read("G0 X1 Y2 Z3 A0 B0\nG1 A-90 F60\nB90\n", machine)
    # p = Rz(B) Rx(-A) (X, Y, Z): a quarter about X takes (1, 2, 3) to (1, -3, 2), one about Z to (3, 1, 2).
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [1, -3, 2], [3, 1, 2]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("on", "off"),
    [("M428", "M429"), ("G43.4 H1", "G49"), ("G234", "G49"), ("M128", "M129"), ("G43.4", "G43 H1")],
)
def test_under_tcp_words_are_the_tip(read, trunnion, on, off):
    text = f"{on}\nG0 X1 Y2 Z3 A0 C0\nG1 X4 A-30 C90 F60\n{off}\nG0 X0 Y0 Z100\n"
    path = read(text, trunnion)
    np.testing.assert_allclose(tips(path)[:2], [[1, 2, 3], [4, 2, 3]], atol=1e-12)
    angles = -np.radians([[0, 0], [90, -30]])  # chain order, and this control counts the other way
    np.testing.assert_allclose(path.axis[:2], tool_axes(trunnion, angles), atol=1e-12)


def test_a_block_may_give_the_tool_direction(read):
    text = "G43.5 H1\nG0 X1 Y2 Z3 I0 J0 K1\nG1 X2 I.6 J0 K.8 F60\nX3\n"
    path = read(text)
    np.testing.assert_allclose(tips(path), [[1, 2, 3], [2, 2, 3], [3, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]])


def test_a_direction_must_be_a_unit_vector_within_rounding(read, fault):
    text = "G43.5 H1\nG0 X1 Y2 Z3 K1\nG1 X2 I.6004 K.8 F60\n"
    np.testing.assert_allclose(np.linalg.norm(read(text).axis, axis=1), 1)
    line, message = fault(text.replace(".6004", ".61"))
    assert line == 3
    assert "has length 1.006" in message
    assert message.endswith("give a unit vector from tip to shank, each component divided by that length")


def test_a_direction_and_an_angle_in_one_block_are_refused(fault, trunnion):
    text = "G43.5 H1\nG0 X1 Y2 Z3 K1\nG1 X2 A5 I.6 K.8 F60\n"
    assert fault(text, trunnion) == (3, "a tool direction and A in one block; write one of them")


def test_axes_that_a_program_never_writes_are_assumed_at_0(read, trunnion):
    path = read("G0 X0 Y0 Z5\nG1 Z0 F60\nX1\n", trunnion)
    np.testing.assert_allclose(tips(path), [[0, 0, 5], [0, 0, 0], [1, 0, 0]], atol=1e-12)
    [assumed] = [f for f in path.findings if f.code == "rotary-assumed"]
    assert assumed.message == (
        "the program cuts before it gives A, C; 0 deg is assumed, set start if it isn't"
    )
    turned = read("G0 X0 Y0 Z5\nG1 Z0 F60\nX1\n", trunnion, start={"A": -90, "C": 0})
    assert "rotary-assumed" not in codes(turned)
    assert turned.axis[0, 2] == pytest.approx(0)


# Frames of the table and of the machine


def test_a_direction_in_the_machine_frame_is_refused(fault):
    text = "G43.5 H1\nG0 X1 Y2 Z3 K1\nG1 X2 I.6 K.8 F60\n"
    line, message = fault(text, NUTATING, positions="machine")
    assert line == 2
    assert message.startswith("positions=machine, and the block gives the tool direction")


# Tilted planes


def test_a_tilted_plane_lies_on_the_workpiece(read):
    # Euler angles: 90 about Z, then 90 about the new X, which is the old Y: the plane's Z is the old X.
    text = "G68.2 X10 Y20 Z30 I90 J90 K0\nG53.1\nG0 X1 Y2 Z3\nG1 X5 F60\nZ0\nG69\n"
    path = read(text)
    np.testing.assert_allclose(tips(path), [[13, 21, 32], [13, 25, 32], [10, 25, 32]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[1, 0, 0]] * 3, atol=1e-12)


@pytest.mark.parametrize(
    "lines",
    [
        # X is the old Y; the third point is on the side of Y, the old Z.
        ("P2 Q1 X10 Y20 Z30", "P2 Q2 X10 Y25 Z30", "P2 Q3 X10 Y18 Z37"),
        ("P3 Q1 X10 Y20 Z30 I0 J2 K0", "P3 Q2 I3 J0 K0"),
        ("P3. Q1. X10. Y20. Z30. I0. J2. K0. (X)", "P3. Q2. I3. J0. K0. (Z)"),
    ],
)
def test_a_plane_by_points_or_vectors_is_the_same_as_by_euler_angles(lines, read):
    plane = "".join(f"N{n}0 G68.2 {line}\n" for n, line in enumerate(lines, start=1))
    path = read(plane + "G53.1\nG0 X1 Y2 Z3\nG1 X5 F60\nZ0\nG69\n")
    np.testing.assert_allclose(tips(path), [[13, 21, 32], [13, 25, 32], [10, 25, 32]], atol=1e-12)
    np.testing.assert_allclose(path.axis, [[1, 0, 0]] * 3, atol=1e-12)


def test_arcs_lie_in_the_tilted_plane(read):
    text = "G68.2 X0 Y0 Z0 I90 J90 K0\nG53.1\nG0 X10 Y0 Z0\nG3 X-10 I-10 F60\n"
    points = tips(read(text))
    np.testing.assert_allclose(points[:, 0], 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 10, atol=1e-9)
    # The plane's X is the old Y, its Y the old Z.
    assert points[:, 2].max() == pytest.approx(10, abs=1e-2)


def test_increments_are_along_the_tilted_plane(read):
    text = "G68.2 X0 Y0 Z0 I90 J90 K0\nG53.1\nG0 X1 Y2 Z3\nG91 G1 X5 F60\n"
    np.testing.assert_allclose(tips(read(text))[-1], [3, 6, 2], atol=1e-12)


def test_a_plane_on_a_rotated_workpiece_is_an_assumption(read, trunnion):
    text = "G0 A-90 C0\nG68.2 X0 Y0 Z0 I0 J90 K0\nG0 X1 Y2 Z3\nG1 X5 F60\n"
    assert codes(read(text, trunnion)).count("plane-on-workpiece") == 1
    aligned = text.replace("K0\n", "K0\nG53.1\n")
    assert "plane-on-workpiece" not in codes(read(aligned, trunnion))


def test_other_kinds_of_planes_are_refused(fault):
    assert "post Euler angles I, J, K, without P" in fault("G68.2 P4 X0 Y0 Z0 I1\n")[1]
    points = "G68.2 P2 Q1 X0 Y0 Z0\nG68.2 P2 Q2 X{}\nG68.2 P2 Q3 X{}\n"
    assert "in lines after one another: Q1 X Y Z, Q2" in fault("G68.2 P2 Q0 X0 Y0 Z0\n")[1]
    assert "in lines after one another" in fault("G68.2 P2 Q1 X0 Y0 Z0\nG0 X9\n")[1]
    assert "in lines after one another" in fault(points.format("5 Y0", "0 Y1 Z0"))[1]
    assert "lie on one line" in fault(points.format("5 Y1 Z0", "15 Y3 Z0"))[1]
    assert "aren't perpendicular" in fault("G68.2 P3 Q1 X0 Y0 Z0 I1 J0 K0\nG68.2 P3 Q2 I1 J0 K9\n")[1]
    assert "G53.1 and G68.2 in one block" in fault("G68.2 G53.1 X0\n")[1]


# Switching within a program


def test_after_a_switch_a_cut_must_give_every_linear_axis(read, fault, trunnion):
    text = "G0 X0 Y0 Z5 A0 C0\nG1 Z0 F60\nM428\nG1 X1 Y1\n"
    line, message = fault(text, trunnion)
    assert line == 4
    assert message.startswith(
        "a feed move without Z: TCP was switched on on line 3, and Z isn't in the program since"
    )
    named = read(text.replace("X1 Y1", "X1 Y1 Z1"), trunnion)
    np.testing.assert_allclose(tips(named)[-1], [1, 1, 1], atol=1e-12)


def test_tcp_that_ends_within_a_turning_cut_is_refused(read, fault, trunnion):
    text = "M428\nG0 X0 Y0 Z5 A0 C0\nG1 X1 A-5 F60\nM429\nG1 X2 Y0 Z0 A-10\n"
    line, message = fault(text, trunnion)
    assert line == 5
    assert message.startswith("rotary axes turn in a cut in which TCP was switched off")
    retracted = text.replace("M429\nG1", "M429\nG0 X0 Y0 Z50\nG1")
    assert len(read(retracted, trunnion)) == 4


def test_with_a_known_zero_positions_are_converted_at_the_switch(read, trunnion):
    text = "G0 X0 Y0 Z5 A0 C0\nG1 Z0 F60\nM428\nG1 X1 Y1\n"
    path = read(text, trunnion, zero={"X": 0, "Y": 0, "Z": 0})
    np.testing.assert_allclose(tips(path)[-1], [1, 1, 0], atol=1e-9)


# Machine coordinates, work offsets


@pytest.mark.parametrize("word", ["G53 G0 Z0", "G91 G28 Z0\nG90", "G30 Z0"])
def test_retracts_in_machine_coordinates_are_omitted_with_a_note(read, word):
    text = f"G0 X0 Y0 Z5\nG1 Z0 F60\n{word}\nG0 X9 Y9\nZ5\nG1 Z0\n"
    path = read(text)
    np.testing.assert_allclose(tips(path), [[0, 0, 5], [0, 0, 0], [9, 9, 5], [9, 9, 0]])
    assert path.ignored[MACHINE_MOVES] == 1
    [note] = [f for f in path.findings if f.code == "machine-zero-moves"]
    assert note.place.line == 3
    assert note.message.startswith("1 moves in machine coordinates")
    # The tool comes back from where only the machine knows.
    [unknown] = [f for f in path.findings if f.code == "start-unknown"]
    assert (unknown.place.line, unknown.severity) == (text.split("\n").index("Z5") + 1, Severity.WARNING)
    assert path.ignored["rapid moves to an unknown position"] == 1


def test_with_a_known_zero_a_retract_is_in_the_path(read):
    path = read("G0 X0 Y0 Z5\nG1 Z0 F60\nG53 G0 Z0\n", zero={"Z": -100})
    np.testing.assert_allclose(tips(path)[:, 2], [-95, -100, 0])


def test_several_work_offsets_need_their_zeros(read, fault):
    text = "G54 G0 X0 Y0 Z5\nG1 Z0 F60\nG55 G0 X0 Y0 Z5\nG1 Z0\n"
    _, message = fault(text)
    assert message.startswith("holds 2 operations")
    assert [tips(read(text, operation=n)).tolist() for n in (1, 2)] == [[[0, 0, 5], [0, 0, 0]]] * 2
    # Where the tool stands in the other zero isn't known.
    assert fault(text.replace("G55 G0 X0 Y0 Z5", "G55 G0 Y0 Z5"))[0] == 4
    path = read(text, zero={"G54X": 0, "G55X": 50, "G55 Z": -1})
    np.testing.assert_allclose(tips(path), [[0, 0, 5], [0, 0, 0], [50, 0, 4], [50, 0, -1]])


# Moves


def test_arcs_are_sampled_under_tcp_too(read, trunnion):
    text = "M428\nG0 X10 Y0 Z0 A0 C0\nG3 X0 Y10 Z6 I-10 A-30 F60\n"
    path = read(text, trunnion)
    points = tips(path)
    share = np.linspace(0, 1, len(points))
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1), 10, atol=1e-9)
    np.testing.assert_allclose(points[:, 2], 6 * share, atol=1e-9)
    np.testing.assert_allclose(angle_between(path.axis[0], path.axis), np.radians(30) * share, atol=1e-9)
    assert 10 * (1 - np.cos(np.pi / 4 / (len(points) - 1))) < PATH_TOLERANCE


def test_drilling_goes_down_and_back_at_each_hole(read):
    text = "G0 X0 Y0 Z20\nG99 G81 X1 Y1 Z-5 R2 F60\nX9\nG80\nG0 Z20\n"
    path = read(text)
    wanted = [[0, 0, 20], [1, 1, 20], [1, 1, 2], [1, 1, -5], [1, 1, 2]]
    wanted += [[9, 1, 2], [9, 1, -5], [9, 1, 2], [9, 1, 20]]
    np.testing.assert_allclose(tips(path), wanted)
    assert [MoveKind(k).name[0] for k in path.kind] == list("RRRCRRCRR")
    back = read(text.replace("G99", "G98"))
    np.testing.assert_allclose(tips(back)[4:6], [[1, 1, 2], [1, 1, 20]])
    tapped = read(text.replace("G81", "G84"))
    assert tapped.kind[4] == CUT


def test_g98_returns_to_the_level_before_the_first_of_several_cycles(read):
    """A repeated or another cycle word continues the series; only G80 or a move in between ends it."""
    text = "G0 X0 Y0 Z50\nG99 G81 X1 Y1 Z-5 R2 F100\nX2\nG98 {} X3{}\nG80\nG0 X9\n"
    for word, rest in (("G81", " Z-5 R2"), ("G81", ""), ("G82", " Z-5 R2 P1")):
        path = read(text.format(word, rest))
        wanted = [[3, 1, 2], [3, 1, -5], [3, 1, 2], [3, 1, 50], [9, 1, 50]]
        np.testing.assert_allclose(tips(path)[-5:], wanted)
    for between in ("G80\n", "G0 X2\n", "G80\nG0 X2\n"):
        path = read(text.format("G81", " Z-5 R2").replace("G98", between + "G98"))
        np.testing.assert_allclose(tips(path)[-3:-1], [[3, 1, -5], [3, 1, 2]])
        np.testing.assert_allclose(tips(path)[-1], [9, 1, 2])


def test_depth_and_level_of_a_cycle_are_cancelled_with_it(read, fault):
    text = "G0 X0 Y0 Z50\nG99 G81 X1 Y1 Z-5 R2 F100\n{}G81 X2\n"
    np.testing.assert_allclose(tips(read(text.format("")))[-2:], [[2, 1, -5], [2, 1, 2]])
    for between in ("G80\n", "G0 Z50\n"):
        line, message = fault(text.format(between))
        assert line == 4
        assert message.startswith("G81 needs depth Z and level R")


def test_g98_from_below_the_level_returns_to_the_level(read):
    path = read("G0 X0 Y0 Z0\nG98 G81 X1 Y1 Z-5 R2 F100\nX2\n")
    wanted = [[0, 0, 0], [0, 0, 2], [1, 1, 2], [1, 1, -5], [1, 1, 2], [2, 1, 2], [2, 1, -5], [2, 1, 2]]
    np.testing.assert_allclose(tips(path), wanted)
    [doubt] = [f for f in path.findings if f.code == "cycle-from-below"]
    assert doubt.place.line == 2


@pytest.mark.parametrize(
    ("text", "line", "fact"),
    [
        ("G81 X1 Y1 Z-5 F60", 2, "G81 needs depth Z and level R"),
        ("G81 X1 Y1 Z-5 R2 L3 F60", 2, "G81 L3 repeats the cycle"),
        ("G81 X1 Y1 Z-5 R2", 2, "without F in force"),
        ("G18 G81 X1 Y1 Z-5 R2 F1", 2, "a cycle in G18"),
        ("M430", 2, "user-defined kinematics"),
        ("G1 X1 X2 F1", 2, "X has two values"),
        ("X#7", 2, "#7 has no value yet"),
        ("WHILE [#1 LT 5] DO1", 2, "#1 has no value yet"),
        ("IF [1 EQ 1] GOTO 9", 2, "goes to block N9"),
    ],
)
def test_unsupported_and_wrong_words_are_refused_with_their_line(fault, text, line, fact):
    found, message = fault("G0 X0 Y0 Z0\n" + text + "\n")
    assert (found, fact in message) == (line, True), message


def test_feeds_are_those_of_the_tip_and_durations_are_kept(read, trunnion):
    head = "M428\nG0 X0 Y0 Z0 A0 C0\n"
    np.testing.assert_allclose(read(head + "G1 X3 Y4 A-5 F600\n", trunnion).feed[1], 10)
    timed = read(head + "G93 G1 X3 Y4 A-5 F30\n", trunnion)
    assert timed.lengths[1] / timed.feed[1] == pytest.approx(2)
    turning = read(head + "G1 A-60 F600\n", trunnion)
    assert turning.lengths[1] / turning.feed[1] == pytest.approx(6)
    assert read(head + "G1 X1 A-60\n", trunnion, feed_mm_min=120).feed.tolist() == [2, 2]
    # In machine coordinates F is along the axes, not the tip path.
    path = read("G0 X0 Y0 Z100 A0 C0\nG1 Y30 A-30 F600\n", trunnion)
    assert path.lengths[1] / path.feed[1] == pytest.approx(3)


@pytest.mark.parametrize("end", ["M30\nG1 X9", "M2\n%", "M99\nG1 X9", "M17", "%"])
def test_a_program_ends_at_its_end_word(read, end):
    path = read(f"\ufeff%\nO1 (part)\nG0 X0 Y0 Z0\nG1 X1 F60\n{end}\n")
    assert len(path) == 2


@pytest.mark.parametrize(
    "text",
    [
        "G0 X0 Y0 Z0\nG1 X1 F60",
        "g0x0y0z0\ng1x1f60",
        "N1 G00 X 0 . Y 0 Z 0\nN2 G01 X 1 . 0 F 60",
        "G0 X0 Y0 Z0 ; begin\n(to X9) G1 X1 F60 (end)",
        "#1=2 (two)\nG0 X[#1-2] Y0 Z0\nG1 X[#1/2] F[30*#1]",
    ],
)
def test_syntax_variants_give_the_same_program(read, text):
    np.testing.assert_allclose(tips(read(text)), [[0, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize("line", ["X" * 10_000_000, "X1" * 5_000_000, "(" * 10_000_000, "[" * 10_000_000])
def test_a_line_of_ten_megabytes_is_refused_at_once(fault, line):
    found, message = fault("G0 X0 Y0 Z0\n" + line)
    assert found == 2
    assert len(message) < 200


# Words whose meaning is certain


HEAD = "G21 G90 G94\n"
CUTS = "G0 X0 Y2 Z10 A0 C0\nG1 X5 F100\nX10 Y5\nM30\n"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("G91 G28 Z0\nG91 G30 Z0\nG90\n", "G91 G30 Z0\n"),
        ("G91 G53 Z0\nG90\n", "G91 G53 Z0 M5\n"),
        ("G10 L2 P1 X0 Y0 Z0\nG10 L10 P1 R100\n", ""),
        ("T01 T02 M06\n", ""),
        ("X0 Y2 Z10 A0 C0\n", ""),
        ("O<PART>\n", ""),
    ],
)
def test_words_around_a_path_leave_it_as_it_is(read, before, after):
    machine = Machine.from_code("640123")
    plain = tips(read(HEAD + CUTS, machine))
    text = HEAD + before + CUTS.replace("M30", after + "M30")
    if before.startswith("X0"):
        text = text.replace("G0 X0 Y2 Z10 A0 C0\n", "")
    np.testing.assert_array_equal(tips(read(text, machine)), plain)


def test_tcp_takes_over_x_and_y_of_an_upright_tool_only(read, fault):
    """At A0 C0 words of the work offset and of the tip are the same; at A10 they aren't."""
    text = HEAD + "G0 A{} C0\nG0 X1 Y2\nG43.4 H1 Z10\nG1 X5 F100\nX10 A10 C20\nM30\n"
    machine = load_machine("variaxis-630")
    np.testing.assert_allclose(tips(read(text.format(0), machine)), [[1, 2, 10], [5, 2, 10], [10, 2, 10]])
    line, message = fault(text.format(10), machine)
    assert (line, message.split(":")[0]) == (5, "a feed move without Y")


def test_two_tools_in_a_block_load_the_first_and_prepare_the_second(read):
    machine = Machine.from_code("640123")
    two = HEAD + "T1 T2 M6\n" + CUTS.replace("M30", "T2 M6\nX0\nM30")
    assert [read(two, machine, operation=n).operation.tool for n in (1, 2)] == ["1", "2"]
    assert read(two.replace("T2 M6\nX0", "X0"), machine).operation.tool == "1"
