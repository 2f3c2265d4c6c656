"""The length unit of a file, stated once or not at all."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.nc.apt.statements import LONGEST_SHOWN
from fiveaxis.nc.source import Source

UNIT_WORDS = {
    **dict.fromkeys(("MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRES", "METRIC"), "mm"),
    **dict.fromkeys(("IN", "INCH", "INCHES"), "inch"),
}


@dataclass
class Units:
    """What is known of the unit while a file is read.

    Parameters
    ----------
    source : the file
    given : the caller's unit for a file that doesn't state it
    stated, stated_line : the file's unit and its line
    used_line : line of the first number in that unit
    inch_feed_line : line of the first feed in inches
    """

    source: Source
    given: str | None
    stated: str | None = None
    stated_line: int | None = None
    used_line: int | None = None
    inch_feed_line: int | None = None

    @property
    def now(self) -> str:
        """The unit in force: ``mm`` or ``inch``."""
        return self.stated or self.given or "mm"

    def use(self, line: int) -> None:
        """Record the first line whose numbers depend on the unit."""
        if self.used_line is None:
            self.used_line = line

    def state(self, minors: list[str], line: int) -> None:
        """Process the file's statement of its unit.

        Raises
        ------
        ToolpathError
            An unknown unit; one that contradicts the caller, an earlier statement, or numbers already read.
        """
        unit = UNIT_WORDS.get(minors[0]) if len(minors) == 1 else None
        if unit is None:
            raise self.source.error(
                f"UNITS/{','.join(minors)[:LONGEST_SHOWN]} isn't known; write UNITS/MM or UNITS/INCHES", line
            )
        if self.given not in (None, unit):
            raise self.source.error(
                f"the file is in {unit}, and unit={self.given} was asked for; leave unit out", line
            )
        before = self.stated_line or self.used_line
        if before is not None and unit != self.now:
            raise self.source.error(
                f"mixed units: {unit} here, and {self.now} from line {before} on; write one file for each "
                "unit",
                line,
            )
        self.stated = unit
        self.stated_line = self.stated_line or line

    def settle(self) -> str:
        """Return the unit of all positions.

        Raises
        ------
        ToolpathError
            Neither the file nor the caller states it, and a feed in inches makes mm uncertain.
        """
        if self.stated is None and self.given is None and self.inch_feed_line is not None:
            raise self.source.error(
                "a feed in inches, in a file without UNITS: its positions may be inches or mm; set "
                "unit=inch or unit=mm",
                self.inch_feed_line,
            )
        return self.now
