"""The stock as it is cut in the page: steps along the time line, and the colours of what is finished."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array
from fiveaxis.check import (
    DEEP,
    FINISHED,
    GOUGED,
    HIGH,
    LEFT,
    UNCUT,
    Blank,
    CutStock,
    Playback,
    colours_at,
    play,
)
from fiveaxis.model import Machine, interpolate, tool_poses
from fiveaxis.show.viewer.moves import Side
from fiveaxis.show.viewer.payload import Sections

# Steps, of equal duration, in which a stock is cut.
STEPS = 2000
# Steps over whose mean a removal rate is shown: what one removes is known to a few rays only.
WINDOW = 21


@dataclass(frozen=True, eq=False)
class PlayedStock:
    """A stock that the result cuts, with the times of its steps.

    Parameters
    ----------
    playback : its surface
    clock : (s + 1,), s from the first row on, when each step ends; step 0 is the stock before
    colours : (v, 3), of the vertices of what remains, where it was compared with the part
    tolerance : mm, distance from the part within which it is finished
    is_compared : whether it was
    """

    playback: Playback
    clock: Array
    colours: NDArray[np.uint8]
    tolerance: float
    is_compared: bool

    @classmethod
    def of(cls, blank: Blank, side: Side, machine: Machine, cut: CutStock | None) -> PlayedStock:
        """Cut a stock by all moves of the result that is shown, approach and retract included.

        `cut` is the stock as verification has cut it and compared it with the part.
        """
        clock, positions = side.clock - side.clock[0], side.motion.positions
        times = np.linspace(0.0, clock[-1], STEPS + 1)
        ends = np.interp(times[1:], clock, np.arange(len(clock)))
        ends[-1] = len(clock) - 1
        found = play(
            blank.stock,
            side.toolpath.tool,
            lambda place: tool_poses(machine, interpolate(positions, place)),
            len(clock),
            ends,
        )
        colours = np.full((len(found.vertices), 3), UNCUT, np.uint8)
        if cut is not None:
            last = np.unique(found.at(STEPS))
            cell = found.cell
            colours[last] = colours_at(found.vertices[last], cut.deviations, blank.tolerance, cell)
        return cls(found, times, colours, blank.tolerance, cut is not None)

    def key(self) -> dict[tuple[int, int, int], str]:
        """Return the colours of the map with what each means."""
        return {
            FINISHED: f"within {self.tolerance:g} mm of the part",
            LEFT: f"left, dark from {HIGH * self.tolerance:g} mm",
            GOUGED: f"gouged, dark from {DEEP * self.tolerance:g} mm",
            UNCUT: "not cut, or not yet finished",
        }

    @property
    def rate(self) -> Array:
        """Material removal rate about the end of each step, (s + 1,) mm³/s."""
        sums = np.concatenate([[0.0], np.cumsum(self.playback.removed)])
        step = np.arange(len(sums))
        begin, end = np.maximum(step - WINDOW // 2, 0), np.minimum(step + WINDOW // 2, step[-1])
        taken = self.clock[end] - self.clock[begin]
        return np.asarray((sums[end] - sums[begin]) / np.where(taken > 0.0, taken, 1.0))

    def describe(self, sections: Sections) -> dict[str, Any]:
        """Add its arrays to those of the page, and return what else the script needs."""
        found = self.playback
        low, lives = found.vertices.min(axis=0), found.lives
        there = np.bincount(lives[:, 0], minlength=STEPS + 2)
        there -= np.bincount(np.minimum(lives[:, 1], STEPS + 1), minlength=STEPS + 2)
        sections.add_steps("stock/vertices", found.vertices - low)
        sections.add("stock/colours", self.colours, "u1")
        sections.add("stock/quads", found.quads, "i4")
        sections.add("stock/born", lives[:, 0], "i4")
        sections.add("stock/gone", lives[:, 1], "i4")
        sections.add("stock/clock", self.clock, "f8")
        sections.add("stock/rate", self.rate, "f4")
        return {"low": low.tolist(), "most": int(np.cumsum(there).max())}
