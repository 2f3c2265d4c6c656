"""The command that computes the power surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.cli.options import AsJson, Drives, MachineName
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import (
    errors_explained,
    load_powered,
    parse_numbers,
    print_json,
    require_between,
    require_machine,
)

if TYPE_CHECKING:
    from fiveaxis.energy import PowerSurface
    from fiveaxis.machine import Machine


def surface(
    tip: Annotated[str, typer.Argument(help="position of the tool tip, X,Y,Z in mm, workpiece frame")],
    machine: MachineName = None,
    drives: Drives = None,
    feed: Annotated[float, typer.Option("--feed", help="feed, mm/min")] = 1000.0,
    step: Annotated[float, typer.Option("--step", help="step of the rotary angles, deg")] = 10.0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="CSV file; default: stdout")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute the power surface S_W = S_WL + S_WR over the rotary angles at a cutter location."""
    with errors_explained(as_json):
        from fiveaxis.energy import power_surface
        from fiveaxis.files import write_atomically

        position = parse_numbers(tip, 3, "X,Y,Z")
        require_between("--feed", feed, 1e-3, 1e6, "mm/min")
        require_between("--step", step, 0.1, 90.0, "deg")
        loaded = load_powered(require_machine(machine), drives)
        grid = tuple(_angles(loaded, letter, step) for letter in loaded.rotaries[:2])
        columns = _surface_columns(power_surface(loaded, position, feed, grid))
        if as_json:
            return print_json(columns)
        lines = (",".join(f"{v:.6f}" for v in row) for row in zip(*columns.values(), strict=True))
        text = "\n".join([",".join(columns), *lines]) + "\n"
        if output is None:
            write_results(text)
        else:
            write_atomically(output, text)


def _angles(machine: Machine, letter: str, step: float) -> Any:
    """Divide the range of a rotary axis into steps, an endless one over one turn; rad."""
    import numpy as np

    from fiveaxis.report.landscape import shown_range

    low, high = shown_range(machine.axis(letter))
    return np.linspace(low, high, max(2, round(np.degrees(high - low) / step) + 1))


def _surface_columns(surface: PowerSurface) -> dict[str, list[float]]:
    """List a surface by columns, one row per posture, the second angle varying fastest."""
    import numpy as np

    first, second = np.meshgrid(surface.first, surface.second, indexing="ij")
    parts = (np.degrees(first), np.degrees(second), surface.linear, surface.rotary, surface.total)
    names = (*(f"{c}_deg" for c in surface.letters), "S_WL_J", "S_WR_J", "S_W_J")
    return {name: part.ravel().tolist() for name, part in zip(names, parts, strict=True)}
