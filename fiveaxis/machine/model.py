"""The machine: structure, axes, powers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.geometry import Array
from fiveaxis.machine.axes import Axis
from fiveaxis.machine.chain import Chain
from fiveaxis.machine.code import AXIS_ORDER, FormShapingCode, parse_code


@dataclass(frozen=True)
class Provenance:
    """Where a figure of a machine comes from: a source, or an assumption with its sentence."""

    figure: str
    shown: str
    source: str
    assumed: bool


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine tool.

    Parameters
    ----------
    name : short name
    code : form-shaping code
    chain : joints with their lines, and the tool at home
    axes : sorted X Y Z A B C; axis values of a path have their columns in this order
    base_power : W that the machine draws whatever it does, None where unknown
    provenance : every figure with its source
    """

    name: str
    code: FormShapingCode
    chain: Chain
    axes: tuple[Axis, ...]
    base_power: float | None = None
    description: str = ""
    provenance: tuple[Provenance, ...] = field(default=())

    @classmethod
    def from_code(cls, code: str) -> Machine:
        """Make a machine without offsets, limits or powers from its form-shaping code.

        Raises
        ------
        CodeError
            The code doesn't name a machine.
        """
        parsed = parse_code(code)
        letters = sorted(parsed.letters, key=AXIS_ORDER.index)
        return cls(code, parsed, Chain.from_code(parsed), tuple(Axis(c) for c in letters))

    @cached_property
    def letters(self) -> str:
        """Axis letters in column order, e.g. ``XYZAC``."""
        return "".join(a.letter for a in self.axes)

    @cached_property
    def rotaries(self) -> tuple[str, ...]:
        """Letters of the rotary axes in chain order, from the workpiece to the tool."""
        return self.chain.rotaries

    @cached_property
    def rotary_columns(self) -> list[int]:
        """Columns of the rotary axes, in chain order."""
        return [self.column(c) for c in self.rotaries]

    @cached_property
    def linear_columns(self) -> list[int]:
        """Columns of the linear axes, in column order."""
        return [i for i, a in enumerate(self.axes) if not a.is_rotary]

    def column(self, letter: str) -> int:
        """Find the column of an axis letter in arrays of axis values."""
        if letter not in self.letters:
            raise MachineError(
                f"machine {self.name!r} has no axis {letter}; it has {', '.join(self.letters)}"
            )
        return self.letters.index(letter)

    def axis(self, letter: str) -> Axis:
        """Find an axis by its letter."""
        return self.axes[self.column(letter)]

    @cached_property
    def low(self) -> Array:
        """(k,), mm and rad, lower limits."""
        return np.array([a.limits.low for a in self.axes])

    @cached_property
    def high(self) -> Array:
        """(k,), mm and rad, upper limits."""
        return np.array([a.limits.high for a in self.axes])

    @property
    def has_powers(self) -> bool:
        """Whether every axis has a drive with known power."""
        return all(a.drive is not None for a in self.axes)

    def shown(self, positions: Array) -> Array:
        """Convert axis values (…, k) from mm and rad to mm and degrees."""
        scale = np.array([180.0 / np.pi if a.is_rotary else 1.0 for a in self.axes])
        return positions * scale

    def with_drives_of(self, other: Machine) -> Machine:
        """Return this machine with the axis powers of another one, letter by letter.

        For a machine whose powers nobody has measured: a comparison of postures then rests on the other
        machine's figures, and the provenance says so.

        Raises
        ------
        MachineError
            The other machine lacks an axis of this one.
        """
        axes = tuple(replace(a, drive=other.axis(a.letter).drive) for a in self.axes)
        borrowed = tuple(
            replace(p, source=f"taken from {other.name}: {p.source}", assumed=True)
            for p in other.provenance
            if p.figure.endswith("drive")
        )
        kept = tuple(p for p in self.provenance if not p.figure.endswith("drive"))
        return replace(self, axes=axes, provenance=kept + borrowed)
