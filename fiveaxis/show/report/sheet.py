"""A machine's data sheet, the output of `fiveaxis info`, as plain data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fiveaxis.model import (
    Axis,
    Joint,
    Machine,
    dimensions,
    draw,
    drive_table,
    lean_range,
    singular_direction,
    unknown_figures,
    why_not_orienting,
    why_not_positioning,
    zero_of,
)

TOUCHING = 1e-6  # rad, range of leans below which the branches coincide and there is no choice

Document = dict[str, Any]


def describe_machine(machine: Machine) -> Document:
    """Describe a machine in mm, deg, s and W.

    Parameters
    ----------
    machine : any structure

    Returns
    -------
    Plain data: ``control`` (None where none is stated), ``chain`` from the workpiece to the tool, ``limits``,
    ``speeds`` and ``powers`` by axis letter (None where unknown or endless), ``orientation`` with branches
    and singular direction or the reason why there are none, ``unknown`` with the figures without which no
    program of axis words is written (`unknown_figures`), ``to_measure`` with the dimensions that place the
    rotary axes (None where they are known), ``figures`` with their sources
    """
    home = machine.chain.tool_home
    unknown = [figure.name for figure in unknown_figures(machine) if figure.name != "tool_length"]
    return {
        "name": machine.name,
        "code": str(machine.code),
        "description": machine.description,
        "control": machine.control or None,
        "kind": machine.code.kind,
        "kinematic_class": machine.code.kinematic_class,
        "axes": machine.letters,
        "reversed": [a.letter for a in machine.axes if a.reversed],
        "chain": [_joint(joint, machine, unknown) for joint in machine.chain.joints],
        "unknown": unknown,
        "spindle": {
            "point": None if "spindle" in unknown else _numbers(home[:3, 3]),
            "direction": _numbers(home[:3, 2]),
        },
        "limits": {a.letter: [_shown(a, end) for end in a.limits.ends] for a in machine.axes},
        "speeds": {a.letter: _shown(a, a.max_speed) for a in machine.axes},
        "powers": {letter: drive_table(machine, letter) for letter in machine.letters},
        "base_power": machine.base_power,
        "positioning": why_not_positioning(machine.chain) or "every position",
        "orientation": _orientation(machine),
        "bodies": len(machine.bodies),
        "to_measure": _to_measure(machine),
        "figures": [p.as_dict() for p in machine.provenance],
    }


def _joint(joint: Joint, machine: Machine, unknown: list[str]) -> Document:
    side = "table" if joint.letter in machine.code.table else "head"
    line = {"axis": joint.letter, "side": side, "direction": _numbers(joint.line.direction)}
    point = None if f"{joint.letter}.points" in unknown else _numbers(joint.line.point)
    return line | ({"point": point} if joint.is_rotary else {})


def _shown(axis: Axis, value: float | None) -> float | None:
    return None if value is None else _short(axis.shown(value))


def _orientation(machine: Machine) -> Document:
    reason = why_not_orienting(machine.chain)
    if reason is not None:
        return {"branches": 0, "reason": reason}
    leans = lean_range(machine)
    return {
        "branches": 2,
        "singular_axis": machine.rotaries[0],
        "singular_direction": _numbers(singular_direction(machine)),
        "branch_axis": leans.letter,
        "branch_middle": _short(math.degrees(leans.middle)),
        "lean_reach": _degrees(leans.unlimited),
        "lean_within_limits": _degrees(leans.limited),
        "both_branches_within_limits": [
            _degrees(ends) for ends in leans.both if ends[1] - ends[0] > TOUCHING
        ],
    }


def _to_measure(machine: Machine) -> Document | None:
    missing = dimensions(machine)
    if not missing:
        return None
    listed = [{"name": d.name, "key": d.key, "text": d.text} for d in missing]
    return {"zero": zero_of(machine), "drawing": draw(machine).splitlines(), "dimensions": listed}


def _degrees(angles: tuple[float, float]) -> list[float]:
    return [_short(math.degrees(v)) for v in angles]


def _numbers(vector: Any) -> list[float]:
    return [_short(float(v)) for v in np.asarray(vector)]


def _short(value: float) -> float:
    """Remove the rounding left by unit conversions."""
    return float(f"{value:.10g}") + 0.0
