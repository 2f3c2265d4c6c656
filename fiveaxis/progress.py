"""What work tells while it goes on."""

from __future__ import annotations

from collections.abc import Callable

# Takes what is being done, in words for people, steps done and steps in all; one step where none are counted.
Progress = Callable[[str, int, int], None]


def unheard(_stage: str, _done: int, _total: int) -> None:
    """Take progress that nobody asked for."""


def within(progress: Progress, part: str) -> Progress:
    """Return a progress that says of which part of the work its stages are."""
    return lambda stage, done, total: progress(f"{part}: {stage}", done, total)
