"""Changes of speed against the highest accelerations."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.findings import Severity
from fiveaxis.check import verify
from fiveaxis.model import MoveKind, Tool, Toolpath, follow, peak_rates

N = 5


def with_axis(machine, letter: str, **changes):
    axes = tuple(replace(a, **changes) if a.letter == letter else a for a in machine.axes)
    return replace(machine, axes=axes)


@pytest.fixture
def path() -> Toolpath:
    """Tips along x, 1 mm apart; at 60 mm/min each move takes a second."""
    tip = np.stack([np.arange(N, dtype=float), np.zeros(N), np.zeros(N)], axis=1)
    return Toolpath.from_tips(tip, np.tile([0.0, 0.0, 1.0], (N, 1)), Tool.ball(10.0), feed_mm_min=60.0)


def turned(path: Toolpath, machine, degrees):
    return follow(path, machine, np.radians(np.stack([degrees, np.zeros(N)], axis=1)))


def test_a_change_of_rotary_speed_beyond_the_highest_acceleration_is_a_warning(hayashi, path):
    """C turns by 0, 2, 2 and 0 deg: 2 deg/s² where it starts and where it stops."""
    degrees = [0, 0, 2, 4, 4]
    for bound, found in ((2.0, []), (1.9, [1, 3])):
        machine = with_axis(hayashi, "C", max_acceleration=np.radians(bound))
        report = verify(turned(path, machine, degrees), machine, path)
        rows = [f.place.location for f in report.findings if f.code == "rotary-acceleration"]
        assert rows == found
        assert report.ok
        assert report.figures["rotary_acceleration_share"] == pytest.approx(2.0 / bound)
    warning = report.findings[0]
    assert warning.severity is Severity.WARNING
    assert "C accelerates by 2 deg/s²" in warning.message
    assert "at most 1.9 deg/s²" in warning.message


def test_the_figure_equals_the_peak_rates(hayashi, path):
    machine = with_axis(hayashi, "C", max_acceleration=1.0)
    motion = turned(path, machine, [0, 1, 5, 4, 9])
    peak = peak_rates(machine, motion)["C"].acceleration
    assert verify(motion, machine, path).figures["rotary_acceleration_share"] == pytest.approx(peak)


def test_a_corner_of_a_linear_axis_has_a_code_of_its_own(hayashi, path):
    machine = with_axis(hayashi, "X", max_acceleration=1.5)
    pivot = path.pivot.copy()
    pivot[:, 0] = [0, 1, 2, 1, 0]
    back = replace(path, pivot=pivot)
    report = verify(turned(back, machine, [0] * N), machine, back)
    assert report.counts == {"linear-acceleration": 1}
    assert report.findings[0].place.location == 2
    assert report.figures["linear_acceleration_share"] == pytest.approx(2.0 / 1.5)
    assert report.ok


def test_links_may_change_their_speed_without_bound(hayashi, path):
    machine = with_axis(hayashi, "C", max_acceleration=1e-6)
    linked = replace(path, kind=np.array([0, 0, MoveKind.LINK, 0, MoveKind.LINK]))
    report = verify(turned(linked, machine, [0, 0, 2, 2, 2]), machine, linked)
    assert "rotary-acceleration" not in report.counts


def test_an_axis_without_a_highest_acceleration_is_reported_as_unchecked(hayashi, path):
    report = verify(turned(path, hayashi, [0] * N), hayashi, path)
    assert report.figures["rotary_acceleration_share"] is None
    text = " ".join(report.not_checked)
    assert "acceleration of X, Y, Z: the machine states no maximum" in text
    assert "acceleration of A, C: the machine states no maximum" in text


def test_an_invalid_duration_hides_only_its_own_changes(hayashi, path):
    machine = with_axis(hayashi, "C", max_acceleration=np.radians(1.0))
    motion = turned(path, machine, [0, 0, 0, 3, 3])
    time = motion.time.copy()
    time[1] = np.nan
    report = verify(replace(motion, time=time), machine, path)
    assert report.counts["not-finite"] == 1
    assert report.counts["rotary-acceleration"] == 2
