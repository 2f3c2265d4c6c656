"""Progress of long work, and what it has found when it is interrupted."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any, Self, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Found = TypeVar("Found", bound="NDArray[np.float64] | None")

# Called with the stage in words, a `Stage` for those of a job, the steps done and the steps in all; a stage
# without steps has one.
Progress = Callable[[str, int, int], None]
# Called with the steps done of a stage, and the steps in all.
Steps = Callable[[int, int], None]

# Stages of a job in their order: identifier, words, and share of a usual job's time, in percent, as
# `python tests/benchmarks/stages.py` prints them. What is searched is searched again, more finely: that
# share has a place of its own.
_STAGES = (
    ("read", "reading the input", 8.0),
    ("plan", "planning passes", 2.0),
    ("part", "reading part and stock", 1.0),
    ("place", "placing the part", 2.0),
    ("setups", "trying setups", 1.0),
    ("clear", "finding postures that are clear", 2.0),
    ("baselines", "computing baselines", 3.0),
    ("price", "pricing baselines as programs", 2.0),
    ("search", "searching postures", 22.0),
    ("blocks", "solving for the program's blocks", 8.0),
    ("again", "searching again", 27.0),
    ("collisions", "checking the path for collisions", 2.0),
    ("bound", "bounding the cost from below", 1.0),
    ("verify", "writing and verifying the program", 9.0),
    ("report", "writing the report", 5.0),
    ("preview", "writing the preview", 5.0),
)
# Share of the whole work from which on a remaining time is told, and s that have to be past.
SURE_SHARE, SURE_TIME = 0.05, 1.0


class Stage(str):
    """A stage of a job in words, with its place in the whole work.

    Parameters
    ----------
    words : what is being done
    id : identifier, which stays when the words change
    begin, end : shares of the time of the whole work, 0 to 1
    until : share up to which the same stages may be done again
    """

    id: str
    begin: float
    end: float
    until: float

    def __new__(cls, words: str, id: str, begin: float, end: float, until: float) -> Self:
        """Make it of its words."""
        stage = super().__new__(cls, words)
        stage.id, stage.begin, stage.end, stage.until = id, begin, end, until
        return stage


def _stages() -> dict[str, Stage]:
    ends = [0.0, *accumulate(weight for *_, weight in _STAGES)]
    spans = [(a / ends[-1], b / ends[-1]) for a, b in pairwise(ends)]
    verify = next(span[0] for (id, *_), span in zip(_STAGES, spans, strict=True) if id == "verify")
    return {
        id: Stage(words, id, *span, verify if span[1] <= verify else span[1])
        for (id, words, _), span in zip(_STAGES, spans, strict=True)
    }


STAGES = _stages()
# The part of a job in which postures are chosen.
CHOOSING = STAGES["clear"].begin, STAGES["verify"].begin


def unheard(_stage: str, _done: int, _total: int) -> None:
    """Ignore progress."""


def uncounted(_done: int, _total: int) -> None:
    """Ignore the steps of a stage."""


def within(
    progress: Progress, part: str, number: int = 0, of: int = 1, span: tuple[float, float] = (0.0, 1.0)
) -> Progress:
    """Return the progress of one of several like parts of the work: it is named in front of each stage.

    Parameters
    ----------
    progress : of the whole work
    part : in words
    number, of : which one, from 0, and how many there are
    span : shares of the whole work between which they lie
    """
    low, high = span

    def placed(share: float) -> float:
        inside = min(max((share - low) / (high - low), 0.0), 1.0)
        return low + (high - low) * (min(number, of - 1) + inside) / of

    def step(stage: str, done: int, total: int) -> None:
        words = f"{part}: {stage}"
        if isinstance(stage, Stage):
            words = Stage(words, stage.id, *map(placed, (stage.begin, stage.end, stage.until)))
        progress(words, done, total)

    return step


@dataclass(frozen=True)
class ProgressReport:
    """How far long work is.

    Parameters
    ----------
    stage : what is being done, in words
    id : of the stage; empty for one that isn't a job's
    done, total : its steps
    share : of the whole work, 0 to 1; None where it isn't known
    left : s, until its end, by what is past; None while that isn't sure
    """

    stage: str
    id: str
    done: int
    total: int
    share: float | None
    left: float | None


class Meter:
    """Makes one share of the whole work, which never goes back, and one remaining time out of stages.

    A report goes to `tell` as each stage begins, and then after a pause; clock and pause are in s.
    """

    def __init__(
        self,
        tell: Callable[[ProgressReport], None],
        clock: Callable[[], float] = time.monotonic,
        pause: float = 0.0,
    ) -> None:
        self._tell, self._clock, self._pause, self._began = tell, clock, pause, clock()
        self._next = self._began
        self._stage, self._span, self._share = "", (0.0, 0.0), 0.0

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Take a step: a `Progress`."""
        own = done / total if total > 1 else None
        if isinstance(stage, Stage):
            if stage != self._stage or done == 0:
                begin, end = stage.begin, stage.end
                if begin < self._share:
                    # Done again, nobody knows how often: each time takes half of what is left for it.
                    begin = self._share
                    end = max(end, begin + 0.5 * (stage.until - begin))
                self._span = begin, end
            begin, end = self._span
            self._share = own = max(self._share, begin + (end - begin) * min(own or 0.0, 1.0))
        elif stage != self._stage:
            # Work of one stage, or one after another of which nobody knows the places.
            self._began = self._clock()
        now = self._clock()
        if stage != self._stage or now >= self._next:
            self._stage, self._next = stage, now + self._pause
            self._tell(ProgressReport(stage, getattr(stage, "id", ""), done, total, own, self._left(own)))

    def _left(self, share: float | None) -> float | None:
        past = self._clock() - self._began
        if share is None or share < SURE_SHARE or past < SURE_TIME:
            return None
        return past * (1.0 - share) / share


class Checkpoint:
    """Takes what the long steps of a job find, in their order; this one keeps nothing."""

    def found(self, find: Callable[[], Found]) -> Found:
        """Do a step that finds an array that isn't empty, or None."""
        return find()

    def about(self, *_columns: NDArray[Any]) -> None:
        """Tell what the next steps are about: steps about anything else aren't theirs."""

    def part(self) -> Checkpoint:
        """Return what takes the steps of one of several threads."""
        return self


UNKEPT = Checkpoint()
