"""Drilling power: idle spindle, cutting lips, and the spindle drive's losses under load.

``P_total = P_idle(ω) + P_cutting + P_aux(P_cutting)``, Wang et al. The idle power is a quadratic of the
spindle speed, the cutting power an integral over the lips, the auxiliary power a fitted share of the cutting
power.

The paper's tables are reproduced from their own cutting powers (`examples/drilling/reproduce.py`). The
printed force coefficients don't yield these cutting powers, since the drill's point isn't printed in full:
the nearest web and point angle are 3 % off the table, so the integral is tested against its closed form
instead. Two printed fits aren't the least-squares fits of the printed data: C0 of the auxiliary power, and
Model-2.

References
----------
Wang, Zhang, Chen, Zhang, Wu (2019), Appl. Sci. 9(22), 4801, doi 10.3390/app9224801.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.energy.bounds import require_at_most, require_finite, require_not_negative, require_positive
from fiveaxis.energy.milling import WATT
from fiveaxis.errors import SettingError, ToolError
from fiveaxis.geometry import Array, product


@dataclass(frozen=True)
class Drill:
    """The cutting lips of a drill: straight lines from the web to the corner.

    Parameters
    ----------
    diameter : mm
    web : mm, diameter of the core, whose chisel edge isn't counted
    half_point : rad, κ, between lip and drill axis; 59 degrees for the common 118 degree point
    lips : number of lips

    Raises
    ------
    ToolError
        The diameter, the angle or the number of lips is out of its range; the web is as large as the drill.
    """

    diameter: float
    web: float = 0.0
    half_point: float = 59.0 * np.pi / 180.0
    lips: int = 2

    def __post_init__(self) -> None:
        require_positive("drill diameter", self.diameter, "mm", error=ToolError)
        require_not_negative("web", self.web, "mm", error=ToolError)
        if self.web >= self.diameter:
            raise ToolError(
                f"web is {self.web:g} mm; it must be below the drill diameter {self.diameter:g} mm"
            )
        if not 0.0 < self.half_point <= np.pi / 2.0:
            shown = np.degrees(self.half_point)
            raise ToolError(f"half point angle is {shown:g} deg; it must lie above 0 and at most at 90 deg")
        if not (isinstance(self.lips, int) and self.lips >= 1):
            raise ToolError(f"number of lips is {self.lips!r}; give a whole number, at least 1")


@dataclass(frozen=True)
class DrillCoefficients:
    """Cutting and edge coefficients of the lips, as the paper prints them.

    Parameters
    ----------
    tangential : N/mm², K_tc, positive
    tangential_edge : N/mm, K_te, not negative
    thrust : N/mm², K_zc, not negative
    thrust_edge : N/mm, K_ze, not negative

    Raises
    ------
    SettingError
        A coefficient is out of its range.
    """

    tangential: float
    tangential_edge: float = 0.0
    thrust: float = 0.0
    thrust_edge: float = 0.0

    def __post_init__(self) -> None:
        require_positive("tangential cutting coefficient", self.tangential, "N/mm²")
        require_not_negative("tangential edge coefficient", self.tangential_edge, "N/mm")
        require_not_negative("thrust cutting coefficient", self.thrust, "N/mm²")
        require_not_negative("thrust edge coefficient", self.thrust_edge, "N/mm")


@dataclass(frozen=True)
class DrillingLoad:
    """Forces and powers of a cut.

    Parameters
    ----------
    thrust : N, against the feed
    torque : N·mm
    turning : W, torque times spindle speed
    feeding : W, thrust times feed
    """

    thrust: float
    torque: float
    turning: float
    feeding: float

    @property
    def power(self) -> float:
        """W, of the whole cut: ``f ΣdF_z + ΣV dF_t``."""
        return self.turning + self.feeding


def drilling_load(
    drill: Drill, coefficients: DrillCoefficients, feed: float, spindle: float, *, elements: int = 50
) -> DrillingLoad:
    """Integrate the forces over the lips (Wang et al. 2019).

    ``dF = (K_c h + K_e) db`` on each lip, with the chip thickness ``h = (c/Z) sinκ`` of a feed per turn c
    shared by Z lips, and the lip's length ``db = dr/sinκ``. Then ``P = f ΣdF_z + ΣV(r) dF_t``, ``V = ωr``.

    Parameters
    ----------
    drill : its lips
    coefficients : of drill and material
    feed : mm/s
    spindle : rad/s, magnitude
    elements : parts of a lip

    Raises
    ------
    SettingError
        Feed or speed isn't positive, the feed per turn is above the diameter, or there is no element.
    """
    require_positive("feed", feed, "mm/s")
    require_positive("spindle speed", spindle, "rad/s")
    advance = 2.0 * np.pi * feed / spindle
    require_at_most(
        "feed per turn", advance, drill.diameter, "mm", "check the units: feed mm/s, spindle rad/s"
    )
    if elements < 1:
        raise SettingError(f"a lip has {elements} elements; take at least 1")
    ends = np.linspace(drill.web / 2.0, drill.diameter / 2.0, elements + 1)
    radius, length = (ends[:-1] + ends[1:]) / 2.0, np.diff(ends) / np.sin(drill.half_point)
    chip = advance / drill.lips * np.sin(drill.half_point)
    k = coefficients
    tangential = drill.lips * (k.tangential * chip + k.tangential_edge) * length
    thrust = float(np.sum(drill.lips * (k.thrust * chip + k.thrust_edge) * length))
    torque = float(product(radius, tangential))
    return DrillingLoad(thrust, torque, torque * spindle / WATT, thrust * feed / WATT)


def drilling_removal_rate(diameter: ArrayLike, feed: ArrayLike) -> Array:
    """Compute the material removal rate: ``MRR = π d² f/4`` (Wang et al. 2019).

    Parameters
    ----------
    diameter, feed : (...), mm and mm/s

    Returns
    -------
    (...), mm³/s

    Raises
    ------
    SettingError
        A diameter isn't positive, or a feed is below 0.
    """
    across = require_positive("drill diameter", diameter, "mm")
    return np.pi / 4.0 * across**2 * require_not_negative("feed", feed, "mm/s")


def idle_power(spindle: ArrayLike, coefficients: ArrayLike) -> Array:
    """Compute the power of machine and turning spindle without a cut, a quadratic of the speed.

    Parameters
    ----------
    spindle : (...), rad/s, magnitude
    coefficients : (3,), constant W, linear W/(rad/s), quadratic W/(rad/s)²

    Returns
    -------
    (...), W

    Raises
    ------
    SettingError
        There aren't three coefficients, or a speed is below 0.

    References
    ----------
    Wang et al. (2019): ``P_idle = 0.0003 n² + 0.0524 n + 1221`` W, n in rev/min.
    """
    speed = require_not_negative("spindle speed", spindle, "rad/s")
    terms = require_finite("idle coefficient", coefficients, "W")
    if terms.shape != (3,):
        raise SettingError(f"idle power has {terms.size} coefficients; give constant, linear and quadratic")
    return terms[0] + speed * (terms[1] + speed * terms[2])


def auxiliary_power(cutting: ArrayLike, linear: float, quadratic: float = 0.0) -> Array:
    """Compute the spindle drive's load loss: ``P_aux = C0 P_c + C1 P_c²`` (Wang et al. 2019).

    Parameters
    ----------
    cutting : (...), W, power of the cut
    linear : W/W, C0; 0.1336 in the paper, 0.1283 by least squares of its table
    quadratic : 1/W, C1; 0 for the linear model

    Returns
    -------
    (...), W

    Raises
    ------
    SettingError
        A cutting power is below 0, or a coefficient isn't finite.
    """
    power = require_not_negative("cutting power", cutting, "W")
    require_finite("auxiliary coefficient", (linear, quadratic), "W/W")
    return power * (linear + quadratic * power)


def drilling_power(
    spindle: ArrayLike, cutting: ArrayLike, idle: ArrayLike, auxiliary: tuple[float, float]
) -> Array:
    """Compute the machine's power while it drills: ``P_idle(ω) + P_c + P_aux(P_c)`` (Wang et al. 2019).

    Parameters
    ----------
    spindle : (...), rad/s, magnitude
    cutting : (...), W, power of the cut (`drilling_load`)
    idle : (3,), coefficients of `idle_power`
    auxiliary : C0 in W/W and C1 in 1/W of `auxiliary_power`

    Returns
    -------
    (...), W

    Raises
    ------
    SettingError
        As `idle_power` and `auxiliary_power`.
    """
    power = require_not_negative("cutting power", cutting, "W")
    return idle_power(spindle, idle) + power + auxiliary_power(power, *auxiliary)
