"""Terms of the drive models to fit: names, the machine file's units, bounds; and their choice for an axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.energy.bounds import require_at_most, require_finite, require_not_negative, require_positive
from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array
from fiveaxis.machine import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive

MODELS = ("friction", "affine", "weight", "directional")
# What a log's power has at standstill beside a drive that then takes nothing; of friction drives it is hold.
STANDING = "standing"


@dataclass(frozen=True)
class AxisFacts:
    """What the caller of `calibrate_drive` knows of the axis; parameters as given there."""

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
        """Whether acceleration takes power: a linear axis has a mass, a rotary one an inertia to fit."""
        if self.model != "friction":
            return False
        if not self.rotary:
            return self.moved_mass is not None
        return self.max_acceleration is None if self.terms is None else "inertia" in self.terms


def require_facts(given: AxisFacts) -> None:
    """Check the options, before any log is read.

    Raises
    ------
    SettingError
        An option is out of its range, or the model needs one that is missing.
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
        raise SettingError(f"{given.axis} is rotary: its inertia is fitted; leave out the moved mass")
    if given.model == "weight" and given.moved_mass is None:
        raise SettingError("the weight model needs the moved mass in kg, with workpiece and fixture")
    if given.model == "friction":
        _require_friction_options(given)


def _require_friction_options(given: AxisFacts) -> None:
    known = tuple(friction_terms(rotary=given.rotary))
    wrong = [name for name in given.terms or () if name not in known]
    if wrong:
        raise SettingError(
            f"the friction drive of {given.axis} has no term {wrong[0]!r}; it has {', '.join(known)}"
        )
    if given.terms is not None and "friction" not in given.terms:
        raise SettingError("the terms of a friction drive lack friction; add it")
    if not given.rotary and given.moved_mass is None and given.max_acceleration is None:
        raise SettingError(
            "the friction model of a linear axis needs its moved mass in kg; without it, fit the steady rows "
            "alone with a max acceleration"
        )
    if given.axis == "Z" and given.gravity is None:
        raise SettingError(
            "the friction model of Z needs gravity, in N: 9.81 per kg of a head that rises while Z grows, "
            "minus 9.81 per kg of a table that sinks, 0 for a horizontal Z"
        )


def choose_model(given: AxisFacts, *, standing: bool) -> DriveModel:
    """Choose the terms to fit; for a friction drive those that were named, or the usual ones.

    Parameters
    ----------
    given : facts of the axis
    standing : whether the rows at standstill suffice for a term of their own
    """
    if given.model != "friction":
        model = _table_model(given)
        return model.with_standing() if standing else model
    usual = ["friction", "viscous"]
    usual += ["counterbalance"] if given.gravity else []
    usual += ["inertia"] if given.rotary and given.dynamic else []
    usual += ["hold"] if standing else []
    return friction_model(given.terms or usual, given.efficiency, rotary=given.rotary)


def _table_model(given: AxisFacts) -> DriveModel:
    """Return the model of a drive that takes nothing at standstill."""
    per_speed = f"W/({'deg' if given.rotary else 'mm'}/min)"
    factor = 60.0 / (math.radians(1.0) if given.rotary else 1.0)
    if given.model == "weight":
        return weight_model()
    if given.model == "affine":
        return affine_model(per_speed, factor)
    unit = (per_speed, factor) if given.proportional else ("W", 1.0)
    return directional_model(*unit, proportional=given.proportional)


@dataclass(frozen=True)
class Term:
    """A coefficient of a drive model.

    Parameters
    ----------
    name : as in a machine file, preceded by ``plus`` or ``minus`` if the sides differ
    unit : of the machine file
    factor : from that unit to the drive's own
    low, high : its bounds
    """

    name: str
    unit: str
    factor: float = 1.0
    low: float = 0.0
    high: float = np.inf


@dataclass(frozen=True)
class DriveModel:
    """A drive model to be fitted: its terms, and how to build a drive from their values.

    A term `STANDING` isn't the drive's: the log's power is the drive's and that.
    """

    terms: tuple[Term, ...]
    build: Callable[[dict[str, float]], Drive]

    def drive(self, values: Sequence[float] | Array) -> Drive:
        """Build the drive from values in the machine file's units."""
        own = self._own(values)
        own.pop(STANDING, None)
        return self.build(own)

    def standing(self, values: Sequence[float] | Array) -> float:
        """Return the power at standstill that isn't the drive's, W."""
        return self._own(values).get(STANDING, 0.0)

    def _own(self, values: Sequence[float] | Array) -> dict[str, float]:
        pairs = zip(self.terms, values, strict=True)
        return {term.name: float(value) * term.factor for term, value in pairs}

    def with_standing(self) -> DriveModel:
        """Return the model with a term for the power at standstill."""
        return replace(self, terms=(*self.terms, Term(STANDING, "W")))

    def without(self, names: Sequence[str]) -> DriveModel:
        """Return the model without some terms."""
        return replace(self, terms=tuple(t for t in self.terms if t.name not in names))


def directional_model(unit: str, factor: float, *, proportional: bool) -> DriveModel:
    """Define the directional table's coefficients; `factor` converts `unit` to the drive's own."""
    terms = (Term("plus", unit, factor), Term("minus", unit, factor))
    return DriveModel(terms, lambda v: DirectionalDrive(v["plus"], v["minus"], proportional=proportional))


def affine_model(unit: str, factor: float) -> DriveModel:
    """Define the affine drive's coefficients; `factor` converts the slopes' unit to W per mm/s or rad/s."""
    terms = tuple(
        term
        for side in ("plus", "minus")
        for term in (Term(f"{side} slope", unit, factor), Term(f"{side} offset", "W"))
    )

    def build(v: dict[str, float]) -> AffineDrive:
        plus, minus = ((v[f"{side} slope"], v[f"{side} offset"]) for side in ("plus", "minus"))
        return AffineDrive(plus, minus)

    return DriveModel(terms, build)


def weight_model() -> DriveModel:
    """Define the weight drive's coefficients."""
    return DriveModel((Term("a", "W/(N·m/s)"), Term("b", "W/N")), lambda v: WeightDrive(v["a"], v["b"]))


def friction_terms(*, rotary: bool) -> dict[str, Term]:
    """Define every coefficient that a fit of a friction drive may have, likeliest first."""
    # N is J/m: a thousandth per mm, squared where the metre is squared.
    force, metre = ("N·m", 1.0) if rotary else ("N", 1000.0)
    per_speed = "N·m/(rad/s)" if rotary else "N/(m/s)"
    per_force = "W/(N·m)²" if rotary else "W/N²"
    terms = [
        Term("friction", force, 1.0 / metre),
        Term("viscous", per_speed, 1.0 / metre**2),
        Term("counterbalance", force, 1.0 / metre, low=-np.inf),
        Term("copper", per_force, metre**2),
        Term("hold", "W"),
        Term("regeneration", "W/W", high=0.9),
    ]
    if rotary:
        terms.insert(2, Term("inertia", "kg·m²"))
    return {term.name: term for term in terms}


def friction_model(names: Sequence[str], efficiency: float, *, rotary: bool) -> DriveModel:
    """Define a friction drive with some terms; its efficiency is given, since power shows only F/η."""
    terms = tuple(term for name, term in friction_terms(rotary=rotary).items() if name in names)
    return DriveModel(terms, lambda v: FrictionDrive(**v, efficiency=efficiency))
