"""Findings on a path as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from fiveaxis.findings import Severity
from fiveaxis.nc.remarks import remark_on
from fiveaxis.toolpath import MoveKind, Tool, Toolpath

CUT, RAPID, LINK = MoveKind.CUT, MoveKind.RAPID, MoveKind.LINK
UP, SIDE = [0, 0, 1], [1, 0, 0]


def path(axes, kinds):
    tips = np.arange(3 * len(axes)).reshape(-1, 3)
    return Toolpath.from_tips(tips, axes, Tool.ball(6), kind=kinds, name="part.apt")


def test_one_direction_is_a_3_axis_path():
    (finding,) = remark_on(path([UP, UP, UP], [RAPID, CUT, CUT]))
    assert finding.code == "no-simultaneous-path"
    assert finding.severity is Severity.NOTE
    assert finding.value == 1
    assert finding.place.file == "part.apt"
    assert "3-axis path: its cuts have one direction of the tool axis, (0, 0, 1);" in finding.message


def test_several_directions_that_change_in_the_air_are_a_3_2_path():
    (finding,) = remark_on(path([UP, UP, SIDE, SIDE, UP, UP], [RAPID, CUT, RAPID, CUT, LINK, CUT]))
    assert finding.value == 2
    assert "a 3+2 path: its cuts have 2 directions" in finding.message


def test_an_axis_that_changes_in_one_cut_is_simultaneous():
    assert remark_on(path([UP, UP, SIDE], [RAPID, CUT, CUT])) == ()
    assert remark_on(path([UP, SIDE], [RAPID, CUT])) == ()


def test_the_last_digit_of_an_axis_isnt_a_motion():
    (finding,) = remark_on(path([UP, [0, 1e-6, 1], UP], [CUT, CUT, CUT]))
    assert finding.value == 1


@pytest.mark.parametrize("kinds", [[RAPID, RAPID], [RAPID, LINK]])
def test_a_path_without_cuts_has_no_finding(kinds):
    assert remark_on(path([UP, UP], kinds)) == ()


def test_a_path_without_axes_has_no_finding():
    contacts = Toolpath.from_contacts([[0, 0, 0], [1, 0, 0]], [UP, UP], Tool.ball(6))
    assert remark_on(contacts) == ()
