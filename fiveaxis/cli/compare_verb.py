"""The command that compares machines for one job."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Column, Table

from fiveaxis.cli.batch_verb import interruptible, live_table
from fiveaxis.cli.options import AsJson, JobTimeout, Scheduler, Workers, flags_of, read_flags, takes
from fiveaxis.cli.terminal import err, errors_explained, out, print_json, print_written
from fiveaxis.options import Costs

if TYPE_CHECKING:
    from fiveaxis.batch.machines import MachineComparison


@takes(flags_of(Costs))
def compare(
    context: typer.Context,
    job: Annotated[Path, typer.Argument(help="job file (.toml)", metavar="JOB.toml")],
    machines: Annotated[
        str, typer.Option("--machines", help="names or files, joined by commas; all: those of the library")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="folder for the results")],
    as_placed: Annotated[
        bool, typer.Option("--as-placed", help="leave the part where the job or its machine has it")
    ] = False,
    scheduler: Scheduler = None,
    workers: Workers = None,
    job_timeout: JobTimeout = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Run a job on several machines, each with its best place of the part, and tell which is cheapest.

    A machine that can't run it is a row with the reason; the exit code is 0 if at least one can. What isn't
    known surely enough to name a winner is told with what to measure.
    """
    with errors_explained(as_json) as written:
        with interruptible(), live_table(err) as listener:
            from fiveaxis.batch.machines import compare as run

            names = [name.strip() for name in machines.split(",") if name.strip()]
            limits: Any = {"scheduler": scheduler, "workers": workers, "job_timeout": job_timeout}
            how: Any = {**limits, **read_flags(Costs, context.params)}
            done = run(job, names, output, as_placed=as_placed, tell=listener, **how)
        written += (*done.files, *done.batch.files, *(p for c in done.batch.comparisons for p in c.files))
        if as_json:
            print_json(done.as_dict())
        else:
            _print(done)
            for path in written:
                print_written(path)
        if done.exit_code:
            raise typer.Exit(done.exit_code)


def _print(done: MachineComparison) -> None:
    from fiveaxis.batch.machine_page import HEADS, cells

    rows = [cells(candidate) for candidate in done.candidates]
    # What no machine has would only make the others narrow.
    shown = [k for k in range(len(HEADS)) if any(row[k] for row in rows)]
    heads = (Column(HEADS[k].lstrip("#"), justify="right" if HEADS[k][0] == "#" else "left") for k in shown)
    table = Table(*heads, box=None)
    for row in rows:
        table.add_row(*(escape(row[k]) for k in shown))
    out.print("energy of the feed drives (J) with its range; travel of the axes and margin in mm and deg")
    out.print(table)
    for candidate in done.candidates:
        if candidate.row.message:
            out.print(f"{candidate.machine}: {candidate.row.message}", markup=False, soft_wrap=True)
    for claim in done.claims:
        out.print(claim, markup=False, soft_wrap=True)
