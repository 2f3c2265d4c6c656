"""Circular moves of APT files."""

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import PATH_TOLERANCE, MoveKind

ROUNDING = 1e-9


def tips(path):
    return path.tips(path.axis)


def swept(path, centre=(0.0, 0.0)):
    """Angle about the centre from the first to the last location, deg, positive counterclockwise."""
    xy = tips(path)[:, :2] - centre
    angles = np.unwrap(np.arctan2(xy[:, 1], xy[:, 0]))
    return round(float(np.degrees(angles[-1] - angles[0])), 6)


def chord_error(points, centre, radius):
    """Largest distance of the chords' middles from the circle, mm."""
    middle = (points[1:] + points[:-1]) / 2.0
    return float(np.max(np.abs(np.linalg.norm(middle - centre, axis=1) - radius)))


@pytest.mark.parametrize(
    ("circle", "sweep"),
    [
        ("CIRCLE/0,0,0,0,0,1", 90),
        ("CIRCLE/0,0,0,0,0,1,10", 90),
        ("CIRCLE/0,0,0,0,0,-1,10", -270),
        ("CIRCLE/0,0,0,0,0,-1,10.0,0.06,0.5,40.0,1.0", 90),
        ("CIRCLE/0,0,0,0,0,1,10.0,0.06,.5,.5", -270),
        ("MOVARC/0,0,0,0,0,1,10,ANGLE,90", 90),
        ("MOVARC/0,0,0,0,0,1,10,ANGLE,450", 450),
        ("MOVARC/0,0,0,0,0,-1,10,ANGLE,270", -270),
    ],
)
def test_arcs_turn_by_the_right_hand_and_those_of_nx_by_the_left(read, circle, sweep):
    path = read(f"GOTO/10,0,5\n{circle}\nGOTO/0,10,5\n")
    assert swept(path) == sweep
    points = tips(path)
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1), 10, atol=ROUNDING)
    np.testing.assert_allclose(points[[0, -1]], [[10, 0, 5], [0, 10, 5]], atol=ROUNDING)
    assert chord_error(points, [0, 0, 5], 10) <= PATH_TOLERANCE
    assert set(path.source.tolist()) == {1, 3}


def test_arcs_are_as_coarse_as_the_tolerance_allows(read):
    points = tips(read("GOTO/10,0,5\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,5\n"))
    step = 2 * np.arccos(1 - PATH_TOLERANCE / 10)
    assert len(points) - 1 == np.ceil(np.pi / 2 / step)


def test_inches_keep_the_tolerance_in_mm(read):
    points = tips(read("UNITS/INCHES\nGOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1\nGOTO/0,1,0\n"))
    assert chord_error(points, [0, 0, 0], 25.4) <= PATH_TOLERANCE
    np.testing.assert_allclose(points[-1], [0, 25.4, 0], atol=ROUNDING)


def test_an_arc_to_its_begin_is_a_full_circle(read):
    assert swept(read("GOTO/10,0,5\nCIRCLE/0,0,5,0,0,1\nGOTO/10,0,5\n")) == 360
    assert swept(read("GOTO/10,0,5\nCIRCLE/0,0,5,0,0,-1\nGOTO/10,0,5\n")) == -360


def test_the_tool_axis_turns_evenly_along_an_arc(read):
    path = read("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0,0,0.6,0.8\n")
    np.testing.assert_allclose(np.linalg.norm(path.axis, axis=1), 1, atol=ROUNDING)
    np.testing.assert_allclose(path.axis[[0, -1]], [[0, 0, 1], [0, 0.6, 0.8]], atol=ROUNDING)
    assert np.all(np.diff(path.axis[:, 2]) < 0)
    still = read("GOTO/10,0,0,0,0.6,0.8\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\n")
    assert np.ptp(still.axis, axis=0).max() == 0


def test_words_between_an_arc_and_its_end_do_not_matter(read):
    path = read("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nPAINT/COLOR,31\nFEDRAT/50,MMPM\nGOTO/0,10,0\nGOTO/0,0,0\n")
    assert swept(read("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n")) == 90
    np.testing.assert_allclose(path.feed * 60, 50)
    assert tips(path)[-1].tolist() == [0, 0, 0]


def test_creo_may_write_several_points_for_one_arc(read):
    head = "$$-> CUTTER / 10.0\nGOTO / 10, 0, 0\nCIRCLE / 0, 0, 0, $\n0, 0, 1, 10\n"
    arc = "GOTO / 0, 10, 0\nGOTO / -10, 0, 0\n"
    path = read(head + arc)
    assert swept(path) == 180
    assert chord_error(tips(path), [0, 0, 0], 10) <= PATH_TOLERANCE
    assert len(read(head + arc + "GOTO / 10, 0, 0\n")) == len(path) + 1, "a chord is a longer step"
    assert len(read(head + arc + "GOTO / 20, 0, 0\n")) == len(path) + 1
    assert len(read(head + arc + "COOLNT/OFF\nGOTO / 0, -10, 0\n")) == len(path) + 1


def test_others_write_one_point_for_one_arc(read):
    path = read("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\nGOTO/-10,0,0\n")
    assert swept(path) == 180
    assert chord_error(tips(path), [0, 0, 0], 10) > 1


