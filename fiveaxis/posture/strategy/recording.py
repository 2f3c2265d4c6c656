"""Runs that record their stages, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

from fiveaxis.posture.solution import Stage
from fiveaxis.progress import Progress, unheard
from fiveaxis.threads import at_once

T = TypeVar("T")


@dataclass(eq=False, kw_only=True)
class Recorded:
    """A run that says what it does.

    Parameters
    ----------
    progress : called with what is being done, steps done and steps in all
    stages : what was done so far
    """

    progress: Progress = unheard
    stages: list[Stage] = field(default_factory=list)


R = TypeVar("R", bound=Recorded)


def side_by_side(run: R, tasks: Sequence[Callable[[R], T]]) -> list[T]:
    """Run independent tasks of a run in threads.

    Each has its own copy of the run, and the stages are recorded in the order of the tasks: the result
    doesn't depend on which one ends first, or how many run at once.
    """
    # Only the first reports progress.
    parts = [replace(run, stages=[], progress=unheard if n else run.progress) for n in range(len(tasks))]
    answers = at_once([partial(task, part) for task, part in zip(tasks, parts, strict=True)])
    run.stages += [stage for part in parts for stage in part.stages]
    return answers
