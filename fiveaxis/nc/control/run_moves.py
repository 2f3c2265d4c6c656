"""Moves of runs of plain blocks, computed together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.nc.control.axis_track import NO_MOVE, Columns, nowhere
from fiveaxis.nc.control.interpreter_state import CUT, RAPID
from fiveaxis.nc.control.moves import STRAIGHT, Moves
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, Run
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES

_OF_MOTION = {"G0": 0.0, "G1": 1.0}


@dataclass
class RunMoves(Moves):
    """Runs of plain blocks, as rows."""

    def is_plain(self, run: Run) -> bool:
        """Whether blocks mean what they say: all axes are known, and nothing special is in force."""
        modes, track = self.modes, self.track
        return (
            bool(track.rows)
            and modes.technology.cuts
            and self.switch is None
            and self.cycle is None
            and self.suspended is None
            and not (modes.incremental or modes.vectors or modes.feed_mode == "G95")
            and not self.coordinates.turned
            and not (run.points and (track.vector is None or not self.coordinates.of_tip))
            and not track.unknown(track.now)
        )

    def take_run(self, run: Run) -> bool:
        """Run all blocks of a plain run if they are straight moves of known axes; return whether they are.

        The rows, and the state after them, are those of the blocks one by one; nothing has changed if it
        returns False.
        """
        modes, track, count = self.modes, self.track, len(run)
        columns = run.columns()
        feeds = columns.pop("F", np.full(count, np.nan))
        motions = _held(columns.pop("G", np.full(count, np.nan)), _OF_MOTION.get(str(modes.motion)))
        vectors, normals = _directions(columns, DIRECTION, count), _directions(columns, NORMAL, count)
        named = {self.columns.get(letter, -1) for letter in columns}
        if -1 in named or (track.vector is not None and not named.isdisjoint(track.rotary)):
            return False
        if np.isnan(motions).any() or (feeds <= 0.0).any() or not self._unwraps(columns):
            return False
        values, given = self._values(columns, count)
        if (np.abs(values) > LARGEST_POSITION).any():
            return False
        moves = _change(values, np.array(track.now, dtype=float))
        if track.vector is not None:
            vectors = vectors if run.points else np.tile(track.vector, (count, 1))
            moves |= _change(vectors, np.array(track.vector))
        held = _held(feeds, modes.feed)
        cuts = moves & (motions == _OF_MOTION["G1"])
        timed = modes.feed_mode == "G93" and not self.fixed_feed
        pace = np.ones(count) if self.fixed_feed else 60.0 / feeds if timed else held / 60.0
        if np.isnan(pace[cuts]).any():
            return False
        rows = np.flatnonzero(moves)
        if len(rows):
            none = np.full(len(rows), np.nan)
            kept = np.where(cuts, pace, np.nan)[rows]
            track.rows.extend(
                Columns(
                    track.machine,
                    values[rows],
                    run.line + rows,
                    np.where(cuts[rows], CUT, RAPID),
                    kept if timed else none,
                    none if timed else kept,
                    np.full(len(rows), track.counting),
                    vectors[rows] if track.vector is not None else nowhere(len(rows)),
                    np.where(cuts[:, None], normals, np.nan)[rows],
                )
            )
            last = zip(values[-1].tolist(), track.now, strict=True)
            track.now = [None if old is None else new for new, old in last]
        if run.points:
            x, y, z = vectors[-1].tolist()
            track.vector = x, y, z
        self.ignored[NO_MOVE] += int(((given | run.points) & ~moves).sum())
        self.line = run.last_line
        modes.motion = STRAIGHT[int(motions[-1])]
        modes.feed = None if np.isnan(held[-1]) else float(held[-1])
        return True

    def _unwraps(self, columns: dict[str, Array]) -> bool:
        """Whether no word of an axis that wraps is beyond what its rule has."""
        return not any(
            self.wrapping.fault(letter, float(np.nanmax(np.abs(words))))
            for letter, words in columns.items()
            if self.columns[letter] in self.wrapped
        )

    def _values(self, columns: dict[str, Array], count: int) -> tuple[Array, BoolArray]:
        """Return the axis values after each block, (n, k), and whether it names an axis, (n,)."""
        track, scale = self.track, MILLIMETRES[self.modes.units.now]
        values = np.tile(np.array(track.now, dtype=float), (count, 1))
        given = np.zeros(count, dtype=bool)
        for letter, words in columns.items():
            column, offset = self.columns[letter], self.coordinates.offsets[self.columns[letter]]
            if column in self.wrapped:
                positions = self._unwrapped_words(column, words, offset)
            else:
                positions = words * (1.0 if column in track.rotary else scale) + offset
            values[:, column] = _held(positions, track.now[column])
            given |= np.isfinite(words)
        return values, given

    def _unwrapped_words(self, column: int, words: Array, offset: float) -> Array:
        """Return the angles, (n,) deg, to which words from 0 to 360 turn an axis, one after the other."""
        now, angles = cast("float", self.track.now[column]), words.copy()
        for row in np.flatnonzero(np.isfinite(words)).tolist():
            angles[row] = now = self.wrapping.unwrap(float(words[row]), now - offset) + offset
        return angles


def _directions(columns: dict[str, Array], letters: str, count: int) -> Array:
    """Remove the components of a direction, and return them, (n, 3), NaN in blocks without any."""
    if columns.keys().isdisjoint(letters):
        return nowhere(count)
    parts = np.column_stack([columns.pop(c, np.full(count, np.nan)) for c in letters])
    some = np.isfinite(parts).any(axis=1, keepdims=True)
    return np.where(some, np.nan_to_num(parts), np.nan)


def _change(values: Array, begin: Array) -> BoolArray:
    """Mark the rows of (n, m) that differ from the row before, the first from `begin`; NaN is no change."""
    return np.asarray((np.nan_to_num(np.diff(values, axis=0, prepend=begin[None])) != 0.0).any(axis=1))


def _held(values: Array, begin: float | None) -> Array:
    """Fill in each NaN of (n,) with the value before it, and those at the beginning with `begin`."""
    known = np.isfinite(values)
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], np.nan if begin is None else begin)
