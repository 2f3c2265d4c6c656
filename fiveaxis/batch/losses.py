"""Workers that died: by a job's doing, or by that of somebody who could have hit any job."""

from __future__ import annotations

import math
from collections import defaultdict

# Workers that a job takes with it before it is told to kill them, and the largest likelihood of chance then.
MOST_KILLS, BY_CHANCE = 3, 1e-6


class Losses:
    """Tells a job that kills its workers from one whose workers were killed by chance.

    A signal doesn't say who sent it: memory that a job used up looks like an operator's mistake. So a job is
    to blame after `MOST_KILLS` deaths in a row, unless as many are likely by the rate at which workers die
    that no job can have killed: those that were starting, and those whose job came to its end later.
    """

    def __init__(self) -> None:
        self._lives, self._seconds, self._deaths = 0, 0.0, 0
        self._lost: dict[str, list[float]] = defaultdict(list)

    def survive(self, seconds: float) -> None:
        """Count a life without a death: a start, or a job."""
        self._lives += 1
        self._seconds += seconds

    def die(self, seconds: float) -> None:
        """Count a death that no job can have caused."""
        self.survive(seconds)
        self._deaths += 1

    def finish(self, name: str, seconds: float) -> None:
        """Count a job that came to its end: it hadn't killed the workers that it lost before."""
        self.survive(seconds)
        for lost in self._lost.pop(name, []):
            self.die(lost)

    def blame(self, name: str, seconds: float, *, crashed: bool) -> bool:
        """Count the death of a job's worker.

        Parameters
        ----------
        name : of the job
        seconds : that it had run
        crashed : whether the worker died of itself, which is no chance

        Returns
        -------
        Whether the job is to blame.
        """
        lost = self._lost[name]
        lost.append(math.nan if crashed else seconds)
        return len(lost) >= MOST_KILLS and math.prod(map(self._likelihood, lost)) < BY_CHANCE

    def count(self, name: str) -> int:
        """Count the workers that a job has lost."""
        return len(self._lost[name])

    def _likelihood(self, seconds: float) -> float:
        """Compute how likely a life ends by chance: longer ones more, none less than one of mean length."""
        if not self._deaths or math.isnan(seconds):
            return 0.0
        mean = max(self._seconds / self._lives, 1e-3)
        return -math.expm1(-self._deaths / self._lives * max(1.0, seconds / mean))
