"""The feed of links, with cutters whose pivot is on their axis and beside it."""

import numpy as np
import pytest
from planted.technology import FAR, feed_moves, of_one_block
from planted.trial import Trial, two_passes

import fiveaxis as fx
from fiveaxis.model import MoveKind, Tool, tool_poses
from fiveaxis.nc import ProgramSettings

# Degrees between tool axis and normal at which the cutter touches with its edge.
TILT = (15.0, 60.0)


@pytest.fixture(scope="module", params=[Tool.ball(8), Tool.bull(12, 3), Tool.flat(8)], ids=str)
def linked(request, hayashi):
    """Two passes that links at feed join."""
    path = two_passes(request.param, rapid=False)
    return fx.optimise(path, hayashi, tilt=TILT, effort="quick")


@pytest.mark.parametrize(("control", "mode"), [("linuxcnc", "axes"), ("fanuc", "tip")])
def test_a_link_of_ten_times_its_feed_is_found_in_the_file(linked, control, mode, tmp_path):
    trial = Trial(linked, control, mode, ProgramSettings())
    text, subject = trial.text, trial.subject
    path, motion = linked.toolpath, trial.made.motion.motion
    tip = tool_poses(linked.machine, motion.positions)[0]
    far = np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1) > FAR
    links = [
        i for i in feed_moves(subject) if motion.kind[text.rows[i]] == MoveKind.LINK and far[text.rows[i]]
    ]
    assert len(links) > 3
    assert path.zone.offset == 0.0 or not np.isfinite(path.normal[path.kind == MoveKind.LINK]).all()
    for line in links[:: max(1, len(links) // 3)]:
        assert trial.by_program(of_one_block(subject, line, 10.0), tmp_path).errors["feed-differs"]
    assert not trial.by_program(text, tmp_path).errors


def test_a_link_runs_at_its_feed_whatever_the_cutter(linked):
    """It is that of the tool's centre: a pivot beside the axis may stand while the tool swings about it."""
    path, machine = linked.toolpath, linked.machine
    made = linked.program(control="linuxcnc", coordinates="axes")
    blocks = made.blocks
    tip, axis = tool_poses(machine, blocks.positions)
    centre = tip + path.zone.height * axis
    step = np.linalg.norm(np.diff(centre, axis=0, prepend=centre[:1]), axis=1)
    links = (blocks.kind == MoveKind.LINK) & (step > FAR)
    assert links.any()
    np.testing.assert_allclose(60.0 * step[links] / blocks.time[links], 1000.0, rtol=0.02)


def test_a_centre_that_turns_faster_than_f_moves_the_tip_is_told_once(hayashi, tmp_path):
    # The tip goes 1 mm in each block; a turn of 5 deg takes the centre of the ball 0.87 mm on, or back.
    text = "(control: linuxcnc tip)\nG21 G90 G94\nG43 H1\nM428\nG0 X0 Y0 Z5 A0 C0\nG1 Z0 F600\n{}M429\nM2\n"
    path, ball = tmp_path / "part.ngc", Tool.ball(20)
    path.write_text(text.format("Y1 A5\nY2 A0\nY12\n"))
    turning = fx.verify_program(path, machine=hayashi, tool=ball)
    [finding] = [f for f in turning.findings if f.code == "cutter-speed"]
    assert finding.place.line in (7, 8)
    assert "tool's centre" in finding.message
    assert "87% above F (600 mm/min)" in finding.message
    path.write_text(text.format("Y1 A0.5\nY2 A0\nY12\n"))
    slow = fx.verify_program(path, machine=hayashi, tool=ball)
    path.write_text(text.replace("G94", "G93").format("Y1 A5 F600\nY2 A0 F600\nY12 F60\n"))
    timed = fx.verify_program(path, machine=hayashi, tool=ball)
    assert "cutter-speed" not in [f.code for f in (*slow.findings, *timed.findings)]
