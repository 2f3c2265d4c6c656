"""A correct motion passes, and every check finds its own fault and no other."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.base.findings import Severity
from fiveaxis.check import CheckedInterpolation, Report, Tolerances, verify
from fiveaxis.model import (
    Axis,
    Interpolation,
    Limits,
    Machine,
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    follow,
    tool_poses,
)

TILT = (15.0, 75.0)
ROW = 100


def with_positions(motion: Motion, positions: np.ndarray) -> Motion:
    return replace(motion, positions=positions)


def shifted(motion: Motion, machine: Machine, letter: str, amount: float, rows=ROW) -> Motion:
    positions = motion.positions.copy()
    positions[rows, machine.column(letter)] += amount
    return with_positions(motion, positions)


def with_axis(machine: Machine, letter: str, **changes) -> Machine:
    axes = tuple(replace(a, **changes) if a.letter == letter else a for a in machine.axes)
    return replace(machine, axes=axes)


def errors(report: Report) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for finding in report.findings:
        if finding.severity is Severity.ERROR:
            found.setdefault(finding.code, []).append(finding.place.location)
    return found


def test_a_correct_motion_passes(good, hayashi, ring):
    report = verify(good, hayashi, ring, tilt=TILT)
    assert report.ok
    assert report.findings == ()
    assert report.counts == {}
    assert report.figures["contact_error_mm"] < 1e-12
    assert report.figures["tilt_min_deg"] == pytest.approx(30.0)
    assert report.figures["tilt_max_deg"] == pytest.approx(30.0)
    assert report.figures["limit_overrun_deg"] == 0.0


@pytest.mark.parametrize("letter", "XYZ")
def test_a_micrometre_in_one_row_is_a_contact_error_there(good, hayashi, ring, letter):
    report = verify(shifted(good, hayashi, letter, 1e-3), hayashi, ring, tilt=TILT)
    assert errors(report) == {"contact-error": [ROW]}
    assert report.findings[0].value == pytest.approx(1e-3, rel=1e-6)
    assert report.figures["contact_error_mm"] == pytest.approx(1e-3, rel=1e-6)


def test_one_location_beyond_a_limit_is_found_with_value_bound_and_unit(good, hayashi, ring):
    z = good.positions[:, hayashi.column("Z")]
    tight = with_axis(hayashi, "Z", limits=Limits(-1000.0, float(z.max()) - 2e-6))
    beyond = np.flatnonzero(z > tight.axis("Z").limits.high + 1e-6)
    report = verify(good, tight, ring, tilt=TILT)
    assert errors(report) == {"axis-limit": beyond.tolist()}
    assert "Z = " in report.findings[0].message
    assert "above the limit" in report.findings[0].message
    assert report.figures["limit_overrun_mm"] == pytest.approx(2e-6, rel=1e-3)


def test_a_rotary_overrun_is_shown_in_degrees(good, hayashi, ring):
    column = hayashi.column("A")
    low = float(good.positions[:, column].min())
    tight = with_axis(hayashi, "A", limits=Limits(low + np.radians(0.25), np.pi))
    report = verify(good, tight, ring, tilt=TILT)
    assert set(errors(report)) == {"axis-limit"}
    assert report.findings[0].value == pytest.approx(0.25, rel=1e-6)
    assert "below the limit" in report.findings[0].message
    assert report.figures["limit_overrun_deg"] == pytest.approx(0.25, rel=1e-6)


def test_rounding_at_a_limit_is_no_finding(good, hayashi, ring):
    z = good.positions[:, hayashi.column("Z")]
    tight = with_axis(hayashi, "Z", limits=Limits(-1000.0, float(z.max()) - 5e-7))
    assert verify(good, tight, ring, tilt=TILT).ok


@pytest.mark.parametrize(("tilt", "side"), [((30.001, 75.0), "below"), ((15.0, 29.999), "above")])
def test_a_tilt_outside_the_range_is_found_on_both_sides(good, hayashi, ring, tilt, side):
    report = verify(good, hayashi, ring, tilt=tilt)
    assert set(errors(report)) == {"tilt"}
    assert report.counts == {"tilt": len(ring)}
    assert f"is {side} the bound" in report.findings[0].message
    assert report.findings[0].value == pytest.approx(0.001, rel=1e-3)


def test_one_posture_turned_about_the_ball_breaks_the_tilt_alone(good, hayashi, ring):
    rotary = good.positions[:, hayashi.rotary_columns].copy()
    rotary[ROW, hayashi.rotaries.index("A")] -= np.radians(20.0)
    report = verify(follow(ring, hayashi, rotary), hayashi, ring, tilt=(15.0, 40.0))
    assert errors(report) == {"tilt": [ROW]}


def test_a_cone_is_measured_from_the_programmed_axis(hayashi, good, ring):
    tip, axis = tool_poses(hayashi, good.positions)
    path = Toolpath.from_tips(tip, axis, Tool.ball(10.0))
    assert verify(good, hayashi, path, cone=1.0).ok
    rotary = good.positions[:, hayashi.rotary_columns] + [0.0, np.radians(1.001)]
    report = verify(follow(path, hayashi, rotary), hayashi, path, cone=1.0)
    assert set(errors(report)) == {"tilt"}
    assert "programmed axis" in report.findings[0].message


def test_a_whole_turn_between_two_locations_is_a_jump(good, hayashi, ring):
    """The poses stay right at both ends, which is what makes it dangerous."""
    turned = shifted(good, hayashi, "C", 2.0 * np.pi, rows=slice(ROW, None))
    report = verify(turned, hayashi, ring, tilt=TILT)
    assert errors(report) == {"jump": [ROW]}
    assert report.findings[0].value == pytest.approx(360.0, abs=5.0)
    assert report.counts["tip-deviation"] == 1


def test_the_same_turn_in_a_link_is_allowed(good, hayashi, ring):
    kind = ring.kind.copy()
    kind[ROW] = MoveKind.LINK
    turned = shifted(good, hayashi, "C", 2.0 * np.pi, rows=slice(ROW, None))
    report = verify(turned, hayashi, replace(ring, kind=kind), tilt=TILT)
    assert report.ok
    assert report.counts == {}


def test_a_motion_cannot_exempt_itself_by_calling_a_cut_a_link(good, hayashi, ring):
    turned = shifted(good, hayashi, "C", 2.0 * np.pi, rows=slice(ROW, None))
    disguised = replace(turned, kind=np.full(len(ring), MoveKind.LINK))
    assert errors(verify(disguised, hayashi, ring, tilt=TILT)) == {"jump": [ROW]}


@pytest.mark.parametrize(("degrees", "fires"), [(44.9, False), (45.1, True)])
def test_the_jump_threshold_is_45_degrees(hayashi, degrees, fires):
    path = Toolpath.from_tips(np.zeros((2, 3)), [[0.0, 0.0, 1.0]] * 2, Tool.ball(10.0))
    motion = follow(path, hayashi, np.array([[0.0, 0.0], [np.radians(degrees), 0.0]]))
    assert ("jump" in verify(motion, hayashi, path).counts) is fires
    assert verify(motion, hayashi, path, tolerances=Tolerances(jump=1.0)).ok


def test_a_block_shorter_than_the_highest_speed_allows_is_found(good, hayashi, ring):
    limited = with_axis(hayashi, "X", max_speed=20.0)
    timed = follow(ring, limited, good.positions[:, hayashi.rotary_columns])
    assert verify(timed, limited, ring, tilt=TILT).ok
    time = timed.time.copy()
    time[ROW] = 0.99 * abs(timed.moves[ROW, hayashi.column("X")]) / 20.0
    report = verify(replace(timed, time=time), limited, ring, tilt=TILT)
    assert errors(report) == {"feed-differs": [ROW], "speed": [ROW]}
    assert "X needs" in next(f.message for f in report.findings if f.code == "speed")


def test_a_link_at_ten_times_its_feed_is_found(good, hayashi, ring):
    """A link at feed runs beside the part: what the feed check says of every move holds for it, too."""
    kind = ring.kind.copy()
    kind[ROW - 2 : ROW + 2] = MoveKind.LINK
    path, motion = replace(ring, kind=kind), replace(good, kind=kind)
    assert verify(motion, hayashi, path, tilt=TILT).ok
    time = motion.time.copy()
    time[ROW] /= 10.0
    assert errors(verify(replace(motion, time=time), hayashi, path, tilt=TILT)) == {"feed-differs": [ROW]}


def test_a_speed_at_its_limit_passes_and_a_millionth_above_does_not(good, hayashi, ring):
    steps = np.abs(np.diff(good.positions[:, hayashi.column("C")], prepend=good.positions[0, -1]))
    highest = float(steps.max())
    limited = with_axis(hayashi, "C", max_speed=highest)
    lasting = replace(good, time=np.ones(len(good)))
    report = verify(lasting, limited, ring, tilt=TILT)
    assert "speed" not in report.counts
    assert report.figures["speed_share"] == pytest.approx(1.0)
    hurried = replace(good, time=np.full(len(good), 1.0 - 3e-6))
    assert "speed" in verify(hurried, limited, ring, tilt=TILT).counts


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_found_and_no_other_check_fails(good, hayashi, ring, value):
    positions = good.positions.copy()
    positions[ROW, hayashi.column("Y")] = value
    report = verify(with_positions(good, positions), hayashi, ring, tilt=TILT)
    assert errors(report) == {"not-finite": [ROW]}
    assert report.findings[0].message.startswith("Y is ")
    json.dumps(report.as_dict(), allow_nan=False)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_an_invalid_duration_is_found(good, hayashi, ring, value):
    time = good.time.copy()
    time[ROW] = value
    report = verify(replace(good, time=time), hayashi, ring, tilt=TILT)
    assert errors(report) == {"not-finite": [ROW]}
    assert "duration" in report.findings[0].message


def test_the_deviation_of_a_rotating_block_is_the_sagitta_of_its_arc(hayashi):
    """A ball held 50 mm off the C axis while C alone turns by 10 deg and X, Y follow linearly."""
    centre = np.array([[50.0, 0.0, 5.0], [50.0, 0.0, 5.0]])
    path = Toolpath.from_tips(centre - [0.0, 0.0, 5.0], [[0.0, 0.0, 1.0]] * 2, Tool.ball(10.0))
    turn = np.radians(10.0)
    motion = follow(path, hayashi, np.array([[0.0, 0.0], [turn, 0.0]]))
    report = verify(motion, hayashi, path)
    sagitta = 50.0 * (1.0 - np.cos(turn / 2.0))
    assert report.figures["tip_deviation_mm"] == pytest.approx(sagitta, rel=1e-9)
    assert report.counts == {"tip-deviation": 1}
    assert report.findings[0].severity is Severity.NOTE
    assert report.ok
    blocks = verify(motion, hayashi, path, between="joint")
    assert blocks.findings[0].severity is Severity.ERROR
    assert not blocks.ok
    # A program that inserts blocks there is checked by itself: of the locations only the figure counts.
    inserted = verify(
        motion, hayashi, path, between=CheckedInterpolation(Interpolation.TCP, Interpolation.JOINT)
    )
    assert inserted.findings == ()
    assert inserted.figures == report.figures


def test_what_was_not_checked_is_reported(good, hayashi, ring):
    report = verify(good, hayashi, ring)
    text = " ".join(report.not_checked)
    for word in (
        "tilt",
        "gouges",
        "holder",
        "speed of X, Y, Z, A, C",
        "limits of X, Y, Z:",
        "acceleration",
    ):
        assert word in text
    assert report.figures["tilt_min_deg"] is None
    assert report.figures["gouge_depth_mm"] is None


def test_the_worst_thousand_and_the_first_are_listed_and_all_are_counted(hayashi):
    n = 1500
    path = Toolpath.from_tips(
        np.zeros((n, 3)), [[0.0, 0.0, 1.0]] * n, Tool.ball(10.0), source=np.arange(1, n + 1), name="long"
    )
    motion = follow(path, hayashi, np.zeros((n, 2)))
    slipped = shifted(motion, hayashi, "X", np.arange(n) * 1e-6 + 2e-6, rows=slice(None))
    report = verify(slipped, hayashi, path)
    assert report.counts == {"contact-error": n}
    assert errors(report)["contact-error"] == [0, *range(501, n)]
    assert report.findings[0].place.file == "long"
    assert report.findings[0].place.line == 1
    (cause,) = report.summary()
    assert (cause.count, cause.worst.place.location, cause.first.location) == (n, n - 1, 0)


def test_findings_come_errors_first_then_along_the_path(good, hayashi, ring):
    turned = shifted(good, hayashi, "C", 2.0 * np.pi, rows=slice(ROW, None))
    broken = shifted(turned, hayashi, "Z", 0.5, rows=[3, 200])
    keys = [(f.severity, f.place.location) for f in verify(broken, hayashi, ring).findings]
    order = list(Severity)
    assert keys == sorted(keys, key=lambda k: (order.index(k[0]), k[1]))
    assert {s for s, _ in keys} == {Severity.ERROR, Severity.NOTE}


def test_a_motion_of_another_length_is_refused(good, hayashi, ring):
    short = Motion(
        good.letters, good.positions[:-1], good.feed[:-1], good.time[:-1], good.kind[:-1], good.source[:-1]
    )
    with pytest.raises(ToolpathError, match="has 240 locations, the motion has 239"):
        verify(short, hayashi, ring)


def test_a_motion_of_other_axes_is_refused(good, ring):
    with pytest.raises(SettingError, match="X, Y, Z, A, C"):
        verify(good, Machine.from_code("650123"), ring)


def test_times_that_do_not_fit_the_positions_are_refused(good, hayashi, ring):
    with pytest.raises(SettingError, match=r"times \(239,\)"):
        verify(replace(good, time=good.time[1:]), hayashi, ring)


def test_the_report_is_plain_data_and_the_same_each_time(good, hayashi, ring):
    broken = shifted(good, hayashi, "Z", 0.5)
    texts = {
        json.dumps(verify(broken, hayashi, ring, tilt=TILT).as_dict(), allow_nan=False) for _ in range(2)
    }
    assert len(texts) == 1
    document = json.loads(texts.pop())
    keys = ["ok", "summary", "findings", "counts", "figures", "table", "failed", "passed", "not_checked"]
    assert list(document) == keys
    assert list(document["not_checked"]) == ["risks", "not_asked"]
    assert document["failed"] == [{"code": "contact-error", "count": 1}]
    assert not any("contact" in sentence for sentence in document["passed"])


def test_axes_without_limits_are_not_measured_against_any(good, ring):
    free = Machine.from_code("640123")
    assert all(isinstance(a, Axis) and a.limits.unlimited for a in free.axes)
    report = verify(good, free, ring, tilt=TILT)
    assert report.ok
    assert report.figures["limit_overrun_mm"] is None
