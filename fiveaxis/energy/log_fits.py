"""A drive model fitted to logs: the rows in use, the terms that they identify, their values."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.energy.drive_fits import Record, RobustFit, fit_model
from fiveaxis.energy.drive_terms import STANDING, AxisFacts, DriveModel, choose_model
from fiveaxis.energy.drives import STANDARD_GRAVITY
from fiveaxis.energy.motion_log import AxisLog, join_logs
from fiveaxis.errors import InputError, SettingError
from fiveaxis.geometry import Array, BoolArray

logger = logging.getLogger(__name__)

STANDSTILL = "standstill, too few for a term"
WORST_FIT = -0.1  # R² below this is no fit; it is about 0 where the power hardly varies
ROWS_PER_TERM = 10
# Share of an interval's half-width: the solver stays inside the bounds by a hair, not worth printing.
AT_BOUND = 1e-6
DIGITS = 6  # of a coefficient in the machine file; its interval is far wider


@dataclass(frozen=True, eq=False)
class LogFit:
    """A model fitted to logs.

    Parameters
    ----------
    rows : the ones in use, of all logs
    record : the same in the units of `drive_power`
    model : its identified terms
    robust : the optimum
    values : (p,), of the terms, as a machine file has them
    left_out : names of terms that the rows can't identify
    idle : W, median of the rows at standstill; None without any
    idle_rows : how many they are
    """

    rows: AxisLog
    record: Record
    model: DriveModel
    robust: RobustFit
    values: tuple[float, ...]
    left_out: tuple[str, ...]
    idle: float | None
    idle_rows: int

    def power(self, record: Record) -> Array:
        """Compute the power of other rows, (n,) W."""
        return record.explain(self.model, self.values)


def fit_logs(runs: Sequence[AxisLog], facts: AxisFacts) -> LogFit:
    """Fit the model to the steady rows of logs, less the terms that these can't identify.

    Parameters
    ----------
    runs : with speed 0 exactly where the axis stands
    facts : of the axis

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
    record = record_of(rows, facts)
    robust, left_out = fit_model(model, record), tuple[str, ...]()
    while robust.unidentified:
        if facts.model != "friction":
            raise InputError(
                f"the rows can't separate {' and '.join(robust.unidentified)} from the other coefficients "
                f"({', '.join(t.name for t in model.terms)}); log several speeds in both directions",
                file=rows.file,
            )
        left_out += robust.unidentified
        model = model.without(robust.unidentified)
        robust = fit_model(model, record)
    values = tuple(
        t.low if value - t.low <= AT_BOUND * half else float(f"{value:.{DIGITS}g}")
        for t, value, half in zip(model.terms, robust.values, robust.half_widths, strict=True)
    )
    omitted = f", without {', '.join(left_out)}" if left_out else ""
    logger.info("%s: %s model to %d rows%s", Path(rows.file).name, facts.model, len(rows), omitted)
    for reason, count in rows.dropped.items():
        logger.debug("dropped %d rows: %s", count, reason)
    return LogFit(rows, record, model, robust, values, left_out, idle, idle_rows)


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
    unit = np.radians(1.0) if facts.rotary else 1.0
    return np.asarray(np.abs(rows.acceleration) <= facts.max_acceleration * unit)


def record_of(rows: AxisLog, facts: AxisFacts) -> Record:
    """Return rows in the units of `drive_power`, with the load that the facts give."""
    mass = facts.moved_mass or 0.0
    return Record(
        speed=rows.speed,
        power=rows.power,
        acceleration=rows.acceleration if facts.dynamic and rows.acceleration is not None else 0.0,
        gravity=(facts.gravity or 0.0) / (1.0 if facts.rotary else 1000.0),
        weight=mass * STANDARD_GRAVITY,
        inertia=mass * 1e-6,
    )


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
    worth = r_squared(fit.record.power, fit.power(fit.record))
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
