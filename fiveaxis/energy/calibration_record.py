"""The result of a calibration: the drive, how well it is known, and its table for a machine file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Drive, Machine, Provenance, machine_text


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


@dataclass(frozen=True, eq=False)
class Calibration:
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
    rows : number of rows used
    dropped : reason → number of rows that weren't used
    source : the log's name, with its digest
    note : what was given rather than fitted
    lines : (n,), lines of the log
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
    rows: int
    dropped: Mapping[str, int]
    source: str
    note: str
    lines: IntArray
    speed: Array
    power: Array
    fitted: Array

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

    def document(self) -> dict[str, Any]:
        """Return everything but the rows as plain data for JSON."""
        return {
            "axis": self.axis,
            "model": self.model,
            "coefficients": {
                c.name: {"value": c.value, "unit": c.unit, "low": c.low, "high": c.high}
                for c in self.coefficients
            },
            "left_out": list(self.left_out),
            "r_squared": self.r_squared,
            "r_squared_moving": self.r_squared_moving,
            "residual_rms_W": self.residual_rms,
            "noise_W": self.noise,
            "standstill_power_W": self.standstill_power,
            "rows": self.rows,
            "dropped": dict(self.dropped),
            "source": self.source,
            "note": self.note,
            "block": self.block,
        }
