"""One axis of a machine: its limits, drive, mass and location error."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fiveaxis.base import MachineError
from fiveaxis.model.machine.drives import SLOWEST, SLOWEST_TURN, Drive


@dataclass(frozen=True)
class Limits:
    """Range of an axis value, mm or rad; infinite ends if the axis is endless, equal ends if it is held."""

    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if not (self.low < self.high or self.is_fixed):
            raise MachineError(f"axis limits are reversed or empty: {self.low:g} … {self.high:g}")

    @property
    def is_fixed(self) -> bool:
        """Whether the axis is held at one value."""
        return self.low == self.high and math.isfinite(self.low)

    @property
    def unlimited(self) -> bool:
        """Whether the axis is endless in both directions."""
        return math.isinf(self.low) and math.isinf(self.high)

    @property
    def span(self) -> float:
        """Length of the range, mm or rad; infinite if an end is missing."""
        return self.high - self.low

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Both ends, mm or rad; None for a missing one."""
        low, high = (end if math.isfinite(end) else None for end in (self.low, self.high))
        return low, high

    def narrower(self, margin: float) -> Limits:
        """Return the range without a margin, mm or rad, at either end; unchanged where it is no longer."""
        return self if self.span <= 2.0 * margin else Limits(self.low + margin, self.high - margin)

    def contains(self, value: float, tolerance: float = 0.0) -> bool:
        """Check whether a value, mm or rad, is inside the range, or beyond it by at most a tolerance."""
        return self.low - tolerance <= value <= self.high + tolerance


@dataclass(frozen=True)
class LocationError:
    """Deviation of an axis's actual line from its nominal one (ISO 230-7), every axis at 0.

    Parameters
    ----------
    offset : (3,), mm, machine frame; of axis C (X0C, Y0C, Z0C), measured at the `point` of the axis's line
    tilt : (3,), rad, rotation vector in the machine frame; of axis C (A0C, B0C, C0C). A rotation about the
        axis itself would be its zero position, which the control sets: it must be 0

    References
    ----------
    ISO 230-7:2015, 3.5 and annex: location errors of an axis of rotation.
    """

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.offset, *self.tilt))):
            raise MachineError(f"location error {self.offset} mm, {self.tilt} rad: write finite numbers")


@dataclass(frozen=True)
class Axis:
    """One axis.

    Axis values are tool relative to workpiece (ISO 841) on both sides of the bed.

    Parameters
    ----------
    letter : X Y Z A B C
    limits : mm or rad
    drive : model of its power, None where unknown
    max_speed, max_acceleration, max_jerk : mm/s, mm/s², mm/s³ or in rad; None where unknown
    reversed : the control counts this axis in the opposite direction; its sign changes where NC is read and
        written. None where nobody knows: it then counts as False where that does no harm (`unknown_figures`)
    moved_mass : kg that the axis moves, without workpiece and fixture; None where unknown
    mass_centre : (3,), mm, of that mass with every axis at 0, machine frame; for gravity on a rotary axis
    location_error : included in the chain's line; kept so that the nominal line can be recovered
    motor_power : W, rated power of its motor; None where unknown
    """

    letter: str
    limits: Limits = Limits()
    drive: Drive | None = None
    max_speed: float | None = None
    max_acceleration: float | None = None
    max_jerk: float | None = None
    reversed: bool | None = False
    moved_mass: float | None = None
    mass_centre: tuple[float, float, float] | None = None
    location_error: LocationError | None = None
    motor_power: float | None = None

    def __repr__(self) -> str:
        return f"<Axis {self.letter}: {self.range_text}, {type(self.drive).__name__}>"

    @property
    def range_text(self) -> str:
        """The limits in display units."""
        if self.limits.unlimited:
            return "no limits"
        low, high = (self.shown(end) for end in (self.limits.low, self.limits.high))
        return f"{low:g}…{high:g} {self.unit}"

    @property
    def is_rotary(self) -> bool:
        """Whether the value is an angle."""
        return self.letter in "ABC"

    @property
    def slowest_assumed(self) -> float:
        """Slowest measured speed of a drive that states none, mm/s or rad/s: that of the published table.

        It is at most the fastest measured speed and the axis's highest.
        """
        ends = (
            SLOWEST_TURN if self.is_rotary else SLOWEST,
            self.max_speed,
            getattr(self.drive, "measured_to", None),
        )
        return min(end for end in ends if end)

    @property
    def unit(self) -> str:
        """Unit in which the axis value is displayed."""
        return "deg" if self.is_rotary else "mm"

    def shown(self, value: float) -> float:
        """Convert a value in mm or rad to display units, mm or degrees."""
        return math.degrees(value) if self.is_rotary else value
