r"""Robust fits of the drive models to logs, in the units of a machine file, with confidence intervals.

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

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, BoolArray, InputError, SettingError
from fiveaxis.lab.calibration.drive_terms import STANDING, AxisFacts, DriveModel, choose_model
from fiveaxis.lab.calibration.motion_log import AxisLog, join_logs
from fiveaxis.model import GRAVITY, drive_power

logger = logging.getLogger(__name__)

CONFIDENCE = 0.95
NORMAL_MAD = 1.4826  # standard deviation of normal noise over its median absolute value
ROUNDS = 12  # of fit and scale; three or four usually suffice
SETTLED = 1e-3
STEADIER = 0.01  # least scale of the rows at standstill, over that in motion: their power may not vary at all
# A column of the Jacobian with a smaller part orthogonal to the others can't be identified.
OWN_SHARE = 1e-3
STEP = 1e-6  # relative step of the differences
STANDSTILL = "standstill, too few for a term"
WORST_FIT = -0.1  # R² below this is no fit; it is about 0 where the power hardly varies
ROWS_PER_TERM = 10
# Share of an interval's half-width: the solver stays inside the bounds by a hair, not worth printing.
AT_BOUND = 1e-6
DIGITS = 6  # of a coefficient in the machine file; its interval is far wider


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


@dataclass(frozen=True, eq=False)
class LogFit:
    """A model fitted to logs.

    Parameters
    ----------
    rows : the ones in use, of all logs
    facts : of the axis
    model : its identified terms
    robust : the optimum
    values : (p,), of the terms, as a machine file has them
    left_out : names of terms that the rows can't identify
    idle : W, median of the rows at standstill; None without any
    idle_rows : how many they are
    """

    rows: AxisLog
    facts: AxisFacts
    model: DriveModel
    robust: RobustFit
    values: tuple[float, ...]
    left_out: tuple[str, ...]
    idle: float | None
    idle_rows: int

    def power(self, rows: AxisLog) -> Array:
        """Compute the power of these or other rows, (n,) W."""
        return _explain(self.model, self.values, rows, self.facts)


def fit_logs(runs: Sequence[AxisLog], facts: AxisFacts) -> LogFit:
    """Fit the model to the steady rows of logs, less the terms that these can't identify.

    The speed is 0 exactly where the axis stands.

    Raises
    ------
    SettingError
        The acceleration is needed and isn't known.
    InputError
        The rows are too few, or can't separate the terms of a model that needs them all.
    """
    rows = join_logs(runs)
    rows = rows.without(~steady_rows(rows, facts), "acceleration above the bound")
    at_rest = rows.speed == 0.0
    idle, idle_rows = float(np.median(rows.power[at_rest])) if at_rest.any() else None, int(at_rest.sum())
    model = choose_model(facts, standing=idle_rows >= ROWS_PER_TERM)
    if facts.model != "friction" and idle_rows < ROWS_PER_TERM:
        # At rest these models give 0 whatever their coefficients.
        rows = rows.without(at_rest, STANDSTILL)
    _require_content(rows, model)
    robust, left_out = _fit_model(model, rows, facts), tuple[str, ...]()
    while robust.unidentified:
        if facts.model != "friction":
            raise InputError(
                f"the rows can't separate {' and '.join(robust.unidentified)} from the other coefficients "
                f"({', '.join(t.name for t in model.terms)}); log several speeds in both directions",
                file=rows.file,
            )
        left_out += robust.unidentified
        model = model.without(robust.unidentified)
        robust = _fit_model(model, rows, facts)
    values = tuple(
        t.low if value - t.low <= AT_BOUND * half else float(f"{value:.{DIGITS}g}")
        for t, value, half in zip(model.terms, robust.values, robust.half_widths, strict=True)
    )
    omitted = f", without {', '.join(left_out)}" if left_out else ""
    logger.info("%s: %s model to %d rows%s", Path(rows.file).name, facts.model, len(rows), omitted)
    for reason, count in rows.dropped.items():
        logger.debug("dropped %d rows: %s", count, reason)
    return LogFit(rows, facts, model, robust, values, left_out, idle, idle_rows)


def steady_rows(rows: AxisLog, facts: AxisFacts) -> BoolArray:
    """Find the rows within the bound of acceleration, (n,); raise if one is needed and isn't known."""
    if facts.max_acceleration is None and not facts.dynamic:
        return np.ones(len(rows), dtype=bool)
    if rows.acceleration is None:
        raise SettingError(
            "the acceleration is needed: name its column, or the time's, or give the rate in Hz"
        )
    if facts.max_acceleration is None:
        return np.ones(len(rows), dtype=bool)
    return np.asarray(np.abs(rows.acceleration) <= facts.max_acceleration * facts.unit)


