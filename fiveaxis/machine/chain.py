"""The kinematic chain between workpiece and tool, as a product of exponentials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.geometry import Array, normalise
from fiveaxis.machine.code import FormShapingCode

UNIT_DIRECTION = {
    "X": (1.0, 0.0, 0.0),
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
    "A": (1.0, 0.0, 0.0),
    "B": (0.0, 1.0, 0.0),
    "C": (0.0, 0.0, 1.0),
}

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Line:
    """Where an axis lies: its direction, and for a rotary axis a point of it.

    Parameters
    ----------
    direction : (3,), made a unit vector; machine frame at home
    point : (3,), mm, machine frame at home; without meaning for a linear axis
    """

    direction: Triple
    point: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        direction = np.asarray(self.direction, dtype=float)
        if not np.linalg.norm(direction) > 0.0:
            raise MachineError("an axis has a direction of length 0; give three numbers, not all zero")
        object.__setattr__(self, "direction", tuple(float(c) for c in normalise(direction)))


@dataclass(frozen=True)
class Joint:
    """One factor of the chain: an axis letter and where the axis lies."""

    letter: str
    line: Line

    @property
    def is_rotary(self) -> bool:
        """Whether the joint turns."""
        return self.letter in "ABC"


def _identity() -> Array:
    return np.eye(4)


@dataclass(frozen=True, eq=False)
class Chain:
    """``T(q) = E_1(q_1) … E_k(q_k) · M``: the tool tip's frame in the workpiece.

    Parameters
    ----------
    joints : from the workpiece to the tool
    tool_home : (4, 4), mm; M, the tool-tip frame in the machine frame with every axis at 0
    """

    joints: tuple[Joint, ...]
    tool_home: Array = field(default_factory=_identity)

    @classmethod
    def from_code(cls, code: FormShapingCode, lines: Mapping[str, Line] | None = None) -> Chain:
        """Build the chain of a form-shaping code.

        Parameters
        ----------
        code : structure
        lines : where axes lie that aren't through the origin along their own letter's direction
        """
        given = lines or {}
        return cls(tuple(Joint(c, given.get(c, Line(UNIT_DIRECTION[c]))) for c in code.letters))

    @property
    def rotaries(self) -> tuple[str, ...]:
        """Letters of the rotary axes, from the workpiece to the tool."""
        return tuple(j.letter for j in self.joints if j.is_rotary)

    @property
    def linears(self) -> tuple[str, ...]:
        """Letters of the linear axes, from the workpiece to the tool."""
        return tuple(j.letter for j in self.joints if not j.is_rotary)
