"""Axis positions while a program is read, and the rows they form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.nc.languages.block import Triple

# Key of the counts: blocks to the position that the axes already have.
NO_MOVE = "no move"

Values = list[float | None]


class Counting(IntEnum):
    """Meaning of X, Y and Z of a row."""

    AXES = 0  # positions of the machine's axes
    COMPENSATED = 1  # the same, plus tool length by the control (G43)
    TIP = 2  # tip on the workpiece (TCP, a tilted plane)


# Values, line, kind, duration in s, feed per s as in `Modes.pace`, `Counting`, tool vector, surface normal.
# Plain numbers in tuples, because a program has up to a million rows: the garbage collector visits those
# once, but lists and enumeration members again and again, which takes a third of the time.
Row = tuple[tuple[float | None, ...], int, int, float | None, float | None, int, Triple | None, Triple | None]


@dataclass
class AxisTrack:
    """Axis values, mm and deg in the control's own sign, row by row.

    Parameters
    ----------
    machine : the machine of the axes
    now : (k,), in the order of `machine.axes`; None where unknown
    ignored : counts of moves that aren't in the rows
    approach : count of rapid moves before all axes are known
    vector : tool direction on the workpiece in force, instead of angles
    control_turned : line on which the control began to turn the rotary axes to angles that aren't in the
        program; 0 before
    """

    machine: Machine
    now: Values
    ignored: Counter[str]
    approach: int = 0
    rows: list[Row] = field(default_factory=list)
    counting: int = int(Counting.AXES)
    vector: Triple | None = None
    control_turned: int = 0

    def __post_init__(self) -> None:
        axes = self.machine.axes
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
            self.now = self.without_rotary(self.now)
        self.vector = vector

    def without_rotary(self, values: Values) -> Values:
        """Return the values, (k,), with unknown rotary axes."""
        return [None if i in self.rotary else v for i, v in enumerate(values)]

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
        self.rows.append((tuple(values), line, kind, time, feed, self.counting, self.vector, normal))
        self.now = values

    def columns(self) -> Columns:
        """Return the rows as arrays."""
        values, lines, kinds, times, feeds, counting, vectors, normals = zip(*self.rows, strict=True)
        return Columns(
            self.machine,
            np.array(values, dtype=float),
            np.array(lines, dtype=np.int64),
            np.array(kinds, dtype=np.int64),
            np.array(times, dtype=float),
            np.array(feeds, dtype=float),
            np.array(counting, dtype=np.int64),
            _directions(vectors),
            _directions(normals),
        )


@dataclass(frozen=True, eq=False)
class Columns:
    """The rows of a program as arrays; NaN where unknown.

    Parameters
    ----------
    machine : the machine of the axes
    values : (n, k), mm and deg, control's own sign
    lines, kinds : (n,)
    times : (n,), s, if the program gives the duration
    feeds : (n,), per second as in `Modes.pace`, if the program gives a feed
    counting : (n,), `Counting` values
    vectors, normals : (n, 3), as written
    """

    machine: Machine
    values: Array
    lines: IntArray
    kinds: IntArray
    times: Array
    feeds: Array
    counting: IntArray
    vectors: Array
    normals: Array

    @property
    def of_tip(self) -> BoolArray:
        """(n,), whether X, Y and Z are the tip's."""
        return self.counting == Counting.TIP

    def positions(self) -> Array:
        """Return the rows as axis values, (n, k) mm and rad, tool relative to workpiece."""
        return _to_axis_values(self.machine, self.values, self.of_tip)


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
        return np.full((len(values), 3), np.nan)
    return np.array([unknown if v is None else v for v in values])
