"""The command that compares machines for one job."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from fiveaxis.cli.batch_verb import interruptible, live_table
from fiveaxis.cli.options import AsJson, Scheduler, Workers
from fiveaxis.cli.terminal import err, errors_explained, out, print_json, print_written

if TYPE_CHECKING:
    from fiveaxis.batch.machines import Candidate, MachineComparison


def compare(
    job: Annotated[Path, typer.Argument(help="job file (.toml)", metavar="JOB.toml")],
    machines: Annotated[
        str, typer.Option("--machines", help="names or files, joined by commas; all: those of the library")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="folder for the results")],
    scheduler: Scheduler = None,
    workers: Workers = None,
    as_json: AsJson = False,
) -> None:
    """Run a job on several machines, and tell which is cheapest and which is quickest, if that is known.

    A machine that can't run it is a row with the reason; the exit code is 0 if at least one can.
    """
    with errors_explained(as_json) as written:
        with interruptible(), live_table(err) as listener:
            from fiveaxis.batch.machines import compare_machines

            names = [name.strip() for name in machines.split(",") if name.strip()]
            done = compare_machines(job, names, output, scheduler=scheduler, workers=workers, tell=listener)
        written += (*done.batch.files, *(path for c in done.batch.comparisons for path in c.files))
        if as_json:
            print_json(done.as_dict())
        else:
            _print(done)
            for path in written:
                print_written(path)
        if done.exit_code:
            raise typer.Exit(done.exit_code)


def _print(done: MachineComparison) -> None:
    table = Table("machine", "J", "from", "to", "s", "deg/s", "state", box=None)
    for candidate in done.candidates:
        table.add_row(escape(candidate.machine), *_cells(candidate), str(candidate.row.status))
    out.print("energy of the feed drives with its range, run time, largest speed of a rotary axis")
    out.print(table)
    for candidate in done.candidates:
        if candidate.row.message:
            out.print(f"{candidate.machine}: {candidate.row.message}", markup=False, soft_wrap=True)
    for claim in done.claims:
        out.print(claim, markup=False, soft_wrap=True)


def _cells(candidate: Candidate) -> tuple[str, ...]:
    if candidate.energy is None or candidate.row.energy is None or candidate.row.time is None:
        return ("",) * 5
    fastest = candidate.figures.get("largest_rotary_deg_s")
    speed = f"{fastest:.0f}" if isinstance(fastest, float) else ""
    joules = (candidate.row.energy, *candidate.energy)
    return *(f"{joule:.0f}" for joule in joules), f"{candidate.row.time:.1f}", speed
