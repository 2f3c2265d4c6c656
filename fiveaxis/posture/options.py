"""The options of the optimiser."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array
from fiveaxis.motion import Interpolation
from fiveaxis.nc import Clock
from fiveaxis.posture.local.refinement import STRUCTURED, require_solver
from fiveaxis.posture.masks.mask import MaskFunction
from fiveaxis.posture.strategy.delivery import Objective
from fiveaxis.posture.strategy.effort import Effort, effort_of
from fiveaxis.posture.strategy.portfolio import Progress
from fiveaxis.toolpath import Constraints
from fiveaxis.toolpath.passes import Passes


@dataclass(frozen=True, eq=False)
class Options:
    """What is minimised and how: the keywords of `fiveaxis.optimise`, which documents each of them."""

    mask: MaskFunction | None = None
    objective: Objective = "energy"
    up_penalty: float = 0.0
    smoothing: float = 0.0
    time_price: float | None = None
    free_start: bool | Passes = False
    free_direction: bool = False
    effort: str | Effort = "normal"
    interpolation: Interpolation = Interpolation.JOINT
    clock: Clock | None = None
    solver: str = STRUCTURED
    start: Array | None = None
    progress: Progress | None = None

    @property
    def is_timed(self) -> bool:
        """Whether time is the objective."""
        return self.objective == "time"

    def counts(self) -> Effort:
        """Look up the effort by its name; `solver` replaces the effort's own.

        Raises
        ------
        SettingError
            An unknown effort or solver.
        """
        require_solver(self.solver)
        return replace(effort_of(self.effort), solver=self.solver)

    def without_free_start(self) -> Options:
        """Return the options with which passes stay as they are."""
        return replace(self, free_start=False, free_direction=False)

    def require_consistent(self, constraints: Constraints) -> None:
        """Raise an error if options contradict each other or the constraints.

        Raises
        ------
        SettingError
            `free_start` with a mask or a singular cone, `free_direction` without `free_start`, `time_price`
            with the objective ``time``.
        """
        if self.free_start and (self.mask is not None or constraints.singular_cone is not None):
            raise SettingError("free_start can't be combined with a mask or a singular cone; leave one out")
        if self.free_direction and not self.free_start:
            raise SettingError("free_direction needs free_start; give that, too")
        if self.is_timed and self.time_price is not None:
            raise SettingError("time_price can't be combined with the objective time; leave one out")
