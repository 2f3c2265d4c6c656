"""The way of the axes where a control leads a point of the tool straight between rows.

The rotary axes turn in proportion to that way, and the linear ones make up for it: they don't run straight.
Such moves are cut into parts in which axes that do run straight keep the point on its way.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.machine import Machine
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.toolpath import divided_rows, interpolate
from fiveaxis.verification.model import tool_poses

# Rounds of measuring and cutting; each divides a deviation by the square of the parts.
MOST_ROUNDS = 12


def led_positions(machine: Machine, positions: Array, height: float) -> tuple[Array, Array]:
    """Cut the moves between rows until axes that run linearly lead a point of the tool straight.

    Parameters
    ----------
    machine : whose axes they are
    positions : (n, k), mm and rad
    height : mm above the tip, of the point that is led

    Returns
    -------
    positions : (m, k), mm and rad, the given rows among them; the point is within `PATH_TOLERANCE` of its
        straight way halfway in every part
    row : (m,), places in rows as they were given: 3.25 lies between 3 and 4
    """
    columns = machine.rotary_columns
    tip, axis = tool_poses(machine, positions)
    led, row, every = tip + height * axis, np.arange(len(positions), dtype=float), positions
    for _ in range(MOST_ROUNDS):
        tips, axes = tool_poses(machine, (every[1:] + every[:-1]) / 2.0)
        wanted = interpolate(led, (row[1:] + row[:-1]) / 2.0)
        off = np.linalg.norm(tips + height * axes - wanted, axis=1)
        # A parabola's height falls with the square of the parts that its chord is cut into.
        parts = np.maximum(np.ceil(np.sqrt(np.nan_to_num(off) / PATH_TOLERANCE)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        row = interpolate(row[:, None], divided_rows(parts))[:, 0]
        every = interpolate(positions, row)
        between = np.flatnonzero(row != np.floor(row))
        turned = every[between][:, columns]
        tips = interpolate(led, row[between]) - height * tool_axes(machine, turned)
        solved = linear_positions(machine, tips, turned)
        # Where no place of the linear axes leads the point there, the control can't either.
        reached = np.isfinite(solved).all(axis=1)
        every[between[reached]] = solved[reached]
    return every, row
