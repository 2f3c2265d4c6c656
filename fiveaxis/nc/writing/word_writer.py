"""Positions as words: axis positions, the tool tip with angles, or the tip with a direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, BoolArray, Coordinates, MachineError, SettingError
from fiveaxis.model import Interpolation, Machine, singular_angles, tool_poses
from fiveaxis.nc.control.tip_frames import carried_points
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.words import control_values, rounded
from fiveaxis.nc.writing.table_parts import Mode
from fiveaxis.nc.writing.tables import Dialect

LINEAR = "XYZ"
# Steps of the last decimal, rounding error of a direction with three rounded components.
ROUNDED = 2.0
# rad, from the singular direction: beyond it angles change at most 1000 times as much as directions.
CLEAR_OF_SINGULAR = 1e-3


@dataclass(frozen=True, eq=False)
class WordWriter:
    """Converts positions to the words of a control, in one kind of coordinates.

    `unit` is that of lengths, ``mm`` or ``inch``.
    """

    dialect: Dialect
    coordinates: Coordinates
    machine: Machine
    unit: str = "mm"

    @property
    def mode(self) -> Mode:
        """The control's table for the coordinates."""
        return self.dialect.modes[self.coordinates]

    @property
    def linear(self) -> str:
        """Template of a linear move."""
        return self.mode.linear or self.dialect.linear

    @property
    def interpolation(self) -> Interpolation:
        """Interpolation of the control between two blocks."""
        return Interpolation.JOINT if self.coordinates == "axes" else Interpolation.TCP

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Prefix of each number: axis letters, or the words of a direction."""
        if self.coordinates == "vector":
            return (*LINEAR, *(self.mode.directions or ("I", "J", "K")))
        return tuple(self.machine.letters)

    @cached_property
    def is_linear(self) -> BoolArray:
        """(c,), whether words are lengths."""
        return np.array([name in LINEAR for name in self.names])

    @cached_property
    def decimals(self) -> Array:
        """(c,), decimals of each word; inches have one more than mm."""
        number = self.dialect.number
        other = number.direction if self.coordinates == "vector" else number.rotary
        return np.where(self.is_linear, number.linear + (self.unit == "inch"), other)

    @cached_property
    def scale(self) -> Array:
        """(c,), factors from mm, deg and unit vectors to the numbers of words."""
        return np.where(self.is_linear, 1.0 / MILLIMETRES[self.unit], 1.0)

    def values(self, positions: Array) -> Array:
        """Compute the numbers of the words, (n, c), in the control's sign, not yet rounded.

        Parameters
        ----------
        positions : (n, k), mm and rad, tool relative to workpiece
        """
        shown = control_values(self.machine, positions)
        if self.coordinates == "axes":
            return shown * self.scale
        tip, axis = tool_poses(self.machine, positions)
        if self.mode.positions == "machine":
            tip = carried_points(self.machine, tip, positions, to_work=False)
        if self.coordinates == "vector":
            if self.dialect.language == "blocks":  # lists don't depend on a machine
                axis = self._inside_ends(positions, axis)
            return np.hstack([tip, axis]) * self.scale
        shown[:, [self.machine.column(c) for c in LINEAR]] = tip
        return shown * self.scale

    def _inside_ends(self, positions: Array, axis: Array) -> Array:
        """Keep directions inside the limits of rotary axes by their rounding error.

        Past a limit the control would choose the other pair of angles, half a turn away on the first axis.
        Directions near the singular one are left unchanged.
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
        """Round numbers of words, (n, c), as printed."""
        return rounded(values, self.decimals)

    def formats(self, templates: Sequence[str | None] = ()) -> list[str]:
        """Return the ``%`` format of each word, (c,).

        Parameters
        ----------
        templates : (c,), with ``{letter}`` and ``{value}``; None, or empty, for the plain word
        """
        sign = "+" if self.dialect.number.plus else ""
        given = templates or [None] * len(self.names)
        numbers = [f"%{sign}.{int(d)}f" for d in self.decimals]
        return [
            (template or "{letter}{value}").replace("%", "%%").format(letter=name, value=number)
            for template, name, number in zip(given, self.names, numbers, strict=True)
        ]

    def words(self, values: Array, only: str | None = None) -> str:
        """Format one row of values, (c,), as ``X1.000000 Y2.000000``: all words or `only` some."""
        row = self.rounded(values[None])[0]
        chosen = [i for i, name in enumerate(self.names) if only is None or name in only]
        formats = self.formats()
        return " ".join(formats[i] for i in chosen) % tuple(row[chosen].tolist())


def require_expressible(dialect: Dialect, coordinates: Coordinates | None, machine: Machine) -> Coordinates:
    """Check that a machine's motion can be written for a control, and return the coordinates.

    By default they are the first of axes, tip and vector that the control has. `SettingError` for
    coordinates that the control doesn't have; `MachineError` for axes that it doesn't know, and TCP control
    for a machine without rotary axes or without X, Y, Z.
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
            f"machine {machine.name!r} has no rotary axis, so it needs no tool centre point control; "
            "write axes"
        )
