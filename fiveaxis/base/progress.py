"""Progress of long work, and what it has found when it is interrupted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Found = TypeVar("Found", bound="NDArray[np.float64] | None")

# Called with the stage in words, the steps done and the steps in all; a stage without steps has one.
Progress = Callable[[str, int, int], None]
# Called with the steps done of a stage, and the steps in all.
Steps = Callable[[int, int], None]


def unheard(_stage: str, _done: int, _total: int) -> None:
    """Ignore progress."""


def uncounted(_done: int, _total: int) -> None:
    """Ignore the steps of a stage."""


def within(progress: Progress, part: str) -> Progress:
    """Return a progress that puts the part of the work in front of each stage."""
    return lambda stage, done, total: progress(f"{part}: {stage}", done, total)


class Checkpoint:
    """Takes what the long steps of a job find, in their order; this one keeps nothing."""

    def found(self, find: Callable[[], Found]) -> Found:
        """Do a step that finds an array that isn't empty, or None."""
        return find()

    def about(self, *_columns: NDArray[Any]) -> None:
        """Tell what the next steps are about: steps about anything else aren't theirs."""

    def part(self, _number: int) -> Checkpoint:
        """Return what takes the steps of one of several threads."""
        return self


UNKEPT = Checkpoint()
