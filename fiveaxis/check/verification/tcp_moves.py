"""Axis positions in moves under TCP, where the control moves a point of the tool straight between rows.

The rotary axes turn in proportion to the path of that point and the linear axes compensate, so they aren't
linear in time. Such moves are divided into parts in which linear axes keep the point on its path.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, product
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.model import PATH_TOLERANCE, Interpolation, Machine, divided_rows, interpolate

# Rounds of measuring and dividing; each divides a deviation by the square of the number of parts.
MOST_ROUNDS = 12


def divide_tcp_moves(machine: Machine, positions: Array, height: float) -> tuple[Array, Array]:
    """Divide the moves between rows until axes linear in time move a point of the tool straight.

    The point is at a height above the tip, mm. Return positions, (m, k) mm and rad, the given rows included,
    and their fractional given rows, (m,): 3.25 lies between 3 and 4. Halfway through every part the point is
    within `PATH_TOLERANCE` of its straight path.
    """
    tip, axis = tool_poses(machine, positions)
    straight, row, every = tip + height * axis, np.arange(len(positions), dtype=float), positions
    for _ in range(MOST_ROUNDS):
        tips, axes = tool_poses(machine, (every[1:] + every[:-1]) / 2.0)
        wanted = interpolate(straight, (row[1:] + row[:-1]) / 2.0)
        off = np.linalg.norm(tips + height * axes - wanted, axis=1)
        # A parabola's height over its chord falls with the square of the number of parts.
        parts = np.maximum(np.ceil(np.sqrt(np.nan_to_num(off) / PATH_TOLERANCE)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        row = interpolate(row[:, None], divided_rows(parts))[:, 0]
        every = interpolate(positions, row)
        between = np.flatnonzero(row != np.floor(row))
        every[between] = _move_point(machine, every[between], interpolate(straight, row[between]), height)
    return every, row


def positions_between(
    machine: Machine, positions: Array, place: Array, interpolation: Interpolation
) -> Array:
    """Compute the axis positions between the ends of blocks as a control moves them, (n, k) mm and rad.

    Those at the ends are (m, k); places, (n,), are fractional rows of these: 3.25 is after a quarter of the
    block to row 4.
    """
    found = interpolate(positions, place)
    inner = np.flatnonzero(place != np.floor(place))
    if interpolation is Interpolation.JOINT or not len(inner):
        return found
    tip = interpolate(tool_poses(machine, positions)[0], place[inner])
    found[inner] = _move_point(machine, found[inner], tip, 0.0)
    return found


def _move_point(machine: Machine, positions: Array, wanted: Array, height: float) -> Array:
    """Move the linear axes of rows, (m, k), so that the point reaches wanted positions, (m, 3) mm.

    Its position is linear in them. Directions in which the axes can't move it are left as they are.
    """
    columns = machine.linear_columns
    tip, axis = tool_poses(machine, positions)
    slopes = np.empty((len(positions), 3, len(columns)))
    for i, column in enumerate(columns):
        moved = positions.copy()
        moved[:, column] += 1.0
        slopes[:, :, i] = tool_poses(machine, moved)[0] - tip
    steps = product(np.linalg.pinv(slopes), (wanted - tip - height * axis)[:, :, None])
    placed = positions.copy()
    placed[:, columns] += steps[:, :, 0]
    return placed
