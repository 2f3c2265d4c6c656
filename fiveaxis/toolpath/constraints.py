"""What bounds the tool's posture, in one record that goes whole from the optimiser to verification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

Range = tuple[float, float]


@dataclass(frozen=True)
class Constraints:
    """Bounds on postures and turns, in degrees as people say them; what is None or empty isn't bound.

    Parameters
    ----------
    tilt : smallest and largest angle between tool axis and surface normal
    cone : largest angle between tool axis and programmed axis
    lead, lean : smallest and largest angle by which the tool is tipped into the feed, and to its left
    plane : a vector at right angles to a plane that the tool axis stays in
    hold : where rotary axes stand, by letter
    max_turn : largest turn of a rotary axis in one cutting move
    turn_rate : deg/mm, largest turn of a rotary axis over the path of the contact
    singular_cone : half angle about the first rotary axis in which a cut turns that axis by `singular_rate`
    singular_rate : deg/mm
    """

    tilt: Range | None = None
    cone: float | None = None
    lead: Range | None = None
    lean: Range | None = None
    plane: tuple[float, float, float] | None = None
    hold: Mapping[str, float] | None = field(default_factory=dict)
    max_turn: float | None = None
    turn_rate: float | None = None
    singular_cone: float | None = None
    singular_rate: float = 0.0

    @property
    def options(self) -> dict[str, Any]:
        """The bounds as `optimise` and `verify` take them."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def bounds_lean(self) -> bool:
        """Whether anything bounds the tool's lean."""
        return any(b is not None for b in (self.tilt, self.cone, self.lead, self.lean, self.plane))
