"""Where the axes are while a program is read, and the rows that come of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.nc.languages.block import Triple
from fiveaxis.nc.source import Source

# Counted under this name: a block whose words say where the axes are already.
NO_MOVE = "no move"

Values = list[float | None]


class Counting(IntEnum):
    """What the X, Y and Z of a row are."""

    AXES = 0  # positions of the machine's axes
    COMPENSATED = 1  # the same, and the control adds the tool's length (G43)
    TIP = 2  # the tip's place on the workpiece (tool centre point control, a tilted plane)


# Values, line, kind, duration in s, feed per s as `Modes.pace` gives it, `Counting`, tool vector, surface
# normal. All plain numbers in tuples, because a program has a million rows: the garbage collector looks at
# those once, but at lists and members of enumerations again and again, which takes a third of the time.
Row = tuple[tuple[float | None, ...], int, int, float | None, float | None, int, Triple | None, Triple | None]


@dataclass
class AxisTrack:
    """Axis values, mm and deg in the control's own sign, row by row.

    Parameters
    ----------
    source : the program
    machine : whose axes they are
    now : (k,), in the order of `machine.axes`; None where the program hasn't said and nobody else has
    ignored : counts of moves that aren't in the rows
    approach : rapid moves that only tell where some axes are, because others aren't known
    vector : the tool's direction on the workpiece, where it is in force instead of angles
    led_line : where the control began to turn the rotary axes by itself, to angles that aren't in the
        program; 0 before
    """

    source: Source
    machine: Machine
    now: Values
    ignored: Counter[str]
    approach: int = 0
    rows: list[Row] = field(default_factory=list)
    counting: int = int(Counting.AXES)
    vector: Triple | None = None
    led_line: int = 0

    def __post_init__(self) -> None:
        axes = self.machine.axes
        self.linear = [i for i, a in enumerate(axes) if not a.is_rotary]
        self.rotary = [i for i, a in enumerate(axes) if a.is_rotary]

    def unknown(self, values: Sequence[float | None]) -> str:
        """Letters of the axes whose place isn't known, as ``A, C``; none of the rotary ones by a vector."""
        wanted = self.linear if self.vector is not None else range(len(values))
        missing = [self.machine.letters[i] for i in wanted if values[i] is None]
        if self.led_line and self.vector is None and not self.rotary:
            # A machine that has no rotary axes here can't be told where they are.
            missing.append("the rotary axes")
        return ", ".join(missing)

    def lead(self, vector: Triple, line: int) -> None:
        """Let the control turn the tool into a direction: where the rotary axes stand isn't known then."""
        if self.vector is None:
            self.led_line = line
            self.now = self.led(self.now)
        self.vector = vector

    def led(self, values: Values) -> Values:
        """Forget where the rotary axes are, (k,)."""
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
        """Add a row at values, which are where the axes are from here on."""
        self.rows.append((tuple(values), line, kind, time, feed, self.counting, self.vector, normal))
        self.now = values

    def columns(self) -> Columns:
        """Put the rows into arrays."""
        values, lines, kinds, times, feeds, counting, vectors, normals = zip(*self.rows, strict=True)
        return Columns(
            self.machine,
            np.array(values, dtype=float),
            np.array(lines, dtype=np.int64),
            np.array(kinds, dtype=np.int64),
            np.array(times, dtype=float),
            np.array(feeds, dtype=float),
            np.array(counting, dtype=np.int64),
            _triples(vectors),
            _triples(normals),
        )


@dataclass(frozen=True, eq=False)
class Columns:
    """The rows of a program as arrays; NaN where a row doesn't know.

    Parameters
    ----------
    machine : whose axes they are
    values : (n, k), mm and deg, control's own sign
    lines, kinds : (n,)
    times : (n,), s, where the program gives the duration
    feeds : (n,), per second as `Modes.pace` gives them, where it gives a speed
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
        """Convert the rows to axis values, (n, k) mm and rad, tool relative to workpiece.

        This is the one place where an axis that the control counts the other way (`Axis.reversed`) changes
        its sign on the way in, as in `fiveaxis.nc.words.control_values` on the way out. X, Y and Z of the tip
        aren't axis values and keep their sign.
        """
        signs = np.array([-1.0 if a.reversed else 1.0 for a in self.machine.axes])
        is_linear = np.array([not a.is_rotary for a in self.machine.axes])
        kept = self.of_tip[:, None] & is_linear
        return np.where(kept, 1.0, signs) * self.values / self.machine.shown(np.ones(len(signs)))


def axis_values(machine: Machine, values: Sequence[float | None], counting: Counting) -> Array:
    """Convert one place, (k,) mm and deg in the control's own sign, to axis values, (1, k) mm and rad."""
    row = (tuple(values), 0, 0, None, None, counting, None, None)
    return AxisTrack(Source("", []), machine, [], Counter(), rows=[row]).columns().positions()


def _triples(values: tuple[Triple | None, ...]) -> Array:
    if not any(values):
        return np.full((len(values), 3), np.nan)
    nothing = (np.nan, np.nan, np.nan)
    return np.array([nothing if v is None else v for v in values])
