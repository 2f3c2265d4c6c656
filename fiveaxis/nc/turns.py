"""How a program counts rotary axes that make more than a turn: on and on, from 0 to 360, or anew per pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine
from fiveaxis.nc.dialects import Dialect
from fiveaxis.nc.words import format_number, format_words
from fiveaxis.toolpath import MoveKind

Winding = Literal["unwound", "modulo", "rezero"]

# deg
TURN = 360.0
# deg: a move that turns less than half a turn, with room for rounding, goes the shorter way.
MOST_TURN = 179.0


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves as they are written, one block each.

    Parameters
    ----------
    letters : of the columns
    values : (m, k), mm and deg, control's sign, turns counted on and on; the first row is where they begin
    time : (m,), s
    kind : (m,), `MoveKind` values
    """

    letters: str
    values: Array
    time: Array
    kind: IntArray

    def __len__(self) -> int:
        return len(self.values)


def require_winding(winding: str, machine: Machine, dialect: Dialect) -> None:
    """Check that a control, and the machine, can count as asked.

    Raises
    ------
    SettingError
        An unknown word; one that the control doesn't know; turns from 0 to 360 for an axis with limits.
    """
    if winding not in get_args(Winding):
        raise SettingError(f"unknown winding {winding!r}; known: {', '.join(get_args(Winding))}")
    if winding not in dialect.windings:
        raise SettingError(
            f"control {dialect.name!r} has no winding {winding!r}; it knows {', '.join(dialect.windings)}"
        )
    if winding != "modulo":
        return
    for column in counted_columns(machine):
        limits = machine.axes[column].limits
        if not limits.unlimited:
            low, high = np.degrees([limits.low, limits.high])
            raise SettingError(
                f"{machine.letters[column]} of {machine.name!r} goes from {low:g} to {high:g} deg, and words "
                "from 0 to 360 would lose which turn it is on; write it unwound"
            )


def counted_columns(machine: Machine) -> list[int]:
    """Columns of the rotary axes with more than one turn: the only ones whose turns need counting."""
    return [
        c
        for c in machine.rotary_columns
        if np.degrees(machine.axes[c].limits.high - machine.axes[c].limits.low) > TURN
    ]


def shortened(moves: Moves, machine: Machine) -> Moves:
    """Cut moves in which a counted axis makes half a turn or more into equal parts that stay below it."""
    columns = counted_columns(machine)
    steps = np.diff(moves.values, axis=0, prepend=moves.values[:1])
    turns = np.abs(steps[:, columns]).max(axis=1, initial=0.0)
    parts = np.floor(turns / MOST_TURN).astype(np.int64) + 1
    owner = np.repeat(np.arange(len(moves)), parts)
    order = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    # The last part ends where the move does, to the digit.
    left = (parts[owner] - order) / parts[owner]
    return replace(
        moves,
        values=moves.values[owner] - left[:, None] * steps[owner],
        time=moves.time[owner] / parts[owner],
        kind=moves.kind[owner],
    )


def word_lines(moves: Moves, machine: Machine, dialect: Dialect, winding: str) -> Iterator[tuple[str, str]]:
    """Give for every move but the first row the block before it and its words.

    Yields
    ------
    before : block to write first; mostly none
    words : of the move
    """
    if winding == "unwound":
        for row in moves.values[1:].tolist():
            yield "", format_words(moves.letters, row, dialect.decimals)
    elif winding == "modulo":
        yield from _modulo(moves, counted_columns(machine), dialect)
    else:
        yield from _rezeroed(moves, counted_columns(machine), dialect)


def first_words(values: Array, machine: Machine, dialect: Dialect, winding: str) -> Array:
    """Give the words of one place, (k,) mm and deg, as the approach writes them."""
    if winding != "modulo":
        return values
    counted = values.copy()
    columns = counted_columns(machine)
    counted[columns] = within_a_turn(values[columns], dialect.decimals)
    return counted


def within_a_turn(degrees: Array, decimals: int) -> Array:
    """Take degrees into [0, 360) so that they are below 360 when rounded, too."""
    return np.remainder(np.round(np.remainder(degrees, TURN), decimals), TURN)


def _modulo(moves: Moves, columns: list[int], dialect: Dialect) -> Iterator[tuple[str, str]]:
    signed = dialect.modulo == "signed"
    counted = moves.values.copy()
    counted[:, columns] = within_a_turn(moves.values[:, columns], dialect.decimals)
    steps = np.diff(np.round(moves.values, dialect.decimals), axis=0)
    for row, step in zip(counted[1:].tolist(), steps, strict=True):
        words = []
        for column, (letter, value) in enumerate(zip(moves.letters, row, strict=True)):
            if column in columns and signed:
                # A word of the place where the axis stands might be a whole turn: it is left out.
                if step[column] != 0.0:
                    words.append(letter + _signed(value, step[column] < 0.0, dialect.decimals))
            else:
                words.append(letter + format_number(value, dialect.decimals))
        yield "", " ".join(words)


def _signed(value: float, backwards: bool, decimals: int) -> str:
    """Write an angle whose sign is a direction; there is no −0, so the place next to it stands in."""
    if not backwards:
        return format_number(value, decimals)
    return "-" + format_number(max(value, 10.0**-decimals), decimals)


def _rezeroed(moves: Moves, columns: list[int], dialect: Dialect) -> Iterator[tuple[str, str]]:
    """Name counted axes anew, by whole turns, where a link begins and they have left the first turn."""
    shift = np.zeros(moves.values.shape[1])
    for at, (here, there) in enumerate(zip(moves.values[:-1], moves.values[1:], strict=True)):
        before = ""
        if moves.kind[at + 1] != MoveKind.CUT:
            now = np.round(here - shift, dialect.decimals)
            over = np.zeros(len(now))
            over[columns] = TURN * np.floor(now[columns] / TURN)
            shift += over
            if over.any():
                letters = "".join(c for c, moved in zip(moves.letters, over, strict=True) if moved)
                words = format_words(moves.letters, (now - over).tolist(), dialect.decimals, only=letters)
                before = dialect.reset.format(words=words)
        yield before, format_words(moves.letters, (there - shift).tolist(), dialect.decimals)
