"""The result of a calibration: the drive, how well it is known, and its table for a machine file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from fiveaxis.base import Array, HasColumns
from fiveaxis.model import Drive, Machine, Provenance, machine_text

# Ends of names in JSON.
POWERS = ("residual_rms", "noise", "standstill_power", "moving_power", "nominal")
ENERGIES = ("measured", "fitted", "whole_measured", "whole_fitted")
UNITS = {"time": "_s", "whole_time": "_s"} | dict.fromkeys(POWERS, "_W") | dict.fromkeys(ENERGIES, "_J")


@dataclass(frozen=True)
class Coefficient:
    """A fitted figure of a drive.

    Parameters
    ----------
    name : as in a machine file, preceded by ``plus`` or ``minus`` if the sides differ
    value : in the machine file's unit
    unit : of the machine file
    low, high : ends of its confidence interval, cut at its bounds; 95 % for all coefficients together
    """

    name: str
    value: float
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class RunEnergy:
    """What a run took, and what a fitted drive gives for it.

    Parameters
    ----------
    name : of the log
    held_out : whether the drive was fitted without it
    rows : the ones within the fit's bound of acceleration
    time : s, of these rows
    measured, fitted : J, of these rows
    r_squared : of their power
    whole_time, whole_measured, whole_fitted : s, J, of all rows, above the bound too
    dropped : reason → number of rows of the file that are in neither
    gaps : reason → number of steps between rows that are gaps
    """

    name: str
    held_out: bool
    rows: int
    time: float
    measured: float
    fitted: float
    r_squared: float
    whole_time: float
    whole_measured: float
    whole_fitted: float
    dropped: Mapping[str, int]
    gaps: Mapping[str, int]

    @property
    def error(self) -> float:
        """Relative error of the fitted energy, over the rows within the bound."""
        return relative_error(self.fitted, self.measured)

    @property
    def whole_error(self) -> float:
        """Relative error of the fitted energy, over all rows."""
        return relative_error(self.whole_fitted, self.whole_measured)


def relative_error(fitted: float, measured: float) -> float:
    """Return fitted over measured energy, less 1; NaN where nothing was drawn."""
    return fitted / measured - 1.0 if measured > 0.0 else math.nan


def held_out_error(runs: Iterable[RunEnergy]) -> float:
    """Return the relative error of the energy of the held-out runs together; NaN without any."""
    held = [run for run in runs if run.held_out]
    return relative_error(sum(run.fitted for run in held), sum(run.measured for run in held))


@dataclass(frozen=True, eq=False)
class Calibration(HasColumns):
    """A drive fitted to a log, and the quality of the fit.

    Parameters
    ----------
    axis : letter
    model : its name in a machine file
    drive : the fitted drive
    coefficients : in the order of the model
    left_out : requested terms that these rows can't separate from the others
    r_squared : 1 − Σ r² / Σ (P − mean P)² over the rows used, outliers included; means little where P hardly
        varies
    r_squared_moving : the same over the rows in motion alone; rows at standstill are easy to fit
    residual_rms : W, over the rows used
    noise : W, robust scale of the residuals in motion
    standstill_power : W, median of the rows at standstill; None where the axis never rests
    standstill_rows : how many they are
    moving_power : W, median of the rows in motion
    nominal : W, of 100 % load; None for a log that isn't in %
    rows : number of rows used
    dropped : reason → number of rows that weren't used
    gaps : reason → number of steps between rows that are gaps
    logs : names of the fitted ones
    source : names of the logs, with their digests
    note : what was given rather than fitted
    runs : energy of each log; of a single one only if others are held out
    speed, power, fitted : (n,), mm/s or rad/s, W, W, of the rows used
    """

    axis: str
    model: str
    drive: Drive
    coefficients: tuple[Coefficient, ...]
    left_out: tuple[str, ...]
    r_squared: float
    r_squared_moving: float
    residual_rms: float
    noise: float
    standstill_power: float | None
    standstill_rows: int
    moving_power: float
    nominal: float | None
    rows: int
    dropped: Mapping[str, int]
    gaps: Mapping[str, int]
    logs: tuple[str, ...]
    source: str
    note: str
    runs: tuple[RunEnergy, ...]
    speed: Array
    power: Array
    fitted: Array

    @property
    def held_out_error(self) -> float:
        """Relative error of the energy of all held-out runs together; NaN without any."""
        return held_out_error(self.runs)

    @property
    def held_out_whole_error(self) -> float:
        """The same over all rows, above the bound of acceleration too."""
        held = [run for run in self.runs if run.held_out]
        return relative_error(sum(run.whole_fitted for run in held), sum(run.whole_measured for run in held))

    @property
    def block(self) -> str:
        """The machine file's ``[axes.….drive]`` table, as TOML."""
        # The table is cut out of a whole machine's text, so that the format is defined only once.
        bare = Machine.from_code("650123" if self.axis == "B" else "640123")
        axes = tuple(replace(a, drive=self.drive) if a.letter == self.axis else a for a in bare.axes)
        source = f"fitted to {self.source}, {self.rows} rows, R² {self.r_squared:.3f}"
        origin = Provenance(f"{self.axis} drive", "", source, False, self.note, fitted=True)
        header = f"[axes.{self.axis}.drive]\n"
        text = machine_text(replace(bare, axes=axes, provenance=(origin,)))
        return header + text.partition(header)[2].partition("\n[")[0].strip() + "\n"

    def columns(self) -> dict[str, Array]:
        """Return the rows used by columns, (n,) each: ``speed_mm_s`` (or deg), ``power_W``, ``fitted_W``."""
        turns = self.axis in "ABC"
        speed = {"speed_deg_s": np.degrees(self.speed)} if turns else {"speed_mm_s": self.speed}
        return {**speed, "power_W": self.power, "fitted_W": self.fitted}

    def document(self) -> dict[str, Any]:
        """Return everything but the rows as plain data for JSON."""
        figures = _plain(self, "drive", "speed", "power", "fitted")
        coefficients = {c.name: _plain(c, "name") for c in self.coefficients}
        return figures | {
            "coefficients": coefficients,
            "runs": [_plain(run) for run in self.runs],
            "block": self.block,
        }


def _plain(record: Coefficient | RunEnergy | Calibration, *but: str) -> dict[str, Any]:
    """Return the fields of a record, but some, by their names in JSON, which have the units."""
    values = {f.name: getattr(record, f.name) for f in fields(record) if f.name not in but}
    return {
        name + UNITS.get(name, ""): list(value) if isinstance(value, tuple) else value
        for name, value in values.items()
    }
