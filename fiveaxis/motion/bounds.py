"""Bounds on the speed of a motion: the axes' highest speeds and accelerations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.errors import MachineError, ToolpathError
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.timing import STANDSTILL


@dataclass(frozen=True, eq=False)
class AxisBounds:
    """Highest speed and acceleration of every axis; infinite if the machine states none.

    Parameters
    ----------
    speed : (k,), mm/s and rad/s
    acceleration : (k,), mm/s² and rad/s²
    """

    speed: Array
    acceleration: Array

    @property
    def accelerates_at_once(self) -> bool:
        """Whether no axis has a highest acceleration."""
        return bool(np.isinf(self.acceleration).all())


def axis_bounds(machine: Machine) -> AxisBounds:
    """Collect the axes' bounds.

    Raises
    ------
    MachineError
        A bound that isn't a positive number.
    """
    bounds = {}
    for name, unit in (("max_speed", "s"), ("max_acceleration", "s²")):
        values = [getattr(axis, name) for axis in machine.axes]
        for axis, value in zip(machine.axes, values, strict=True):
            if value is not None and not value > 0.0:
                raise MachineError(
                    f"machine {machine.name!r}: {name} of {axis.letter} is {axis.shown(value):g} "
                    f"{axis.unit}/{unit}; it must be above 0"
                )
        bounds[name] = np.array([np.inf if value is None else value for value in values])
    return AxisBounds(bounds["max_speed"], bounds["max_acceleration"])


def require_motion(motion: Motion, machine: Machine) -> None:
    """Raise unless a motion belongs to this machine and can be timed.

    Raises
    ------
    ToolpathError
        No rows; positions that aren't finite; times that aren't finite or are negative; a move without a
        time.
    MachineError
        The motion has other axes than the machine.
    """
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}; machine {machine.name!r} has {machine.letters}"
        )
    if len(motion) == 0:
        raise ToolpathError("no cutter locations to time")
    timed = np.isfinite(motion.time) & (motion.time >= 0.0)
    moved = (np.abs(motion.moves) > STANDSTILL).any(axis=1)
    faults = (
        (~np.isfinite(motion.positions).all(axis=1), "an axis value that isn't a finite number"),
        (~timed, "a time that isn't 0 s or more"),
        (timed & (motion.time == 0.0) & moved, "a move that takes 0 s at its feed"),
    )
    for bad, what in faults:
        if bad.any():
            row = int(np.argmax(bad))
            raise ToolpathError(
                f"location {row} (source line {motion.source[row]}) has {what}"
                f" ({int(bad.sum())} such locations)"
            )
