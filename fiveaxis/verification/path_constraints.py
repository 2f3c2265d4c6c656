"""What an optimisation was bound by, to be held against the motion that came out of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.toolpath import TiltBounds, Toolpath, tilt_bounds, turned


@dataclass(frozen=True, eq=False)
class PathConstraints:
    """Bounds on postures and turns; what is None or empty wasn't asked for.

    Parameters
    ----------
    leaning : on the angles between the tool axis and directions
    hold : rad by letter, where rotary axes stand
    max_turn : rad, of a rotary axis in one cutting move
    turn_rate : rad/mm, of a rotary axis over the way of the pivot in cutting moves
    cone : rad, half angle about the first rotary axis in which that axis turns by `cone_rate` at most
    cone_rate : rad/mm
    cutting : (n,), whether the move to a location cuts: the lean between two is bound only there; None where
        all do
    inserted : (n,), locations between those that were given; None where there are none
    passed : (n,), those of them that nobody optimised: the axes pass them; None where there are none
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
    def of_degrees(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        *,
        hold: Mapping[str, float] | None = None,
        max_turn: float | None = None,
        turn_rate: float | None = None,
        singular_cone: float | None = None,
        singular_rate: float = 0.0,
        **leaning: Any,
    ) -> PathConstraints:
        """Take bounds as `verify` does, deg and deg/mm, for a path in the zone that its lean asks for.

        Raises
        ------
        SettingError
            A bound out of its range; an axis that the machine hasn't got; what `tilt_bounds` refuses.
        ToolpathError
            A path without the direction that a bound refers to.
        """
        foreign = sorted(set(hold or {}) - set(machine.rotaries))
        if foreign:
            raise SettingError(
                f"{', '.join(foreign)} can't be held: the rotary axes of {machine.name} are "
                f"{', '.join(machine.rotaries)}; write for example C=30"
            )
        _require_within("max_turn", max_turn, math.ulp(0.0), math.inf, "deg")
        _require_within("turn_rate", turn_rate, math.ulp(0.0), math.inf, "deg/mm")
        _require_within("singular_cone", singular_cone, math.ulp(0.0), math.nextafter(90.0, 0.0), "deg")
        if singular_cone is None and singular_rate:
            raise SettingError(
                f"singular_rate {singular_rate:g} deg/mm belongs to a singular cone; give that too"
            )
        _require_within("singular_rate", singular_rate, 0.0, math.inf, "deg/mm")
        bound = any(value is not None for value in leaning.values())
        return cls(
            leaning=tilt_bounds(toolpath, **leaning) if bound else None,
            hold={letter: math.radians(angle) for letter, angle in (hold or {}).items()},
            max_turn=_radians(max_turn),
            turn_rate=_radians(turn_rate),
            cone=_radians(singular_cone),
            cone_rate=math.radians(singular_rate),
            cutting=toolpath.cutting,
            inserted=toolpath.inserted if toolpath.inserted.any() else None,
        )

    def between(self, row: Array) -> PathConstraints:
        """Return the bounds for a path with inserted locations.

        What a bound refers to (a normal, a programmed axis) turns evenly from one location to the next.
        Within a link or a rapid move nothing binds.

        Parameters
        ----------
        row : (m,), places of the locations in rows of the path that the bounds are of: 3.25 lies between
            3 and 4
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


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)


def _require_within(name: str, value: float | None, low: float, high: float, unit: str) -> None:
    if value is not None and not low <= value <= high:
        sign = "can't be negative" if low == 0.0 else "must be above 0"
        top = "" if high == math.inf else f" and below {math.ceil(high):g}"
        raise SettingError(f"{name} is {value:g} {unit}; it {sign}{top}")
