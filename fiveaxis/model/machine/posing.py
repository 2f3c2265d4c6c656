"""Forward and inverse kinematics as methods of a machine, where users look for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

from fiveaxis.base import Array

if TYPE_CHECKING:
    from fiveaxis.model.machine.model import Machine


class Posing:
    """Poses of the tool from axis values, and axis values from poses; a part of `Machine`.

    The mathematics is that of `fiveaxis.model.kinematics`, a room above this one, which is imported when it
    is called.
    """

    def forward(self, positions: Array) -> tuple[Array, Array]:
        """Compute tool tip and tool axis for given axis values.

        Parameters
        ----------
        positions : (n, k), mm and rad, columns in the order of `axes`

        Returns
        -------
        tip : (n, 3), mm, workpiece frame
        axis : (n, 3), unit vectors from tip to shank, workpiece frame

        Raises
        ------
        MachineError
            Another number of columns.
        """
        from fiveaxis.model.kinematics.poses import tool_poses

        return tool_poses(cast("Machine", self), positions)

    def inverse(self, tip: Array, axis: Array, *, held: Mapping[str, float] | None = None) -> Array:
        """Solve all axes for given tool tips and tool axes, in every branch.

        Parameters
        ----------
        tip : (n, 3), mm, workpiece frame
        axis : (n, 3), unit vectors from tip to shank, workpiece frame
        held : rad by letter, 0 by default: angles of axes whose angle is arbitrary, such as the first rotary
            axis where the tool lies along it

        Returns
        -------
        (branches, n, k), mm and rad, columns in the order of `axes`; a row is NaN where a branch doesn't
        exist. Limits aren't applied; angles lie in (−π, π]

        Raises
        ------
        FiveAxisError
            As `fiveaxis.model.axis_positions`.
        """
        from fiveaxis.model.kinematics.inverse import axis_positions

        return axis_positions(cast("Machine", self), tip, axis, held=held)
