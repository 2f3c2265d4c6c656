"""Bounds at locations inserted between those of a path."""

import numpy as np
import pytest

from fiveaxis.check import CheckedInterpolation, PathConstraints, Report, Surroundings, Tolerances
from fiveaxis.check.verification.check_context import make_context
from fiveaxis.check.verification.verdict import Examination, examine
from fiveaxis.model import Constraints, Interpolation, Machine, Motion, Tool, Toolpath, follow
from fiveaxis.model.motion.filling import fill_in


def examined(
    motion: Motion, machine: Machine, path: Toolpath, constraints: PathConstraints, **words
) -> Report:
    """The report on the locations of a path."""
    context = make_context(motion, machine, path, constraints, Tolerances(jump=2.0))
    return examine(
        Examination(
            context, Surroundings(), CheckedInterpolation(Interpolation.TCP, Interpolation.JOINT), **words
        )
    )


def bent(n: int = 3, step: float = 20.0) -> Toolpath:
    """A cut whose normal turns by `step` degrees from one location to the next."""
    angle = np.radians(step * np.arange(n))
    normal = np.stack([np.zeros(n), -np.sin(angle), np.cos(angle)], axis=1)
    contact = np.stack([30.0 + np.arange(n), -40.0 * np.sin(angle), 40.0 * np.cos(angle)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6.0))


def angles_of(constraints: PathConstraints) -> list[float]:
    reference = constraints.leaning.reference
    return np.degrees(np.arctan2(-reference[:, 1], reference[:, 2])).tolist()


def test_the_reference_of_a_bound_turns_uniformly_between_two_locations(hayashi):
    constraints = PathConstraints.of(bent(), hayashi, Constraints.of_degrees(tilt=(10.0, 60.0)))
    found = constraints.between(np.array([0.0, 0.5, 1.0, 1.25, 2.0]))
    assert angles_of(found) == pytest.approx([0.0, 10.0, 20.0, 25.0, 40.0], abs=0.2)
    assert (found.leaning.low, found.leaning.high) == (constraints.leaning.low, constraints.leaning.high)


def test_further_bounds_are_interpolated_too(hayashi):
    constraints = PathConstraints.of(
        bent(), hayashi, Constraints.of_degrees(lead=(-10.0, 20.0), lean=(-5.0, 5.0))
    )
    found = constraints.between(np.array([0.0, 0.5, 1.0]))
    assert len(found.leaning.all) == len(constraints.leaning.all) == 5
    assert all(b.reference.shape == (3, 3) for b in found.leaning.all)


def test_within_a_link_there_is_no_bound(hayashi):
    path = bent().with_links(np.array([False, True, False]))
    found = PathConstraints.of(path, hayashi, Constraints.of_degrees(tilt=(10.0, 60.0))).between(
        np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    )
    assert np.isfinite(found.leaning.reference).all(axis=1).tolist() == [True, False, False, False, True]


def test_a_lean_out_of_bounds_only_between_locations_is_found(hayashi):
    """A swings from one side of the normal to the other: right at both ends, upright in the middle."""
    path = bent(2, step=0.0)
    rotary = np.radians([[0.0, -30.0], [0.0, 30.0]])
    filled, motion, row = fill_in(path, hayashi, rotary)
    constraints = PathConstraints.of(path, hayashi, Constraints.of_degrees(tilt=(20.0, 40.0)))
    report = examined(motion, hayashi, filled, constraints.between(row))
    assert set(report.counts) == {"tilt"}
    assert report.figures["tilt_min_deg"] < 5.0
    assert all("put locations closer together" in f.message for f in report.findings)
    assert examined(follow(path, hayashi, rotary), hayashi, path, constraints).ok


def test_rows_of_a_filled_path_lie_among_the_given_ones(hayashi):
    path = bent()
    rotary = np.radians([[0.0, -20.0], [0.3, -40.0], [0.5, -50.0]])
    filled, motion, row = fill_in(path, hayashi, rotary)
    assert len(filled) == len(motion) == len(row) > len(path)
    assert (np.diff(row) > 0.0).all()
    given = np.isin(row, np.arange(3.0))
    np.testing.assert_array_equal(filled.pivot[given], path.pivot)
    angles = motion.positions[:, hayashi.rotary_columns]
    expected = np.stack([np.interp(row, np.arange(3.0), a) for a in rotary.T], axis=1)
    np.testing.assert_allclose(angles, expected, atol=1e-12)


def test_accelerations_of_a_divided_path_are_left_out(hayashi):
    path = bent()
    motion = follow(path, hayashi, np.radians([[0.0, -20.0], [5.0, -40.0], [9.0, -50.0]]))
    report = examined(motion, hayashi, path, PathConstraints(), accelerations=False)
    assert "rotary_acceleration_share" not in report.figures
