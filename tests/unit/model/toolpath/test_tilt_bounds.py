"""Bounds on the tool's lean hold at cuts, and not between them."""

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.model import MoveKind, Tool, Toolpath

CUT, LINK, RAPID = MoveKind.CUT, MoveKind.LINK, MoveKind.RAPID
KINDS = [RAPID, RAPID, CUT, CUT, LINK, LINK, CUT]
BOUND = [False, True, True, True, False, True, True]


@pytest.fixture
def path() -> Toolpath:
    tips = np.column_stack([np.arange(7.0), np.zeros((7, 2))])
    given = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (7, 1)), Tool.ball(6), kind=KINDS)
    return given.touching_at(np.tile([0.0, 0.6, 0.8], (7, 1)))


@pytest.mark.parametrize(
    "asked",
    [{"cone": 20.0}, {"tilt": (0.0, 60.0)}, {"lead": (-5.0, 20.0)}, {"cone": 20.0, "plane": (1.0, 0.0, 0.0)}],
)
def test_the_lean_is_bound_where_a_cut_ends_or_begins_and_nowhere_else(path, asked):
    bounds = tilt_bounds(path, **asked)
    for bound in bounds.all:
        assert np.isfinite(bound.reference).all(axis=1).tolist() == BOUND
    assert bounds.admits(np.tile([0.0, 0.0, -1.0], (7, 1))).tolist() == [not bound for bound in BOUND]
