"""LinuxCNC's simulated machine keeps the stated tolerance, in the predicted time, under our programs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fiveaxis import optimise
from fiveaxis.model import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    Machine,
    MoveKind,
    Tool,
    Toolpath,
    follow,
    load_machine,
    predicted_time,
    tool_axes,
    tool_poses,
)
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.nc import DIALECTS, ProgramSettings, compose_program, read_program
from referee.deviation import deviations, joint_path
from referee.linuxcnc import SimulationFault, run_program, why_unavailable

ABSENT = why_unavailable()
simulated = [pytest.mark.slow, pytest.mark.skipif(ABSENT is not None, reason=str(ABSENT))]
TRUNNION = load_machine("linuxcnc-xyzac-trt")
LINUXCNC = DIALECTS["linuxcnc"]
BALL = Tool.ball(8)
# mm and deg: LinuxCNC puts cubics through the ends of its cycles, so that two blocks overlap at the rest
# between them by a part of a T², here 3 µm. Measured: 0.16 µm.
OVERLAP, TURNED = 3e-4, 1e-4
# Share of the predicted time by which the simulated one may differ.
NEAR = 0.01
PLAIN = ProgramSettings(way_out=False)


def measured_machine() -> Machine:
    """The paper's machine, which states no limits: with those of the simulated one's axes."""
    paper = load_machine("hayashi-640123")
    axes = (
        replace(mine, max_speed=a.max_speed, max_acceleration=10.0 * a.max_acceleration)
        for mine, a in zip(paper.axes, TRUNNION.axes, strict=True)
    )
    return replace(paper, axes=tuple(axes))


def wavy_path(turning: bool, n: int = 81) -> tuple[Toolpath, np.ndarray]:
    """Once through a wave of 40 mm, with rotary angles that turn to and fro, or stand."""
    u = np.linspace(0.0, 1.0, n)
    swing = 1.0 if turning else 0.0
    rotary = np.radians(np.column_stack([40.0 + swing * 50.0 * u, -30.0 + swing * 20.0 * np.sin(6.0 * u)]))
    tips = np.column_stack([40.0 * u - 20.0, 6.0 * np.sin(7.0 * u), 3.0 * np.cos(5.0 * u)])
    axes = tool_axes(load_machine("hayashi-640123"), rotary)
    return Toolpath.from_tips(tips, axes, BALL, feed_mm_min=900.0), rotary


def read_back(text: str, machine: Machine, folder: Path):
    file = folder / "program.ngc"
    file.write_text(text, encoding="ascii")
    return read_program(file, machine)


def cut_begin(read) -> int:
    """Row of a program that was read at which its cut begins, behind start, rapid moves and lead-in."""
    return int(np.flatnonzero(read.kind != MoveKind.RAPID)[1])


def cut_of(run, read):
    """The samples of the cut."""
    return run.of_lines(int(read.source[cut_begin(read)]), int(read.source[-1]))


def predicted_cut(read, machine: Machine, coordinates="axes") -> float:
    predicted = predicted_time(read, machine, LINUXCNC, coordinates)
    assert predicted.basis == "accelerations"
    return float(predicted.times[cut_begin(read) :].sum())


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """A program of axis positions: its machine, text, motion, and the path that it is for."""
    machine = measured_machine()
    path, rotary = wavy_path(turning=True)
    _, motion, _ = fill_in(path, machine, rotary)
    text = compose_program(motion, machine=machine, settings=PLAIN).text
    return machine, text, read_back(text, machine, tmp_path_factory.mktemp("turning")), path


def strayed(run, read, path: Toolpath) -> tuple[float, float]:
    """Largest distance of the ball's centre from its path, mm, and of the tool axis from its turn, rad.

    In the first cycle that counts for the cut the lead-in may still be under way: it is part of the path.
    """
    (tip, axis), start = run.poses, tool_poses(run.machine, read.positions[:1])
    directions = np.vstack([start[1], path.axis])
    centres = np.vstack([start[0] + 4.0 * start[1], path.centres(path.axis)])
    away, turned = deviations(tip + 4.0 * axis, axis, centres, directions)
    return float(away.max()), float(turned.max())


class TestAxisPositions:
    pytestmark = simulated

    def test_the_cutter_keeps_to_its_path_in_the_predicted_time(self, turning):
        machine, text, read, path = turning
        run = cut_of(run_program(text, machine), read)
        away, turned = strayed(run, read, path)
        assert away < PATH_TOLERANCE + OVERLAP
        assert np.degrees(turned) < np.degrees(AXIS_TOLERANCE) + TURNED
        assert run.seconds == pytest.approx(predicted_cut(read, machine), rel=NEAR)
        assert run.seconds > 1.05 * read.time[cut_begin(read) :].sum()

    @pytest.mark.parametrize(
        ("word", "least", "most"), [("G64 P0.001", 4.0 * PATH_TOLERANCE, 1.0), ("G61", 0.0, OVERLAP)]
    )
    def test_a_blend_tolerance_doesnt_hold_where_rotary_axes_turn(self, word, least, most, tmp_path):
        """Why G61 is written: X goes straight on while C swings, so G64 P sees no corner to keep to."""
        machine = measured_machine()
        rows = np.zeros((21, 5))
        rows[:, 0], rows[1::2, 4] = np.linspace(30.0, 50.0, 21), np.radians(3.0)
        path = Toolpath.from_tips(rows[:, :3], np.tile([0.0, 0.0, 1.0], (21, 1)), BALL, feed_mm_min=900.0)
        motion = replace(follow(path, machine, np.zeros((21, 2))), positions=rows)
        text = compose_program(motion, machine=machine, settings=PLAIN).text
        assert "\nG61\n" in text
        read = read_back(text, machine, tmp_path)
        run = cut_of(run_program(text.replace("\nG61\n", f"\n{word}\n"), machine), read)
        away, _ = deviations(*run.poses, *joint_path(machine, read.positions, parts=64))
        assert least <= away.max() < most

    @pytest.mark.parametrize("coordinates", ["axes", "tip"])
    @pytest.mark.parametrize(("word", "blend"), [("G64", 0.0), ("G64 P0.01", 0.01)])
    def test_blended_blocks_take_the_predicted_time(self, word, blend, coordinates, tmp_path):
        path, rotary = wavy_path(turning=True)
        motion = follow(path, TRUNNION, rotary)
        text = compose_program(motion, machine=TRUNNION, coordinates=coordinates, settings=PLAIN).text
        read = read_back(text, TRUNNION, tmp_path)
        blended = LINUXCNC.model_copy(update={"corners": "blended", "blend": blend})
        predicted = predicted_time(read, TRUNNION, blended, coordinates).times[cut_begin(read) :].sum()
        run = cut_of(run_program(text.replace("\nG61\n", f"\n{word}\n"), TRUNNION), read)
        assert run.seconds == pytest.approx(predicted, rel=NEAR)
        assert run.seconds < 0.8 * predicted_cut(read, TRUNNION, coordinates)

    @pytest.mark.parametrize(("word", "blend"), [("G64", 0.0), ("G64 P0.01", 0.01), ("G64 P0.001", 0.001)])
    def test_corners_without_turns_take_the_predicted_time(self, word, blend, tmp_path):
        corners = np.array([[0, 0, 0], [20, 0, 0], [20, 20, 0], [0, 20, 0], [0, 0, 0]], dtype=float)
        path = Toolpath.from_tips(corners, np.tile([0.0, 0.0, 1.0], (5, 1)), BALL, feed_mm_min=900.0)
        motion = follow(path, TRUNNION, np.zeros((5, 2)))
        text = compose_program(motion, machine=TRUNNION, settings=PLAIN).text
        read = read_back(text, TRUNNION, tmp_path)
        blended = LINUXCNC.model_copy(update={"corners": "blended", "blend": blend})
        predicted = predicted_time(read, TRUNNION, blended).times[cut_begin(read) :].sum()
        run = cut_of(run_program(text.replace("\nG61\n", f"\n{word}\n"), TRUNNION), read)
        assert run.seconds == pytest.approx(predicted, rel=NEAR)

    def test_a_fine_curve_of_three_axes_is_passed_without_rests(self, tmp_path):
        machine = measured_machine()
        path, rotary = wavy_path(turning=False, n=1001)
        motion = follow(path, machine, rotary)
        text = compose_program(motion, machine=machine, settings=PLAIN).text
        read = read_back(text, machine, tmp_path)
        run = cut_of(run_program(text, machine), read)
        assert strayed(run, read, path)[0] < OVERLAP
        assert run.seconds == pytest.approx(predicted_cut(read, machine), rel=NEAR)
        assert run.seconds < 1.05 * read.time[cut_begin(read) :].sum()


class TestToolTip:
    pytestmark = simulated

    def test_the_tip_goes_straight_in_the_predicted_time(self, tmp_path):
        path, rotary = wavy_path(turning=True, n=31)
        motion = follow(path, TRUNNION, rotary)
        text = compose_program(motion, machine=TRUNNION, coordinates="tip", settings=PLAIN).text
        read = read_back(text, TRUNNION, tmp_path)
        run = cut_of(run_program(text, TRUNNION), read)
        tip, axis = run.poses
        tips, _ = tool_poses(TRUNNION, motion.positions)
        away, _ = deviations(tip, axis, tips, tool_axes(TRUNNION, rotary))
        assert away.max() < PATH_TOLERANCE
        # The rotary axes turn in proportion to the way: their own straight line is where the tool points.
        turns = joint_path(TRUNNION, read.positions)
        assert np.degrees(deviations(tip, axis, *turns)[1].max()) < 0.05
        assert run.seconds == pytest.approx(predicted_cut(read, TRUNNION, "tip"), rel=NEAR)


class TestMachine:
    pytestmark = simulated

    def test_an_axis_limit_is_a_fault_and_the_next_program_runs(self):
        with pytest.raises(SimulationFault, match="limit"):
            run_program("G21 G90 G94\nG1 X1 F1000\nG1 X1000 F1000\nM2\n", TRUNNION)
        run = run_program("G21 G90 G94 G61\nG1 X2 A-3 F600\nM2\n", TRUNNION)
        # This control counts A the other way.
        np.testing.assert_allclose(run.positions[-1], [2.0, 0.0, 0.0, np.radians(3.0), 0.0], atol=1e-6)

    def test_a_program_that_isnt_done_in_time_is_a_fault(self):
        with pytest.raises(SimulationFault, match="not done after 1 s"):
            run_program("G21 G90 G94\nG1 X100 F60\nM2\n", TRUNNION, limit=1.0)


def test_deviations_are_those_of_a_point_beside_a_line():
    path = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 10.0, 0]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    tip = np.array([[5.0, 0.2, 0.0], [10.3, 5.0, 0.4], [-1.0, 0.0, 0.0]])
    axis = np.array([[0.0, 0.0, 1.0], [0.0, np.sin(0.1), np.cos(0.1)], [0.0, 0.0, 1.0]])
    away, turned = deviations(tip, axis, path, up)
    np.testing.assert_allclose(away, [0.2, 0.5, 1.0], atol=1e-12)
    np.testing.assert_allclose(turned, [0.0, 0.1, 0.0], atol=1e-12)


def test_where_a_path_crosses_itself_the_direction_tells_which_strand():
    path = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 10.0, 0], [5.0, 5.0, 0], [5.0, -5.0, 0]])
    directions = np.array([[0.0, 0, 1], [0.0, 0, 1], [0.0, 0.6, 0.8], [0.0, 0.6, 0.8], [0.0, 0.6, 0.8]])
    tip, axis = np.array([[5.0, 0.0, 0.0]] * 2), directions[[0, 4]]
    away, turned = deviations(tip, axis, path, directions)
    np.testing.assert_allclose(away, 0.0, atol=1e-12)
    np.testing.assert_allclose(turned, 0.0, atol=1e-7)


def test_a_joint_path_meets_the_ends_of_its_blocks():
    positions = np.array([[0.0, 0, 0, 0, 0], [10.0, 5.0, -3.0, 0.3, 0.8], [12.0, 5.0, 0.0, 0.1, 2.0]])
    tips, axes = joint_path(TRUNNION, positions, parts=4)
    meant, directions = tool_poses(TRUNNION, positions)
    np.testing.assert_allclose(tips[::4], meant, atol=1e-12)
    np.testing.assert_allclose(axes[::4], directions, atol=1e-12)


@pytest.mark.parametrize("n", [pytest.param(60, marks=simulated)])
@pytest.mark.slow
def test_on_a_coarsely_sampled_cone_the_ball_stays_between_the_circle_and_its_chords(n, tmp_path):
    """The circle is the cone's own, not the curve that was found through the samples."""
    machine, angle = measured_machine(), 2.0 * np.pi * np.arange(n + 1) / n
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    contact = np.column_stack([30.0 * around, np.zeros(n + 1)])
    normal = np.column_stack([around, -np.ones(n + 1)])
    path = Toolpath.from_contacts(contact, normal, BALL, feed_mm_min=3000.0)
    found = optimise(path, machine, tilt=(15, 70), effort="quick", control="linuxcnc")
    blocks = found.filling.blocks(found.toolpath, machine, found.motion)
    assert len(blocks) <= len(path)
    text = compose_program(blocks, machine=machine, settings=PLAIN).text
    run = cut_of(run_program(text, machine), read_back(text, machine, tmp_path))
    tip, axis = run.poses
    ball = tip + path.zone.height * axis
    radius = float(np.linalg.norm(path.pivot[0, :2]))
    sagitta = radius * (1.0 - np.cos(np.pi / n))
    assert sagitta > 8.0 * PATH_TOLERANCE
    outside = np.linalg.norm(ball[:, :2], axis=1) - radius
    assert outside.max() < PATH_TOLERANCE + OVERLAP
    assert outside.min() > -sagitta - PATH_TOLERANCE - OVERLAP
    assert np.abs(ball[:, 2] - path.pivot[0, 2]).max() < PATH_TOLERANCE + OVERLAP
    # It doesn't follow the chords: with C alone turning, these blocks make the circle.
    assert np.abs(outside).mean() < 0.1 * sagitta
