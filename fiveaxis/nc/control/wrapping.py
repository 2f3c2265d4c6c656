"""Unwrapping of rotary words from 0 to 360 deg.

Such words give the end of a rotation, but not its direction. Controls have two rules: the shorter direction
(Fanuc with roll-over, Klartext under M126), or the direction of the word's sign (LinuxCNC's
``WRAPPED_ROTARY``). A program rarely states its rule, so the caller does (`ReadOptions.wrap`), or the header
that `compose_program` writes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import SettingError, Wrap
from fiveaxis.model import Machine
from fiveaxis.nc.languages.block import block_error
from fiveaxis.nc.languages.choice import KLARTEXT, SINUMERIK, Language
from fiveaxis.nc.own_header import MODULO
from fiveaxis.nc.source import HEAD, Source

# deg
TURN, HALF_TURN = 360.0, 180.0
# deg: closer angles are equal, not a full turn apart.
SAME = 1e-9

# Mark of LinuxCNC programs with wrapped rotary words.
WRAPPED = "WRAPPED_ROTARY"


@dataclass(frozen=True)
class Wrapping:
    """Rotary axes with words from 0 to 360, and the rule of their direction.

    Parameters
    ----------
    rule : None if words are read as written
    columns : of the axes
    switched : whether the program switches the rule on and off (M126, M127)
    """

    rule: Wrap | None = None
    columns: tuple[int, ...] = ()
    switched: bool = False

    def unwrap(self, word: float, now: float | None) -> float:
        """Return the unwrapped angle, deg, that a word leads to; on the first turn if `now` is unknown.

        The word is deg, as written, including its sign; `now`, deg, is unwrapped, in the same coordinates.
        """
        if self.rule == "signed":
            return _signed(word, now)
        return word if now is None else _shorter(word, now)

    def fault(self, letter: str, word: float) -> str | None:
        """Return the fault of a word, None if it has none."""
        if self.rule != "signed" or abs(word) < TURN:
            return None
        return (
            f"{letter}{word:g} is beyond a turn, and signed rotary words are between -360 and 360; set "
            "wrap=unwound if the axis doesn't wrap"
        )


def _signed(word: float, now: float | None) -> float:
    """Turn in the direction of the sign, including that of -0, to the angle of the number (LinuxCNC 2.9)."""
    if now is None:
        return abs(word)
    backwards = math.copysign(1.0, word) < 0.0
    angle = abs(word) + TURN * math.floor(now / TURN)
    # The present angle is no move, in either direction.
    for near in (angle - TURN, angle, angle + TURN):
        if abs(near - now) <= SAME:
            return near
    if backwards:
        return angle - TURN if angle > now else angle
    return angle + TURN if angle < now else angle


def _shorter(word: float, now: float) -> float:
    """Turn in the shorter direction; forward if both are half a turn."""
    forward = (word - now) % TURN
    return now + (forward if forward <= HALF_TURN else forward - TURN)


def find_wrapping(
    source: Source, language: Language, machine: Machine, wrap: Wrap | None, *, stand_in: bool
) -> Wrapping:
    """Find the rule of a program's rotary words.

    It is the caller's, or else that of the program's header, by default words as written. `SettingError` for
    a rule that the program's language doesn't have, or that applies to no axis; `ToolpathError`, with file
    and line, if the program's words are wrapped, and it doesn't state the rule.
    """
    if language == SINUMERIK and wrap not in (None, "unwound"):
        raise SettingError(f"wrap = {wrap!r}, and Sinumerik words have their own (DC, ACP, ACN); omit it")
    rule, letters = (wrap, None) if wrap is not None else _stated(source) or (None, None)
    if rule in (None, "unwound") or language == SINUMERIK:
        return Wrapping()
    if rule == "signed" and language == KLARTEXT:
        raise SettingError("wrap = 'signed', and Klartext takes the shorter direction; set wrap=shorter")
    columns = _columns(machine, letters)
    if not columns and wrap is not None:
        missing = "give the machine" if stand_in else f"machine {machine.name!r} has none; omit it"
        raise SettingError(f"wrap = {wrap!r} is for rotary axes of more than a turn, and {missing}")
    return Wrapping(rule, columns, switched=language == KLARTEXT)


def _stated(source: Source) -> tuple[Wrap, str] | None:
    """Return the rule and its axis letters from the header of a program written by this package."""
    if stated := MODULO.read(source):
        return "signed" if stated[0] == "signed" else "shorter", stated[1].upper()
    for line, text in enumerate(source.lines[:HEAD], start=1):
        if WRAPPED in text:
            raise block_error(
                source,
                line,
                "rotary words may be in 0 to 360, with the sign as direction; set wrap=signed (--wrap "
                "signed) if they are, wrap=unwound if they aren't",
            )
    return None


def _columns(machine: Machine, letters: str | None) -> tuple[int, ...]:
    """Return the columns of axes by letter; by default those with more than a turn."""
    if letters is not None:
        return tuple(machine.column(c) for c in letters if c in machine.letters)
    limits = [(c, machine.axes[c].limits) for c in machine.rotary_columns]
    return tuple(c for c, a in limits if np.degrees(a.high - a.low) > TURN)
