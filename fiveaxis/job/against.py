"""What a program or a motion is verified against."""

from __future__ import annotations

from dataclasses import dataclass, field

from fiveaxis.collision import Surroundings
from fiveaxis.toolpath import Constraints, Tool, Toolpath
from fiveaxis.verification import DEFAULT_TOLERANCES, Tolerances


@dataclass(frozen=True, eq=False)
class Against:
    """What a motion's program is held against; nothing of it leaves it unverified.

    Parameters
    ----------
    toolpath : that it should follow
    tool : the cutter; that of `toolpath` by default
    surroundings : part, stock and fixtures
    constraints : on postures and turns
    gouge_tolerance : mm, how deep the cutter may reach into the part
    """

    toolpath: Toolpath | None = None
    tool: Tool | None = None
    surroundings: Surroundings | None = None
    constraints: Constraints = field(default_factory=Constraints)
    gouge_tolerance: float = DEFAULT_TOLERANCES.gouge

    @property
    def is_nothing(self) -> bool:
        """Whether there is nothing to verify against."""
        return self.toolpath is None and self.tool is None and self.surroundings is None

    @property
    def cutter(self) -> Tool | None:
        """The tool, or that of the path."""
        return self.tool or (None if self.toolpath is None else self.toolpath.tool)

    @property
    def leaning_path(self) -> Toolpath | None:
        """The path with the part of the cutter that touches within the bounds on its lean."""
        return None if self.toolpath is None else self.constraints.zoned(self.toolpath)

    @property
    def tolerances(self) -> Tolerances:
        """From where on a difference is a finding."""
        return DEFAULT_TOLERANCES.with_gouge(self.gouge_tolerance)


NOTHING = Against()
