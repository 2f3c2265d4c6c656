"""The length unit of a file: the caller's, else the file's own, else mm; and whether its sizes fit that."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fiveaxis.base import Finding, LengthUnit, Severity
from fiveaxis.model import Machine
from fiveaxis.nc.apt.statements import LONGEST_SHOWN
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source

UNIT_WORDS: dict[str, LengthUnit] = {
    **dict.fromkeys(("MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRES", "METRIC"), "mm"),
    **dict.fromkeys(("IN", "INCH", "INCHES"), "inch"),
}


@dataclass
class Units:
    """What is known of the unit while a file is read.

    Parameters
    ----------
    source : the file
    given : the caller's unit, in place of the file's
    stated, stated_line : the file's unit and its line
    used_line : line of the first number in that unit
    inch_feed_line : line of the first feed in inches
    overridden : the file's unit and its line, where the caller's is another one
    """

    source: Source
    given: LengthUnit | None
    stated: LengthUnit | None = None
    stated_line: int | None = None
    used_line: int | None = None
    inch_feed_line: int | None = None
    overridden: tuple[str, int] | None = None

    @property
    def now(self) -> LengthUnit:
        """The unit in force: ``mm`` or ``inch``."""
        return self.given or self.stated or "mm"

    def use(self, line: int) -> None:
        """Record the first line whose numbers depend on the unit."""
        if self.used_line is None:
            self.used_line = line

    def state(self, minors: list[str], line: int) -> None:
        """Process the file's statement of its unit; of several before the first number the last one holds.

        `ToolpathError` for an unknown unit, or another one than that of numbers already read.
        """
        unit = UNIT_WORDS.get(minors[0]) if len(minors) == 1 else None
        if unit is None:
            raise self.source.error(
                f"UNITS/{','.join(minors)[:LONGEST_SHOWN]} isn't known; write UNITS/MM or UNITS/INCHES", line
            )
        if self.given is not None:
            if unit != self.given:
                self.overridden = self.overridden or (unit, line)
            return
        if self.used_line is not None and unit != self.now:
            before = self.stated_line or self.used_line
            raise self.source.error(
                f"mixed units: {unit} here, and {self.now} from line {before} on; write one file for each "
                "unit",
                line,
            )
        self.stated_line = self.stated_line if unit == self.stated else line
        self.stated = unit

    def settle(self) -> LengthUnit:
        """Return the unit of all positions.

        `ToolpathError` if neither the file nor the caller states it, and a feed in inches makes mm
        uncertain.
        """
        if self.stated is None and self.given is None and self.inch_feed_line is not None:
            raise self.source.error(
                "a feed in inches, in a file without UNITS: its positions may be inches or mm; set "
                "unit=inch or unit=mm",
                self.inch_feed_line,
            )
        return self.now

    def judge(self, size: Size, machine: Machine | None) -> tuple[LengthUnit, list[Finding]]:
        """Return the unit that the file is in, and findings: it isn't the file's, or doesn't fit the sizes.

        Where no unit is stated, it is inch if the sizes fit that and don't fit mm. Sizes are those of what
        was read, in the unit in force; the machine is None if unknown.
        """
        other, why = _other(self.now), " and ".join(size.faults(self.now, machine))
        figures = self._figures(size)
        code, text, line = "", "", self.stated_line or self.used_line
        unit = self.now
        if why and (neither := " and ".join(size.faults(other, machine))):
            code = "unit-doubtful"
            text = (
                f"lengths fit neither unit: in {self.now}, as they are read, {why}; in {other}, {neither}: "
                f"{figures}; check unit, decimal points and feeds in the CAM system"
            )
        elif why:
            if self.stated is None and self.given is None:
                code, unit, whose = "unit-assumed", other, "as no unit is stated"
                cure = f"{other} is assumed instead, set unit={self.now} (--unit {self.now}) if it isn't"
            else:
                code, whose = "unit-doubtful", "as asked for" if self.given else "as the file says"
                cure = f"set unit={other} (--unit {other}) if that is meant"
            text = f"lengths are read in {self.now}, {whose}, and {why}: {figures}; {cure}"
        elif self.overridden is not None:
            code, (stated, line) = "unit-overridden", self.overridden
            text = f"the file states {stated}, and is read in {self.given} as asked for: {figures}"
        return unit, [self.source.finding(Severity.WARNING, code, text, line)] if code else []

    def assumed(self, size: Size, severity: Severity, how: str) -> Finding:
        """Return the finding on a unit that isn't stated, with the sizes in both units.

        `how` says where the unit could stand.
        """
        text = (
            f"the file doesn't state its unit{how}; {self.now} is assumed, set unit={_other(self.now)} if it "
            f"isn't: {self._figures(size)}"
        )
        return self.source.finding(severity, "unit-assumed", text, self.used_line)

    def _figures(self, size: Size) -> str:
        other = _other(self.now)
        return f"{size.text(self.now)} as {self.now}, {size.text(other)} as {other}"


@dataclass(frozen=True)
class Size:
    """What shows the unit of lengths, as numbers in that unit; None where a file doesn't have it.

    Parameters
    ----------
    extent : largest range of the cuts along X, Y or Z
    feed : highest feed, per minute
    cutter : diameter
    """

    extent: float
    feed: float | None = None
    cutter: float | None = None

    def faults(self, unit: str, machine: Machine | None) -> list[str]:
        """Return why the numbers can't be in a unit, none if they can."""
        ranges = (
            ("the cuts' extent", self.extent, 0.0, _largest(machine), "mm"),
            ("the feed", self.feed, *FEEDS, "mm/min"),
            ("the cutter's diameter", self.cutter, *CUTTERS, "mm"),
        )
        found = []
        for what, number, low, high, name in ranges:
            value = None if number is None else number * MILLIMETRES[unit]
            if value is not None and not low <= value <= high:
                side, bound = ("below", low) if value < low else ("above", high)
                found.append(f"{what} of {value:.6g} {name} is {side} {bound:g}")
        return found

    def text(self, unit: str) -> str:
        """Write the sizes in mm, if the numbers are in a unit."""
        scale = MILLIMETRES[unit]
        parts = [f"cuts over {self.extent * scale:.6g} mm"]
        parts += [] if self.feed is None else [f"at up to F{self.feed * scale:.6g} mm/min"]
        parts += [] if self.cutter is None else [f"by a cutter of {self.cutter * scale:.6g} mm"]
        return " ".join(parts)


# mm and mm/min: sizes of five-axis work beyond which a unit is doubtful.
LARGEST_EXTENT = 4000.0
FEEDS = (4.0, 25_000.0)
CUTTERS = (0.05, 160.0)
# Largest part that a machine's travel allows, by its length: a table that turns brings both sides before
# the tool.
TRAVELS = 2.0


def _largest(machine: Machine | None) -> float:
    """Return the largest extent of cuts, mm, by a machine's travel."""
    spans = [] if machine is None else [a.limits.span for a in machine.axes if not a.is_rotary]
    travel = TRAVELS * max(spans, default=math.inf)
    return travel if math.isfinite(travel) else LARGEST_EXTENT


def _other(unit: LengthUnit) -> LengthUnit:
    return "inch" if unit == "mm" else "mm"
