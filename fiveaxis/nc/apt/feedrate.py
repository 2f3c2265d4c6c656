"""Feeds of an APT file: ``FEDRAT`` with number and unit in either order."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array
from fiveaxis.nc.apt.statements import LONGEST_SHOWN, numbers_and_words
from fiveaxis.nc.rows import DEFAULT_FEED, MILLIMETRES
from fiveaxis.nc.units import Units

# Feed word -> length unit (None: the file's) and whether it is per revolution of the spindle.
FEED_WORDS: dict[str, tuple[str | None, bool]] = {
    "MMPM": ("mm", False),
    "IPM": ("inch", False),
    "PERMIN": (None, False),
    "MMPR": ("mm", True),
    "IPR": ("inch", True),
    "PERREV": (None, True),
}

# Words of SPINDL whose number isn't the speed.
OTHER_SPINDLE_WORDS = ("RANGE", "MAXRPM", "ORIENT", "RADIUS", "OSETNO")


@dataclass
class Feeds:
    """The feed in force while a file is read.

    Parameters
    ----------
    units : the length unit of the file
    override : mm/min, the caller's feed in place of all feeds of the file
    now, first : mm/min, the last and the first ``FEDRAT``, None before that
    spindle : rev/min, None if unknown
    highest : highest feed in the file's unit per minute; None if all state their unit
    """

    units: Units
    override: float | None
    now: float | None = None
    first: float | None = None
    spindle: float | None = None
    highest: float | None = None

    def state(self, minors: list[str], line: int) -> None:
        """Process ``FEDRAT``; feeds in inches are noted in the units.

        `ToolpathError` for no number or several, an unknown word, a feed per revolution at an unknown speed,
        or a feed that isn't above 0.
        """
        feed = self.convert(minors, line)
        if feed is not None:
            self.now = feed
            self.first = self.first or feed

    def convert(self, minors: list[str], line: int) -> float | None:
        """Convert a number and its unit to a feed, mm/min, None with an override; errors as in `state`."""
        units, (number, unit, per_turn) = self.units, self._read(minors, line)
        if units.overridden is not None and unit == units.overridden[0]:
            unit = None  # it repeats the file's unit, in place of which the caller gives another
        if unit is None:
            units.use(line)
        elif unit == "inch" and units.inch_feed_line is None:
            units.inch_feed_line = line
        if self.override is not None:
            return None
        feed = number * MILLIMETRES[unit or units.now]
        feed *= self._spindle_speed(minors, line) if per_turn else 1.0
        if not (math.isfinite(feed) and feed > 0.0):
            raise self.units.source.error(f"feed = {feed:g} mm/min; it must be a number above 0", line)
        if unit is None:
            self.highest = max(self.highest or 0.0, feed / MILLIMETRES[units.now])
        return feed

    def set_spindle(self, minors: list[str]) -> None:
        """Process ``SPINDL``: its only number is the speed, if in rev/min.

        Numbers after a word of `OTHER_SPINDLE_WORDS` aren't speeds. Several numbers leave the speed unknown,
        so that no feed per revolution uses the wrong one.
        """
        parts = [m for i, m in enumerate(minors) if i == 0 or minors[i - 1] not in OTHER_SPINDLE_WORDS]
        numbers, words = numbers_and_words(parts)
        if {"OFF", "SFM", "SMM"} & set(words) or len(numbers) > 1:
            self.spindle = None
        elif len(numbers) == 1:
            self.spindle = abs(numbers[0])

    def fill(self, feeds: Array) -> Array:
        """Return a feed for every location, (n,) mm/min: before the first ``FEDRAT`` the feed of that one.

        The given feeds, (n,), are in force at each location, NaN if none.
        """
        if self.override is not None:
            return np.full(len(feeds), self.override)
        return np.where(np.isnan(feeds), self.first or DEFAULT_FEED, feeds)

    def _read(self, minors: list[str], line: int) -> tuple[float, str | None, bool]:
        numbers, words = numbers_and_words(minors)
        text = f"FEDRAT/{','.join(minors)}"[:LONGEST_SHOWN]
        unknown = [w for w in words if w not in FEED_WORDS]
        if unknown:
            raise self.units.source.error(
                f"{text}: {unknown[0][:LONGEST_SHOWN]!r} isn't known; known: {', '.join(FEED_WORDS)}", line
            )
        if len(numbers) != 1 or len(words) > 1:
            raise self.units.source.error(f"{text}: one number and at most one unit are needed", line)
        unit, per_turn = FEED_WORDS[words[0]] if words else (None, False)
        return numbers[0], unit, per_turn

    def _spindle_speed(self, minors: list[str], line: int) -> float:
        if self.spindle is None:
            raise self.units.source.error(
                f"FEDRAT/{','.join(minors)} counts per revolution, and no SPINDL before it gives rev/min; "
                "write the feed per minute, or give one feed for the path (feed_mm_min)",
                line,
            )
        return self.spindle
