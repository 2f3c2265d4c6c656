"""Whole programs of Sinumerik and Heidenhain controls, as toolpaths."""

from pathlib import Path

import numpy as np
import pytest
from support.nc_blocks import one_by_one
from support.whole_files import each_path

from fiveaxis.base import angle_between
from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Axis, Machine, MoveKind, Tool, Toolpath
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code
from fiveaxis.nc import read_operations, read_toolpath
from fiveaxis.nc.languages import choice
from fiveaxis.nc.source import load_source

BALL = Tool.ball(6.0)
INCH = 25.4
# 4 decimals of X Y Z and 3 of two angles at 2.4 inch, in both programs; inch and deg.
ROUNDED_INCH = 2 * np.sqrt(3) * 0.5e-4 + 2 * np.radians(0.5e-3) * 2.4
ROUNDED_DEG = 1e-3


def machine_of(code: str, lines: dict[str, Line] | None = None, reverse: str = "") -> Machine:
    parsed = parse_code(code)
    axes = tuple(Axis(c, reversed=c in reverse) for c in sorted(parsed.letters, key="XYZABC".index))
    return Machine(code, parsed, Chain.from_code(parsed, lines or {}), axes)


def read(path: Path, text: str, **options) -> Toolpath:
    path.write_text(text, encoding="utf-8")
    return read_toolpath(path, tool=BALL, **options)


def tips_of(path: Toolpath):
    return path.tips(path.axis)


# The real programs

# All work offsets at one zero: the programs don't give the distances of G54 to G56.
ZEROS = {"G54X": 0.0, "G55X": 0.0, "G56X": 0.0}


@pytest.fixture(scope="module")
def dmu(data) -> list[Toolpath]:
    machine = machine_of("650123", {"B": Line((0.0, 1.0, -1.0))}, reverse="B")
    file = data / "toolpaths" / "nx_dmu70_840d_traori_inch.mpf"
    return each_path(file, tool=BALL, machine=machine, zero=ZEROS)


def test_a_dmu_and_a_haas_have_the_same_tip_in_the_same_operation(data, dmu):
    """The oracle of `tests.unit.kinematics.test_oracles`, through both readers: the same largest distance."""
    haas = read_toolpath(
        data / "toolpaths" / "nx_haas_vf2tr_machine_inch.nc",
        tool=BALL,
        machine=machine_of("540123", {"B": Line((0.0, 0.0, 1.0))}, reverse="A"),
        unit="inch",
        zero=ZEROS,
        operation=3,
    )
    posted = [
        path.at(np.flatnonzero((path.source >= first) & (path.source < first + 350)))
        for path, first in ((dmu[2], 479), (haas, 543))
    ]
    assert [len(p) for p in posted] == [350, 350]
    apart = np.linalg.norm(tips_of(posted[0]) - tips_of(posted[1]), axis=1) / INCH
    assert apart.max() < ROUNDED_INCH
    assert apart.max() == pytest.approx(1.31e-4, abs=1e-6)
    turned = np.degrees(angle_between(posted[0].axis, posted[1].axis))
    assert turned[:311].max() < ROUNDED_DEG
    assert turned[311:].min() > ROUNDED_DEG  # the nutating axis is at its end


def test_the_dmu_program_is_read_completely_with_its_long_turns(dmu):
    last = dmu[-1]
    assert last.source[-1] == 1197
    turns = [f for path in dmu for f in path.findings if f.code == "long-turn"]
    assert [(f.place.line, round(f.value, 3)) for f in turns] == [(1197, 1903.826)]
    assert last.ignored["MCALL"] == 35
    found = {f.code for path in dmu for f in path.findings}
    assert found >= {"feed-unit-assumed", "cycle-retracts-below", "cycle-as-hole"}


