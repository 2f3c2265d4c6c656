"""Coefficients of the drive models as a fit sees them: names, the machine file's units, bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive


@dataclass(frozen=True)
class Term:
    """A coefficient of a drive model.

    Parameters
    ----------
    name : as in a machine file, with the side in front where there are two
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
    """A drive model to be fitted: its terms and how values of theirs become a drive."""

    terms: tuple[Term, ...]
    build: Callable[[dict[str, float]], Drive]

    def drive(self, values: Sequence[float] | Array) -> Drive:
        """Make the drive of values in the machine file's units."""
        pairs = zip(self.terms, values, strict=True)
        return self.build({term.name: float(value) * term.factor for term, value in pairs})

    def without(self, names: Sequence[str]) -> DriveModel:
        """Leave terms out."""
        return replace(self, terms=tuple(t for t in self.terms if t.name not in names))


def directional_model(unit: str, factor: float, *, proportional: bool) -> DriveModel:
    """Describe the directional table's coefficients; `factor` is from `unit` to the drive's."""
    terms = (Term("plus", unit, factor), Term("minus", unit, factor))
    return DriveModel(terms, lambda v: DirectionalDrive(v["plus"], v["minus"], proportional=proportional))


def affine_model(unit: str, factor: float) -> DriveModel:
    """Describe the affine drive's coefficients; `factor` is from the slopes' unit to W per mm/s or rad/s."""
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
    """Describe the weight drive's coefficients."""
    return DriveModel((Term("a", "W/(N·m/s)"), Term("b", "W/N")), lambda v: WeightDrive(v["a"], v["b"]))


def friction_terms(*, rotary: bool) -> dict[str, Term]:
    """Describe every coefficient that a friction drive may have fitted, likeliest first."""
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
    """Describe a friction drive of some terms; its efficiency is given, since only F/η shows in a power."""
    terms = tuple(term for name, term in friction_terms(rotary=rotary).items() if name in names)
    return DriveModel(terms, lambda v: FrictionDrive(**v, efficiency=efficiency))
