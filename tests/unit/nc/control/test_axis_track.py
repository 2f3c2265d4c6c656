"""Rotary axes that the control turns by itself, to angles that aren't in the program."""

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import ToolpathError

BALL = fx.Tool.ball(6)
ISO = "G21 G90 G54\nG0 X0 Y0 Z50 A0 C0\n"
SINUMERIK = "G90 G71 G54\nG0 X0 Y0 Z50 A0 C0\n"
KLARTEXT = "BEGIN PGM p MM\nL X+0 Y+0 Z+50 A+0 C+0 R0 FMAX\n"

# Suffix, the program up to the end of the direction or the plane, and how words give X, and A and C.
TURNED = {
    "G43.5": ("nc", ISO + "G43.5 H1\nG0 X0 Y0 Z50 I0 J0 K1\nG1 X1 I.6 J0 K.8 F100\nG49\n", 4),
    "G68.2": ("nc", ISO + "G68.2 X10 Y0 Z0 I90 J30 K0\nG53.1\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG69\n", 4),
    "A3": (
        "mpf",
        SINUMERIK + "TRAORI\nG0 X0 Y0 Z50\nG1 X1 A3=.6 B3=0 C3=.8 F100\nTRAFOOF\n",
        5,
    ),
    "CYCLE800": (
        "mpf",
        SINUMERIK + 'CYCLE800(0,"X",200000,57,10,0,0,0,30,0,0,0,0,-1,100,1)\nG0 X0 Y0 Z5\nG1 Z-1 F100\n'
        "CYCLE800()\n",
        3,
    ),
    "PLANE": (
        "h",
        KLARTEXT + "PLANE SPATIAL SPA+20 SPB+30 SPC+40 TURN FMAX SEQ-\nL X+0 Y+0 Z+5 R0 FMAX\nL Z-1 F100\n"
        "PLANE RESET STAY\n",
        3,
    ),
    "LN": (
        "h",
        KLARTEXT + "M128\nL X+0 Y+0 Z+50 FMAX\nLN X+1 Y+0 Z+0 NX+0 NY+0 NZ+1 TX+0.6 TY+0 TZ+0.8 F100\nM129\n",
        5,
    ),
}
# The others are two operations, in a plane and out of it.
ONE_PLANE = ("G43.5", "A3", "LN")
AWAY = {"h": "L X+0 Y+0 Z+50 R0 FMAX\n", "nc": "G0 X0 Y0 Z50\n", "mpf": "G0 X0 Y0 Z50\n"}
ON = {"h": "L X+5 F100\n", "nc": "G1 X5\n", "mpf": "G1 X5\n"}
UPRIGHT = {"h": "L A+0 C+0 R0 FMAX\n", "nc": "G0 A0 C0\n", "mpf": "G0 A=DC(0) C=DC(0)\n"}


@pytest.fixture
def read(tmp_path, hayashi):
    def read_text(text, suffix="nc", **options):
        path = tmp_path / f"part.{suffix}"
        path.write_text(text, encoding="utf-8")
        return fx.read_toolpath(path, **{"tool": BALL, "machine": hayashi} | options)

    return read_text


@pytest.mark.parametrize("word", TURNED)
def test_after_a_direction_or_a_plane_a_cut_needs_the_angles_again(read, word):
    """The control has turned A and C away from the angles that the program gave before."""
    suffix, text, line = TURNED[word]
    with pytest.raises(ToolpathError) as caught:
        read(text + AWAY[suffix] + ON[suffix], suffix)
    assert caught.value.line == len(text.split("\n")) + 1
    assert caught.value.message == (
        f"a feed move without A, C: since line {line} the control turns them itself, to directions or a "
        "plane, and their angles aren't in the program; write A, C"
    )