def test_operations_from_work_offsets_of_unknown_distance_are_kept_apart(data):
    file = data / "toolpaths" / "nx_dmu70_840d_traori_inch.mpf"
    machine = machine_of("650123", {"B": Line((0.0, 1.0, -1.0))}, reverse="B")
    found = read_operations(file, machine=machine)
    assert [operation.work_offset for operation in found][:5] == ["G54", "G55", "G56", "G56", "G54"]
    assert [operation.kind for operation in found[6:]] == [*["drilling"] * 5, "3+2", "drilling"]
    assert len(read_operations(file, machine=machine, zero=ZEROS)) == len(found) - 1


def test_the_cross_has_six_directions_and_no_simultaneous_cut(data):
    file = data / "toolpaths" / "spinner_achskreuz_840D_mm.mpf"
    paths = each_path(file, tool=BALL, machine=machine_of("650123"))
    assert paths[-1].source[-1] == 3059
    cuts = np.concatenate([path.axis[path.cutting] for path in paths])
    directions = np.unique(np.round(cuts, 9) + 0.0, axis=0)
    assert len(directions) == 6
    for path in paths:
        same = np.linalg.norm(np.diff(path.axis, axis=0), axis=1) < 1e-9
        assert same[path.cutting[1:]].all()
        assert [f.value for f in path.findings if f.code == "no-simultaneous-path"] == [1.0]
    assert {path.operation.kind for path in paths} == {"3-axis", "3+2"}
    assert paths[-1].ignored["moves in machine coordinates"] == 64


def test_frames_and_rotary_axes_of_the_cross_give_the_same_directions(data):
    """The post wrote each plane twice: as AROT about rotated axes, and as B and C of a table."""
    source = load_source(data / "toolpaths" / "spinner_achskreuz_840D_mm.mpf")
    angles, planes = {}, 0
    last = None
    for block in one_by_one(choice.SINUMERIK.split(source)):
        if last is not None and block.frame is None:
            b, c = (np.radians(angles[letter]) for letter in "BC")
            axis = [np.cos(c) * np.sin(b), np.sin(c) * np.sin(b), np.cos(b)]
            np.testing.assert_allclose(last.rotation[:, 2], axis, atol=1e-12)
            planes += 1
        last = block.frame if block.frame is not None and block.frame.word == "AROT" else None
        angles |= {k: v for k, v in block.words.items() if k in "BC"}
    assert planes == 21


# The same path in three languages

ISO = """%
G21 G90 G54
G43.4 H1
G0 X10 Y0 Z5 A0 C0
G1 Z0 F200
X20 A-10 C20
G91 X5
G90 G3 X25 Y20 I0 J10 F100
G0 Z50
M30
"""
SINUMERIK = """G710 G90 G54
DEF REAL _UP
_UP = 5
TRAORI
G0 X10 Y0 Z=_UP A0 C0
G1 Z0 F200
X20 A=DC(350) C20
X=IC(5)
G3 X25 Y20 I=AC(25) J=AC(10) F100
G0 Z50
M30
"""
KLARTEXT = """0 BEGIN PGM PART MM
1 TOOL CALL 1 Z S1000 F200
2 M128
3 L X+10 Y+0 Z+5 A+0 C+0 R0 FMAX
4 L Z+0 F AUTO
5 L X+20 A-10 C+20
6 L IX+5
7 CC X+25 Y+10
8 C X+25 Y+20 DR+ F100
9 L Z+50 FMAX
10 END PGM PART MM
"""


def test_three_languages_give_one_path(tmp_path):
    machine = machine_of("640123")
    iso = read(tmp_path / "part.nc", ISO, machine=machine)
    for name, text in (("part.mpf", SINUMERIK), ("part.h", KLARTEXT)):
        path = read(tmp_path / name, text, machine=machine)
        np.testing.assert_allclose(tips_of(path), tips_of(iso), atol=1e-12)
        np.testing.assert_allclose(path.axis, iso.axis, atol=1e-12)
        np.testing.assert_allclose(path.feed[1:], iso.feed[1:])
        np.testing.assert_array_equal(path.kind, iso.kind)
    assert iso.axis[-1] != pytest.approx([0.0, 0.0, 1.0])


