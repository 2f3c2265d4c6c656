"""Where the blocks of a program take longer than F says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.base import Array
from fiveaxis.lab.pricing.programs import ProgramEnergy
from fiveaxis.model import tool_poses

# Share by which a slow block takes longer than its F says, and how many lines that are quick enough may lie
# between two slow ones of one place.
SLOW, APART = 0.1, 4
# s: less is lost in places that aren't told.
LEAST_LOST = 0.05
# mm: along shorter paths the tool turns about its tip, and no feed is told.
TURNS = 1e-3


@dataclass(frozen=True)
class SlowPlace:
    """Blocks one after the other that take longer than F says.

    Parameters
    ----------
    first, last : lines of the program
    lost : s, beyond the programmed time
    cause : that costs most time there, as `Limiting` names it
    asked, got : mm/min, speed of the tool's tip by F and as timed; None where the tool only turns
    """

    first: int
    last: int
    lost: float
    cause: str
    asked: float | None
    got: float | None

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return vars(self).copy()


def slow_places(program: ProgramEnergy) -> Iterator[SlowPlace]:
    """Yield the places of a program where blocks take longer than F says, the costliest first."""
    motion, time, asked = program.motion, program.motion.time, program.programmed
    late = late_times(program)
    slow = np.flatnonzero(late > SLOW * np.maximum(asked, 1e-9))
    if not len(slow):
        return
    tips, _ = tool_poses(program.machine, motion.positions)
    length = np.nan_to_num(np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1))
    causes, by_cause = program.limiting.causes, program.limiting.time.copy()
    # The feed doesn't make a block late, and a dwell is asked for.
    by_cause[:, [causes.index(name) for name in ("feed", "dwell")]] = 0.0
    places = []
    for rows in np.split(slow, np.flatnonzero(np.diff(motion.source[slow]) > APART) + 1):
        block = slice(int(rows[0]), int(rows[-1]) + 1)
        lost, path = float(late[block].sum()), float(length[block].sum())
        if lost < LEAST_LOST:
            continue
        spent = by_cause[block].sum(axis=0)
        feeds = (None, None) if path < TURNS else (60.0 * path / float(t[block].sum()) for t in (asked, time))
        cause = causes[int(spent.argmax())] if spent.any() else ""
        lines = motion.source[block]
        places.append(SlowPlace(int(lines.min()), int(lines.max()), lost, cause, *feeds))
    yield from sorted(places, key=lambda place: -place.lost)


def late_times(program: ProgramEnergy) -> Array:
    """Compute by how much each block takes longer than F says, (n,) s; rapid moves have no F."""
    late = np.maximum(program.motion.time - program.programmed, 0.0)
    return np.where(program.motion.rapid, 0.0, late)
