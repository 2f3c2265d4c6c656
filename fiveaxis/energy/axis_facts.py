"""What is known of an axis before its log is read: checked here, and turned into the model to be fitted."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fiveaxis.energy.bounds import require_at_most, require_finite, require_not_negative, require_positive
from fiveaxis.energy.drive_terms import (
    DriveModel,
    affine_model,
    directional_model,
    friction_model,
    friction_terms,
    weight_model,
)
from fiveaxis.errors import SettingError

MODELS = ("friction", "affine", "weight", "directional")


@dataclass(frozen=True)
class AxisFacts:
    """What the caller of `calibrate_drive` knows of the axis; parameters as there."""

    axis: str
    model: str
    moved_mass: float | None
    gravity: float | None
    max_acceleration: float | None
    standstill: float | None
    efficiency: float
    terms: tuple[str, ...] | None
    proportional: bool

    @property
    def rotary(self) -> bool:
        """Whether the axis turns."""
        return self.axis in "ABC"

    @property
    def dynamic(self) -> bool:
        """Whether acceleration costs: the mass of a linear axis, the inertia to be fitted of a rotary one."""
        if not self.rotary:
            return self.model == "friction" and self.moved_mass is not None
        asked = self.max_acceleration is None if self.terms is None else "inertia" in self.terms
        return self.model == "friction" and asked


def require_facts(given: AxisFacts) -> None:
    """Refuse what no log could mend.

    Raises
    ------
    SettingError
        An option out of its range, or one that the model needs and that is missing.
    """
    if given.axis not in tuple("XYZABC"):
        raise SettingError(f"no axis {given.axis!r}; write one of X, Y, Z, A, B, C")
    if given.model not in MODELS:
        raise SettingError(f"no drive model {given.model!r}; write {', '.join(MODELS)}")
    if given.moved_mass is not None:
        require_positive("moved mass", given.moved_mass, "kg")
    if given.max_acceleration is not None:
        require_positive("max acceleration", given.max_acceleration, "per s²")
    if given.standstill is not None:
        require_not_negative("standstill", given.standstill, "per s")
    require_finite("gravity", given.gravity or 0.0, "N")
    require_positive("efficiency", given.efficiency, "W/W")
    require_at_most("efficiency", given.efficiency, 1.0, "W/W", "a drive gives no more than it takes")
    if given.rotary and given.model == "weight":
        raise SettingError(f"the weight model is for linear axes; {given.axis} is rotary: take another model")
    if given.rotary and given.moved_mass is not None:
        raise SettingError(
            f"{given.axis} is rotary and has an inertia, which is fitted, in place of a moved mass"
        )
    if given.model == "weight" and given.moved_mass is None:
        raise SettingError("the weight model needs the moved mass in kg, with workpiece and fixture")
    if given.model == "friction":
        _require_friction_options(given)


def _require_friction_options(given: AxisFacts) -> None:
    known = tuple(friction_terms(rotary=given.rotary))
    wrong = [name for name in given.terms or () if name not in known]
    if wrong:
        raise SettingError(
            f"no term {wrong[0]!r} of a friction drive of {given.axis}; it has {', '.join(known)}"
        )
    if given.terms is not None and "friction" not in given.terms:
        raise SettingError("a friction drive has friction; add it to the terms")
    if not given.rotary and given.moved_mass is None and given.max_acceleration is None:
        raise SettingError(
            "the friction model of a linear axis needs its moved mass in kg; without it, fit the steady rows "
            "alone with a max acceleration"
        )
    if given.axis == "Z" and given.gravity is None:
        raise SettingError(
            "the friction model of Z needs gravity: N that it holds while Z grows, 9.81 per kg of a head "
            "that rises, minus that of a table that sinks, 0 where Z lies flat"
        )


def choose_model(given: AxisFacts) -> DriveModel:
    """Give the model with the terms to be fitted; a friction drive has those named, or the usual ones."""
    per_speed = f"W/({'deg' if given.rotary else 'mm'}/min)"
    factor = 60.0 / (math.radians(1.0) if given.rotary else 1.0)
    if given.model == "directional":
        unit = (per_speed, factor) if given.proportional else ("W", 1.0)
        return directional_model(*unit, proportional=given.proportional)
    if given.model == "affine":
        return affine_model(per_speed, factor)
    if given.model == "weight":
        return weight_model()
    usual = ["friction", "viscous"]
    usual += ["counterbalance"] if given.gravity else []
    usual += ["inertia"] if given.rotary and given.dynamic else []
    return friction_model(given.terms or usual, given.efficiency, rotary=given.rotary)
