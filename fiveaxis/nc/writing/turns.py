"""How a program counts rotary axes that make more than a turn: on and on, from 0 to 360, or anew per pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.nc.writing.places import Wording
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
    values : (m, c), numbers of words, control's sign, turns counted on and on; the first row is where they
        begin
    time : (m,), s
    kind : (m,), `MoveKind` values
    row : (m,), of the motion that each belongs to
    """

    values: Array
    time: Array
    kind: IntArray
    row: IntArray

    def __len__(self) -> int:
        return len(self.values)

    @property
    def rapid(self) -> BoolArray:
        """(m,), which blocks are the control's rapid moves; the first row is none."""
        rapid = np.asarray(self.kind == MoveKind.RAPID)
        rapid[:1] = False
        return rapid


@dataclass(frozen=True, eq=False)
class Words:
    """What stands in the blocks.

    Parameters
    ----------
    values : (m, c), rounded as they are printed; the first row is where the moves begin
    kept : (m, c), which of them are written
    before : row -> block to write before it
    """

    values: Array
    kept: BoolArray
    before: Mapping[int, str] = field(default_factory=dict)


def require_winding(winding: str, wording: Wording) -> None:
    """Check that a control, and the machine, can count as asked.

    Raises
    ------
    SettingError
        An unknown word; one that the control doesn't know, or that directions of the tool leave nothing to
        do; turns from 0 to 360 for an axis with limits.
    """
    dialect, machine = wording.dialect, wording.machine
    if winding not in get_args(Winding):
        raise SettingError(f"unknown winding {winding!r}; known: {', '.join(get_args(Winding))}")
    if winding not in dialect.windings:
        raise SettingError(
            f"control {dialect.name!r} has no winding {winding!r}; it knows {', '.join(dialect.windings)}"
        )
    if winding != "unwound" and wording.coordinates == "vector":
        raise SettingError(
            f"winding {winding!r} counts angles, and directions of the tool have none; leave it out"
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
        row=moves.row[owner],
    )


def count_turns(moves: Moves, wording: Wording, winding: str) -> Words:
    """Turn moves into the numbers that a control counts turns by.

    Parameters
    ----------
    moves : shortened, where the words go from 0 to 360
    """
    columns = counted_columns(wording.machine)
    if winding == "modulo":
        return _modulo(moves, columns, wording)
    if winding == "rezero":
        return _rezeroed(moves, columns, wording)
    return Words(wording.rounded(moves.values), np.ones(moves.values.shape, dtype=bool))


def first_words(values: Array, wording: Wording, winding: str) -> Array:
    """Give the numbers of places, (n, c), as the approach writes them."""
    if winding != "modulo":
        return values
    counted = values.copy()
    columns = counted_columns(wording.machine)
    counted[:, columns] = within_a_turn(values[:, columns], wording.decimals[columns], _low(wording))
    return counted


def within_a_turn(degrees: Array, decimals: Array | int, low: float = 0.0) -> Array:
    """Take degrees into [low, low + 360) so that they are below its end when rounded, too."""
    scale = 10.0 ** np.asarray(decimals)
    return low + np.remainder(np.rint(np.remainder(degrees - low, TURN) * scale) / scale, TURN)


def _low(wording: Wording) -> float:
    return 0.0 if wording.dialect.modulo is None else float(wording.dialect.modulo.low)


def modulo_templates(wording: Wording, winding: str) -> list[str | None]:
    """Give the template of each word, (c,), that isn't a plain one."""
    templates: list[str | None] = [None] * len(wording.names)
    modulo = wording.dialect.modulo
    if winding == "modulo" and modulo is not None:
        for column in counted_columns(wording.machine):
            templates[column] = modulo.word
    return templates


def _modulo(moves: Moves, columns: list[int], wording: Wording) -> Words:
    counted = moves.values.copy()
    counted[:, columns] = within_a_turn(moves.values[:, columns], wording.decimals[columns], _low(wording))
    values, kept = wording.rounded(counted), np.ones(counted.shape, dtype=bool)
    modulo = wording.dialect.modulo
    if modulo is not None and modulo.way == "signed":
        steps = np.diff(wording.rounded(moves.values), axis=0, prepend=wording.rounded(moves.values[:1]))
        for column in columns:
            # A word of the place where the axis stands might be a whole turn: it is left out.
            kept[:, column] = steps[:, column] != 0.0
            # There is no −0, so the place next to it stands in.
            least = 10.0 ** -wording.decimals[column]
            backwards = steps[:, column] < 0.0
            values[backwards, column] = -np.maximum(values[backwards, column], least)
    return Words(values, kept)


def _rezeroed(moves: Moves, columns: list[int], wording: Wording) -> Words:
    """Name counted axes anew, by whole turns, where a link begins and they have left the first turn."""
    reset = wording.dialect.reset
    block = reset.block if reset is not None else ""
    shifts = np.zeros(moves.values.shape)
    shift = np.zeros(moves.values.shape[1])
    before, begin = {}, 0
    for at in (np.flatnonzero(moves.kind[1:] != MoveKind.CUT) + 1).tolist():
        now = wording.rounded(moves.values[at - 1 : at] - shift)[0]
        over = np.zeros(len(now))
        over[columns] = TURN * np.floor(now[columns] / TURN)
        if over.any():
            shifts[begin:at], begin = shift, at
            shift = shift + over
            letters = "".join(c for c, moved in zip(wording.names, over, strict=True) if moved)
            before[at] = block.format(words=wording.words(now - over, only=letters))
    shifts[begin:] = shift
    values = wording.rounded(moves.values - shifts)
    return Words(values, np.ones(values.shape, dtype=bool), before)
