r"""Robust fits of the drive models, in the units of a machine file, with confidence intervals.

The fit uses `drive_power` itself, so that a model and its fit can't diverge. It minimises ``Σ ρ(r_i / s)``
with ``ρ(u) = 2 (sqrt(1 + u²) − 1)``, quadratic for small residuals r and linear for outliers (SciPy's soft
L1); the scale s is 1.4826 times the median of \|r\|, by iteration. Rows at standstill have a scale of their
own, since a drive at rest hardly varies: so they, and not the misfit of moving rows, tell the constant part.

The covariance of the optimum is the sandwich of Huber's estimators, ``A⁻¹ B A⁻¹`` with ``A = Σ ψ'(u_i) J_i
J_iᵀ`` and ``B = Σ g_i g_iᵀ``, ``g_i = ψ(u_i) J_i / (1 − h_i)``, J of u = r / s, ψ = ρ'/2, which assumes no
constant variance. The residuals of a log are correlated in time, so the covariance is also computed with
products of neighbours (Bartlett's weights), and the wider of the two intervals is used. A drive is used with
all its coefficients at once, so the 95 % hold for all p intervals together: each alone has ``1 − 0.05 / p``
(Bonferroni), with Student's t of n − p degrees of freedom.

References
----------
Huber & Ronchetti (2009), Robust Statistics, chapter 7. MacKinnon & White (1985), J. Econometrics 29, 305 (the
correction by leverages h, HC3). Newey & West (1987), Econometrica 55, 703; lags 4 (n/100)^(2/9).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.energy.drive_terms import DriveModel
from fiveaxis.energy.drives import drive_power
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Drive

CONFIDENCE = 0.95
NORMAL_MAD = 1.4826  # standard deviation of normal noise over its median absolute value
ROUNDS = 12  # of fit and scale; three or four usually suffice
SETTLED = 1e-3
STEADIER = 0.01  # least scale of the rows at standstill, over that in motion: their power may not vary at all
# A column of the Jacobian with a smaller part orthogonal to the others can't be identified.
OWN_SHARE = 1e-3
STEP = 1e-6  # relative step of the differences


@dataclass(frozen=True, eq=False)
class Record:
    """Motion and power of an axis in the units of `drive_power`; (n,) each, or a scalar for the whole log."""

    speed: Array
    power: Array
    acceleration: Array | float = 0.0
    gravity: float = 0.0
    weight: float = 0.0
    inertia: float = 0.0

    @property
    def moving(self) -> BoolArray:
        """Rows in motion, (n,)."""
        return self.speed != 0.0

    def predict(self, drive: Drive) -> Array:
        """Compute the power that a drive would have drawn, (n,) W."""
        return drive_power(
            drive,
            self.speed,
            acceleration=self.acceleration,
            gravity=self.gravity,
            weight=self.weight,
            inertia=self.inertia,
        )

    def explain(self, model: DriveModel, values: Sequence[float] | Array) -> Array:
        """Compute the power that a model with these values gives, (n,) W, also what isn't the drive's."""
        return self.predict(model.drive(values)) + model.standing(values)


@dataclass(frozen=True, eq=False)
class RobustFit:
    """The optimum of a fit.

    Parameters
    ----------
    values : (p,), in the units of the terms
    half_widths : (p,), of the intervals that contain all coefficients together with 95 % confidence
    scale : W, of the residuals in motion
    unidentified : names of terms that the rows can't separate from those before them
    """

    values: Array
    half_widths: Array
    scale: float
    unidentified: tuple[str, ...]


def fit_model(model: DriveModel, record: Record) -> RobustFit:
    """Fit a model's terms to a record within their bounds.

    Parameters
    ----------
    model : its terms
    record : more rows than terms

    Returns
    -------
    If terms are unidentified the intervals mean nothing: leave those terms out and fit again.
    """
    from scipy.optimize import least_squares

    def residuals(values: Array) -> Array:
        return record.explain(model, values) - record.power

    bounds = np.array([(t.low, t.high) for t in model.terms]).T
    start = values = _start(model, record)
    floor = 1e-9 * float(np.abs(record.power).max())
    moving = record.moving
    scale, still = _scales(record.power - _medians(record.power, moving), moving, floor)
    for _ in range(ROUNDS):
        scales = np.where(moving, scale, still)
        found = least_squares(
            lambda v, s=scales: residuals(v) / s,
            values,
            jac="3-point",
            bounds=bounds,
            loss="soft_l1",
            x_scale="jac",
        )
        values, before = found.x, scale
        scale, still = _scales(residuals(values), moving, floor)
        if abs(scale - before) <= SETTLED * before:
            break
    jacobian = _jacobian(residuals, values, np.maximum(np.abs(values), start))
    unidentified = tuple(model.terms[i].name for i in _made_of_others(jacobian))
    if unidentified:
        return RobustFit(values, np.full(len(values), np.inf), scale, unidentified)
    scales = np.where(moving, scale, still)
    try:
        widths = _half_widths(jacobian / scales[:, None], residuals(values) / scales)
    except np.linalg.LinAlgError:  # rows that the loss counts for almost nothing identify none of them
        return RobustFit(values, np.full(len(values), np.inf), scale, tuple(t.name for t in model.terms))
    return RobustFit(values, widths, scale, ())


def _start(model: DriveModel, record: Record) -> Array:
    """Start where each term explains its share of the power: the right order of magnitude in any unit."""
    values = np.zeros(len(model.terms))
    share = np.sqrt(np.mean(record.power**2)) / len(values)
    for i, term in enumerate(model.terms):
        step = np.where(np.arange(len(values)) == i, 1.0, 0.0)
        change = record.explain(model, values + step) - record.explain(model, values)
        size = float(np.sqrt(np.mean(change**2)))
        if np.isfinite(term.low) and size > 0.0:
            values[i] = min(share / size, 0.5 * term.high)
    return values


def _medians(power: Array, moving: BoolArray) -> Array:
    """Return the median of the rows in motion and that at standstill, each in its rows, (n,)."""
    return np.where(moving, np.median(power[moving]), 0.0 if moving.all() else np.median(power[~moving]))


def _scales(residuals: Array, moving: BoolArray, floor: float) -> tuple[float, float]:
    """Return the scale of the residuals in motion and of those at standstill."""
    scale = max(NORMAL_MAD * float(np.median(np.abs(residuals[moving]))), floor)
    if moving.all():
        return scale, scale
    return scale, max(NORMAL_MAD * float(np.median(np.abs(residuals[~moving]))), STEADIER * scale)


def _jacobian(residuals: Callable[[Array], Array], values: Array, sizes: Array) -> Array:
    """Differentiate by central differences, (n, p); SciPy's own Jacobian includes the loss."""
    # A value at its bound is too small for a relative step; its start value isn't.
    steps = STEP * np.where(sizes > 0.0, sizes, 1.0)
    columns = [(residuals(values + h) - residuals(values - h)) / (2.0 * h.sum()) for h in np.diag(steps)]
    return np.stack(columns, axis=1)


