"""The motions shown, and what is read off them."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base import angle_between
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import Against
from fiveaxis.job.posting import make_of_motion
from fiveaxis.model import Constraints, tool_poses
from fiveaxis.nc import ProgramOptions
from fiveaxis.show.viewer.moves import NO_LINE, choose_sides, read_off


@pytest.fixture(scope="module")
def program(solution):
    against = Against(toolpath=solution.toolpath, constraints=Constraints.of_degrees(tilt=(15, 75)))
    return make_of_motion(solution.motion, solution.machine, ProgramOptions.of(), against)


def test_without_a_program_the_locations_are_shown(solution):
    result, normal = choose_sides(solution)
    assert (result.name, normal.name) == ("optimised", "normal")
    np.testing.assert_array_equal(result.place, np.arange(len(solution.motion)))
    assert (result.line == NO_LINE).all()


def test_the_programs_moves_are_shown_with_their_blocks_and_places(solution, program):
    result = choose_sides(solution, program)[0]
    moves = program.motion
    np.testing.assert_array_equal(result.motion.positions, moves.motion.positions)
    on_path = slice(moves.first, moves.last + 1)
    # A row of the path is at the location that its posture is of.
    place = result.place[on_path]
    np.testing.assert_array_equal(place, np.unique(place))
    given = np.flatnonzero(place == np.round(place))
    np.testing.assert_allclose(
        moves.motion.positions[on_path][given], solution.motion.positions[place[given].astype(int)], atol=1e-9
    )
    for row in (moves.first, moves.first + 5, moves.last):
        text = program.text.lines[result.line[row] - 1]
        assert program.text.rows[result.line[row] - 1] == row, text


def test_starts_and_reversals_are_those_that_the_report_counts_after_the_approach(solution, program):
    result, normal = choose_sides(solution, program)
    counted, begin = solution.energy.steadiness, result.clock[program.motion.first]
    assert (result.steadiness.starts, result.steadiness.reversals) == (counted.starts, counted.reversals)
    np.testing.assert_allclose(result.steadiness.time, begin + counted.time)
    assert result.steadiness.time[-1] <= result.clock[-1]
    assert result.steadiness.reverses.any()
    assert normal.steadiness is solution.baselines["normal"].steadiness


def test_feed_lean_and_power_are_those_of_the_motion(solution):
    side = choose_sides(solution)[0]
    read = read_off(side, solution.machine)
    motion, path = solution.motion, solution.toolpath
    cuts = np.flatnonzero(motion.cutting & (motion.time > 0.0))
    np.testing.assert_allclose(read["programmed"][cuts], 60.0 * path.feed[cuts])
    np.testing.assert_allclose(read["actual"][cuts], 60.0 * path.lengths[cuts] / motion.time[cuts], rtol=1e-9)
    _, axis = tool_poses(solution.machine, motion.positions)
    np.testing.assert_allclose(read["lean"], np.degrees(angle_between(path.normal, axis)), atol=1e-9)
    assert (read["powers"] * motion.time[:, None]).sum() == pytest.approx(solution.energy.total)


def test_a_finding_is_where_its_location_is_reached(solution, program):
    result = choose_sides(solution, program)[0]
    row = result.row_of(Finding(Severity.ERROR, "tilt", "said", Place(location=60)))
    assert result.place[row - 1] < 60.0 <= result.place[row]
    assert result.row_of(Finding(Severity.NOTE, "code", "said")) is None


def test_a_baseline_with_locations_of_its_own_follows_those(solution):
    rows = np.concatenate([[0, 1], np.arange(len(solution.toolpath))])
    baseline = solution.compared["normal"]
    longer = replace(baseline, motion=baseline.motion.at(rows), toolpath=solution.toolpath.at(rows))
    side = choose_sides(replace(solution, compared={"normal": longer}))[1]
    assert len(side.motion) == len(side.toolpath) == len(rows)
    assert np.isfinite(read_off(side, solution.machine)["lean"]).any()


def test_a_very_long_motion_keeps_its_time_and_its_ends(solution, monkeypatch):
    monkeypatch.setattr("fiveaxis.show.viewer.moves.MOST_ROWS", 50)
    side = choose_sides(solution)[0]
    assert len(side.motion) <= 50
    assert side.motion.time.sum() == pytest.approx(solution.motion.time.sum())
    np.testing.assert_array_equal(side.motion.positions[[0, -1]], solution.motion.positions[[0, -1]])
    assert side.steadiness is solution.energy.steadiness
