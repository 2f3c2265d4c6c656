"""The chain's equations as CasADi functions of the rotary angles."""

from __future__ import annotations

import casadi as ca

from fiveaxis.model.kinematics.equations import cosines_of, leaning_tip, linear_axes, tool_axis
from fiveaxis.model.kinematics.poses import require_positioning
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.toolpath.cutter import Zone


def linear_axes_of_posture(
    machine: Machine, pivot: ca.SX, rotary: ca.SX, zone: Zone, normal: ca.SX | None = None
) -> ca.SX:
    """Express the linear axis values, (3,) mm in column order, by the rotary angles, (r,) rad in chain order.

    Parameters
    ----------
    pivot : (3,), mm, workpiece frame; the point about which the tool leans
    zone : the arc of the cutter's profile whose centre is the pivot
    normal : (3,), unit vector out of the material; zero where unknown, and not needed for a ball

    Raises
    ------
    DegenerateChain
        The linear axes don't reach every position.
    """
    require_positioning(machine)
    cosines = _cosines(machine, rotary)
    axis = tool_axis(machine.chain, cosines)
    point, given = (tuple(v[i] for i in range(3)) for v in (pivot, ca.SX(3, 1) if normal is None else normal))
    tip = leaning_tip(point, axis, zone.height, zone.offset, given)
    values = linear_axes(machine.chain, cosines, tip)
    return ca.vertcat(*(values[machine.letters[i]] for i in machine.linear_columns))


def tool_axis_of_posture(machine: Machine, rotary: ca.SX) -> ca.SX:
    """Express the tool axis, (3,) unit vector in the workpiece frame, by the rotary angles, (r,) rad."""
    return ca.vertcat(*tool_axis(machine.chain, _cosines(machine, rotary)))


def _cosines(machine: Machine, rotary: ca.SX) -> dict[str, tuple[ca.SX, ca.SX]]:
    return dict(cosines_of({c: rotary[i] for i, c in enumerate(machine.rotaries)}, ca))