def _made_of_others(jacobian: Array) -> list[int]:
    """Find the columns that are zero or a combination of those before them."""
    kept: list[Array] = []
    found = []
    for i, column in enumerate(jacobian.T):
        size = float(np.linalg.norm(column))
        own = column.copy()
        for direction in kept:
            own -= (own @ direction) * direction
        if np.linalg.norm(own) <= OWN_SHARE * size:
            found.append(i)
        else:
            kept.append(own / np.linalg.norm(own))
    return found


def _half_widths(jacobian: Array, residuals: Array) -> Array:
    """Compute the half-widths of the confidence intervals, (p,), as described in the module's docstring.

    Parameters
    ----------
    jacobian, residuals : (n, p), (n,), over their scales
    """
    from scipy.special import stdtrit

    n, p = jacobian.shape
    # Columns of unit size, so that the inverse doesn't depend on units.
    size = np.linalg.norm(jacobian, axis=0)
    columns = jacobian / size
    slope = (1.0 + residuals**2) ** -1.5
    bread = np.linalg.inv((columns * slope[:, None]).T @ columns)
    leverage = np.minimum(slope * np.einsum("ij,jk,ik->i", columns, bread, columns), 0.5)
    scores = columns * (residuals / np.sqrt(1.0 + residuals**2) / (1.0 - leverage))[:, None]
    alone = scores.T @ scores
    together = alone.copy()
    lags = int(4.0 * (n / 100.0) ** (2.0 / 9.0))
    for lag in range(1, min(lags, n - 1) + 1):
        products = scores[lag:].T @ scores[:-lag]
        together += (1.0 - lag / (lags + 1.0)) * (products + products.T)
    variance = np.maximum(*(np.diag(bread @ middle @ bread) for middle in (alone, together)))
    tail = (1.0 - CONFIDENCE) / (2.0 * p)
    return float(stdtrit(n - p, 1.0 - tail)) * np.sqrt(variance) / size
