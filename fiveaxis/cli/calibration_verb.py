"""The command that fits a drive to logs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from fiveaxis.base import Calibrate, FitDrive, ReadLog
from fiveaxis.cli.options import AsJson, flags_of, read_flags, takes
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import err, errors_explained, out, print_json, print_table, print_written
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.lab import Calibration

BLOCK = ".toml"
LOG, DRIVE = flags_of(ReadLog), flags_of(FitDrive)


@takes(LOG, DRIVE)
def calibrate(
    context: typer.Context,
    logs: Annotated[
        list[Path],
        typer.Argument(help="CSV files, fitted together; their first line names the columns", metavar="LOG…"),
    ],
    axis: Annotated[str, typer.Option("--axis", help="letter of the axis")],
    model: Annotated[
        str, typer.Option("--model", help="drive model: friction, affine, weight or directional")
    ],
    power: Annotated[
        str, typer.Option("--power", help="column of the drive's power or load", metavar="COLUMN")
    ],
    power_unit: Annotated[str, typer.Option("--power-unit", help="W, kW, % (load) or A")],
    hold_out: Annotated[
        list[Path] | None,
        typer.Option("--hold-out", help="log to price with the drive but not to fit; repeatable"),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            *("--output", "-o"),
            help="block of the machine file (.toml; default: stdout), table of the rows used (.csv), or "
            "figure of the fit and its errors (.svg, .html); repeatable",
        ),
    ] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Fit the drive of an axis to logs of its speed and power, for the machine file.

    Every column needs its unit. Of several logs each is held out in turn, or those of --hold-out are.
    """
    with errors_explained(as_json) as written:
        with shown_work(err, hidden=as_json) as work:
            from fiveaxis.base import InputError, require_file, require_suffix
            from fiveaxis.lab import calibrate_drive
            from fiveaxis.show import DRAWN_SUFFIXES

            suffixes = [
                require_suffix(p, (BLOCK, *DRAWN_SUFFIXES), "a block, table or figure") for p in output or ()
            ]
            for log in (*logs, *(hold_out or ())):
                require_file(log, InputError)
            given: dict[str, Any] = {"axis": axis, "model": model, "power": power, "power_unit": power_unit}
            given |= read_flags(Calibrate, context.params) | {"hold_out": hold_out or ()}
            work.step("fitting the drive", 0, 1)
            found = work.run(lambda _: calibrate_drive(logs, **given))
            for path in output or ():
                work.step("writing", 0, 1)
                written.append(_write(path, found))
        for path in written:
            print_written(path)
        if as_json:
            print_json(found.document())
        else:
            _print_calibration(found, with_block=BLOCK not in suffixes)


def _write(path: Path, found: Calibration) -> Path:
    from fiveaxis.base import columns_text, write_atomically
    from fiveaxis.show import write_calibration_figure

    match path.suffix.lower():
        case ".toml":
            return write_atomically(path, found.block)
        case ".csv":
            return write_atomically(path, columns_text(found.as_lists()))
        case _:
            return write_calibration_figure(found, path)


def _print_calibration(found: Calibration, *, with_block: bool) -> None:
    names = ", ".join(found.logs)
    out.print(f"axis {found.axis}, {found.model} model, {found.rows} rows of {escape(names)}")
    values = ((c.name, f"{c.value:.4g}", f"{c.low:.4g}", f"{c.high:.4g}", c.unit) for c in found.coefficients)
    print_table(("coefficient", "value", "95 % from", "to", "unit"), values)
    out.print(
        f"R² {found.r_squared:.4f} ({found.r_squared_moving:.4f} of the rows in motion); "
        f"residual {found.residual_rms:.3g} W rms, {found.noise:.3g} W robust"
    )
    out.print("the intervals contain all coefficients at once with 95 % confidence")
    _print_rows(found)
    if found.note:
        out.print(escape(found.note))
    if found.runs:
        _print_runs(found)
    if with_block:
        out.print()
        # Not through the console, which would break long lines.
        write_results(found.block)


def _print_rows(found: Calibration) -> None:
    """Say what the log's rows are, and which weren't used."""
    if found.standstill_power is not None:
        words = f"{found.standstill_power:.4g} W standing (median of {found.standstill_rows} rows)"
        out.print(f"{words}, {found.moving_power:.4g} W moving")
        if found.nominal is not None:
            shares = [f"{p / found.nominal:.1%}" for p in (found.standstill_power, found.moving_power)]
            out.print(f"of {found.nominal:g} W: {shares[0]} standing, {shares[1]} moving")
    _print_counts("", found.dropped, found.gaps)
    if not all(run.held_out for run in found.runs):
        # Otherwise each was held out in turn, and its rows are counted above.
        for run in found.runs:
            if run.held_out:
                _print_counts(f"{run.name}: ", run.dropped, run.gaps)


def _print_counts(place: str, dropped: Mapping[str, int], gaps: Mapping[str, int]) -> None:
    """Say which rows of a log weren't used, and where it was split."""
    for reason, count in dropped.items():
        out.print(escape(f"{place}dropped {count} rows: {reason}"))
    for reason, count in gaps.items():
        out.print(escape(f"{place}{count} gaps: {reason}"))


def _print_runs(found: Calibration) -> None:
    """Compare the energy of each run with the drive's, within the bound of acceleration and over all rows."""
    bounded = any(run.time < run.whole_time for run in found.runs)
    heads = ["run", "", "s", "measured J", "drive J", "error", "R²"]
    heads += ["all rows J", "drive J", "error"] if bounded else []
    rows = []
    for run in found.runs:
        cells = [run.name, "held out" if run.held_out else "fitted", f"{run.time:.1f}"]
        cells += [f"{run.measured:.2f}", f"{run.fitted:.2f}", _signed(run.error), f"{run.r_squared:.3f}"]
        if bounded:
            cells += [f"{run.whole_measured:.2f}", f"{run.whole_fitted:.2f}", _signed(run.whole_error)]
        rows.append(map(escape, cells))
    print_table(heads, rows)
    out.print(
        f"held-out runs together: {_signed(found.held_out_error)}"
        + (f", all rows {_signed(found.held_out_whole_error)}" if bounded else "")
    )


def _signed(error: float) -> str:
    # Rounded first: -0.0% would be a sign without an error.
    return f"{round(error, 3) + 0.0:+.1%}"
