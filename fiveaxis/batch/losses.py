"""Tell jobs that kill their workers from jobs whose workers somebody else killed."""

from __future__ import annotations

import math
from collections import defaultdict

# Workers that a job may lose before it counts as their killer, and the largest probability of chance then.
MOST_KILLS, BY_CHANCE = 3, 1e-6


class Losses:
    """The workers that each job has lost, and how often workers die that no job can have killed.

    A signal doesn't say who sent it: the system kills a worker whose job uses up the memory just as an
    operator does. So a job counts as the killer of its workers after `MOST_KILLS` of them, unless as many are
    likely to die by chance, which is how workers die that are starting, or whose job finishes on another one.
    """

    def __init__(self) -> None:
        self._lives, self._seconds, self._deaths = 0, 0.0, 0
        self._lost: dict[str, list[tuple[float, bool]]] = defaultdict(list)

    def survive(self, seconds: float) -> None:
        """Count a start, or a job, that came to its end."""
        self._lives += 1
        self._seconds += seconds

    def die(self, seconds: float) -> None:
        """Count a worker that no job can have killed."""
        self.survive(seconds)
        self._deaths += 1

    def finish(self, name: str, seconds: float) -> None:
        """Count a job that came to its end: it can't have killed the workers that it lost before."""
        self.survive(seconds)
        for lost, _ in self._lost.pop(name, []):
            self.die(lost)

    def lose(self, name: str, seconds: float, *, crashed: bool) -> int:
        """Count a worker that died while it ran a job.

        Parameters
        ----------
        name : of the job
        seconds : that it had run
        crashed : whether the worker ended by a fault of its own, which is no chance

        Returns
        -------
        How many workers the job has killed; 0 while they may have died by chance.
        """
        lost = self._lost[name]
        lost.append((seconds, crashed))
        chance = math.prod(0.0 if crash else self._probability(lived) for lived, crash in lost)
        return len(lost) if len(lost) >= MOST_KILLS and chance < BY_CHANCE else 0

    def _probability(self, seconds: float) -> float:
        """Compute how likely chance ends a life: longer ones more, none less than one of mean length."""
        if not self._deaths:
            return 0.0
        mean = max(self._seconds / self._lives, 1e-3)
        return -math.expm1(-self._deaths / self._lives * max(1.0, seconds / mean))
