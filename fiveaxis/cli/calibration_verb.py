"""The command that fits a drive to a log."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from fiveaxis.cli.options import AsJson, optional, takes
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import err, errors_explained, out, print_json
from fiveaxis.cli.work import work_aside

if TYPE_CHECKING:
    from fiveaxis.energy.calibration_record import Calibration


LOG: Mapping[str, Any] = {
    "velocity": optional(str, "column of the speed; default: from position"),
    "acceleration": optional(str, "column of the acceleration; default: from speed"),
    "position": optional(str, "column of the position"),
    "time": optional(str, "column of the time, in s"),
    "rate": optional(float, "rows per second, in place of --time"),
    "power_unit": optional(str, "unit of the power: W (default) or kW"),
    "length_unit": optional(str, "unit of lengths: mm, inch or deg; default: mm or deg"),
    "moved_mass": optional(float, "total moving mass, kg"),
    "gravity": optional(float, "gravity load that opposes the + direction, N or N·m (friction)"),
    "max_acceleration": optional(float, "drop rows above this acceleration, length unit per s²"),
    "standstill": optional(float, "speed that counts as 0; default: 0.5 % of the highest"),
    "efficiency": optional(float, "efficiency of the drive, 1 by default; a log doesn't show it"),
    "terms": optional(str, "terms of a friction drive: friction,viscous,counterbalance,copper,hold, …"),
    "proportional": optional(
        bool, "directional drive: power proportional to speed, or not (default)", "--proportional/--constant"
    ),
}


@takes(LOG)
def calibrate(
    context: typer.Context,
    log: Annotated[
        Path, typer.Argument(help="CSV file; its first line names the columns", metavar="LOG.csv")
    ],
    axis: Annotated[str, typer.Option("--axis", help="letter of the axis")],
    model: Annotated[
        str, typer.Option("--model", help="drive model: friction, affine, weight or directional")
    ],
    power: Annotated[str, typer.Option("--power", help="column of the drive's power", metavar="COLUMN")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="file for the TOML block of the machine file; default: stdout"),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="file for a figure of the residuals, .png or .svg")
    ] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Fit the drive of an axis to a log of its speed and power, for the machine file."""
    with errors_explained(as_json):
        from fiveaxis.energy.calibration import calibrate_drive
        from fiveaxis.files import write_atomically

        if figure is not None:
            from fiveaxis.report.plots import require_figure_suffix, write_calibration_figure

            require_figure_suffix(figure)
        given = {name: value for name in LOG if (value := context.params[name]) is not None}
        if "terms" in given:
            given["terms"] = [name.strip() for name in given["terms"].split(",")]
        fit = partial(calibrate_drive, log, axis=axis, model=model, power=power, **given)
        found = work_aside(fit)
        written = [] if output is None else [write_atomically(output, found.block)]
        written += [] if figure is None else [write_calibration_figure(found, figure)]
        for path in written:
            err.print(f"wrote {escape(str(path))}")
        if as_json:
            print_json(found.document())
        else:
            _print_calibration(found, with_block=output is None)


def _print_calibration(found: Calibration, *, with_block: bool) -> None:
    table = Table("coefficient", "value", "95 % from", "to", "unit", box=None)
    for c in found.coefficients:
        table.add_row(c.name, f"{c.value:.4g}", f"{c.low:.4g}", f"{c.high:.4g}", c.unit)
    out.print(f"axis {found.axis}, {found.model} model, {found.rows} rows of {escape(found.source)}")
    out.print(table)
    out.print(
        f"R² {found.r_squared:.4f} ({found.r_squared_moving:.4f} of the rows in motion); "
        f"residual {found.residual_rms:.3g} W rms, {found.noise:.3g} W robust"
    )
    out.print("the intervals contain all coefficients at once with 95 % confidence")
    for reason, count in found.dropped.items():
        out.print(f"dropped {count} rows: {reason}")
    if found.note:
        out.print(escape(found.note))
    if with_block:
        out.print()
        # Not through the console, which would break long lines.
        write_results(found.block)
