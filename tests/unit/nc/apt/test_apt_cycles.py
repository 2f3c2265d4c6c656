"""Drilling cycles of APT files."""

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import MoveKind

CUT, RAPID = MoveKind.CUT, MoveKind.RAPID


def tips(path):
    return path.tips(path.axis)


def heights(path):
    return np.round(tips(path)[:, 2], 9).tolist()


def cycle_codes(path):
    return [f.code for f in path.findings if f.code.startswith("cycle-")]


@pytest.mark.parametrize(
    ("cycle", "expected"),
    [
        # NX: offsets from the named point along the tool axis.
        ("CYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0043,MMPM,250.0000", [23, -13.0043, 23]),
        ("CYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0043,RTRCTO,AUTO,MMPM,250.0000", [23, -13.0043, 23]),
        ("CYCLE/DRILL,RAPTO,3.0000,FEDTO,-10,RTRCTO,50.0000,MANUAL,MMPM,250.0000", [23, 10, 70]),
        ("CYCLE/DRILL,RAPTO,3.0000,FEDTO,0.0000,MMPM,250.0000", [23, 20, 23]),
        ("CYCLE/BORE,RAPTO,2,FEDTO,-8,MMPM,250,DWELL,REV,3.0", [22, 12, 22]),
        # Creo: couplets of a depth and a clearance, and its fixed format.
        ("CYCLE / DRILL, DEPTH, 10.0, MMPM, 250, CLEAR, 5.0", [25, 10, 25]),
        ("CYCLE / DRILL, DEPTH, 10.0, MMPM, 250, CLEAR, 5.0, RAPTO, 2, RETURN, 12", [25, 10, 32]),
        ("CYCLE / DRILL, DEPTH, 10.0, MMPM, 250, CLEAR, 5.0, RETURN, 0", [25, 10, 25]),
        ("CYCLE / FACE, DEPTH, 10.0, MMPM, 250, CLEAR, 5.0, DWELL, 1.5", [25, 10, 25]),
        ("CYCLE / DRILL, 10, 250, MMPM, 5", [25, 10, 25]),
        # CATIA and CAMWorks: the unit before the feed.
        ("CYCLE/DRILL,   10.000000,MMPM, 250.000000,RAPTO,    1.000000,RTRCTO,  $\n100.0", [21, 10, 120]),
        ("CYCLE/DRILL, 10.0, MMPM, 250, 5.0, RAPTO, 2.0", [25, 10, 25]),
    ],
)
def test_a_hole_is_approach_feed_and_retract(read, cycle, expected):
    path = read(f"UNITS/MM\nFEDRAT/99,MMPM\nGOTO/0,0,100\n{cycle}\nGOTO/1,2,20\nCYCLE/OFF\nGOTO/1,2,100\n")
    assert heights(path) == [100, *expected, 100]
    np.testing.assert_allclose(tips(path)[1:4, :2], [[1, 2]] * 3)
    assert path.kind.tolist() == [CUT, RAPID, CUT, RAPID, CUT]
    np.testing.assert_allclose(path.feed * 60, [99, 250, 250, 250, 99])
    assert cycle_codes(path) == []


def test_holes_lie_along_the_tool_axis(read):
    path = read("CYCLE/DRILL,RAPTO,3,FEDTO,-10,MMPM,250\nGOTO/1,2,3,0.6,0,0.8\nGOTO/5,2,3\nCYCLE/OFF\n")
    point, axis = np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, 0.8])
    expected = [point + 3 * axis, point - 10 * axis, point + 3 * axis]
    np.testing.assert_allclose(tips(path)[:3], expected, atol=1e-12)
    np.testing.assert_allclose(tips(path)[3:] - tips(path)[:3], [[4, 0, 0]] * 3, atol=1e-12)


@pytest.mark.parametrize("kind", ["TAP", "REAM"])
def test_taps_and_reamers_feed_out_of_the_hole(read, kind):
    path = read(f"CYCLE/{kind},DEPTH,10,MMPM,250,CLEAR,5\nGOTO/1,2,20\n")
    assert path.kind.tolist() == [RAPID, CUT, CUT]


@pytest.mark.parametrize(
    "cycle", ["DEEP,DEPTH,10,STEP,2,MMPM,250,CLEAR,5", "DRILL,DEEP,DEPTH,10,INCR,2,MMPM,250,CLEAR,5"]
)
def test_steps_of_a_deep_hole_are_omitted_and_reported(read, cycle):
    path = read(f"CYCLE/{cycle}\nGOTO/1,2,20\n")
    assert heights(path) == [25, 10, 25]
    assert cycle_codes(path) == ["cycle-simplified"]


