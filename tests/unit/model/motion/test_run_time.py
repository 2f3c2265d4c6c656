"""The time a control takes: LinuxCNC's stops between blocks, blends, and controls with unknown behaviour."""

from dataclasses import replace

import numpy as np
import pytest
from support.trapezoid_times import rest_times

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Motion, block_ends, linear_positions, load_machine, predicted_time, time_motion
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, find_dialect, read_program

TRUNNION = load_machine("linuxcnc-xyzac-trt")
LINUXCNC = DIALECTS["linuxcnc"]
CYCLE = 1e-3


def motion_of(rows, feed=10.0, turn_time=0.0):
    positions = np.zeros((len(rows), 5))
    positions[:, : np.shape(rows)[1]] = rows
    length = np.linalg.norm(np.diff(positions[:, :3], axis=0, prepend=positions[:1, :3]), axis=1)
    time = np.maximum(length / feed, turn_time)
    time[0] = 0.0
    n = len(positions)
    return Motion("XYZAC", positions, np.full(n, feed), time, np.zeros(n, int), np.arange(n))


def arc(n, turn, radius=20.0):
    angle = np.linspace(0.0, 1.0, n) * turn
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def test_blocks_that_turn_rotary_axes_go_from_rest_to_rest_in_whole_cycles():
    rows = np.column_stack([np.linspace([0, 0, 0], [20, 10, 5], 41), np.linspace([0, 0], [0.3, 0.5], 41)])
    motion = motion_of(rows)
    predicted = predicted_time(motion, TRUNNION, LINUXCNC)
    rest = rest_times(motion, TRUNNION)
    assert predicted.basis == "accelerations"
    assert (predicted.times >= rest - 1e-9).all()
    assert (predicted.times < rest + CYCLE).all()
    np.testing.assert_allclose(predicted.times / CYCLE, np.round(predicted.times / CYCLE), atol=1e-6)


def test_a_fine_curve_without_rotary_axes_is_passed_without_rests():
    """Directions that differ by 0.8 mrad: a jump of 0.008 mm/s in 1 ms is 8 mm/s², not 30.

    It speeds up along Y with 300 mm/s², and brakes with 300 mm/s² of X, sin 0.8 of the distance; 0.03 of the
    accelerations are kept for the jumps.
    """
    fine = motion_of(arc(1001, 0.8))
    ramps = 10.0 / (0.97 * 300.0) * (1.0 + np.sin(0.8)) / 2.0
    assert predicted_time(fine, TRUNNION, LINUXCNC).total == pytest.approx(1.6 + ramps, abs=3 * CYCLE)


def test_a_coarse_curve_rests_at_every_corner():
    """A tenth of the accelerations is kept for the corners, by a control that then rests at them."""
    coarse = motion_of(arc(41, 0.8))
    axes = tuple(replace(axis, max_acceleration=0.9 * axis.max_acceleration) for axis in TRUNNION.axes)
    rest = rest_times(coarse, replace(TRUNNION, axes=axes)).sum()
    assert predicted_time(coarse, TRUNNION, LINUXCNC).total == pytest.approx(rest, abs=41 * CYCLE)
    assert rest > 1.5 * coarse.time.sum()


def test_a_rotary_axis_that_begins_to_turn_is_a_rest():
    rows = np.zeros((3, 5))
    rows[:, 0], rows[2, 4] = [0.0, 10.0, 20.0], 0.1
    motion = motion_of(rows)
    assert predicted_time(motion, TRUNNION, LINUXCNC).total == pytest.approx(
        2.0 * (1.0 + 10.0 / 300.0), abs=2 * CYCLE
    )


def test_under_tcp_control_the_path_of_the_tip_counts_block_by_block(tmp_path):
    """A quarter turn of C about a tip at rest, 30 mm from the axis: X and Y follow."""
    turn = np.array([[0.0, 0.0], [0.0, np.pi / 2.0]])
    rows = linear_positions(TRUNNION, np.tile([30.0, 0.0, 0.0], (2, 1)), turn)
    motion = replace(motion_of(rows), time=np.array([0.0, 4.0]))
    stays = ProgramSettings(way_out=False)
    program = compose_program(motion, machine=TRUNNION, coordinates="tip", settings=stays)
    file = tmp_path / "turn.ngc"
    file.write_text(program.text)
    read = read_program(file, TRUNNION)
    assert len(read) > 5
    predicted = predicted_time(read, TRUNNION, LINUXCNC, "tip")
    assert len(predicted.times) == len(read)
    turning = predicted.times[read.source == read.source[-1]].sum()
    assert turning == pytest.approx(4.0 + np.radians(22.5) / np.radians(300.0), abs=2 * CYCLE)


