"""Feeds of an APT file: ``FEDRAT`` with number and unit in either order."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.nc.rows import DEFAULT_FEED, MILLIMETRES, parse_number
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units

# Feed word -> length unit (None: the file's) and whether it counts per revolution of the spindle.
FEED_WORDS: dict[str, tuple[str | None, bool]] = {
    "MMPM": ("mm", False),
    "IPM": ("inch", False),
    "PERMIN": (None, False),
    "MMPR": ("mm", True),
    "IPR": ("inch", True),
    "PERREV": (None, True),
}


@dataclass
class Feeds:
    """The feed in force while a file is read.

    Parameters
    ----------
    source : the file
    asked : mm/min, a feed of the caller that replaces the file's everywhere
    now, first : mm/min, the last and the first ``FEDRAT``, None before that
    spindle : rev/min, None where the file hasn't said
    """

    source: Source
    asked: float | None
    now: float | None = None
    first: float | None = None
    spindle: float | None = None

    def state(self, minors: list[str], line: int, units: Units) -> None:
        """Take a ``FEDRAT`` statement; ``units`` learns of feeds in inches.

        Raises
        ------
        ToolpathError
            No number or several, an unknown word, a feed per revolution at an unknown speed, a feed that
            isn't above 0.
        """
        number, unit, per_turn = self._read(minors, line)
        if unit is None:
            units.use(line)
        elif unit == "inch" and units.inch_feed_line is None:
            units.inch_feed_line = line
        if self.asked is not None:
            return
        feed = number * MILLIMETRES[unit or units.now] * (self._turns(minors, line) if per_turn else 1.0)
        if not (math.isfinite(feed) and feed > 0.0):
            raise self.source.error(f"feed = {feed:g} mm/min; it must be a number above 0", line)
        self.now = feed
        self.first = self.first or feed

    def turn(self, minors: list[str]) -> None:
        """Take a ``SPINDL`` statement: its only number is the speed, if it is one in rev/min."""
        numbers, words = _sort(minors)
        if "OFF" in words or "SFM" in words or "SMM" in words:
            self.spindle = None
        elif len(numbers) == 1:
            self.spindle = numbers[0]

    def fill(self, feeds: list[float | None]) -> Array:
        """Give every location a feed, (n,) mm/min: before the first ``FEDRAT`` the feed of that one.

        Parameters
        ----------
        feeds : what was in force at each location
        """
        default = self.first or DEFAULT_FEED
        if self.asked is not None:
            return np.full(len(feeds), self.asked)
        return np.array([default if f is None else f for f in feeds])

    def _read(self, minors: list[str], line: int) -> tuple[float, str | None, bool]:
        numbers, words = _sort(minors)
        text = f"FEDRAT/{','.join(minors)}"
        unknown = [w for w in words if w not in FEED_WORDS]
        if unknown:
            raise self.source.error(
                f"{text}: {unknown[0]!r} isn't known; known: {', '.join(FEED_WORDS)}", line
            )
        if len(numbers) != 1 or len(words) > 1:
            raise self.source.error(f"{text}: one number and at most one unit are needed", line)
        unit, per_turn = FEED_WORDS[words[0]] if words else (None, False)
        return numbers[0], unit, per_turn

    def _turns(self, minors: list[str], line: int) -> float:
        if self.spindle is None:
            raise self.source.error(
                f"FEDRAT/{','.join(minors)} counts per revolution, and no SPINDL before it gives rev/min; "
                "write the feed per minute, or give one feed for the path (feed_mm_min)",
                line,
            )
        return self.spindle


def _sort(minors: list[str]) -> tuple[list[float], list[str]]:
    """Part numbers from words."""
    numbers, words = [], []
    for part in minors:
        try:
            numbers.append(parse_number(part))
        except ValueError:
            words.append(part)
    return numbers, words
