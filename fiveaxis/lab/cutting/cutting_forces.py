"""The mean power of a cut from cutting coefficients: a job's cutting power without a dynamometer.

An edge takes ``dF_t = (K_tc h + K_te) db`` against its motion while it is in the material, with the chip
thickness h and the chip width db. Its power over a turn has a closed form: removal rate times K_tc plus swept
surface times K_te. Neither depends on how a ball leans, so in this model leaning doesn't change the mean
cutting power. `examples/papers/cutting_forces.py` integrates the forces themselves over a turn.

The model assumes circular tooth paths, a rigid tool without runout, and coefficients that don't change with
speed, chip thickness or position on the edge.

References
----------
Lee and Altintas (1996), "Prediction of ball-end milling forces from orthogonal cutting data", Int. J. Mach.
Tools Manufact. 36(9), 1059-1072. Altintas (2012), "Manufacturing Automation", 2nd ed., ch. 2 (end milling).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.lab.cutting.engagement import WATT, Cut, removal_rate, require, swept_surface


@dataclass(frozen=True)
class CuttingCoefficients:
    """Cutting (N/mm²) and edge (N/mm) coefficients of a cutter in a material.

    Parameters
    ----------
    tangential : N/mm², K_tc, positive
    tangential_edge : N/mm, K_te, not negative
    thrust, thrust_edge : N/mm² and N/mm, K_zc and K_ze of a drill, not negative

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
        require("tangential cutting coefficient", self.tangential, "N/mm²", above=0.0)
        require("tangential edge coefficient", self.tangential_edge, "N/mm", least=0.0)
        require("thrust cutting coefficient", self.thrust, "N/mm²", least=0.0)
        require("thrust edge coefficient", self.thrust_edge, "N/mm", least=0.0)


def mean_cutting_power(cut: Cut, coefficients: CuttingCoefficients) -> float:
    """Compute the mean spindle power of a cut in closed form.

    Each of Z teeth passes every surface element dA = r dφ db of the engaged envelope once per turn, so ``P =
    K_tc MRR + K_te A Z ω/2π`` with the removal rate and the swept surface A: the energy per turn and tooth is
    K_tc times the removed volume plus K_te times the surface that its edge sweeps. Without edge coefficients
    this is the handbook's ``a_p a_e v_f k_c`` with ``k_c = K_tc``.

    Parameters
    ----------
    cut : cutter, engagement, feed and speed
    coefficients : of cutter and material

    Returns
    -------
    W

    References
    ----------
    Integral over one turn of the tangential force of Lee and Altintas (1996) times its speed; for a flat end
    the mean of Altintas (2012), ch. 2.
    """
    passes = cut.mill.teeth * cut.spindle / (2.0 * np.pi)
    rubbing = coefficients.tangential_edge * swept_surface(cut) * passes
    return (coefficients.tangential * removal_rate(cut) + rubbing) / WATT
