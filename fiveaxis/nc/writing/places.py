"""What words stand for: positions of axes, the tool's tip and the angles, the tip and a direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.errors import MachineError, SettingError
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import link_poses, singular_angles, tool_poses
from fiveaxis.machine import BED, Machine
from fiveaxis.motion import Interpolation
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.words import control_values
from fiveaxis.nc.writing.numbers import rounded
from fiveaxis.nc.writing.table_parts import Coordinates, Mode
from fiveaxis.nc.writing.tables import Dialect

LINEAR = "XYZ"
# Steps of the last decimal of a direction by which it may be off: three rounded components, and some room.
ROUNDED = 2.0
# rad, from the singular direction: beyond it angles change at most a thousand times as much as directions.
CLEAR_OF_SINGULAR = 1e-3


@dataclass(frozen=True, eq=False)
class Wording:
    """How places become words of one control, in one kind of coordinates.

    Parameters
    ----------
    dialect, coordinates, machine : what for
    unit : of lengths, ``mm`` or ``inch``
    """

    dialect: Dialect
    coordinates: Coordinates
    machine: Machine
    unit: str = "mm"

    @property
    def mode(self) -> Mode:
        """The table of the coordinates."""
        return self.dialect.modes[self.coordinates]

    @property
    def interpolation(self) -> Interpolation:
        """How the control moves between two blocks of such words."""
        return Interpolation.JOINT if self.coordinates == "axes" else Interpolation.TCP

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What stands before each number: letters of axes, or words of a direction."""
        if self.coordinates == "vector":
            return (*LINEAR, *(self.mode.directions or ("I", "J", "K")))
        return tuple(self.machine.letters)

    @cached_property
    def is_linear(self) -> BoolArray:
        """(c,), which words are lengths."""
        return np.array([name in LINEAR for name in self.names])

    @cached_property
    def decimals(self) -> Array:
        """(c,), of each word; inches have one more than mm."""
        number = self.dialect.number
        other = number.direction if self.coordinates == "vector" else number.rotary
        return np.where(self.is_linear, number.linear + (self.unit == "inch"), other)

    @cached_property
    def scale(self) -> Array:
        """(c,), from mm, deg and unit vectors to the numbers of words."""
        return np.where(self.is_linear, 1.0 / MILLIMETRES[self.unit], 1.0)

    def values(self, positions: Array) -> Array:
        """Give the numbers of the words, (n, c), control's sign, not yet rounded.

        Parameters
        ----------
        positions : (n, k), mm and rad, tool relative to workpiece
        """
        shown = control_values(self.machine, positions)
        if self.coordinates == "axes":
            return shown * self.scale
        tip, axis = tool_poses(self.machine, positions)
        if self.mode.positions == "machine":
            tip = carry_to_machine(self.machine, tip, positions)
        if self.coordinates == "vector":
            if self.dialect.language == "blocks":  # a list is for no machine in particular
                axis = self._inside_ends(positions, axis)
            return np.hstack([tip, axis]) * self.scale
        shown[:, [self.machine.column(c) for c in LINEAR]] = tip
        return shown * self.scale

    def _inside_ends(self, positions: Array, axis: Array) -> Array:
        """Keep directions as far from the ends of rotary axes as they are rounded.

        Past an end the control would take the other pair of angles, with half a turn of the first axis. By
        the singular direction no angle follows from so small a change, and they stay as they are.
        """
        machine, step = self.machine, ROUNDED * 10.0 ** -float(self.decimals[-1])
        inside = positions.copy()
        for column in machine.rotary_columns:
            limits = machine.axes[column].limits
            if not limits.is_fixed:
                inside[:, column] = np.clip(positions[:, column], limits.low + step, limits.high - step)
        clear = singular_angles(machine, axis) > CLEAR_OF_SINGULAR
        near = clear & (inside != positions).any(axis=1)
        if not near.any():
            return axis
        kept = axis.copy()
        kept[near] = tool_poses(machine, inside[near])[1]
        return kept

    def rounded(self, values: Array) -> Array:
        """Round numbers of words as they are printed, (n, c)."""
        return rounded(values, self.decimals)

    def formats(self, templates: Sequence[str | None] = ()) -> list[str]:
        """Give the format of each word, (c,).

        Parameters
        ----------
        templates : (c,), with ``{letter}`` and ``{value}``; None, or nothing, for the plain word
        """
        sign = "+" if self.dialect.number.plus else ""
        given = templates or [None] * len(self.names)
        numbers = [f"%{sign}.{int(d)}f" for d in self.decimals]
        return [
            (template or "{letter}{value}").replace("%", "%%").format(letter=name, value=number)
            for template, name, number in zip(given, self.names, numbers, strict=True)
        ]

    def words(self, values: Array, only: str | None = None) -> str:
        """Write one place, (c,), as ``X1.000000 Y2.000000``: all words or `only` some."""
        row = self.rounded(values[None])[0]
        chosen = [i for i, name in enumerate(self.names) if only is None or name in only]
        formats = self.formats()
        return " ".join(formats[i] for i in chosen) % tuple(row[chosen].tolist())


def require_expressible(dialect: Dialect, coordinates: Coordinates | None, machine: Machine) -> Coordinates:
    """Check that a control can be told a machine's motion, and settle in which coordinates.

    Parameters
    ----------
    coordinates : as asked for; None for the control's own, the first of axes, tip and vector that it has

    Raises
    ------
    SettingError
        Coordinates that the control hasn't.
    MachineError
        Axes that the control doesn't know; tip control for a machine without rotary axes, or one that can't
        place the tip.
    """
    known: list[Coordinates] = [c for c in ("axes", "tip", "vector") if c in dialect.modes]
    chosen = known[0] if coordinates is None else coordinates
    if chosen not in known:
        reason = dialect.refused.get(chosen)
        what = f"control {dialect.name!r} isn't written in coordinates {chosen!r}"
        raise SettingError(f"{what}: {reason}" if reason else f"{what}; it has {', '.join(known)}")
    strange = [c for c in machine.letters if c not in dialect.axes]
    if strange:
        raise MachineError(
            f"machine {machine.name!r} has axis {strange[0]}, and control {dialect.name!r} knows "
            f"{', '.join(dialect.axes)}; choose another control, or name it in the control's table"
        )
    if chosen != "axes" and dialect.language == "blocks":
        _require_tip_control(machine)
    return chosen


def _require_tip_control(machine: Machine) -> None:
    missing = [c for c in LINEAR if c not in machine.letters]
    if missing:
        raise MachineError(
            f"machine {machine.name!r} has no axis {missing[0]}, and tip positions need X, Y and Z; "
            "write axes"
        )
    if not machine.rotaries:
        raise MachineError(
            f"machine {machine.name!r} has no rotary axis, so there is nothing for tool centre point control "
            "to do; write axes"
        )


def carry_to_machine(machine: Machine, points: Array, positions: Array) -> Array:
    """Say where points of the workpiece are in a frame that stays with the machine while the table turns.

    Parameters
    ----------
    points : (n, 3), mm, workpiece frame
    positions : (n, k), axis values, rad; those of linear axes don't count

    Returns
    -------
    (n, 3), mm, in the workpiece frame as it lies with every axis at 0
    """
    values = positions.copy()
    values[:, machine.linear_columns] = 0.0
    poses = link_poses(machine, values)[BED]
    return np.asarray(np.einsum("nji,nj->ni", poses[:, :3, :3], points - poses[:, :3, 3]))