def _explain(model: DriveModel, values: Sequence[float] | Array, rows: AxisLog, facts: AxisFacts) -> Array:
    """Compute the power that a model with these values gives, (n,) W, also what isn't the drive's."""
    mass = facts.moved_mass or 0.0
    power = drive_power(
        model.drive(values),
        rows.speed,
        acceleration=rows.acceleration if facts.dynamic and rows.acceleration is not None else 0.0,
        gravity=(facts.gravity or 0.0) / (1.0 if facts.rotary else 1000.0),
        weight=mass * GRAVITY,
        inertia=mass * 1e-6,
    )
    return power + model.standing(values)


def _require_content(rows: AxisLog, model: DriveModel) -> None:
    """Raise if a log can't identify the coefficients, whatever they are."""
    moving = int(np.count_nonzero(rows.speed))
    # The rows at standstill tell a constant power, if they suffice.
    constant = (STANDING, "hold") if len(rows) - moving >= ROWS_PER_TERM else ()
    own = [term for term in model.terms if term.name not in constant]
    least = ROWS_PER_TERM * len(own)
    if moving < least:
        lost = "".join(f"; {count} dropped: {reason}" for reason, count in rows.dropped.items())
        raise InputError(
            f"{moving} rows in motion are too few for {len(own)} coefficients, which need {least}{lost}",
            file=rows.file,
        )
    for quantity, values in {"velocity": rows.speed, "power": rows.power}.items():
        if np.ptp(values) <= 1e-12 * np.abs(values).max():
            raise InputError(
                f"the {quantity} is the same in all {len(rows)} remaining rows; log moves of different "
                "speeds in both directions",
                file=rows.file,
            )


def require_fit(fit: LogFit) -> None:
    """Raise if the power's mean explains it better than the fit: the coefficients then mean nothing."""
    worth = r_squared(fit.rows.power, fit.power(fit.rows))
    if worth < WORST_FIT:
        rest = "" if fit.idle is None else f" (the column has {fit.idle:.4g} W at standstill)"
        raise InputError(
            f"the model explains the power worse than its mean: R² is {worth:.3g}{rest}; log the drive's own "
            "power, without the machine's base power, or fit other terms",
            file=fit.rows.file,
        )


def r_squared(power: Array, fitted: Array) -> float:
    """Compute 1 − Σ r² / Σ (P − mean P)²; 0 where the power doesn't vary."""
    spread = float(np.sum((power - power.mean()) ** 2)) if len(power) else 0.0
    return 1.0 - float(np.sum((power - fitted) ** 2)) / spread if spread > 0.0 else 0.0


def _fit_model(model: DriveModel, rows: AxisLog, facts: AxisFacts) -> RobustFit:
    """Fit a model's terms to rows, more than terms, within their bounds.

    If terms are unidentified the intervals mean nothing: leave those terms out and fit again.
    """
    from scipy.optimize import least_squares

    def residuals(values: Array) -> Array:
        return _explain(model, values, rows, facts) - rows.power

    bounds = np.array([(t.low, t.high) for t in model.terms]).T
    start = values = _start(model, rows, facts)
    floor = 1e-9 * float(np.abs(rows.power).max())
    moving = rows.moving
    scale, still = _scales(rows.power - _medians(rows.power, moving), moving, floor)
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


def _start(model: DriveModel, rows: AxisLog, facts: AxisFacts) -> Array:
    """Start where each term explains its share of the power: the right order of magnitude in any unit."""
    values = np.zeros(len(model.terms))
    share = np.sqrt(np.mean(rows.power**2)) / len(values)
    for i, term in enumerate(model.terms):
        step = np.where(np.arange(len(values)) == i, 1.0, 0.0)
        change = _explain(model, values + step, rows, facts) - _explain(model, values, rows, facts)
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
    """Compute the half-widths, (p,), of the confidence intervals of figures over their scales."""
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