def test_tool_vectors_need_no_machine(tmp_path):
    sinumerik = "G710\nTRAORI\nG0 X1 Y2 Z3 A3=0 B3=0 C3=1\nG1 Z0 A3=.6 C3=.8 F100\nX5\nM30\n"
    klartext = (
        "BEGIN PGM A MM\nL X+1 Y+2 Z+3 R0 FMAX M128\nLN X1 Y2 Z3 TX0 TY0 TZ1 FMAX\n"
        "LN Z+0 X1 TX+0.6 TY+0 TZ+0.8 F100\nLN X+5 TX+0.6 TY+0 TZ+0.8\nEND PGM A MM\n"
    )
    for name, text in (("a.mpf", sinumerik), ("a.h", klartext)):
        path = read(tmp_path / name, text)
        np.testing.assert_allclose(tips_of(path)[-3:], [[1, 2, 3], [1, 2, 0], [5, 2, 0]])
        np.testing.assert_allclose(path.axis[-3:], [[0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]])


def test_normals_of_a_program_give_the_contacts_of_a_ball(tmp_path):
    text = (
        "BEGIN PGM A MM\nM128\nLN X0 Y0 Z5 TX0 TY0 TZ1 FMAX\nLN X1 Y0 Z0 NX0 NY.6 NZ.8 TX0 TY0 TZ1 F100\n"
        "LN X2 Y0 Z0 NX0 NY.6 NZ.8 TX0 TY0 TZ1\nEND PGM A MM\n"
    )
    path = read(tmp_path / "a.h", text)
    # The ball centre is 3 mm above the tip, and the contact 3 mm from it against the normal.
    np.testing.assert_allclose(path.contact[1:], [[1, -1.8, 0.6], [2, -1.8, 0.6]], atol=1e-12)


def test_planes_of_both_languages_lie_where_programmed(tmp_path):
    """A hole of 5 mm at (1, 2) of a plane through X 100 whose Z is the workpiece's X."""
    sinumerik = (
        'G710 G90 G54\nCYCLE800(1,"TC",0,57,100,0,0,0,90,0,0,0,0,-1)\nG0 X1 Y2\nZ3\n'
        "F100\nCYCLE82(3,0,1,-5)\nM30\n"
    )
    klartext = (
        "BEGIN PGM A MM\nTRANS DATUM AXIS X+100\nPLANE SPATIAL SPA+0 SPB+90 SPC+0 STAY\n"
        "L B+Q121 C+Q122 R0 FMAX\nL X+1 Y+2 FMAX\nL Z+3 FMAX\nL Z+1 FMAX\nL Z-5 F100\nL Z+3 FMAX\n"
        "END PGM A MM\n"
    )
    for name, text in (("a.mpf", sinumerik), ("a.h", klartext)):
        path = read(tmp_path / name, text)
        tips = [[100 + z, 2, -1] for z in (3, 1, -5, 3)]
        np.testing.assert_allclose(tips_of(path), tips, atol=1e-12)
        np.testing.assert_allclose(path.axis, [[1, 0, 0]] * 4, atol=1e-12)
        assert list(path.kind) == [MoveKind.RAPID, MoveKind.RAPID, MoveKind.CUT, MoveKind.RAPID]


