"""Windings: rotary words of axes with more than a turn, unwrapped, from 0 to 360, or reset at links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import get_args

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, SettingError, Winding
from fiveaxis.model import Machine, MoveKind
from fiveaxis.nc.writing.word_writer import WordWriter

TURN = 360.0  # deg
# deg: below half a turn, with room for rounding, the shorter turn is the intended one.
MOST_TURN = 179.0


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves to be written, one block each.

    Parameters
    ----------
    values : (m, c), numbers of words in the control's sign, turns unwrapped; the first row is the start
    time : (m,), s
    kind : (m,), `MoveKind` values
    row : (m,), row of the motion that each belongs to
    """

    values: Array
    time: Array
    kind: IntArray
    row: IntArray

    def __len__(self) -> int:
        return len(self.values)

    @property
    def rapid(self) -> BoolArray:
        """(m,), whether blocks are rapid moves; the first row isn't."""
        rapid = np.asarray(self.kind == MoveKind.RAPID)
        rapid[:1] = False
        return rapid


@dataclass(frozen=True, eq=False)
class Words:
    """Numbers of the blocks' words.

    Parameters
    ----------
    values : (m, c), rounded as printed; the first row is the start
    kept : (m, c), which of them are written
    before : row -> block to write before it
    """

    values: Array
    kept: BoolArray
    before: Mapping[int, str] = field(default_factory=dict)


def require_winding(winding: str, writer: WordWriter) -> None:
    """Check that the control and the machine support a winding.

    `SettingError` for an unknown winding, one that the control lacks, or that tool directions don't need, or
    ``modulo`` for an axis with limits.
    """
    dialect, machine = writer.dialect, writer.machine
    if winding not in get_args(Winding):
        raise SettingError(f"unknown winding {winding!r}; known: {', '.join(get_args(Winding))}")
    if winding not in dialect.windings:
        raise SettingError(
            f"control {dialect.name!r} has no winding {winding!r}; it knows {', '.join(dialect.windings)}"
        )
    if winding != "unwound" and writer.coordinates == "vector":
        raise SettingError(
            f"winding {winding!r} applies to angles, and tool directions have none; leave it out"
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
    """Return the columns of rotary axes with more than one turn: only their turns need counting."""
    return [c for c in machine.rotary_columns if np.degrees(machine.axes[c].limits.span) > TURN]


def shortened(moves: Moves, machine: Machine) -> Moves:
    """Divide moves in which a counted axis makes half a turn or more into equal parts below it."""
    columns = counted_columns(machine)
    steps = np.diff(moves.values, axis=0, prepend=moves.values[:1])
    turns = np.abs(steps[:, columns]).max(axis=1, initial=0.0)
    parts = np.floor(turns / MOST_TURN).astype(np.int64) + 1
    owner, left = split_moves(parts)
    return replace(
        moves,
        values=moves.values[owner] - left[:, None] * steps[owner],
        time=moves.time[owner] / parts[owner],
        kind=moves.kind[owner],
        row=moves.row[owner],
    )


def split_moves(parts: IntArray) -> tuple[IntArray, Array]:
    """Divide moves into parts: the move of each part, (m,), and the share of the move after it, (m,).

    The share is exactly 0 for the last part.
    """
    owner = np.repeat(np.arange(len(parts)), parts)
    order = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts) + 1
    return owner, (parts[owner] - order) / parts[owner]


def count_turns(moves: Moves, writer: WordWriter, winding: str) -> Words:
    """Return the words of moves with turns counted as the winding has it; for ``modulo`` `shortened` ones."""
    columns = counted_columns(writer.machine)
    if winding == "modulo":
        return _modulo(moves, columns, writer)
    if winding == "rezero":
        return _rezeroed(moves, columns, writer)
    return Words(writer.rounded(moves.values), np.ones(moves.values.shape, dtype=bool))


def first_words(values: Array, writer: WordWriter, winding: str) -> Array:
    """Return the numbers of words, (n, c), as the approach writes them."""
    if winding != "modulo":
        return values
    counted, columns, modulo = values.copy(), counted_columns(writer.machine), writer.dialect.modulo
    low = 0.0 if modulo is None else float(modulo.low)
    counted[:, columns] = within_a_turn(values[:, columns], writer.decimals[columns], low)
    return counted


def within_a_turn(degrees: Array, decimals: Array | int, low: float = 0.0) -> Array:
    """Reduce degrees to [low, low + 360), also when rounded."""
    scale = 10.0 ** np.asarray(decimals)
    return low + np.remainder(np.rint(np.remainder(degrees - low, TURN) * scale) / scale, TURN)


def modulo_templates(writer: WordWriter, winding: str) -> list[str | None]:
    """Return the template of each word, (c,); None for a plain one."""
    templates: list[str | None] = [None] * len(writer.names)
    modulo = writer.dialect.modulo
    if winding == "modulo" and modulo is not None:
        for column in counted_columns(writer.machine):
            templates[column] = modulo.word
    return templates


def _modulo(moves: Moves, columns: list[int], writer: WordWriter) -> Words:
    values = writer.rounded(first_words(moves.values, writer, "modulo"))
    kept, modulo = np.ones(values.shape, dtype=bool), writer.dialect.modulo
    if modulo is not None and modulo.way == "signed":
        steps = np.diff(writer.rounded(moves.values), axis=0, prepend=writer.rounded(moves.values[:1]))
        for column in columns:
            # A word of the angle at which the axis already is might be a whole turn: it is omitted.
            kept[:, column] = steps[:, column] != 0.0
            # There is no −0: the nearest number replaces it.
            least = 10.0 ** -writer.decimals[column]
            backwards = steps[:, column] < 0.0
            values[backwards, column] = -np.maximum(values[backwards, column], least)
    return Words(values, kept)


def _rezeroed(moves: Moves, columns: list[int], writer: WordWriter) -> Words:
    """Reset counted axes by whole turns where a link begins and they have left the first turn."""
    reset = writer.dialect.reset
    block = reset.block if reset is not None else ""
    shifts = np.zeros(moves.values.shape)
    shift = np.zeros(moves.values.shape[1])
    before, begin = {}, 0
    for at in (np.flatnonzero(moves.kind[1:] != MoveKind.CUT) + 1).tolist():
        now = writer.rounded(moves.values[at - 1 : at] - shift)[0]
        over = np.zeros(len(now))
        over[columns] = TURN * np.floor(now[columns] / TURN)
        if over.any():
            shifts[begin:at], begin = shift, at
            shift = shift + over
            letters = "".join(c for c, moved in zip(writer.names, over, strict=True) if moved)
            before[at] = block.format(words=writer.words(now - over, only=letters))
    shifts[begin:] = shift
    values = writer.rounded(moves.values - shifts)
    return Words(values, np.ones(values.shape, dtype=bool), before)
