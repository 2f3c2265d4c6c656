"""How the scene stands in the view: alone, or result and baseline side by side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array

# The scene is shown at this size, whatever the part's: lights and clipping of the viewer are made for it.
SHOWN_SIZE = 2.4
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
# Across the view from the left to the right, workpiece frame.
RIGHT = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
# Side by side: from one to the other, sizes of the scene; and at what share of its size.
GAP, SMALLER = 1.35, 0.62
# How far to the right of the view's middle the scene stands alone, of its size: the legend is on the left.
ASIDE = 0.28
# How much farther away the scene is seen with the machine. If all that a machine sweeps, seen from the part,
# were in view, nothing would be left of the part.
STEP_BACK = 4.0


@dataclass(frozen=True, eq=False)
class Layout:
    """A box of the workpiece frame that is in view.

    Parameters
    ----------
    low, high : (3,), mm, its corners
    size : mm, its longest side, or what else is to fill the view
    """

    low: Array
    high: Array
    size: float

    def with_machine(self) -> Layout:
        """Step back, so that the machine is seen around the part: table and spindle, if not all of it."""
        return replace(self, size=STEP_BACK * self.size)

    def together(self) -> Array:
        """Scale the scene to the view, (4, 4), its middle to the right: no legend is there."""
        aside = ASIDE * self.size * RIGHT
        return self._shown(SHOWN_SIZE / self.size, (self.low + self.high) / 2.0 - aside)

    def apart(self) -> Array:
        """Scale the scene so that the result and a baseline, shifted by `shift`, are in view, (4, 4)."""
        middle = (self.low + self.high + self.shift()[:3, 3]) / 2.0
        return self._shown(SMALLER * SHOWN_SIZE / self.size, middle)

    def shift(self) -> Array:
        """Move a baseline to the left of the result, (4, 4), mm."""
        moved = np.eye(4)
        moved[:3, 3] = -GAP * self.size * RIGHT
        return moved

    @staticmethod
    def _shown(scale: float, middle: Array) -> Array:
        shown = np.diag([scale, scale, scale, 1.0])
        shown[:3, 3] = -scale * middle
        return shown
