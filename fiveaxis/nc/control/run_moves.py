"""Moves of runs of plain blocks, computed together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.nc.control.axis_track import NO_MOVE, Columns, nowhere
from fiveaxis.nc.control.interpreter_state import CUT, RAPID
from fiveaxis.nc.control.moves import STRAIGHT, Moves
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES

_OF_MOTION = {"G0": 0.0, "G1": 1.0}


@dataclass
class RunMoves(Moves):
    """Runs of plain blocks, as rows."""

    def take_run(self, run: Run) -> bool:
        """Run all blocks of a run if they are straight moves of known axes; return whether they are.

        The rows, and the state after them, are those of the blocks one by one; nothing has changed if it
        returns False.
        """
        modes, track = self.modes, self.track
        columns = run.columns()
        feeds = columns.pop("F", np.full(len(run), np.nan))
        motions = _held(columns.pop("G", np.full(len(run), np.nan)), _OF_MOTION.get(str(modes.motion)))
        named = [self.columns.get(letter, -1) for letter in columns]
        if track.vector is not None or -1 in named or not set(self.wrapped).isdisjoint(named):
            return False
        if np.isnan(motions).any() or (feeds <= 0.0).any():
            return False
        values, given = self._values(columns, len(run))
        if not (np.abs(values) <= LARGEST_POSITION).all():
            return False
        before = np.vstack([np.array(track.now, dtype=float), values[:-1]])
        moves = (values != before).any(axis=1)
        held = _held(feeds, modes.feed)
        cuts = moves & (motions == _OF_MOTION["G1"])
        timed = modes.feed_mode == "G93" and not self.fixed_feed
        pace = np.ones(len(run)) if self.fixed_feed else 60.0 / feeds if timed else held / 60.0
        if np.isnan(pace[cuts]).any():
            return False
        pace[~cuts] = np.nan
        self._add_rows(run, values, np.flatnonzero(moves), cuts, pace, timed=timed)
        self.ignored[NO_MOVE] += int((given & ~moves).sum())
        self.line = run.last_line
        modes.motion = STRAIGHT[int(motions[-1])]
        modes.feed = None if np.isnan(held[-1]) else float(held[-1])
        return True

    def _values(self, columns: dict[str, Array], count: int) -> tuple[Array, BoolArray]:
        """Return the axis values after each block, (n, k), and whether it names an axis, (n,)."""
        track, scale = self.track, MILLIMETRES[self.modes.units.now]
        axes = track.machine.axes
        values = np.tile(np.array(track.now, dtype=float), (count, 1))
        given = np.zeros(count, dtype=bool)
        for letter, words in columns.items():
            column = self.columns[letter]
            positions = words * (1.0 if axes[column].is_rotary else scale) + self.coordinates.offsets[column]
            values[:, column] = _held(positions, track.now[column])
            given |= np.isfinite(words)
        return values, given

    def _add_rows(
        self, run: Run, values: Array, rows: IntArray, cuts: BoolArray, pace: Array, *, timed: bool
    ) -> None:
        """Add the rows that move, with the duration of cuts, s, or their feed per s."""
        if len(rows) == 0:
            return
        track, none = self.track, np.full(len(rows), np.nan)
        track.rows.extend(
            Columns(
                track.machine,
                values[rows],
                run.line + rows,
                np.where(cuts[rows], CUT, RAPID),
                pace[rows] if timed else none,
                none if timed else pace[rows],
                np.full(len(rows), track.counting),
                nowhere(len(rows)),
                nowhere(len(rows)),
            )
        )
        track.now = cast("list[float | None]", values[rows[-1]].tolist())


def _held(values: Array, begin: float | None) -> Array:
    """Fill in each NaN of (n,) with the value before it, and those at the beginning with `begin`."""
    known = np.isfinite(values)
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], np.nan if begin is None else begin)
