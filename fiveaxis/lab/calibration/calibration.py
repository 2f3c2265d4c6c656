"""Calibration: a drive's coefficients from logs of its speed and power, and its error on other logs.

The column should hold the drive's own power. A constant part, such as the machine's base power, is told apart
by the rows at standstill: it is a term of its own, and no part of a drive that takes nothing there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.base import InputError, ReadLog, SettingError, keywords_of, product
from fiveaxis.lab.calibration.calibration_record import Calibration, Coefficient, RunEnergy, held_out_error
from fiveaxis.lab.calibration.drive_fits import (
    ROWS_PER_TERM,
    LogFit,
    fit_logs,
    r_squared,
    require_fit,
    steady_rows,
)
from fiveaxis.lab.calibration.drive_terms import STANDING, AxisFacts
from fiveaxis.lab.calibration.log_columns import LogColumns
from fiveaxis.lab.calibration.motion_log import AxisLog, join_logs, read_axis_log, require_motion

# Share of the highest speed that the noise of a scale, or of a differentiated position, shows at rest.
STILL_SHARE = 0.005
NEGLIGIBLE = 0.001  # share of the power in motion, below which none is drawn at standstill
IDLE_NOISE = 3.0  # multiple of the noise below which a power at standstill counts as none

Log = str | Path


@dataclass(frozen=True, kw_only=True)
class Calibrating(AxisFacts, ReadLog):
    """All that `calibrate_drive` takes as keywords."""

    power: str
    power_unit: str | None = None
    hold_out: Log | Sequence[Log] = ()


@keywords_of(Calibrating)
def calibrate_drive(
    log: Log | Sequence[Log],
    facts: Calibrating,
) -> Calibration:
    """Fit a drive model to logs of an axis.

    The power of a friction drive, ``P = F v / η + c F² + P_h`` with ``F = m a + F_c sgn v + B v + G − F_b``,
    shows only F/η: η is given, not fitted, and with η = 1 the forces are those apparent at the motor's
    supply.

    Parameters
    ----------
    log : CSV file, or several of the same columns, which are fitted together; with several that move and none
        held out, each of these is held out in turn from a fit of the others
    axis : its letter
    model : friction, affine, weight or directional
    power : column of the power, of the load in % of a nominal power, or of the current at a known voltage
    power_unit : W, kW, % or A; like the unit of every other named column it is stated, and none is assumed
    hold_out : logs that aren't fitted, but priced with the drive

    Returns
    -------
    The drive and its coefficients, and each run's energy; a friction drive lacks the terms that the rows
    can't identify

    Raises
    ------
    SettingError
        An option is out of its range, or the model needs one that is missing; a unit is missing or unknown.
    InputError
        A log is faulty (with file, line and column), its values aren't plausible in their units, it has too
        few rows, no change in speed or power, or can't separate the terms; a load in % has no nominal power.

    References
    ----------
    Directional: Hayashi et al. (2018), power table. Affine and weight: Edem & Balogun (2018), Eqs. (5) and
    (1). Fit and intervals: `drive_fits`.
    """
    columns = LogColumns.of(facts.power, facts.power_unit, facts, rotary=facts.rotary)
    logs, held_out = _listed(log), _listed(facts.hold_out)
    _require_choice(logs, held_out, columns, facts)
    runs = [read_axis_log(one, columns) for one in logs]
    others = [read_axis_log(one, columns) for one in held_out]
    require_motion(join_logs(runs), columns)
    still = _standstill(join_logs(runs))
    runs, others = ([_with_rests(run, still) for run in group] for group in (runs, others))
    _require_watts(join_logs(runs), columns)
    fit = fit_logs(runs, facts)
    require_fit(fit)
    names = tuple(Path(run.file).name for run in runs)
    return _assess(fit, names, _energies(runs, others, fit), columns)


def _listed(logs: Log | Sequence[Log]) -> list[Log]:
    return [logs] if isinstance(logs, str | Path) else list(logs)


def _require_choice(
    logs: Sequence[Log], hold_out: Sequence[Log], columns: LogColumns, facts: AxisFacts
) -> None:
    """Raise if the logs aren't different ones, lack the time for energies, or can't show a term."""
    if not logs:
        raise SettingError("no log to fit; name one")
    twice = [path for path, count in Counter(map(Path, (*logs, *hold_out))).items() if count > 1]
    if twice:
        raise SettingError(f"{twice[0]} is given twice; fit it or hold it out, once")
    if len(logs) + len(hold_out) > 1 and not columns.has_time:
        raise SettingError("the energy of several runs needs the time: name its column, or the rate in Hz")
    if not columns.signed and "regeneration" in (facts.terms or ()):
        raise SettingError(
            f"a power in {columns.units['power']} has no sign and doesn't show regeneration; "
            "leave this term out"
        )


def _standstill(rows: AxisLog) -> float:
    """Return the speed up to which an axis stands, mm/s or rad/s."""
    highest = float(np.abs(rows.speed).max(initial=0.0))
    if highest == 0.0 and len(rows):
        raise InputError("the axis stands still in every row; log moves of this axis", file=rows.file)
    return STILL_SHARE * highest


def _with_rests(rows: AxisLog, still: float) -> AxisLog:
    """Return the log with speed 0 exactly in its rows at standstill."""
    return replace(rows, speed=np.where(np.abs(rows.speed) <= still, 0.0, rows.speed))


def _require_watts(rows: AxisLog, columns: LogColumns) -> None:
    """Raise if the load is in % and nothing says of how many watts; tell what it shows."""
    if not columns.is_load or columns.nominal is not None:
        return
    shares = [
        f"{float(np.median(rows.power[some])):.3g} % {word} (median of {int(some.sum())} rows)"
        for word, some in (("standing", ~rows.moving), ("moving", rows.moving))
        if some.any()
    ]
    raise InputError(
        f"the load is {' and '.join(shares)}; which power 100 % are isn't known: give the nominal power, or "
        "the nominal current and the voltage",
        file=rows.file,
    )


def _energies(runs: Sequence[AxisLog], others: Sequence[AxisLog], fit: LogFit) -> tuple[RunEnergy, ...]:
    """Price every run with a drive; without others, each run that moves with a fit of the rest."""
    if others:
        return (
            *(_energy(run, fit, held_out=False) for run in runs),
            *(_energy(run, fit, held_out=True) for run in others),
        )
    moving = [run for run in runs if run.speed.any()]
    found = []
    for run in moving if len(moving) > 1 else ():
        try:
            rest = fit_logs([one for one in runs if one is not run], fit.facts)
        except InputError as fault:
            name = Path(run.file).name
            raise InputError(
                f"{fault} (without {name}, held out in turn; name the runs to hold out)"
            ) from None
        found.append(_energy(run, rest, held_out=True))
    return tuple(found)


def _energy(run: AxisLog, fit: LogFit, *, held_out: bool) -> RunEnergy:
    steady = steady_rows(run, fit.facts)
    power, time = fit.power(run), run.duration
    return RunEnergy(
        name=Path(run.file).name,
        held_out=held_out,
        rows=int(steady.sum()),
        time=float(time[steady].sum()),
        measured=float(product(run.power[steady], time[steady])),
        fitted=float(product(power[steady], time[steady])),
        r_squared=r_squared(run.power[steady], power[steady]),
        whole_time=float(time.sum()),
        whole_measured=float(product(run.power, time)),
        whole_fitted=float(product(power, time)),
        dropped=run.dropped,
        gaps=run.gaps,
    )


def _assess(
    fit: LogFit, names: tuple[str, ...], runs: tuple[RunEnergy, ...], columns: LogColumns
) -> Calibration:
    rows, facts = fit.rows, fit.facts
    fitted, moving = fit.power(rows), rows.moving
    coefficients = tuple(
        Coefficient(t.name, value, t.unit, max(value - half, t.low), min(value + half, t.high))
        for t, value, half in zip(
            fit.model.terms, fit.values, map(float, fit.robust.half_widths), strict=True
        )
    )
    return Calibration(
        axis=facts.axis,
        logs=names,
        model=facts.model,
        drive=fit.model.drive(fit.values),
        coefficients=coefficients,
        left_out=fit.left_out,
        r_squared=r_squared(rows.power, fitted),
        r_squared_moving=r_squared(rows.power[moving], fitted[moving]),
        residual_rms=float(np.sqrt(np.mean((rows.power - fitted) ** 2))),
        noise=fit.robust.scale,
        standstill_power=fit.idle,
        standstill_rows=fit.idle_rows,
        moving_power=float(np.median(rows.power[moving])),
        nominal=columns.nominal,
        rows=len(rows),
        dropped=rows.dropped,
        gaps=rows.gaps,
        source=rows.source,
        note=_note(fit, runs, columns),
        runs=runs,
        speed=rows.speed,
        power=rows.power,
        fitted=fitted,
    )


def _note(fit: LogFit, runs: Sequence[RunEnergy], columns: LogColumns) -> str:
    """List the assumptions behind the coefficients, and what the fit left out."""
    parts, facts = [], fit.facts
    if not columns.signed:
        each = f"load of {columns.nominal:g} W" if columns.is_load else f"current at {columns.voltage:g} V"
        parts.append(f"power from a {each}, without sign: braking counts as pushing")
    if facts.moved_mass is not None and facts.model in ("weight", "friction"):
        parts.append(f"moved mass given as {facts.moved_mass:g} kg, workpiece and fixture included")
    if facts.model == "friction":
        parts.append(f"efficiency given as {facts.efficiency:g}")
        if facts.gravity:
            parts.append(f"gravity given as {facts.gravity:g} {'N·m' if facts.rotary else 'N'}")
        if not facts.dynamic:
            parts.append("steady rows, without the axis's inertia")
    parts += [f"not identified by these rows: {', '.join(fit.left_out)}"] if fit.left_out else []
    parts += _standing_notes(fit)
    held = sum(run.held_out for run in runs)
    parts += [f"energy of held-out logs ({held}): {held_out_error(runs):+.1%}"] if held else []
    return "; ".join(parts)


def _standing_notes(fit: LogFit) -> list[str]:
    """Say where the power at standstill is."""
    standing = fit.model.standing(fit.values)
    if standing > NEGLIGIBLE * float(np.median(np.abs(fit.rows.power[fit.rows.moving]))):
        rows = f"fitted to {fit.idle_rows} rows"
        return [f"{standing:.4g} W at standstill, {rows}, aren't in this drive; add them to the base power"]
    if any(term.name in ("hold", "copper", STANDING) for term in fit.model.terms):
        return []
    if fit.idle is not None and abs(fit.idle) > IDLE_NOISE * fit.robust.scale:
        return [f"{fit.idle:.4g} W at standstill aren't in the model, base power or hold?"]
    if fit.idle_rows < ROWS_PER_TERM:
        return [f"{fit.idle_rows} rows at standstill, too few to tell a constant power apart"]
    return []
