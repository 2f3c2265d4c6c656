"""Axis positions while a program is read, the rows they form, and how long the moves between rows take.

Feed moves last by F, rapid moves by the axes' speeds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model import STANDSTILL, Machine, MoveKind
from fiveaxis.nc.languages.block import Triple

# Key of the counts: blocks to the position that the axes already have.
NO_MOVE = "no move"
# The same: rapid moves within the path after which the position of an axis isn't known.
UNKNOWN_END = "rapid moves to an unknown position"

Values = list[float | None]


class Counting(IntEnum):
    """Meaning of X, Y and Z of a row."""

    AXES = 0  # positions of the machine's axes
    COMPENSATED = 1  # the same, while the control adds the tool's length to the words (G43)
    TIP = 2  # tip on the workpiece (TCP, a tilted plane)


# One row of each array of `Columns`, in their order; None where unknown.
Row = tuple[Any, ...]

# mm/min, deg/min: of rapid moves of axes without a known speed; only their duration depends on it.
RAPID = 10_000.0
# Rows that are packed into arrays at a time.
PART = 10_000


@dataclass
class AxisTrack:
    """Axis values, mm and deg in the control's own sign, row by row.

    Parameters
    ----------
    machine : the machine of the axes
    now : (k,), in the order of `machine.axes`; None where unknown
    ignored : counts of moves that aren't in the rows
    approach : count of rapid moves to the first row or before it, whose starts aren't known
    counted : (k,), what F counts of each axis, as in `Columns`
    vector : tool direction on the workpiece in force, instead of angles
    control_turned : line on which the control began to turn the rotary axes to angles that aren't in the
        program; 0 before
    step : of the line being run
    """

    machine: Machine
    now: Values
    ignored: Counter[str]
    approach: int = 0
    counting: int = int(Counting.AXES)
    counted: tuple[float, ...] = ()
    vector: Triple | None = None
    control_turned: int = 0
    step: int = 0

    def __post_init__(self) -> None:
        axes = self.machine.axes
        self.rows = Rows(self.machine)
        self.linear = [i for i, a in enumerate(axes) if not a.is_rotary]
        self.rotary = [i for i, a in enumerate(axes) if a.is_rotary]

    def unknown(self, values: Sequence[float | None]) -> str:
        """Return the letters of unknown axes, as ``A, C``; with a vector, rotary axes needn't be known."""
        wanted = self.linear if self.vector is not None else range(len(values))
        missing = [self.machine.letters[i] for i in wanted if values[i] is None]
        if self.control_turned and self.vector is None and not self.rotary:
            # The machine has no rotary axes whose angles the program could give.
            missing.append("the rotary axes")
        return ", ".join(missing)

    def orient(self, vector: Triple, line: int) -> None:
        """Point the tool along a direction: the control turns the rotary axes to unknown angles."""
        if self.vector is None:
            self.control_turned = line
            self.now = [None if i in self.rotary else v for i, v in enumerate(self.now)]
        self.vector = vector

    def add(
        self,
        values: Values,
        line: int,
        kind: int,
        time: float | None = None,
        feed: float | None = None,
        normal: Triple | None = None,
    ) -> None:
        """Add a row, and move the axes there."""
        # Angles that the control chose for a direction aren't known.
        lost = None in ([self.now[i] for i in self.linear] if self.control_turned else self.now)
        modes = self.counting, self.counted, self.vector
        self.rows.append((tuple(values), line, self.step, kind, time, feed, *modes, normal, lost))
        self.now = values

    def columns(self) -> Columns:
        """Return the rows as arrays."""
        return self.rows.columns()


