"""Fit the feed drives of a public mill to one logged run, and price five other runs with them.

The SMART lab of the University of Michigan milled wax on a CNC mill and logged position, velocity,
acceleration and power of its drives every 100 ms. X and Y are friction drives, P = F_c |v| + B v², fitted to
the rows that accelerate by at most 30 mm/s², of the longest run alone. The other runs are held out: nothing
of them is fitted, and their energy is compared row by row. As one training run may be lucky, every other run
is tried as one too.

What the logs don't show: Z, whose electrical columns are 0; and the order of their rows, which in five of the
six runs comes in pieces of about ten that don't follow each other (the position jumps). `OutputCurrent` (near
325) and `DCBusVoltage` (0 to 3) look swapped, so the power is taken from `OutputPower`, in kW.

Source: SMART lab, "CNC Mill Tool Wear", files of github.com/ejhusom/cnc_milling_tool_wear, folder data.
Run: `python examples/calibration/umich.py FOLDER [OUT]`; the figures go to OUT.
"""

from __future__ import annotations

import sys
from pathlib import Path

import fiveaxis as fx
from fiveaxis.lab import Calibration
from fiveaxis.show.report.plots import write_calibration_figure

FITTED = "umich_experiment_11.csv"  # the longest
STEADY = 30.0  # mm/s²


def fit(log: Path, others: list[Path], axis: str) -> Calibration:
    """Fit the drive of an axis to a run, and price the others."""
    return fx.calibrate_drive(
        log,
        axis=axis,
        model="friction",
        power=f"{axis}1_OutputPower",
        power_unit="kW",
        velocity=f"{axis}1_ActualVelocity",
        velocity_unit="mm/s",
        acceleration=f"{axis}1_ActualAcceleration",
        acceleration_unit="mm/s2",
        position=f"{axis}1_ActualPosition",
        position_unit="mm",
        rate=10.0,
        max_acceleration=STEADY,
        hold_out=others,
    )


def show(found: Calibration) -> None:
    """Print a drive and its runs."""
    values = ", ".join(f"{c.name} {c.value:.4g} {c.unit}" for c in found.coefficients)
    print(f"{found.axis}: {values}; R² {found.r_squared:.3f}")
    print("  run                      steady: J   drive   error     R²  all rows: J   drive   error")
    for run in found.runs:
        print(
            f"  {run.name} {run.measured:10.2f} {run.fitted:7.2f} {run.error:+7.1%}  {run.r_squared:.3f} "
            f"{run.whole_measured:13.2f} {run.whole_fitted:7.2f} {run.whole_error:+7.1%}"
            f"{'' if run.held_out else '  (fitted)'}"
        )
    print(f"  held out together: {found.held_out_error:+.1%}, all rows {found.held_out_whole_error:+.1%}")


def compare(logs: list[Path], axis: str) -> None:
    """Print what the other runs get from each run as the fitted one."""
    for log in logs:
        try:
            found = fit(log, [other for other in logs if other != log], axis)
        except fx.FiveAxisError as fault:
            print(f"  fitted to {log.name}: {str(fault).partition(': ')[2]}")
            continue
        worst = max((run.error for run in found.runs if run.held_out), key=abs)
        print(
            f"  fitted to {log.name}: together {found.held_out_error:+.1%}, worst {worst:+.1%}, "
            f"all rows {found.held_out_whole_error:+.1%}"
        )


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "out")
    out.mkdir(parents=True, exist_ok=True)
    logs = sorted(folder.glob("umich_experiment_*.csv"))
    for axis in ("X", "Y"):
        found = fit(folder / FITTED, [log for log in logs if log.name != FITTED], axis)
        show(found)
        compare(logs, axis)
        write_calibration_figure(found, out / f"umich-{axis.lower()}.svg")


if __name__ == "__main__":
    main()
