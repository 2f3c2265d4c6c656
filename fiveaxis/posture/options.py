"""What the optimiser minimises, and how."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.base import UNKEPT, Array, Checkpoint, Progress, Search, SettingError, unheard
from fiveaxis.model import USUAL_CLOCK, Clock, Interpolation
from fiveaxis.posture.mask import Mask, MaskFunction
from fiveaxis.posture.strategy.effort import Effort, effort_of


@dataclass(frozen=True, kw_only=True, eq=False)
class Options(Search):
    """What is minimised and how: the options of `fiveaxis.base.Search`, and what only code can give.

    Parameters
    ----------
    effort : a word of `Search`, or how much is done
    mask : which postures are admissible; a function that `Mask.of` takes, too
    interpolation, clock : of the program
    start : (n, 2), rad, chain order, postures to begin from beside those that are searched
    holds_ends : whether the tool keeps the axis that the path has at its first and last location
    progress : called with what is being done, steps done and steps in all
    checkpoint : takes what long steps find

    Raises
    ------
    SettingError
        A value out of its range, or an unknown word; `time_price` with the objective ``time``.
    """

    effort: str | Effort = Search.effort  # type: ignore[assignment]  # wider than the words of `Search`
    mask: Mask | MaskFunction | None = None
    interpolation: Interpolation = Interpolation.JOINT
    clock: Clock = USUAL_CLOCK
    start: Array | None = None
    holds_ends: bool = False
    progress: Progress = unheard
    checkpoint: Checkpoint = UNKEPT

    @property
    def is_bounded(self) -> bool:
        """Whether a lower bound is computed: by default only with the effort ``thorough``."""
        return self.effort == "thorough" if self.bound is None else self.bound

    @property
    def is_timed(self) -> bool:
        """Whether time is the objective."""
        return self.objective == "time"

    def counts(self) -> Effort:
        """Look up the effort by its name; `solver` replaces its own. `SettingError` if either is unknown."""
        return effort_of(self.effort).having(solver=self.solver)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.is_timed and self.time_price is not None:
            raise SettingError("time_price can't be combined with the objective time; leave one out")


DEFAULTS = Options()