class Rows:
    """The rows of a program: the last ones as tuples, those before as arrays, in a third of the memory.

    Parameters
    ----------
    machine : the machine of the axes
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._parts: list[Columns] = []
        self._last: list[Row] = []
        self._count = 0

    def __len__(self) -> int:
        return self._count + len(self._last)

    def append(self, row: Row) -> None:
        """Add a row."""
        self._last.append(row)
        if len(self._last) == PART:
            self._pack()

    def extend(self, rows: Columns) -> None:
        """Add rows of the same machine."""
        self._pack()
        self._parts.append(rows)
        self._count += len(rows.lines)

    @property
    def last_kind(self) -> int:
        """Kind of the move that ends at the last row."""
        return self._last[-1][3] if self._last else int(self._parts[-1].kinds[-1])

    def columns(self) -> Columns:
        """Return all rows as arrays."""
        self._pack()
        if len(self._parts) > 1:
            joined: dict[str, Any] = {
                name: _joined([getattr(part, name) for part in self._parts]) for name in ARRAYS
            }
            self._parts = [Columns(self._machine, **joined)]
        return self._parts[0]

    def _pack(self) -> None:
        if not self._last:
            return
        given = zip(ARRAYS, zip(*self._last, strict=True), strict=True)
        arrays: dict[str, Any] = {
            name: _directions(values)
            if name in ("vectors", "normals")
            else np.array(values, dtype=_TYPES.get(name, float))
            for name, values in given
        }
        self._count += len(self._last)
        self._last = []
        self._parts.append(Columns(self._machine, **arrays))


@dataclass(frozen=True, eq=False)
class Columns:
    """The rows of a program as arrays; NaN where unknown.

    Parameters
    ----------
    machine : the machine of the axes
    values : (n, k), mm and deg, control's own sign
    lines, kinds : (n,)
    steps : (n,), place of the line in the order in which lines run, from 1
    times : (n,), s, if the program gives the duration
    feeds : (n,), per second as in `Modes.pace`, if the program gives a feed
    counting : (n,), `Counting` values
    counted : (n, k), mm that F per minute counts of a mm or degree of each axis; NaN where nobody says it
    vectors, normals : (n, 3), as written
    from_unknown : (n,), whether the move that ends at the row starts where the program doesn't say: moves
        before it aren't in the rows
    """

    machine: Machine
    values: Array
    lines: IntArray
    steps: IntArray
    kinds: IntArray
    times: Array
    feeds: Array
    counting: IntArray
    counted: Array
    vectors: Array
    normals: Array
    from_unknown: BoolArray

    def at(self, rows: slice | BoolArray | IntArray) -> Columns:
        """Return some of the rows."""
        return Columns(self.machine, **{name: getattr(self, name)[rows] for name in ARRAYS})

    def same_moves(self, other: Columns) -> BoolArray:
        """Mark rows, (n,), that are those of another program but for their lines; none of another number."""
        same = np.full(len(self.lines), len(self.lines) == len(other.lines))
        if not same.any():
            return same
        for name in set(ARRAYS) - {"lines", "steps"}:
            pair = (getattr(self, name), getattr(other, name))
            own, others = (np.asarray(values, dtype=float).reshape(len(same), -1) for values in pair)
            same &= ((own == others) | (np.isnan(own) & np.isnan(others))).all(axis=1)
        return same

    @property
    def moved(self) -> BoolArray:
        """(n,), whether something moves: all rows but dwells; the first one counts as a move."""
        words = np.nan_to_num(np.column_stack([self.values, self.vectors, self.counting]))
        return np.append(True, (np.diff(words, axis=0) != 0.0).any(axis=1))

    @property
    def of_tip(self) -> BoolArray:
        """(n,), whether X, Y and Z are the tip's."""
        return self.counting == Counting.TIP

    def positions(self) -> Array:
        """Return the rows as axis values, (n, k) mm and rad, tool relative to workpiece."""
        return _to_axis_values(self.machine, self.values, self.of_tip)


ARRAYS = tuple(field.name for field in fields(Columns))[1:]
_TYPES: dict[str, type] = {
    **dict.fromkeys(("lines", "steps", "kinds", "counting"), np.int64),
    "from_unknown": bool,
}


def axis_values(machine: Machine, values: Sequence[float | None], counting: Counting) -> Array:
    """Convert one row, (k,) mm and deg in the control's own sign, to axis values, (1, k) mm and rad."""
    return _to_axis_values(machine, np.array([values], dtype=float), np.array([counting == Counting.TIP]))


def _to_axis_values(machine: Machine, values: Array, of_tip: BoolArray) -> Array:
    """Convert control values to axis values.

    This is the only place where an axis that the control counts the other way (`Axis.reversed`) changes its
    sign on input, as `fiveaxis.nc.words.control_values` does on output. X, Y and Z of the tip aren't axis
    values and keep their sign.
    """
    signs = np.array([-1.0 if a.reversed else 1.0 for a in machine.axes])
    is_linear = np.array([not a.is_rotary for a in machine.axes])
    kept = of_tip[:, None] & is_linear
    return np.where(kept, 1.0, signs) * values / machine.shown(np.ones(len(signs)))


def _directions(values: tuple[Triple | None, ...]) -> Array:
    unknown = (np.nan, np.nan, np.nan)
    if not any(values):
        return nowhere(len(values))
    return np.array([unknown if v is None else v for v in values])