@pytest.mark.parametrize(
    ("indirv", "motion", "sweep"),
    [
        ("0,1,0", "(CIRCLE/ 0,0,5,$\n10),ON,(LINE/0,0,5,0,10,5)", 90),
        ("0,-1,0", "(CIRCLE/ 0,0,5,10),ON,(LINE/0,0,5,0,10,5)", -270),
        ("0,1,0", "(CIRCLE/0,0,5,10),ON,2,INTOF,$\n(LINE/0,0,5,0,-10,5)", 270),
        ("0,1,0", "(CIRCLE/0,0,5,10),ON,(LINE/-20,6,5,20,6,5)", 36.869898),
        ("0,1,0", "(CIRCLE/0,0,5,10),ON,2,INTOF,(LINE/-20,6,5,20,6,5)", 143.130102),
        (
            "0,1,0",
            "(CYLNDR / 0,0,5,0,0,1,10),ON,(PLANE/PERPTO,(PLANE/(POINT/0,0,5),PERPTO,(VECTOR/0,0,1)),$\n"
            "(POINT/0,0,5),(POINT/0,10,5))",
            90,
        ),
    ],
)
def test_motions_along_a_circle_end_at_their_line(read, indirv, motion, sweep):
    path = read(f"GOTO/10,0,5\nAUTOPS\nINDIRV/{indirv}\nTLON,GOFWD/ {motion}\nGOTO/0,0,5\n")
    assert swept(path.at(np.arange(len(path) - 1))) == sweep
    np.testing.assert_allclose(tips(path)[-1], [0, 0, 5])


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("CIRCLE/0,0,0,0,0,1\nGOTO/1,0,0\n", 1, "no location before it to begin at"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\n", 2, "has no GOTO to end at"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n", 3, "can't follow an arc"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGODLTA/0,0,1\n", 3, "can't end an arc"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,11,0\n", 2, "begins 10 mm from its centre and ends 11 mm"),
        (
            "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,9\nGOTO/0,10,0\n",
            2,
            "and its radius is 9 mm; these may differ by",
        ),
        ("GOTO/0,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n", 2, "begins or ends at its centre"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0\nGOTO/0,10,0\n", 2, "isn't understood; write the centre"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,0\nGOTO/0,10,0\n", 2, "has an axis of length 0"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,1,1\nGOTO/0,10,0\n", 2, "has an axis of length 1.41421"),
        ("GOTO/10,0,0\nCIRCLE/0,0,nan,0,0,1\nGOTO/0,10,0\n", 2, "a number that isn't finite"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,inf\n", 3, "a number that isn't finite"),
        ("GOTO/10,0,0\nCIRCLE/C1,0,0,0,0,1\nGOTO/0,10,0\n", 2, "isn't understood; write the centre"),
        ("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0,0,0,0,TIMES,2\nGOTO/0,10,0\n", 2, "a helix of several turns"),
        (
            "GOTO/10,0,0\nMOVARC/0,0,0,0,0,1,10,ANGLE,80\nGOTO/0,10,0\n",
            2,
            "turns by 80 deg, and there are 90",
        ),
        ("GOTO/10,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,1,0)\n", 2, "needs the direction"),
        ("GOTO/10,0,0\nINDIRV/0,1,0\nTLON,GOFWD/L1\n", 3, "a motion along geometry that isn't supported"),
        ("GOTO/10,0,0\nINDIRV/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,1,0)\n", 3, "direction"),
        (
            "GOTO/10,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,0,0)\n",
            3,
            "without length",
        ),
        ("GOTO/10,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,20,0,1,20,0)\n", 3, "meet"),
        ("GOTO/10,0,0\nINDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0),ON,(LINE/0,0,0,0,1,0)\n", 3, "4 numbers"),
        ("INDIRV/0,1\n", 1, "needs a direction of 3 numbers"),
    ],
)
def test_an_arc_that_does_not_fit_is_named_with_its_line(read, text, line, fault):
    with pytest.raises(ToolpathError, match=fault) as caught:
        read(text)
    assert caught.value.line == line


def test_a_rapid_arc_is_rapid_to_its_end(read):
    path = read("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nRAPID\nGOTO/0,10,0\nGOTO/0,0,0\n")
    assert set(path.kind[1:-1].tolist()) == {MoveKind.RAPID}
    assert path.kind[-1] == MoveKind.CUT


def test_arcs_against_the_moves_before_them_are_doubted(read):
    lead = "GOTO/10,-10,0\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,{}\nGOTO/0,10,0\n"
    assert "arc-direction" in [f.code for f in read(lead.format(-1)).findings]
    assert "arc-direction" not in [f.code for f in read(lead.format(1)).findings]


@pytest.mark.parametrize(("end", "sweep"), [("10,0.001,0", 0.00573), ("10,-0.001,0", 359.99427)])
def test_an_arc_that_is_nearly_closed_is_reported(read, end, sweep):
    path = read(f"GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/{end}\n")
    assert swept(path) == pytest.approx(sweep, abs=1e-4)
    (finding,) = [f for f in path.findings if f.code == "arc-nearly-closed"]
    assert finding.place.line == 3
