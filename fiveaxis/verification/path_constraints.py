"""The constraints of an optimisation, against which the resulting motion is checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Constraints, TiltBounds, Toolpath, turned


@dataclass(frozen=True, eq=False)
class PathConstraints:
    """Bounds on postures and turns; None or empty is no bound.

    Parameters
    ----------
    leaning : on the angles between the tool axis and directions
    hold : rad by letter, at which rotary axes are held
    max_turn : rad, of a rotary axis in one cutting move
    turn_rate : rad/mm, of a rotary axis per length of the pivot's path in cutting moves
    cone : rad, half angle about the first rotary axis, in which that axis turns by at most `cone_rate`
    cone_rate : rad/mm
    cutting : (n,), whether the move to a location cuts: only there the lean between locations is bounded;
        None if all do
    inserted : (n,), locations inserted between the given ones; None if there are none
    passed : (n,), inserted locations whose posture wasn't optimised but follows from the axes' motion; None
        if there are none
    """

    leaning: TiltBounds | None = None
    hold: Mapping[str, float] = field(default_factory=dict)
    max_turn: float | None = None
    turn_rate: float | None = None
    cone: float | None = None
    cone_rate: float = 0.0
    cutting: BoolArray | None = None
    inserted: BoolArray | None = None
    passed: BoolArray | None = None

    @classmethod
    def of(cls, toolpath: Toolpath, machine: Machine, constraints: Constraints) -> PathConstraints:
        """Apply constraints to a path in their zone (`Constraints.zoned`).

        Raises
        ------
        SettingError
            A held axis that the machine hasn't got; a plane without another bound on the lean.
        ToolpathError
            A path without the direction that a bound refers to.
        """
        foreign = sorted(set(constraints.hold) - set(machine.rotaries))
        if foreign:
            raise SettingError(
                f"{', '.join(foreign)} can't be held: the rotary axes of {machine.name} are "
                f"{', '.join(machine.rotaries)}; write for example C=30"
            )
        return cls(
            leaning=constraints.lean_bounds(toolpath) if constraints.bounds_lean else None,
            hold=constraints.hold,
            max_turn=constraints.max_turn,
            turn_rate=constraints.turn_rate,
            cone=constraints.singular_cone,
            cone_rate=constraints.singular_rate,
            cutting=toolpath.cutting,
            inserted=toolpath.inserted if toolpath.inserted.any() else None,
        )

    def between(self, row: Array) -> PathConstraints:
        """Return the bounds for a path with inserted locations.

        The direction that a bound refers to (a normal, a programmed axis) turns uniformly from one location
        to the next. Within a link or a rapid move there is no bound.

        Parameters
        ----------
        row : (m,), fractional rows of the path with these bounds: 3.25 lies between 3 and 4
        """
        passed: BoolArray = row != np.floor(row)
        inserted = passed
        if self.inserted is not None:
            inserted = inserted | self.inserted[np.floor(row).astype(np.int64)]
        cutting = None if self.cutting is None else self.cutting[np.ceil(row).astype(np.int64)]
        spread = replace(self, cutting=cutting, inserted=inserted, passed=passed)
        if self.leaning is None:
            return spread
        every = [replace(b, reference=turned(b.reference, row), beside=()) for b in self.leaning.all]
        leaning = replace(every[0], beside=tuple(every[1:]))
        if cutting is not None:
            leaning = leaning.only(cutting | (row == np.floor(row)))
        return replace(spread, leaning=leaning)