def test_without_accelerations_the_programmed_time_is_used_with_the_reason(hayashi):
    motion = motion_of(arc(41, 0.8))
    predicted = predicted_time(motion, hayashi, LINUXCNC)
    assert predicted.basis == "programmed"
    assert predicted.total == motion.time.sum()
    assert "max_acceleration of X, Y, Z, A, C" in predicted.missing


def test_a_control_with_unknown_corner_behaviour_is_assumed_to_pass_them_within_the_tolerance():
    motion = motion_of(arc(41, 0.8))
    predicted = predicted_time(motion, TRUNNION, DIALECTS["haas"])
    assert predicted.basis == "accelerations"
    assert "0.005 mm, since how control 'haas'" in predicted.assumed
    law = time_motion(motion, TRUNNION, corners=0.005)
    np.testing.assert_allclose(predicted.times, law.motion.time)
    assert predicted.total == predicted_time(motion, TRUNNION).total


def test_times_are_lower_bounds_where_the_control_limits_a_jerk_that_the_machine_does_not_state():
    motion = motion_of(arc(41, 0.8))
    lower = predicted_time(motion, TRUNNION, DIALECTS["sinumerik"])
    assert "limits jerk (SOFT" in lower.assumed
    assert lower.assumed.endswith("no max_jerk of X, Y, Z, A, C: times are lower bounds")
    stated = replace(
        TRUNNION, axes=tuple(replace(a, max_jerk=10.0 * a.max_acceleration) for a in TRUNNION.axes)
    )
    whole = predicted_time(motion, stated, DIALECTS["sinumerik"])
    assert "jerk" not in whole.assumed
    assert whole.total > lower.total
    assert any(cause.endswith("jerk") for cause in whole.limiting.by_cause)
    assert not DIALECTS["linuxcnc"].jerk


def test_the_accelerations_that_are_known_count_where_others_are_not():
    """X and Y speed up as on the whole machine; what is unknown is said. LinuxCNC's planner needs all."""
    axes = (
        replace(a, max_acceleration=None if a.letter in "AC" else a.max_acceleration) for a in TRUNNION.axes
    )
    partly, motion = replace(TRUNNION, axes=tuple(axes)), motion_of(arc(41, 0.8))
    predicted = predicted_time(motion, partly)
    assert predicted.total == predicted_time(motion, TRUNNION).total > motion.time.sum()
    assert "no max_acceleration of A, C: their speed changes at once" in predicted.assumed
    assert predicted_time(motion, partly, LINUXCNC).basis == "programmed"


def test_a_custom_table_states_the_corner_tolerance(tmp_path):
    table = tmp_path / "mine.toml"
    table.write_text('based_on = "haas"\ncorners = 0.05\n')
    motion = motion_of(arc(41, 0.8))
    law = time_motion(motion, TRUNNION, corners=0.05)
    np.testing.assert_allclose(predicted_time(motion, TRUNNION, find_dialect(table)).times, law.motion.time)


def test_a_custom_table_states_that_corners_are_blended(tmp_path):
    table = tmp_path / "mine.toml"
    table.write_text('based_on = "linuxcnc"\ncorners = "blended"\nblend = 0.01\n')
    motion = motion_of(arc(9, 0.8))
    blended = predicted_time(motion, TRUNNION, find_dialect(table))
    assert blended.basis == "accelerations"
    assert motion.time.sum() < blended.total < predicted_time(motion, TRUNNION, LINUXCNC).total


@pytest.mark.parametrize("line", ['corners = "sharp"', "corners = -1.0", "cycle = -0.001", "blend = 0.01"])
def test_a_table_with_other_corners_is_refused(tmp_path, line):
    table = tmp_path / "mine.toml"
    table.write_text(f'based_on = "linuxcnc"\n{line}\n')
    with pytest.raises(SettingError, match=line.split()[0]):
        find_dialect(table)


def test_a_control_that_stops_between_blocks_needs_a_cycle(tmp_path):
    table = tmp_path / "mine.toml"
    table.write_text('based_on = "haas"\ncorners = "exact-path"\n')
    with pytest.raises(SettingError, match="cycle"):
        find_dialect(table)


def test_where_a_motion_begins_is_no_part_of_its_first_block():
    motion = replace(motion_of([[0], [1], [2], [3]]), source=np.array([4, 4, 4, 5]))
    assert block_ends(motion).tolist() == [True, False, True, True]
