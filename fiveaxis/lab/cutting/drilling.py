"""Drilling power: idle spindle, cutting lips, and the spindle drive's losses under load.

``P_total = P_idle(ω) + P_cutting + P_aux(P_cutting)``, Wang et al. The idle power is a quadratic of the
spindle speed, the cutting power an integral over the lips, the auxiliary power a fitted share of the cutting
power.

`examples/papers/drilling.py` reproduces the paper's tables, and says what of them doesn't reproduce.

References
----------
Wang, Zhang, Chen, Zhang, Wu (2019), Appl. Sci. 9(22), 4801, doi 10.3390/app9224801.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, SettingError, ToolError
from fiveaxis.lab.cutting.cutting_forces import CuttingCoefficients
from fiveaxis.lab.cutting.engagement import WATT, require, require_at_most


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
        require("drill diameter", self.diameter, "mm", error=ToolError, above=0.0)
        require("web", self.web, "mm", error=ToolError, least=0.0)
        if self.web >= self.diameter:
            raise ToolError(
                f"web is {self.web:g} mm; it must be below the drill diameter {self.diameter:g} mm"
            )
        if not 0.0 < self.half_point <= np.pi / 2.0:
            shown = np.degrees(self.half_point)
            raise ToolError(f"half point angle is {shown:g} deg; it must lie above 0 and at most at 90 deg")
        if not (isinstance(self.lips, int) and self.lips >= 1):
            raise ToolError(f"number of lips is {self.lips!r}; give a whole number, at least 1")


def mean_drilling_power(
    drill: Drill, coefficients: CuttingCoefficients, feed: ArrayLike, spindle: float
) -> Array:
    """Compute the power of a drill's lips: ``f ΣdF_z + ΣV(r) dF_t`` (Wang et al. 2019), in closed form.

    ``dF = (K_c h + K_e) db`` on each lip, with the chip thickness ``h = (c/Z) sinκ`` of a feed per turn c
    shared by Z lips, and the lip's length ``db = dr/sinκ`` from the web r0 to the corner R. So the torque is
    ``(R² - r0²)/2 (K_tc c + Z K_te/sinκ)`` and the thrust ``(R - r0) (K_zc c + Z K_ze/sinκ)``.

    Parameters
    ----------
    drill : its lips
    coefficients : of drill and material
    feed : (...), mm/s
    spindle : rad/s, magnitude

    Returns
    -------
    (...), W

    Raises
    ------
    SettingError
        Feed or speed isn't positive, or the feed per turn is above the diameter.
    """
    require("spindle speed", spindle, "rad/s", above=0.0)
    speed = require("feed", feed, "mm/s", above=0.0)
    advance = 2.0 * np.pi * speed / spindle
    require_at_most(
        "feed per turn",
        float(advance.max()),
        drill.diameter,
        "mm",
        "check the units: feed mm/s, spindle rad/s",
    )
    k, outer, inner = coefficients, drill.diameter / 2.0, drill.web / 2.0
    edges = drill.lips / math.sin(drill.half_point)
    torque = (outer**2 - inner**2) / 2.0 * (k.tangential * advance + edges * k.tangential_edge)
    thrust = (outer - inner) * (k.thrust * advance + edges * k.thrust_edge)
    return (torque * spindle + thrust * speed) / WATT


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
    speed = require("spindle speed", spindle, "rad/s", least=0.0)
    terms = require("idle coefficient", coefficients, "W")
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
    power = require("cutting power", cutting, "W", least=0.0)
    require("auxiliary coefficient", (linear, quadratic), "W/W")
    return power * (linear + quadratic * power)
