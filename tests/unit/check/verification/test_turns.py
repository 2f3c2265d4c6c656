"""Held axes, turns in a block and per mm, and turns near the singular direction."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Severity
from fiveaxis.check import PathConstraints, Tolerances, verify, verify_program
from fiveaxis.check.verification.check_context import make_context
from fiveaxis.check.verification.checks import check_tilt, check_tilt_between
from fiveaxis.check.verification.turns import check_block_turns
from fiveaxis.model import Constraints, MoveKind, Tool, Toolpath, filled, follow, tool_axes
from fiveaxis.nc import write_motion

UP = [0.0, 0.0, 1.0]


def line(n: int, axis=UP, spacing: float = 1.0, **more) -> Toolpath:
    """Tips along x, a millimetre apart, the tool as programmed."""
    tip = np.stack([spacing * np.arange(n), np.zeros(n), np.zeros(n)], axis=1)
    return Toolpath.from_tips(tip, np.broadcast_to(axis, (n, 3)), Tool.ball(10.0), **more)


def turning(path: Toolpath, machine, c=0.0, a=0.0):
    """Follow a path with angles of C and A in degrees, each one number or one per location."""
    angles = np.stack(np.broadcast_arrays(c, a, np.zeros(len(path)))[:2], axis=1)
    return follow(path, machine, np.radians(angles))


def rows_of(report, code: str) -> list[int]:
    return [f.place.location for f in report.findings if f.code == code]


def test_an_axis_off_its_held_angle_is_an_error_there_in_links_too(hayashi):
    path = line(5, kind=[0, 0, MoveKind.LINK, 0, 0])
    motion = turning(path, hayashi, c=[30, 30, 31, 30, 30 + 2e-6])
    report = verify(motion, hayashi, path, hold={"C": 30.0})
    assert rows_of(report, "held-axis") == [2, 4]
    assert not report.ok
    assert report.figures["held_axis_off_deg"] == pytest.approx(1.0)
    assert "C = 31 deg, but it is to be held at 30 deg" in report.findings[0].message
    kept = verify(turning(path, hayashi, c=30.0), hayashi, path, hold={"C": 30.0})
    assert [any("C at 30 deg" in text for text in r.passed) for r in (report, kept)] == [False, True]


def test_a_whole_turn_is_not_the_held_angle(hayashi):
    path = line(2)
    motion = turning(path, hayashi, c=390.0)
    assert verify(motion, hayashi, path, hold={"C": 390.0}).ok
    assert verify(motion, hayashi, path, hold={"C": 30.0}).counts == {"held-axis": 2}


@pytest.mark.parametrize(("bound", "fires"), [(10.0, False), (9.999, True)])
def test_the_turn_of_a_block_is_checked_against_max_turn(hayashi, bound, fires):
    path = line(4)
    report = verify(turning(path, hayashi, c=[0, 10, 10, 10]), hayashi, path, max_turn=bound)
    assert rows_of(report, "jump") == ([1] if fires else [])
    assert report.ok is not fires
    assert report.figures["rotary_step_deg"] == pytest.approx(10.0)


def test_a_cut_may_turn_as_far_as_the_program_turns_the_tool_and_no_farther(hayashi):
    leant = np.array([UP, UP, [0.0, -np.sin(np.radians(50.0)), np.cos(np.radians(50.0))]])
    path = line(3, axis=leant)
    for far, fires in ((50.0, False), (50.1, True)):
        report = verify(turning(path, hayashi, a=[0, 0, far]), hayashi, path, max_turn=15.0)
        assert rows_of(report, "jump") == ([2] if fires else [])
        assert any("more only where the program" in sentence for sentence in report.passed) is not fires


@pytest.mark.parametrize("bounded", [False, True])
def test_a_move_may_turn_as_far_as_its_blocks_where_the_lean_is_checked(hayashi, bounded):
    """Without bounds on the lean nobody knows where a tool goes that turns so far in a cut."""
    path = replace(line(4), numbers=np.array([0, 1, 1, 1]))
    motion = turning(path, hayashi, c=[0, 30, 60, 90])
    cone = 5.0 if bounded else None
    assert rows_of(verify(motion, hayashi, path, cone=cone), "jump") == ([] if bounded else [1])
    assert rows_of(verify(motion, hayashi, path, cone=cone, max_turn=40.0), "jump") == [1]


def test_parts_of_a_move_may_turn_as_far_as_the_whole(hayashi):
    """Inserted locations have no tool axis."""
    leant = [0.0, -np.sin(np.radians(50.0)), np.cos(np.radians(50.0))]
    path = line(5, axis=np.array([UP, UP, UP, leant, leant]))
    axis = path.axis.copy()
    axis[2] = np.nan
    path = replace(path, axis=axis)
    report = verify(turning(path, hayashi, a=[0, 0, 25, 50, 75]), hayashi, path, max_turn=15.0)
    assert rows_of(report, "jump") == [4]


def test_a_turn_per_mm_is_measured_along_cuts(hayashi):
    path = line(5, spacing=2.0, kind=[0, 0, 0, MoveKind.LINK, 0])
    motion = turning(path, hayashi, c=[0, 6, 12.1, 40, 40])
    report = verify(motion, hayashi, path, turn_rate=3.0)
    assert rows_of(report, "turn-rate") == [2]
    assert not report.ok
    assert "6.1 deg over 2 mm (at most 3 deg/mm, 6 deg here)" in report.findings[0].message
    assert report.figures["turn_rate_deg_mm"] == pytest.approx(3.05)


def test_coincident_locations_may_turn_by_a_hundredth_of_a_degree(hayashi):
    path = line(2, spacing=0.0)
    for far, fires in ((0.01, False), (0.011, True)):
        report = verify(turning(path, hayashi, c=[0, far]), hayashi, path, turn_rate=1.0)
        assert ("turn-rate" in report.counts) is fires
    assert report.figures["turn_rate_deg_mm"] is None


def test_a_turn_within_the_singular_cone_is_a_warning(hayashi):
    path = line(6, kind=[0, 0, 0, 0, MoveKind.LINK, 0])
    motion = turning(path, hayashi, c=[0, 3, 6, 9, 12, 12], a=[-20, -8, -4, 8, -4, -4])
    report = verify(motion, hayashi, path, singular_cone=5.0)
    # Into the cone, and through it: the move to 3 passes it halfway. Turns outside or in links are free.
    (found,) = [f for f in report.findings if f.code == "singular-turn"]
    assert (found.severity, found.place.location, found.value) == (Severity.WARNING, 2, pytest.approx(6.0))
    assert "in 2 cuts of a pass, at most 3 deg in one and the last at location 3" in found.message
    assert "(cone 5 deg)" in found.message
    assert report.ok
    assert report.figures["singular_turn_deg"] == pytest.approx(3.0)
    assert "singular-turn" not in verify(motion, hayashi, path, singular_cone=5.0, singular_rate=3.0).counts


def test_a_cone_wider_than_the_path_leaves_is_told_once_a_pass_with_the_one_that_it_keeps(hayashi):
    kind = [0] * 40 + [MoveKind.LINK] + [0] * 39
    path = line(80, kind=kind)
    motion = turning(path, hayashi, c=np.arange(80.0), a=np.full(80, -20.05))
    report = verify(motion, hayashi, path, singular_cone=30.0)
    assert rows_of(report, "singular-turn") == [1, 41]
    assert report.counts["singular-turn"] == 2
    assert all("narrow the cone to 20 deg" in f.message for f in report.findings)
    assert "singular-turn" not in verify(motion, hayashi, path, singular_cone=20.0).counts


def test_the_singular_direction_counts_in_both_senses(hayashi):
    path = line(2)
    motion = turning(path, hayashi, c=[0, 3], a=[-178, -178])
    assert rows_of(verify(motion, hayashi, path, singular_cone=5.0), "singular-turn") == [1]


def test_constraints_not_given_are_reported_as_unchecked(hayashi):
    path = line(2)
    report = verify(turning(path, hayashi), hayashi, path)
    text = " ".join(report.not_checked)
    for words in ("held axes", "per mm", "singular direction"):
        assert words in text
    for figure in ("held_axis_off_deg", "turn_rate_deg_mm", "singular_turn_deg"):
        assert report.figures[figure] is None


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"hold": {"B": 1.0}}, "B can't be held: the rotary axes of .* are C, A"),
        ({"max_turn": 0.0}, "max_turn = 0 deg is out of range; give more than 0 deg"),
        ({"turn_rate": -1.0}, "turn_rate = -1 deg/mm is out of range; give more than 0 deg/mm"),
        ({"turn_rate": float("nan")}, "turn_rate = nan deg/mm is out of range"),
        ({"singular_cone": 90.0}, "singular_cone = 90 deg is out of range; give less than 90 deg"),
        (
            {"singular_cone": 5.0, "singular_rate": -1.0},
            "singular_rate = -1 deg/mm is out of range; give 0 deg/mm or more",
        ),
        ({"singular_rate": 1.0}, "belongs to a singular cone"),
    ],
)
def test_an_invalid_bound_is_refused(hayashi, bounds, message):
    path = line(2)
    with pytest.raises(SettingError, match=message):
        verify(turning(path, hayashi), hayashi, path, **bounds)


@pytest.mark.parametrize(("kind", "fires"), [(MoveKind.CUT, True), (MoveKind.LINK, False)])
def test_turns_of_one_line_add_up_unless_a_link_parts_its_cuts(hayashi, kind, fires):
    path = line(4, kind=[0, 0, kind, 0], source=[1, 2, 2, 2])
    given = PathConstraints.of(path, hayashi, Constraints.of_degrees(max_turn=15.0))
    motion = turning(path, hayashi, c=[0, 10, 10, 20])
    found = check_block_turns(make_context(motion, hayashi, path, given, Tolerances()), None)
    assert (len(found.rows) > 0) is fires


@pytest.mark.parametrize("row", [1, 2])
def test_a_lean_may_be_off_by_more_where_no_posture_was_chosen(hayashi, row):
    path = line(4)
    given = PathConstraints.of(path, hayashi, Constraints.of_degrees(cone=10.0))
    given = replace(given, passed=np.arange(4) == row)
    motion = turning(path, hayashi, a=[0, 10.5, 0, 0])
    context = make_context(motion, hayashi, path, given, Tolerances(lean_between=np.radians(1.0)))
    assert check_tilt(context).rows.tolist() == ([] if row == 1 else [1])


@pytest.mark.parametrize(("swing", "found"), [(20.0, True), (-20.0, False)])
def test_a_lean_out_of_bounds_within_one_move_is_found_there(hayashi, swing, found):
    """The tool stands still, and the surface swings past its axis: right at both ends."""
    lean = np.radians([20.0, -swing])
    normal = np.stack([np.sin(lean), np.zeros(2), np.cos(lean)], axis=1)
    path = Toolpath.from_contacts(np.array([[0.0, 0, 0], [30.0, 0, 0]]), normal, Tool.ball(10.0))
    given = PathConstraints.of(path, hayashi, Constraints.of_degrees(tilt=(15.0, 70.0)))
    context = make_context(turning(path, hayashi), hayashi, path, given, Tolerances())
    assert not len(check_tilt(context).rows)
    result = check_tilt_between(context)
    assert result.rows.tolist() == ([1] if found else [])
    if found:
        assert result.values[0] == pytest.approx(15.0, abs=0.01)
        assert "below the bound 15 deg" in result.message(0)


@pytest.mark.parametrize("tool", [Tool.ball(10.0), Tool.bull(12.0, 3.0)], ids=str)
@pytest.mark.parametrize("late", [False, True])
def test_within_a_move_a_program_is_where_its_course_is_however_its_blocks_are_spaced(
    hayashi, tmp_path, tool, late
):
    """The tool turns with the surface, which is 60 deg steeper at the end, or only after half of the move."""
    rises = np.radians([-10.0, 50.0])
    normal = np.stack([np.sin(rises), np.zeros(2), np.cos(rises)], axis=1)
    path = Toolpath.from_contacts(np.array([[0.0, 0, 0], [30.0, 0, 0]]), normal, tool)
    share = np.concatenate([np.linspace(0.0, 0.75, 16), np.linspace(0.75, 1.0, 150)[1:]])
    turned = np.maximum(2.0 * share - 1.0, 0.0) if late else share
    angles = np.radians(np.stack([np.full(len(share), -90.0), -10.0 - 60.0 * turned], axis=1))
    axes = tool_axes(hayashi, angles[[0, -1]])
    blocks = follow(filled(path, share, axes), hayashi, angles)
    file = write_motion(blocks, tmp_path / "motion.csv", hayashi)
    report = verify_program(file, hayashi, toolpath=path, tilt=(12.0, 28.0))
    assert {f.code for f in report.findings if f.severity is Severity.ERROR} - {"jump"} == (
        {"tilt"} if late else set()
    )
