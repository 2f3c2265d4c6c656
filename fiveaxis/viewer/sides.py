"""What is shown side by side: the result and the posture that it is measured against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
    name : as people call it
    motion, toolpath : row by row; a baseline that is rewound has locations of its own
    frames : key frames, on a clock that both sides share
    energy : J, of the feed drives
    """

    node: str
    name: str
    motion: Motion
    toolpath: Toolpath
    frames: KeyFrames
    energy: float


def choose_sides(solution: Solution) -> tuple[Side, ...]:
    """Choose what is shown: the result, and one baseline if there is one.

    Both start together and run at one pace, so the quicker one ends first.
    """
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