def test_a_helix_of_both_languages_ends_at_its_end_after_all_turns(tmp_path):
    sinumerik = "G710\nG0 X10 Y0 Z0\nG3 X0 Y10 Z-9 I-10 J0 TURN=2 F100\nM30\n"
    klartext = "BEGIN PGM A MM\nL X10 Y0 Z0 FMAX\nCC X0 Y0\nCP IPA+810 IZ-9 DR+ F100\nEND PGM A MM\n"
    for name, text in (("a.mpf", sinumerik), ("a.h", klartext)):
        path = read(tmp_path / name, text)
        tips = tips_of(path)
        np.testing.assert_allclose(tips[-1], [0, 10, -9], atol=1e-9)
        turned = np.unwrap(np.arctan2(tips[:, 1], tips[:, 0]))
        assert turned[-1] - turned[0] == pytest.approx(2.25 * 2 * np.pi)
        np.testing.assert_allclose(np.diff(tips[:, 2]), -9 / (len(tips) - 1), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "text", "fact"),
    [
        ("a.mpf", "TRAORI\nG1 X1 Y2 Z3 A3=1 B3=1 C3=1 F9\nX2", "a.mpf:2"),
        ("a.h", "BEGIN PGM A MM\nM128\nLN X1 Y2 Z3 TX1 TY1 TZ1 F9\nLN X2 TX1 TY0 TZ0", "a.h:3"),
        ("a.mpf", "G710\nG0 X0 Y0 Z0\nG1 X1\nX=2", "a.mpf:3: a feed move without F"),
        ("a.h", "BEGIN PGM A MM\nL X0 Y0 Z0 FMAX\nCC X5 Y5\nC X9 Y0 DR+ F5", "a.h:4: the arc starts"),
        ("a.mpf", "TRAORI\nG0 X0 Y0 Z0\nG1 X1 F5\nG700 X5", "a.mpf:4"),
        (
            "a.mpf",
            'G710\nG0 X0 Y0 Z0\nCYCLE800(1,"",0,57,0,0,0,0,30,0,0,0,0,-1)\nG0 X1 Y1\nG1 X2 F5',
            "a.mpf:5: a feed move without",
        ),
        (
            "a.h",
            "BEGIN PGM A MM\nL X0 Y0 Z0 FMAX\nPLANE SPATIAL SPA+9 SPB0 SPC0 TURN\nL X1 Y1 FMAX\nL X2 F5",
            "a.h:5: a feed move without",
        ),
    ],
)
def test_faults_that_depend_on_other_blocks_are_refused_with_their_line(tmp_path, name, text, fact):
    with pytest.raises(ToolpathError) as caught:
        read(tmp_path / name, text)
    assert fact in str(caught.value)


@pytest.mark.parametrize(
    ("head", "tail"),
    [
        ("PROGRAM LISTING   PAGE 1\n\nO1000(NAME)\n", "M30\n%\nEND OF LISTING, 12 LINES\n"),
        ("MACHINE: VF2\n%\n:1000\n", "M30\n%\n"),
        ("%\n<BRACKET>\n", "M30\n%\n"),
        ("$BRACKET.MIN%\nO1000\n", "M02\n"),
        ("%\nO12345678(MAZAK EIA)\n", "M30\n%\n"),
        ("%\x00\nO1000;\n", "M30;\n\x13%\x7f\n"),
        ("%\nO1000" + 74 * " " + "\n", "M30" + 77 * " " + "\n%\n"),
        ("%\nO1000\n/1 G0 X99.\n/9 X98.\n", "M30\n"),
    ],
)
def test_heads_and_tails_of_files_leave_the_program_as_it_is(head, tail, tmp_path):
    path = tmp_path / "part.nc"
    path.write_bytes(f"{head}G21 G90\nG0 X1. Y2. Z3.\nG1 X4. F100\n{tail}".encode("ascii"))
    found = read_toolpath(path, tool=Tool.ball(4), block_delete=True)
    np.testing.assert_allclose(found.tips(found.axis), [[1, 2, 3], [4, 2, 3]])
    assert ("control-characters" in {f.code for f in found.findings}) == ("\x00" in head)


def test_code_before_a_program_number_is_not_a_listing(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text("T1 M6\nO1000\nG21 G90\nG0 X1. Y2. Z3.\nG1 X4. F100\nM30\n", encoding="ascii")
    [operation] = read_operations(path)
    assert operation.tool == "1"
