"""Axis positions while a control moves a point of the tool straight."""

import numpy as np
import pytest

from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.tcp_moves import divide_tcp_moves
from fiveaxis.model import PATH_TOLERANCE, Machine


@pytest.mark.parametrize("height", [0.0, 5.0])
def test_the_point_stays_on_its_straight_path_throughout(hayashi, height):
    rows = np.array(
        [[60.0, 10.0, 0.0, -0.5, 0.0], [-60.0, 30.0, 5.0, -0.1, 3.0], [-60.0, 31.0, 5.0, -0.1, 3.0]]
    )
    positions, place = divide_tcp_moves(hayashi, rows, height)
    assert np.array_equal(positions[np.isin(place, [0.0, 1.0, 2.0])], rows)
    share = np.linspace(0.0, 1.0, 7)[1:-1, None, None]
    dense = (positions[:-1] + share * (positions[1:] - positions[:-1])).reshape(-1, 5)
    tips, axes = tool_poses(hayashi, dense)
    ends = np.array(tool_poses(hayashi, rows))
    ends = ends[0] + height * ends[1]
    rows_at = (place[:-1] + share[:, :, 0] * np.diff(place)).ravel()
    wanted = np.stack([np.interp(rows_at, np.arange(3.0), column) for column in ends.T], axis=1)
    assert np.linalg.norm(tips + height * axes - wanted, axis=1).max() < 1.2 * PATH_TOLERANCE


def test_moves_that_are_straight_already_are_not_divided():
    machine = Machine.from_code("640123")
    rows = np.array([[0.0, 0.0, 0.0, 0.3, 0.2], [10.0, 5.0, 0.0, 0.3, 0.2]])
    positions, place = divide_tcp_moves(machine, rows, 0.0)
    assert np.array_equal(positions, rows)
    assert np.array_equal(place, [0.0, 1.0])