def nowhere(count: int) -> Array:
    """Return unknown directions, (n, 3) NaN, that take no memory."""
    return np.broadcast_to(np.nan, (count, 3))


def _joined(parts: list[Array]) -> Array:
    if all(part.strides[0] == 0 for part in parts):
        return nowhere(sum(map(len, parts)))
    return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class Travel:
    """Moves of a program, each ending at its row; the first row has none.

    Parameters
    ----------
    steps : (n, k), mm and deg
    along : (n,), whether F counts mm; else deg/min, as only rotary axes turn
    unknown : (n,), whether nobody says what F counts: the linear axes alone, here
    length : (n,), mm or deg, that F counts
    time : (n,), s, NaN if unknown
    feed : (n,), mm/s or deg/s, NaN if unknown
    """

    steps: Array
    along: BoolArray
    unknown: BoolArray
    length: Array
    time: Array
    feed: Array


def travel_of(columns: Columns, scale: float) -> Travel:
    """Compute the moves of a program, with times and feeds as stated; F counts as `fed_lengths` does.

    The scale is mm of a linear feed of 1, `Modes.feed_scale`.
    """
    is_linear = np.array([not a.is_rotary for a in columns.machine.axes])
    # With tool directions, the angles are NaN.
    steps = np.nan_to_num(np.diff(columns.values, axis=0, prepend=columns.values[:1]))
    length, along = fed_lengths(steps, columns.counted, is_linear)
    unknown = along & (np.isnan(columns.counted) & (steps != 0.0)).any(axis=1)
    feed = columns.feeds * np.where(along, scale, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(np.isnan(columns.times), length / feed, columns.times)
        feed = np.where(np.isnan(feed), length / time, feed)
    return Travel(steps, along, unknown, length, time, feed)


def fed_lengths(steps: Array, counted: Array, is_linear: BoolArray) -> tuple[Array, BoolArray]:
    """Measure what F per minute counts of each move, `L = √Σ(w Δ)²`, which lasts for `L / F`.

    L is (n,), mm or deg, with whether it is in mm, (n,). Where only rotary axes turn, a degree of F is one
    of the axis, unless a radius is stated for it. A linear distance of at most `STANDSTILL` beside a
    rotation is rounding. `MixedFeed` has the sources of each control.

    Parameters
    ----------
    steps : (n, k), mm and deg
    counted : (n, k) or (k,), w, mm that F counts of a mm or degree of each axis; NaN counts as 0
    is_linear : (k,)
    """
    weights = np.nan_to_num(np.broadcast_to(counted, steps.shape))
    whole, distance = (np.linalg.norm(part, axis=1) for part in (weights * steps, steps[:, is_linear]))
    turn = np.linalg.norm(steps[:, ~is_linear], axis=1)
    plain = ((weights == 0.0) | (weights == 1.0) | (steps == 0.0))[:, ~is_linear].all(axis=1)
    along = (distance > np.where(turn > 0.0, STANDSTILL, 0.0)) | ~plain
    return np.where(along, np.where(whole > 0.0, whole, distance), turn), along


def motion_times(columns: Columns, scale: float, rapid: float | None) -> tuple[Array, Array]:
    """Compute duration, (n,) s, and feed, (n,) mm/s or deg/s, of each move of a motion, rapid ones included.

    Columns and scale are as for `travel_of`. In rapid moves, axes without `max_speed` go at `rapid`, mm/s or
    deg/s, by default at `RAPID`; the feed there is `rapid` if given, else distance over time. Rows without a
    move have the feed of the row before.
    """
    travel = travel_of(columns, scale)
    quick = (columns.kinds == MoveKind.RAPID) & np.isnan(columns.times)
    stated = RAPID / 60.0 if rapid is None else rapid
    speeds = [stated if a.max_speed is None else a.shown(a.max_speed) for a in columns.machine.axes]
    slowest = np.max(np.abs(travel.steps) / np.array(speeds), axis=1)
    time = np.where(quick, slowest, travel.time)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(quick, travel.length / time if rapid is None else rapid, travel.feed)
    return time, filled(np.where(travel.length > 0.0, feed, np.nan))


def filled(feed: Array) -> Array:
    """Fill in feeds: rows without one have that of the row before, the first ones that of the first move."""
    known = np.flatnonzero(np.isfinite(feed) & (feed > 0.0))
    if len(known) == 0:
        return feed
    last = np.searchsorted(known, np.arange(len(feed)), side="right") - 1
    return feed[known[np.maximum(last, 0)]]
