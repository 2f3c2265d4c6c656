"""Calibration: a drive's coefficients from a log of its speed and power.

The column must hold the drive's own power: a log of the whole machine includes its base power, for which the
drive models have no term.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fiveaxis.energy.calibration_record import Calibration, Coefficient
from fiveaxis.energy.drive_fits import Record, RobustFit, fit_model
from fiveaxis.energy.drive_terms import AxisFacts, DriveModel, choose_model, require_facts
from fiveaxis.energy.drives import STANDARD_GRAVITY
from fiveaxis.energy.motion_log import AxisLog, LogColumns, length_factor, read_axis_log
from fiveaxis.errors import InputError, SettingError
from fiveaxis.geometry import Array, BoolArray

logger = logging.getLogger(__name__)

STANDSTILL = "standstill"
# Share of the highest speed that the noise of a scale, or of a differentiated position, shows at rest.
STILL_SHARE = 0.005
WORST_FIT = -0.1  # R² below this is no fit; it is about 0 where the power hardly varies
IDLE_NOISE = 3.0  # multiple of the noise below which a power at standstill counts as none
ROWS_PER_TERM = 10
# Share of an interval's half-width: the solver stays inside the bounds by a hair, not worth printing.
AT_BOUND = 1e-6
DIGITS = 6  # of a coefficient in the machine file; its interval is far wider


def calibrate_drive(
    log: str | Path,
    *,
    axis: str,
    model: str,
    power: str,
    velocity: str | None = None,
    acceleration: str | None = None,
    position: str | None = None,
    time: str | None = None,
    rate: float | None = None,
    power_unit: str = "W",
    length_unit: str | None = None,
    moved_mass: float | None = None,
    gravity: float | None = None,
    max_acceleration: float | None = None,
    standstill: float | None = None,
    efficiency: float = 1.0,
    terms: Sequence[str] | None = None,
    proportional: bool = False,
) -> Calibration:
    """Fit a drive model to a log of an axis.

    The power of a friction drive, ``P = F v / η + c F² + P_h`` with ``F = m a + F_c sgn v + B v + G − F_b``,
    shows only F/η: η is given, not fitted, and with η = 1 the forces are those apparent at the motor's
    supply.

    Parameters
    ----------
    log : CSV file
    axis : its letter
    model : friction, affine, weight or directional
    power, velocity, acceleration, position : names of columns; missing ones are derived (`read_axis_log`)
    time, rate : name of the column in s, or rows per second
    power_unit : W or kW
    length_unit : unit of position, of velocity per s and of acceleration per s²; mm or deg by default
    moved_mass : kg, everything that the linear axis moves, with workpiece and fixture; the weight model needs
        it, and so does friction unless `max_acceleration` keeps steady rows only
    gravity : N or N·m that the axis holds while its value grows, for friction; 9.81 N per kg of a Z that
        lifts its mass. Required for Z, 0 for the others by default
    max_acceleration : rows that accelerate more are dropped; length unit per s²
    standstill : speed that counts as standstill, length unit per s; 0.5 % of the highest by default
    efficiency : η, of a friction drive
    terms : of a friction drive; by default friction and viscous, counterbalance if there is gravity, and
        inertia of a rotary axis without `max_acceleration`. Copper, hold and regeneration only if named
    proportional : whether a directional table is W per speed instead of W

    Returns
    -------
    The drive and its coefficients; a friction drive lacks the terms that the rows can't identify

    Raises
    ------
    SettingError
        An option is out of its range, or the model needs one that is missing.
    InputError
        The log is faulty (with file, line and column), has too few rows, no change in speed or power, or
        can't separate the terms.

    References
    ----------
    Directional: Hayashi et al. (2018), power table. Affine and weight: Edem & Balogun (2018), Eqs. (5) and
    (1). Fit and intervals: `drive_fits`.
    """
    facts = AxisFacts(
        axis,
        model,
        moved_mass,
        gravity,
        max_acceleration,
        standstill,
        efficiency,
        None if terms is None else tuple(terms),
        proportional,
    )
    require_facts(facts)
    unit = length_factor(length_unit, rotary=facts.rotary)
    columns = LogColumns(power, velocity, acceleration, position, time, rate, power_unit, length_unit)
    rows = _steady_rows(read_axis_log(log, columns, rotary=facts.rotary), facts, unit)
    at_rest = _rows_at_rest(rows, facts, unit)
    idle = float(np.median(rows.power[at_rest])) if at_rest.any() else None
    rows = replace(rows, speed=np.where(at_rest, 0.0, rows.speed))
    if model != "friction":
        # At rest these models give 0 whatever their coefficients.
        rows = rows.without(at_rest, STANDSTILL)
    record, fitted = _record(rows, facts), choose_model(facts)
    _require_content(rows, fitted)
    fit = fit_model(fitted, record)
    left_out: tuple[str, ...] = ()
    while fit.unidentified:
        if model != "friction":
            raise InputError(
                f"the rows can't separate {' and '.join(fit.unidentified)} from the other coefficients "
                f"({', '.join(t.name for t in fitted.terms)}); log several speeds in both directions",
                file=rows.file,
            )
        left_out += fit.unidentified
        fitted = fitted.without(fit.unidentified)
        fit = fit_model(fitted, record)
    omitted = f", without {', '.join(left_out)}" if left_out else ""
    logger.info("%s: %s model to %d rows%s", Path(log).name, model, len(rows.power), omitted)
    for reason, count in rows.dropped.items():
        logger.debug("dropped %d rows: %s", count, reason)
    calibration = _assess(rows, record, fitted, fit, left_out, idle, facts)
    _require_fit(calibration, rows.file)
    return calibration


def _steady_rows(rows: AxisLog, facts: AxisFacts, unit: float) -> AxisLog:
    """Drop the rows above the acceleration bound; raise if an acceleration is needed and isn't known."""
    if facts.max_acceleration is None and not facts.dynamic:
        return rows
    if rows.acceleration is None:
        raise SettingError(
            "the acceleration is needed: name its column, or the time's, or give the rate in Hz"
        )
    if facts.max_acceleration is None:
        return rows
    above = np.abs(rows.acceleration) > facts.max_acceleration * unit
    return rows.without(above, "acceleration above the bound")