def test_a_cycle_without_a_feed_takes_the_one_in_force(read):
    path = read("FEDRAT/77,MMPM\nCYCLE/DRILL,DEPTH,10,CLEAR,5\nGOTO/1,2,20\n")
    np.testing.assert_allclose(path.feed * 60, 77)


def test_a_feed_per_revolution_takes_the_spindle_into_account(read):
    path = read("SPINDL/500,RPM,CLW\nCYCLE/TAP,DEPTH,10,MMPR,1.25,CLEAR,5\nGOTO/1,2,20\n")
    np.testing.assert_allclose(path.feed * 60, 625)


def test_what_a_cycle_leaves_open_is_reported(read):
    path = read("CYCLE/DRILL,FEDTO,10,MMPM,250\nGOTO/1,2,20\n")
    assert heights(path) == [20, 10, 20]
    assert cycle_codes(path) == ["cycle-depth", "cycle-clearance"]


def test_a_cycle_may_be_switched_on_again(read):
    text = (
        "CYCLE/DRILL,DEPTH,10,MMPM,250,CLEAR,5\nGOTO/1,2,20\nCYCLE/OFF\nGOTO/1,2,50\nCYCLE/ON\nGOTO/3,2,20\n"
    )
    assert heights(read(text)) == [25, 10, 25, 50, 25, 10, 25]


def test_inches_apply_to_depths(read):
    path = read("UNITS/INCHES\nCYCLE/DRILL,DEPTH,1,IPM,10,CLEAR,.5\nGOTO/0,0,2\n")
    assert heights(path) == [63.5, 25.4, 63.5]
    np.testing.assert_allclose(path.feed * 60, 254)


@pytest.mark.parametrize(
    ("text", "line", "fault"),
    [
        ("CYCLE/MILL,5\n", 1, "'CYCLE/MILL,5' is a cycle that isn't supported; known: DRILL, DEEP"),
        ("CYCLE/ON\n", 1, "is a cycle that isn't supported"),
        ("CYCLE\n", 1, "is a cycle that isn't supported"),
        ("CYCLE/BORE,BACK,RAPTO,3,FEDTO,-5\n", 1, "has the word 'BACK', which isn't known"),
        ("CYCLE/DRILL,CLEAR,5,MMPM,100\n", 1, "has no depth"),
        ("CYCLE/DRILL,DEPTH,MMPM,100\n", 1, "has no number after DEPTH"),
        ("CYCLE/DRILL,DEPTH\n", 1, "has no number after DEPTH"),
        ("CYCLE/DRILL,5,7\n", 1, "has numbers of unknown meaning: 5, 7; name them"),
        ("CYCLE/DEEP,10,250,MMPM,5,2\n", 1, "has numbers of unknown meaning: 10, 5, 2"),
        ("CYCLE/TAP,10,250,MMPM,1.25,5\n", 1, "has numbers of unknown meaning"),
        ("CYCLE/DRILL,DEPTH,inf\n", 1, "has no depth"),
        ("CYCLE/DRILL,DEPTH,5,CLEAR,nan\nGOTO/1,2,3\n", 1, "has a height that isn't finite"),
        ("CYCLE/DRILL,DEPTH,5,MMPM,0\nGOTO/1,2,3\n", 1, "feed = 0 mm/min"),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1\nCYCLE/DRILL,DEPTH,5\nGOTO/0,1,0\n", 3, "can't follow an arc"),
        ("GOTO/1,0,0\nCYCLE/DRILL,DEPTH,5\nCIRCLE/0,0,0,0,0,1\nGOTO/0,1,0\n", 3, "can't follow CYCLE"),
        ("GOTO/1,0,0\nCYCLE/DRILL,DEPTH,5\nGODLTA/0,0,5\n", 3, "can't end an arc or follow CYCLE"),
    ],
)
def test_a_cycle_that_is_not_understood_is_refused(read, text, line, fault):
    with pytest.raises(ToolpathError, match=fault) as caught:
        read(text)
    assert caught.value.line == line


def test_a_cycle_that_is_off_moves_nothing(read):
    path = read("CYCLE/OFF\nGOTO/1,2,3\nCYCLE/NOMORE\n")
    assert len(path) == 1
