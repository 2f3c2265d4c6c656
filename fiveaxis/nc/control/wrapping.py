"""Rotary words from 0 to 360 deg: to which turn of the axis each of them leads.

Such words say where an axis stops, and not how it gets there. Controls have two rules: the shorter way
(Fanuc with roll-over, Klartext under M126), or the way that the word's sign says (LinuxCNC's
``WRAPPED_ROTARY``). A program rarely names its rule, so the caller does (`ReadOptions.wrap`), or a line of
the header that `compose_program` writes.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.machine import Machine
from fiveaxis.nc.languages.choice import KLARTEXT, SINUMERIK, find_language
from fiveaxis.nc.options import Wrap
from fiveaxis.nc.source import Source

# deg
TURN, HALF_TURN = 360.0, 180.0
# deg: a place as near as this to where the axis stands is that place, and no turn away.
SAME = 1e-9

# What a program says, in its first lines, whose rotary words LinuxCNC takes as wrapped.
WRAPPED, HEAD = "WRAPPED_ROTARY", 100
_STATED = re.compile(r"winding: modulo (shorter|signed) ([ABC]+)", re.IGNORECASE)


@dataclass(frozen=True)
class Wrapping:
    """Which rotary axes have words from 0 to 360, and by which rule they turn.

    Parameters
    ----------
    rule : None where words are read as they stand
    columns : of the axes
    switched : whether the program switches the rule on and off (M126, M127)
    """

    rule: Wrap | None = None
    columns: tuple[int, ...] = ()
    switched: bool = False

    def place(self, word: float, now: float | None) -> float:
        """Give the place, deg, to which a word leads an axis; of the first turn where none is known.

        Parameters
        ----------
        word : deg, as written, its sign included
        now : deg, where the axis stands, counted as words are
        """
        if self.rule == "signed":
            return _signed(word, now)
        return word if now is None else _shorter(word, now)

    def fault(self, letter: str, word: float) -> str | None:
        """Say what is wrong with a word; None where nothing is."""
        if self.rule != "signed" or abs(word) < TURN:
            return None
        return (
            f"{letter}{word:g} is beyond a turn, and signed rotary words go from -360 to 360; say "
            "wrap=unwound, if the axis isn't wrapped"
        )


def _signed(word: float, now: float | None) -> float:
    """Turn the way that the sign says, -0 included, to the place that the number says (LinuxCNC 2.9)."""
    if now is None:
        return abs(word)
    backwards = math.copysign(1.0, word) < 0.0
    place = abs(word) + TURN * math.floor(now / TURN)
    # Of the places a turn apart the one where the axis stands is no move, whichever way.
    for near in (place - TURN, place, place + TURN):
        if abs(near - now) <= SAME:
            return near
    if backwards:
        return place - TURN if place > now else place
    return place + TURN if place < now else place


def _shorter(word: float, now: float) -> float:
    """Turn the shorter way; forwards where both are half a turn."""
    forward = (word - now) % TURN
    return now + (forward if forward <= HALF_TURN else forward - TURN)


def find_wrapping(source: Source, machine: Machine, wrap: Wrap | None, *, stand_in: bool) -> Wrapping:
    """Find the rule by which a program's rotary words turn the axes.

    Parameters
    ----------
    wrap : as the caller says; None for what stands in the program's header, words as they stand by default
    stand_in : whether the machine only stands in for one that nobody has given

    Raises
    ------
    SettingError
        A rule that the program's language hasn't; no axis that it could be about.
    ToolpathError
        With file and line: the program says that its words are wrapped, and not by which rule.
    """
    if wrap == "unwound":
        return Wrapping()
    language = find_language(source)
    stated = None if wrap is not None else _stated(source)
    rule, letters = (wrap, None) if stated is None else stated
    if rule is None:
        return Wrapping()
    if language == SINUMERIK:
        if wrap is not None:
            raise SettingError(
                f"wrap = {wrap!r}, and a Sinumerik program says the way in each word (DC, ACP, ACN); leave "
                "it out"
            )
        return Wrapping()
    if rule == "signed" and language == KLARTEXT:
        raise SettingError("wrap = 'signed', and Klartext goes the shorter way (M126); say wrap=shorter")
    columns = _columns(machine, letters)
    if not columns and wrap is not None:
        missing = "give the machine" if stand_in else f"machine {machine.name!r} has none; leave it out"
        raise SettingError(f"wrap = {wrap!r} is for rotary axes of more than a turn, and {missing}")
    return Wrapping(rule, columns, switched=language == KLARTEXT)


def _stated(source: Source) -> tuple[Wrap, str] | None:
    """Read the rule, and the letters of its axes, in the header that a program of ours has."""
    for line, text in enumerate(source.lines[:HEAD], start=1):
        found = _STATED.search(text)
        if found is not None:
            return ("signed" if found[1].lower() == "signed" else "shorter"), found[2].upper()
        if WRAPPED in text:
            raise _unsaid(source, line, text)
    return None


def _unsaid(source: Source, line: int, text: str) -> ToolpathError:
    return source.error(
        f"{text.strip()[:60]!r}: rotary words may count from 0 to 360 here, and their signs be directions "
        "to turn in; say wrap=signed (--wrap signed) if they do, wrap=unwound if they don't",
        line,
    )


def _columns(machine: Machine, letters: str | None) -> tuple[int, ...]:
    """Give the columns of axes by their letters; by default of those with more than a turn."""
    if letters is not None:
        return tuple(machine.column(c) for c in letters if c in machine.letters)
    limits = [(c, machine.axes[c].limits) for c in machine.rotary_columns]
    return tuple(c for c, a in limits if np.degrees(a.high - a.low) > TURN)
