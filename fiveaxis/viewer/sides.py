"""The motions shown side by side: the result and a baseline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.findings import Finding
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Toolpath
from fiveaxis.viewer.tool_motion import KeyFrames, choose_frames, show_pace

if TYPE_CHECKING:
    from fiveaxis.posture.solution import Solution

PREFERRED_BASELINES = ("as-programmed", "normal")


@dataclass(frozen=True, eq=False)
class Side:
    """A motion to show.

    Parameters
    ----------
    node : of the scene: ``after`` for the result, ``before`` for a baseline
    name : shown to the user
    motion, toolpath : row by row; a baseline with rewinds has its own locations
    frames : key frames, on the clock of both sides
    energy : J, of the feed drives
    """

    node: str
    name: str
    motion: Motion
    toolpath: Toolpath
    frames: KeyFrames
    energy: float

    def when_shown(self, finding: Finding) -> float | None:
        """Return when the show passes a finding's location, s; None if it has none."""
        row = finding.place.location
        if row is None or not 0 <= row < len(self.motion):
            return None
        return float(np.interp(row, self.frames.rows, self.frames.times))


def choose_sides(solution: Solution) -> tuple[Side, ...]:
    """Return the result and one baseline, if there is one; both start together and run at one pace."""
    path = solution.toolpath
    chosen = [("after", "result", solution.motion, path, solution.energy)]
    name = next((name for name in PREFERRED_BASELINES if name in solution.compared), None)
    if name is not None:
        baseline = solution.compared[name]
        chosen.append(("before", name, baseline.motion, baseline.toolpath or path, baseline.energy))
    pace = show_pace(*(motion for _, _, motion, _, _ in chosen))
    return tuple(
        Side(node, name, motion, path, choose_frames(motion, pace), energy.total)
        for node, name, motion, path, energy in chosen
    )
