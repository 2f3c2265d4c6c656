"""Moves of runs of plain blocks, computed together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray
from fiveaxis.model import as_triple
from fiveaxis.nc.control.axis_track import NO_MOVE, Columns, nowhere
from fiveaxis.nc.control.interpreter_state import CUT, RAPID
from fiveaxis.nc.control.moves import STRAIGHT, Moves
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, Run
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES

# Letters of the tool direction under G43.5.
ISO_DIRECTION = "IJK"

_OF_MOTION = {"G0": 0.0, "G1": 1.0}


@dataclass(frozen=True, eq=False)
class _State:
    """What is in force after each block of a run.

    Parameters
    ----------
    motions : (n,), 0 for G0 and 1 for G1
    feeds, held : (n,), F as written, and the one in force; NaN if there is none
    values : (n, k), axis values, mm and deg, control's own sign
    vectors : (n, 3), tool directions, NaN where angles are in force
    normals : (n, 3), surface normals as written, NaN without
    moves : (n,), whether the block moves
    given : (n,), whether it names an axis or gives a direction
    """

    motions: Array
    feeds: Array
    held: Array
    values: Array
    vectors: Array
    normals: Array
    moves: BoolArray
    given: BoolArray


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
            and modes.feed_mode != "G95"
            and not self.coordinates.turned
            and not (self._direction(run) and (track.vector is None or not self.coordinates.of_tip))
            and not track.unknown(track.now)
        )

    def take_run(self, run: Run) -> bool:
        """Run all blocks of a plain run if they are straight moves of known axes; return whether they are.

        The rows, and the state after them, are those of the blocks one by one; nothing has changed if it
        returns False.
        """
        state = self._state_of(run)
        pace = None if state is None else self._paces(state)
        if state is None or pace is None:
            return False
        track, modes = self.track, self.modes
        self._add_rows(run, state, pace)
        last = zip(state.values[-1].tolist(), track.now, strict=True)
        track.now = [None if old is None else new for new, old in last]
        if track.vector is not None:
            track.vector = as_triple(state.vectors[-1])
        self.ignored[NO_MOVE] += int((state.given & ~state.moves).sum())
        self.line, track.step = int(run.lines[-1]), int(run.steps[-1])
        modes.motion = STRAIGHT[int(state.motions[-1])]
        modes.feed = None if np.isnan(state.held[-1]) else float(state.held[-1])
        return True

    def _direction(self, run: Run) -> str:
        """Return the letters of the tool direction that the blocks of a run give; empty if they give none."""
        if run.points:
            return DIRECTION
        given = {chr(code) for code in run.letters[: run.begins[1]].tolist()}
        return ISO_DIRECTION if self.modes.vectors and not given.isdisjoint(ISO_DIRECTION) else ""

    def _state_of(self, run: Run) -> _State | None:
        """Follow the words of a run; None if they aren't all of straight moves of known axes."""
        modes, track, count = self.modes, self.track, len(run)
        columns = run.columns()
        feeds = columns.pop("F", np.full(count, np.nan))
        motions = _held(columns.pop("G", np.full(count, np.nan)), _OF_MOTION.get(str(modes.motion)))
        direction = self._direction(run)
        vectors, normals = _directions(columns, direction, count), _directions(columns, NORMAL, count)
        named = {self.columns.get(letter, -1) for letter in columns}
        if -1 in named or (track.vector is not None and not named.isdisjoint(track.rotary)):
            return None
        if np.isnan(motions).any() or (feeds <= 0.0).any() or not self._unwraps(columns):
            return None
        values, given = self._values(columns, count)
        if (np.abs(values) > LARGEST_POSITION).any():
            return None
        moves = _change(values, np.array(track.now, dtype=float))
        if track.vector is not None:
            vectors = vectors if direction else np.tile(track.vector, (count, 1))
            moves |= _change(vectors, np.array(track.vector))
        held = _held(feeds, modes.feed)
        return _State(motions, feeds, held, values, vectors, normals, moves, given | bool(direction))

    def _paces(self, state: _State) -> Array | None:
        """Return the pace of each cut, (n,), as `Modes.pace`, NaN in rapid moves; None if one is unknown."""
        cuts = state.moves & (state.motions == _OF_MOTION["G1"])
        if self.fixed_feed:
            pace = np.ones(len(cuts))
        else:
            pace = 60.0 / state.feeds if self.modes.feed_mode == "G93" else state.held / 60.0
        return None if np.isnan(pace[cuts]).any() else np.where(cuts, pace, np.nan)

    def _add_rows(self, run: Run, state: _State, pace: Array) -> None:
        """Add the rows of the blocks that move."""
        track, rows = self.track, np.flatnonzero(state.moves)
        if len(rows) == 0:
            return
        none, pace = np.full(len(rows), np.nan), pace[rows]
        timed = self.modes.feed_mode == "G93" and not self.fixed_feed
        cuts = state.motions[rows] == _OF_MOTION["G1"]
        track.rows.extend(
            Columns(
                track.machine,
                state.values[rows],
                run.lines[rows],
                run.steps[rows],
                np.where(cuts, CUT, RAPID),
                pace if timed else none,
                none if timed else pace,
                np.full(len(rows), track.counting),
                np.broadcast_to(track.counted, (len(rows), len(track.counted))),
                state.vectors[rows] if track.vector is not None else nowhere(len(rows)),
                np.where(cuts[:, None], state.normals[rows], np.nan),
                np.zeros(len(rows), dtype=bool),
            )
        )

    def _unwraps(self, columns: dict[str, Array]) -> bool:
        """Whether no word of an axis that wraps is beyond what its rule has."""
        return self.modes.incremental or not any(
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
            lengths = words if column in track.rotary else words * scale
            if self.modes.incremental:
                positions = _summed(lengths, float(values[0, column]))
            elif column in self.wrapped:
                positions = self._unwrapped_words(column, words, offset, float(values[0, column]))
            else:
                positions = lengths + offset
            values[:, column] = _held(positions, track.now[column])
            given |= np.isfinite(words)
        return values, given

    def _unwrapped_words(self, column: int, words: Array, offset: float, now: float) -> Array:
        """Return the angles, (n,) deg, to which words from 0 to 360 turn an axis, one after the other."""
        angles = words.copy()
        for row in np.flatnonzero(np.isfinite(words)).tolist():
            angles[row] = now = self.wrapping.unwrap(float(words[row]), now - offset) + offset
        return angles


def _summed(steps: Array, begin: float) -> Array:
    """Return the positions, (n,), to which increments lead one after the other; NaN where there is none."""
    positions, known = steps.copy(), np.isfinite(steps)
    positions[known] = np.cumsum(np.append(begin, steps[known]))[1:]
    return positions


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
