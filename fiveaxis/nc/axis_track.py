"""Where the axes are while a program is read, and the rows of the motion that come of it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import STANDSTILL
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import MoveKind

# Counted under this name: a block whose words say where the axes are already.
NO_MOVE = "no move"

Values = list[float]


@dataclass
class AxisTrack:
    """Axis values, mm and deg in the control's own sign, row by row.

    Parameters
    ----------
    source : the program
    machine : whose axes they are
    now : (k,), in the order of `machine.axes`; None where the program hasn't said and nobody else has
    rapid : mm/s, speed in rapid moves of axes without a known highest one; deg/s of rotary axes
    ignored : counts of moves that aren't in the motion
    approach : rapid moves before every axis was known
    """

    source: Source
    machine: Machine
    now: list[float | None]
    rapid: float | None
    ignored: Counter[str]
    approach: int = 0
    rows: list[Values] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    feeds: list[float | None] = field(default_factory=list)
    kinds: list[int] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        axes = self.machine.axes
        self.linear = [i for i, a in enumerate(axes) if not a.is_rotary]
        self.rotary = [i for i, a in enumerate(axes) if a.is_rotary]
        self.speeds = [self.rapid if a.max_speed is None else a.shown(a.max_speed) for a in axes]

    @property
    def unknown(self) -> str:
        """Letters of the axes whose place isn't known, as ``A, C``."""
        return ", ".join(a.letter for a, v in zip(self.machine.axes, self.now, strict=True) if v is None)

    def place(self, line: int) -> Values:
        """Give the axis values before a move; the first move makes them the motion's first row.

        Raises
        ------
        ToolpathError
            An axis isn't known.
        """
        values = [v for v in self.now if v is not None]
        if len(values) < len(self.now):
            raise self.source.error(
                f"a feed move, and the place of {self.unknown} isn't in the program up to here; give start, "
                "or a rapid move before",
                line,
            )
        if not self.rows:
            self._append(values, line, 0.0, None, MoveKind.RAPID)
        return values

    def measure(self, target: Sequence[float]) -> tuple[float, float]:
        """Measure the way to a place: mm of the linear axes and deg of the rotary ones, one of them above 0.

        Rounding of the linear axes beside a turn is no way (`STANDSTILL`).
        """
        steps = [b - a for a, b in zip(self.rows[-1], target, strict=True)]
        way = math.hypot(*(steps[i] for i in self.linear))
        turn = math.hypot(*(steps[i] for i in self.rotary))
        return (0.0, turn) if way <= STANDSTILL and turn > 0.0 else (way, 0.0)

    def go(self, target: Values, line: int, time: float, feed: float) -> None:
        """Add a feed move, s and mm/s (deg/s of rotary axes alone), from the place of the last row."""
        self._append(target, line, time, feed, MoveKind.CUT)
        self.now = list(target)

    def go_rapid(self, target: Sequence[float | None], line: int) -> None:
        """Add a rapid move; before every axis is known it only tells where they are.

        Raises
        ------
        ToolpathError
            The speed of an axis that moves isn't known.
        """
        if None in self.now:
            self.now = list(target)
            self.approach += 1
            if None not in self.now:
                self.place(line)
            return
        self.place(line)
        values = [v for v in target if v is not None]
        way, turn = self.measure(values)
        if way == turn == 0.0:
            self.ignored[NO_MOVE] += 1
            return
        time = max(self._rapid_time(i, values[i], line) for i in range(len(values)))
        self._append(values, line, time, (way or turn) / time, MoveKind.RAPID)
        self.now = list(values)

    def wait(self, line: int, time: float) -> None:
        """Add a dwell, s: a row at the same place, of the same kind as the move before it."""
        if None in self.now:
            self.ignored["G4 before the motion begins"] += 1
            return
        values = self.place(line)
        self._append(values, line, time, self.feeds[-1], self.kinds[-1])

    def positions(self) -> Array:
        """Convert the rows to axis values, (n, k) mm and rad, tool relative to workpiece.

        This is the one place where an axis that the control counts the other way (`Axis.reversed`) changes
        its sign on the way in, as in `fiveaxis.nc.words.control_values` on the way out.
        """
        signs = np.array([-1.0 if a.reversed else 1.0 for a in self.machine.axes])
        return np.array(self.rows) * signs / self.machine.shown(np.ones(len(signs)))

    def filled_feeds(self) -> list[float]:
        """Give every row a feed: those before the first move have the feed of that one."""
        first = next(f for f in self.feeds if f is not None)
        return [first if f is None else f for f in self.feeds]

    def _append(self, values: Values, line: int, time: float, feed: float | None, kind: int) -> None:
        self.rows.append(values)
        self.lines.append(line)
        self.times.append(time)
        self.feeds.append(feed)
        self.kinds.append(kind)

    def _rapid_time(self, column: int, value: float, line: int) -> float:
        step = abs(value - self.rows[-1][column])
        speed = self.speeds[column]
        if step == 0.0:
            return 0.0
        if speed is None:
            letter = self.machine.letters[column]
            raise self.source.error(
                f"a rapid move of {letter}, whose highest speed machine {self.machine.name!r} doesn't tell, "
                "has no duration; give rapid_mm_min (--rapid), or max_speed in the machine file",
                line,
            )
        return step / speed
