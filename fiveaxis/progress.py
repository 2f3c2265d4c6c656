"""Progress of long work."""

from __future__ import annotations

from collections.abc import Callable

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
