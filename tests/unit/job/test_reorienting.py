"""Rapid moves that turn the tool between two cuts: no bound on the lean holds within them."""

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.model import MoveKind, Tool, Toolpath, follow, motion_energy

CONE = 10.0
# Rows of the rapid move: up, over and down again.
RAPIDS = slice(5, 8)


@pytest.fixture(scope="module")
def path() -> Toolpath:
    """Two cuts of five locations, and rapid moves between their axes, which are 70 deg apart."""
    along = np.arange(5.0)[:, None] * [[1.0, 0.0, 0.0]]
    first, second = [-20.0, -30.0, 0.0], [10.0, 30.0, 0.0]
    lift = [0.0, 0.0, 40.0]
    tips = np.vstack(
        [along + first, np.add([[4.0, 0.0, 0.0]], np.add(first, lift)), np.add([second], lift), [second]]
    )
    tips = np.vstack([tips, along + second])
    angle = np.radians(np.where(np.arange(len(tips)) < 6, -50.0, 20.0))
    axes = np.column_stack([np.zeros(len(tips)), -np.sin(angle), np.cos(angle)])
    kind = np.full(len(tips), MoveKind.CUT, dtype=np.int64)
    kind[RAPIDS] = MoveKind.RAPID
    return Toolpath.from_tips(tips, axes, Tool.ball(6), feed_mm_min=600.0, kind=kind)


@pytest.fixture(scope="module")
def solution(path, hayashi) -> fx.Solution:
    return fx.optimise(path, hayashi, cone=CONE, effort="quick")


def test_a_program_that_reorients_in_rapid_moves_keeps_its_cone(path, solution, hayashi, tmp_path):
    program = solution.program()
    assert program.ok, program.report.counts
    file = program.write(tmp_path / "part.ngc")
    report = fx.verify_program(file, hayashi, toolpath=path, cone=CONE)
    assert "tilt" not in report.counts
    # Within cuts the cone is looked at as before.
    narrow = fx.verify_program(file, hayashi, toolpath=path, cone=CONE / 4.0)
    assert narrow.counts["tilt"] > 0


def test_free_postures_cost_no_more_than_turning_in_proportion(path, solution, hayashi):
    given = ~solution.toolpath.inserted
    rotary = solution.motion.positions[given][:, hayashi.rotary_columns].copy()
    for share, row in ((1 / 3, 5), (2 / 3, 6)):
        rotary[row] = rotary[4] + share * (rotary[7] - rotary[4])
    even = motion_energy(hayashi, solution.filling.blocks(path, hayashi, follow(path, hayashi, rotary))).total
    assert solution.energy.total <= even * (1.0 + 1e-6)
