"""Terms of the drive models to fit: names, the machine file's units, bounds; and their choice for an axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, FitDrive, SettingError
from fiveaxis.model import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive

MODELS = ("friction", "affine", "weight", "directional")
# What a log's power has at standstill beside a drive that then takes nothing; of friction drives it is hold.
STANDING = "standing"


@dataclass(frozen=True, kw_only=True)
class AxisFacts(FitDrive):
    """What the caller of `calibrate_drive` knows of the axis, in the same units.

    Raises
    ------
    SettingError
        An option is out of its range, the model needs one that is missing, or one doesn't fit the axis.
    """

    axis: str
    model: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axis not in tuple("XYZABC"):
            raise SettingError(f"no axis {self.axis!r}; write one of X, Y, Z, A, B, C")
        if self.model not in MODELS:
            raise SettingError(f"no drive model {self.model!r}; write {', '.join(MODELS)}")
        if self.rotary and self.model == "weight":
            raise SettingError(
                f"the weight model is for linear axes; {self.axis} is rotary: take another model"
            )
        if self.rotary and self.moved_mass is not None:
            raise SettingError(f"{self.axis} is rotary: its inertia is fitted; leave out the moved mass")
        if self.model == "weight" and self.moved_mass is None:
            raise SettingError(
                "the weight model needs the moved mass in kg (--moved-mass), with workpiece and fixture"
            )
        if self.model == "friction":
            self._check_friction()

    def _check_friction(self) -> None:
        known = tuple(friction_terms(rotary=self.rotary))
        wrong = [name for name in self.terms or () if name not in known]
        if wrong:
            raise SettingError(
                f"the friction drive of {self.axis} has no term {wrong[0]!r}; it has {', '.join(known)}"
            )
        if self.terms is not None and "friction" not in self.terms:
            raise SettingError("the terms of a friction drive lack friction; add it")
        if not self.rotary and self.moved_mass is None and self.max_acceleration is None:
            raise SettingError(
                "the friction model of a linear axis needs its moved mass in kg (--moved-mass); without it, "
                "fit the steady rows alone with a max acceleration (--max-acceleration)"
            )
        if self.axis == "Z" and self.gravity is None:
            raise SettingError(
                "the friction model of Z needs gravity (--gravity), in N: 9.81 per kg of a head that rises "
                "while Z grows, minus 9.81 per kg of a table that sinks, 0 for a horizontal Z"
            )

    @property
    def rotary(self) -> bool:
        """Whether the axis turns."""
        return self.axis in "ABC"

    @property
    def unit(self) -> float:
        """Size of the unit in which the caller gives speed and acceleration: mm, or rad of a degree."""
        return math.radians(1.0) if self.rotary else 1.0

    @property
    def dynamic(self) -> bool:
        """Whether acceleration takes power: a linear axis has a mass, a rotary one an inertia to fit."""
        if self.model != "friction":
            return False
        if not self.rotary:
            return self.moved_mass is not None
        return self.max_acceleration is None if self.terms is None else "inertia" in self.terms


def choose_model(facts: AxisFacts, *, standing: bool) -> DriveModel:
    """Choose the terms to fit; for a friction drive those that were named, or the usual ones.

    `standing` is whether the rows at standstill suffice for a term of their own.
    """
    if facts.model != "friction":
        model = _table_model(facts)
        return replace(model, terms=(*model.terms, Term(STANDING, "W"))) if standing else model
    usual = ["friction", "viscous"]
    usual += ["counterbalance"] if facts.gravity else []
    usual += ["inertia"] if facts.rotary and facts.dynamic else []
    usual += ["hold"] if standing else []
    names = facts.terms or usual
    terms = [term for name, term in friction_terms(rotary=facts.rotary).items() if name in names]
    # The efficiency is given, since power shows only F/η.
    return DriveModel(tuple(terms), lambda v: FrictionDrive(**v, efficiency=facts.efficiency))


def _table_model(facts: AxisFacts) -> DriveModel:
    """Return the model of a drive that takes nothing at standstill."""
    per_speed = f"W/({'deg' if facts.rotary else 'mm'}/min)", 60.0 / facts.unit
    if facts.model == "weight":
        return DriveModel((Term("a", "W/(N·m/s)"), Term("b", "W/N")), lambda v: WeightDrive(**v))
    if facts.model == "directional":
        unit = per_speed if facts.proportional else ("W", 1.0)
        return DriveModel(
            (Term("plus", *unit), Term("minus", *unit)),
            lambda v: DirectionalDrive(**v, proportional=facts.proportional),
        )
    sides = [(f"{side} slope", f"{side} offset") for side in ("plus", "minus")]

    def build(v: dict[str, float]) -> AffineDrive:
        plus, minus = ((v[slope], v[offset]) for slope, offset in sides)
        return AffineDrive(plus, minus)

    terms = [term for slope, offset in sides for term in (Term(slope, *per_speed), Term(offset, "W"))]
    return DriveModel(tuple(terms), build)


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

    def without(self, names: Sequence[str]) -> DriveModel:
        """Return the model without some terms."""
        return replace(self, terms=tuple(t for t in self.terms if t.name not in names))


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
