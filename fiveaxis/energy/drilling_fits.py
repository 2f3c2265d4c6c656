"""Least-squares fits of drilling power: the paper's own models and the three that it compares them with.

Every fit minimises the sum of squared power residuals and returns its coefficients in the formula's order.
Each raises `SettingError` for too few different records, lists of unequal length, or a number that isn't
finite.

References
----------
Wang, Zhang, Chen, Zhang, Wu (2019), Appl. Sci. 9(22), 4801, doi 10.3390/app9224801.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.energy.bounds import require_finite
from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array


def fit_idle_power(spindle: ArrayLike, power: ArrayLike) -> Array:
    """Fit the idle power's quadratic: ``P = a0 + a1 ω + a2 ω²`` (Wang et al. 2019).

    Parameters
    ----------
    spindle : (n,), rad/s, at least three speeds
    power : (n,), W

    Returns
    -------
    (3,), constant W, linear W/(rad/s), quadratic W/(rad/s)²; the coefficients of `idle_power`
    """
    speed = require_finite("spindle speed", spindle, "rad/s")
    return _least_squares({"a constant": np.ones_like(speed), "speed": speed, "its square": speed**2}, power)


def fit_auxiliary_power(cutting: ArrayLike, auxiliary: ArrayLike, *, quadratic: bool = False) -> Array:
    """Fit the auxiliary power through zero: ``P_aux = C0 P_c`` or ``C0 P_c + C1 P_c²``.

    Parameters
    ----------
    cutting : (n,), W, P_c
    auxiliary : (n,), W, measured power less idle and cutting power
    quadratic : fit C1 as well

    Returns
    -------
    (1,) or (2,), C0 in W/W and C1 in 1/W

    References
    ----------
    Wang et al. (2019), auxiliary power. Their printed C0 = 0.1336 isn't this fit of their table (0.1283).
    """
    power = require_finite("cutting power", cutting, "W")
    columns = {"cutting power": power} | ({"its square": power**2} if quadratic else {})
    return _least_squares(columns, auxiliary)


def fit_removal_model(rate: ArrayLike, power: ArrayLike) -> Array:
    """Fit Model-1, power by removal rate: ``P = C0 MRR + C1`` (printed 5.749, 1393.6).

    Parameters
    ----------
    rate : (n,), mm³/s
    power : (n,), W

    Returns
    -------
    (2,), C0 J/mm³, C1 W
    """
    rates = require_finite("removal rate", rate, "mm³/s")
    return _least_squares({"removal rate": rates, "a constant": np.ones_like(rates)}, power)


def fit_removal_speed_model(rate: ArrayLike, spindle: ArrayLike, power: ArrayLike) -> Array:
    """Fit Model-2, power by removal rate and speed: ``P = k0 MRR + k1 ω + k2``.

    Parameters
    ----------
    rate : (n,), mm³/s
    spindle : (n,), rad/s
    power : (n,), W

    Returns
    -------
    (3,), k0 J/mm³, k1 W/(rad/s), k2 W

    References
    ----------
    Wang et al. (2019), Model-2. Their printed 5.801, 0.334 W/(rev/min), 1170.5 isn't the least-squares fit of
    their table, which is 3.926, 0.617, 1194.0.
    """
    rates, speed = require_finite("removal rate", rate, "mm³/s"), require_finite("speed", spindle, "rad/s")
    return _least_squares({"removal rate": rates, "speed": speed, "a constant": np.ones_like(rates)}, power)


def fit_cutting_model(cutting: ArrayLike, power: ArrayLike) -> Array:
    """Fit Model-3, power by cutting power: ``P = C0 P_c + C1`` (printed 1.4036, 1237.9).

    Parameters
    ----------
    cutting : (n,), W, P_c
    power : (n,), W

    Returns
    -------
    (2,), C0 W/W, C1 W
    """
    cuts = require_finite("cutting power", cutting, "W")
    return _least_squares({"cutting power": cuts, "a constant": np.ones_like(cuts)}, power)


def _least_squares(columns: dict[str, Array], power: ArrayLike) -> Array:
    target = require_finite("power", power, "W")
    names, shapes = " and ".join(columns), {c.shape for c in columns.values()} | {target.shape}
    if len(shapes) > 1 or target.ndim != 1:
        raise SettingError(
            f"the records of power and {names} must be lists of one length, not {sorted(shapes)}"
        )
    design = np.stack(list(columns.values()), axis=1)
    # Columns of unit size, so that the rank doesn't depend on units.
    size = np.linalg.norm(design, axis=0)
    scaled = design / np.where(size > 0.0, size, 1.0)
    solution, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=1e-10)
    if rank < len(columns):
        raise SettingError(
            f"{target.size} records can't separate {names} (rank {rank}, needed {len(columns)}); record more "
            "different states"
        )
    return solution / size