@pytest.mark.parametrize("word", TURNED)
def test_after_a_direction_or_a_plane_written_angles_apply(read, word):
    suffix, text, _ = TURNED[word]
    text += AWAY[suffix] + UPRIGHT[suffix] + ON[suffix]
    first, path = (read(text, suffix, operation=None if word in ONE_PLANE else n) for n in (1, 2))
    np.testing.assert_allclose(path.tips(path.axis)[-1], [5, 0, 50], atol=1e-12)
    np.testing.assert_allclose(path.axis[-1], [0, 0, 1], atol=1e-12)
    assert first.axis[first.cutting][0, 2] < 0.9
    assert "approach-unknown" in [f.code for f in first.findings]


@pytest.mark.parametrize("word", ["G43.5", "G68.2"])
def test_without_a_machine_the_error_asks_for_one(read, word):
    suffix, text, line = TURNED[word]
    text = text.replace(" A0 C0", "")
    with pytest.raises(
        ToolpathError, match=rf"without the rotary axes: since line {line} .* give the machine"
    ):
        read(text + AWAY[suffix] + ON[suffix], suffix, machine=None)
    assert len(read(text, suffix, machine=None)) > 1


@pytest.mark.parametrize(
    ("suffix", "text", "missing"),
    [
        ("nc", "G43.5 H1\nG0 X0 Y0 Z50 K1\nG1 X1 I.6 J0 K.8 F100\nX5 A10\n", "C"),
        ("mpf", "TRAORI\nG0 X0 Y0 Z50 A0 C350\nG1 X1 A3=.6 B3=0 C3=.8 F100\nX5 C=DC(10)\n", "A"),
        ("mpf", "TRAORI\nG0 X0 Y0 Z50 A0 C350\nG1 F100 X1 A3=.6 B3=0 C3=.8 A4=0\nX5 C10\n", "A"),
        ("nc", "G43.5 H1\nG0 X0 Y0 Z50 K1\nG1 X1 I.6 J0 K.8 F100\nG53 G0 A0\nG1 X5\n", "C"),
    ],
)
def test_one_angle_after_a_direction_leaves_the_other_unknown(read, suffix, text, missing):
    with pytest.raises(ToolpathError, match=f"a feed move without {missing}: since line"):
        read((SINUMERIK if suffix == "mpf" else ISO) + text, suffix)


def test_an_incremental_angle_after_a_direction_is_refused(read):
    text = SINUMERIK + "TRAORI\nG0 X0 Y0 Z50\nG1 X1 A3=.6 B3=0 C3=.8 F100\nX5 A=IC(5) C10\n"
    with pytest.raises(ToolpathError, match="A by an increment"):
        read(text, "mpf")


def test_dc_after_a_direction_ignores_the_angle_before_it(read):
    """C=DC(10) after C350 is C370; after a direction it is C10."""
    text = SINUMERIK + "TRAORI\nG0 X0 Y0 Z50 A0 C350\nG1 X1 A3=.6 B3=0 C3=.8 F100\nX5 A=DC(30) C=DC(10)\n"
    path = read(text, "mpf")
    plain = read(text.replace("=DC(30)", "30").replace("=DC(10)", "10"), "mpf")
    np.testing.assert_array_equal(path.axis, plain.axis)


def test_a_move_in_machine_coordinates_ends_a_direction(read):
    text = ISO + "G43.5 H1\nG0 X0 Y0 Z50 K1\nG1 X1 I.6 J0 K.8 F100\nG53 G0 A0 C0\nG1 X5\n"
    np.testing.assert_allclose(read(text).axis[-1], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("motion", ["L X+1 F100", "CC X+0 Y+1\nC X+0 Y+2 DR+ F100"])
def test_the_rotation_into_a_plane_is_no_cut_whatever_motion_is_in_force(read, motion):
    plane = "PLANE SPATIAL SPA+0 SPB+90 SPC+0 TURN FMAX\nL X+1 Y+2 Z+3 R0 FMAX\nL Z-1 F100\n"
    text = f"{KLARTEXT}{motion}\n{plane}"
    path = read(text, "h", operation=2)
    np.testing.assert_allclose(path.tips(path.axis)[-2:], [[3, 2, -1], [-1, 2, -1]], atol=1e-12)
    np.testing.assert_allclose(path.axis[-2:], [[1, 0, 0]] * 2, atol=1e-12)
    assert path.cutting[-2:].tolist() == [False, True]
