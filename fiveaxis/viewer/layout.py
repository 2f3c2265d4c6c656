"""Arrangement of the scene in the view: the result alone, or with a baseline side by side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array

# Size of the scene in the view, for which the viewer's lights and clipping are made.
SHOWN_SIZE = 2.4
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
# Direction across the view from left to right, workpiece frame.
RIGHT = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
# Side by side: distance of the two in sizes of the scene, and scale of each.
GAP, SMALLER = 1.35, 0.62
# Offset of the scene, alone, to the right of the middle, in its sizes: the legend is on the left.
ASIDE = 0.28
# Factor of the viewing distance with the machine. With its whole working space in view the part would be too
# small.
STEP_BACK = 4.0


@dataclass(frozen=True, eq=False)
class Layout:
    """A box of the workpiece frame that is in view.

    Parameters
    ----------
    low, high : (3,), mm, its corners
    size : mm, of what fills the view, as a rule its longest side
    """

    low: Array
    high: Array
    size: float

    def with_machine(self) -> Layout:
        """Step back, so that table and spindle are visible around the part."""
        return replace(self, size=STEP_BACK * self.size)

    def together(self) -> Array:
        """Return the transform, (4, 4), that scales the scene to the view, beside the legend."""
        aside = ASIDE * self.size * RIGHT
        return self._scaled(SHOWN_SIZE / self.size, (self.low + self.high) / 2.0 - aside)

    def apart(self) -> Array:
        """Return the transform, (4, 4), that shows the result and a baseline moved by `shift`."""
        middle = (self.low + self.high + self.shift()[:3, 3]) / 2.0
        return self._scaled(SMALLER * SHOWN_SIZE / self.size, middle)

    def shift(self) -> Array:
        """Return the transform, (4, 4) mm, that moves a baseline to the left of the result."""
        moved = np.eye(4)
        moved[:3, 3] = -GAP * self.size * RIGHT
        return moved

    @staticmethod
    def _scaled(scale: float, middle: Array) -> Array:
        scaled = np.diag([scale, scale, scale, 1.0])
        scaled[:3, 3] = -scale * middle
        return scaled
