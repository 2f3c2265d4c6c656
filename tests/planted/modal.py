"""Faults in modal state: what a program sets wrongly, or doesn't set. Each of them matters."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from planted.words import COMMENT, IN_LIST, Text

# The word or the line that switches tool centre point control on, in all languages.
TCP = re.compile(r"(?:G43\.[45]|G234) H\d+ |^TRAORI$|^(?:\d+ )?(?:FUNCTION TCPM .*|L M128)$|^M428$")
UNIT = re.compile(r"\bG21\b ?|\bG710\b ?|(?<=BEGIN PGM PROGRAM) MM|^UNITS/MM$")
OTHER_UNIT = {"G21": "G20", "G710": "G700", "MM": "INCH", "UNITS/MM": "UNITS/INCHES"}
SPEED = re.compile(r"\bS8000 ?|^\d+ TOOL CALL Z S8000$")
SENSE = re.compile(r"\bM3\b|^\d+ L M3$")
INVERSE_TIME = re.compile(r"^G93$")
FEED = re.compile(r"(?<= F)[\d.]+")
FEDRAT = re.compile(r"(?<=FEDRAT/)[\d.]+")


def rapid(text: Text, rng: np.random.Generator) -> Text | None:
    """One cut at rapid."""
    line = text.moves[int(rng.choice(text.cuts[1:]))]
    was = text.lines[line]
    if was.startswith("GOTO/"):
        return text.replaced(line, "RAPID", was)
    if IN_LIST.match(was):
        # The last columns: a cut or not, rapid or not.
        return text.replaced(line, f"{was[:-3]}0,1")
    other = re.sub(r" F[\d.]+", " FMAX" if " R0 " in was else "", was)
    return text.replaced(line, other.replace("G1 ", "G0 "))


def feed(text: Text, rng: np.random.Generator) -> Text | None:
    """Double the feed of one cut; in an APT file the one FEDRAT."""
    stated = _first(text, FEDRAT)
    if stated is not None:
        return text.replaced(stated, FEDRAT.sub(lambda m: f"{2.0 * float(m[0]):.3f}", text.lines[stated]))
    line = text.moves[int(rng.choice(text.cuts[1:]))]
    was = text.lines[line]
    if IN_LIST.match(was):
        *columns, value, cut, quick = was.split(",")
        return text.replaced(line, ",".join([*columns, f"{2.0 * float(value):.3f}", cut, quick]))
    if not FEED.search(was):
        return None
    return text.replaced(line, FEED.sub(lambda m: f"{2.0 * float(m[0]):.3f}", was))


def _first(text: Text, pattern: re.Pattern[str]) -> int | None:
    return next(
        (i for i, line in enumerate(text.lines) if not COMMENT.match(line) and pattern.search(line)), None
    )


def _without(text: Text, pattern: re.Pattern[str]) -> Text | None:
    """Take out what a pattern finds, and the line where nothing else stands in it."""
    line = _first(text, pattern)
    if line is None:
        return None
    left = pattern.sub("", text.lines[line]).strip()
    return text.replaced(line, left) if left else text.replaced(line)


def tcp_lost(text: Text, _: np.random.Generator) -> Text | None:
    """Tool centre point control isn't switched on."""
    return _without(text, TCP)


def unit_lost(text: Text, _: np.random.Generator) -> Text | None:
    """The unit isn't stated."""
    return _without(text, UNIT)


def unit_inch(text: Text, _: np.random.Generator) -> Text | None:
    """The unit is inch, but the numbers are in mm."""
    line = _first(text, UNIT)
    if line is None:
        return None
    other = UNIT.sub(lambda m: m[0].replace(m[0].strip(), OTHER_UNIT[m[0].strip()]), text.lines[line])
    return text.replaced(line, other)


def speed_lost(text: Text, _: np.random.Generator) -> Text | None:
    """The spindle's speed isn't stated."""
    return _without(text, SPEED)


def sense_lost(text: Text, _: np.random.Generator) -> Text | None:
    """The spindle isn't switched on."""
    return _without(text, SENSE)


def sense_wrong(text: Text, _: np.random.Generator) -> Text | None:
    """The spindle turns in the wrong sense."""
    line = _first(text, SENSE)
    return None if line is None else text.replaced(line, text.lines[line].replace("M3", "M4"))


def feed_mode_lost(text: Text, _: np.random.Generator) -> Text | None:
    """F, the inverse of a block's duration, is read in mm/min."""
    return _without(text, INVERSE_TIME)


FAULTS: tuple[Callable[[Text, np.random.Generator], Text | None], ...] = (
    rapid,
    feed,
    tcp_lost,
    unit_lost,
    unit_inch,
    speed_lost,
    sense_lost,
    sense_wrong,
    feed_mode_lost,
)