def _rows_at_rest(rows: AxisLog, facts: AxisFacts, unit: float) -> BoolArray:
    """Find the rows at standstill, (n,)."""
    highest = float(np.abs(rows.speed).max(initial=0.0))
    if highest == 0.0 and len(rows):
        raise InputError(
            "the axis stands still in every remaining row; log moves of this axis", file=rows.file
        )
    still = STILL_SHARE * highest if facts.standstill is None else facts.standstill * unit
    at_rest = np.abs(rows.speed) <= still
    if at_rest.all() and len(rows):
        raise InputError(
            f"every row is at standstill, the fastest at {highest / unit:g} per s; lower that speed",
            file=rows.file,
        )
    return at_rest


def _record(rows: AxisLog, facts: AxisFacts) -> Record:
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
    least = ROWS_PER_TERM * len(model.terms)
    moving = int(np.count_nonzero(rows.speed))
    if moving < least:
        lost = "".join(f"; {count} dropped: {reason}" for reason, count in rows.dropped.items())
        raise InputError(
            f"{moving} rows in motion are too few for {len(model.terms)} coefficients, which need "
            f"{least}{lost}",
            file=rows.file,
        )
    for quantity, values in {"velocity": rows.speed, "power": rows.power}.items():
        if np.ptp(values) <= 1e-12 * np.abs(values).max():
            raise InputError(
                f"the {quantity} is the same in all {len(rows)} remaining rows; log moves of different "
                "speeds in both directions",
                file=rows.file,
            )


def _assess(
    rows: AxisLog,
    record: Record,
    model: DriveModel,
    fit: RobustFit,
    left_out: tuple[str, ...],
    idle: float | None,
    facts: AxisFacts,
) -> Calibration:
    values = [
        t.low if value - t.low <= AT_BOUND * half else float(f"{value:.{DIGITS}g}")
        for t, value, half in zip(model.terms, fit.values, fit.half_widths, strict=True)
    ]
    drive = model.drive(values)
    fitted = record.predict(drive)
    coefficients = tuple(
        Coefficient(t.name, value, t.unit, max(value - half, t.low), min(value + half, t.high))
        for t, value, half in zip(model.terms, values, map(float, fit.half_widths), strict=True)
    )
    moving = record.moving
    return Calibration(
        axis=facts.axis,
        model=facts.model,
        drive=drive,
        coefficients=coefficients,
        left_out=left_out,
        r_squared=_r_squared(record.power, fitted),
        r_squared_moving=_r_squared(record.power[moving], fitted[moving]),
        residual_rms=float(np.sqrt(np.mean((record.power - fitted) ** 2))),
        noise=fit.scale,
        standstill_power=idle,
        rows=len(rows),
        dropped=rows.dropped,
        source=f"{Path(rows.file).name} (sha256 {rows.sha256})",
        note=_note(facts, left_out, _unexplained(idle, model, fit)),
        lines=rows.lines,
        speed=record.speed,
        power=record.power,
        fitted=fitted,
    )


def _require_fit(found: Calibration, file: str) -> None:
    """Raise if the power's mean explains it better than the fit: the coefficients then mean nothing."""
    if found.r_squared < WORST_FIT:
        idle = found.standstill_power
        rest = "" if idle is None else f" (the column has {idle:.4g} W at standstill)"
        raise InputError(
            f"the {found.model} model explains the power worse than its mean: R² is {found.r_squared:.3g}"
            f"{rest}; log the drive's own power, without the machine's base power, or fit other terms",
            file=file,
        )


def _r_squared(power: Array, fitted: Array) -> float:
    spread = float(np.sum((power - power.mean()) ** 2))
    return 1.0 - float(np.sum((power - fitted) ** 2)) / spread if spread > 0.0 else 0.0


def _unexplained(idle: float | None, model: DriveModel, fit: RobustFit) -> float:
    """Return the power at standstill that the model has no term for, W; 0 within the noise."""
    explained = any(term.name in ("hold", "copper") for term in model.terms)
    return 0.0 if idle is None or explained or abs(idle) <= IDLE_NOISE * fit.scale else idle


def _note(facts: AxisFacts, left_out: tuple[str, ...], idle: float) -> str:
    """List the assumptions behind the coefficients, and what the fit left out."""
    parts = []
    if facts.moved_mass is not None and facts.model in ("weight", "friction"):
        parts.append(f"moved mass given as {facts.moved_mass:g} kg, workpiece and fixture included")
    if facts.model == "friction":
        parts.append(f"efficiency given as {facts.efficiency:g}")
        if facts.gravity:
            parts.append(f"gravity given as {facts.gravity:g} {'N·m' if facts.rotary else 'N'}")
        if not facts.dynamic:
            parts.append("steady rows, without the axis's inertia")
    parts += [f"not identified by these rows: {', '.join(left_out)}"] if left_out else []
    parts += [f"{idle:.4g} W at standstill aren't in the model, base power or hold?"] if idle else []
    return "; ".join(parts)
