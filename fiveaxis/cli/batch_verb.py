"""The commands that run many jobs: a batch, and one job on several machines."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Column, Table

from fiveaxis.base import Costs, Severity
from fiveaxis.cli.options import AsJson, JobTimeout, Scheduler, Workers, flags_of, read_flags, takes
from fiveaxis.cli.process import INTERRUPTED
from fiveaxis.cli.terminal import err, errors_explained, out, print_json, print_table, print_written
from fiveaxis.cli.work import clock_text

if TYPE_CHECKING:
    from fiveaxis.job import Batch, Comparison, Event, Listener, MachineComparison, Row


# Rows of a live table: one longer than the screen can't be redrawn.
SHOWN = 24
# Jobs that have to be done before a remaining time is told.
SURE = 0.2
# Heads of a job's figures.
FIGURES = ("J", "saved", "s", "starts", "reversals")


@takes()
def batch(
    files: Annotated[
        list[Path], typer.Argument(help="job files (.toml), also with sweeps", metavar="JOB.toml…")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="folder for the results")],
    scheduler: Scheduler = None,
    workers: Workers = None,
    job_timeout: JobTimeout = None,
    job_memory: Annotated[
        float | None,
        typer.Option("--job-memory", help="MB of memory above which a job is stopped and broken"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run many jobs, each into its own folder; finished jobs aren't run again.

    The exit code is that of the worst job, from bad to worse: 0 fine, 1 verification found errors, 3 no
    admissible posture, 2 wrong input, 4 broken (a fault of the program, a job that kills its workers or is
    over a limit, or a lost scheduler). Jobs with wrong input and broken jobs run again the next time.
    """
    with errors_explained(as_json) as written:
        with interruptible(), live_table(err) as listener:
            from fiveaxis.job import run_batch

            done = run_batch(
                files,
                output,
                scheduler=scheduler,
                workers=workers,
                job_timeout=job_timeout,
                job_memory=job_memory,
                tell=listener,
            )
        written += (*done.files, *(path for c in done.comparisons for path in c.files))
        if as_json:
            print_json(done.as_dict())
        else:
            _print_batch(done)
        if done.exit_code:
            raise typer.Exit(done.exit_code)


class Board:
    """The states of the jobs, as a table that fits the screen."""

    def __init__(self) -> None:
        self._latest: dict[str, Event] = {}
        self._began: dict[str, float] = {}
        self._start = time.monotonic()

    def record(self, event: Event) -> None:
        """Record the latest event of a job."""
        if self.begins(event):
            self._began[event.name] = time.monotonic()
        self._latest[event.name] = event

    def begins(self, event: Event) -> bool:
        """Whether a job that waited runs with this event."""
        return event.state == "running" and self._latest[event.name].state == "waiting"

    def count(self, state: str) -> int:
        """Count the jobs in a state."""
        # A copy: the table is drawn by one thread while others record events.
        return sum(event.state == state for event in list(self._latest.values()))

    def _left(self) -> float | None:
        """Time until the batch's end, s, by what is done and the shares of what runs; None while unsure."""
        # What an earlier batch had done took no time of this one.
        events = [event for event in list(self._latest.values()) if not event.again]
        done = sum(1.0 if event.row is not None else event.share for event in events)
        past = time.monotonic() - self._start
        return past * (len(events) - done) / done if done >= SURE and past >= 1.0 else None

    def __rich__(self) -> Table:
        states = ("done", "running", "waiting")
        counts = ", ".join(f"{self.count(state)} {state}" for state in states)
        past, left = time.monotonic() - self._start, self._left()
        more = "" if left is None else f", about {clock_text(left)} more"
        title = f"{counts}, {clock_text(past)}{more}"
        table = Table("job", "state", "where", "stage", "s", "J", title=title, box=None, title_justify="left")
        order = ("running", "done", "waiting")
        latest = sorted(self._latest.values(), key=lambda event: order.index(event.state))
        for event in latest[:SHOWN]:
            table.add_row(*self._cells(event))
        if len(latest) > SHOWN:
            table.add_row(f"… {len(latest) - SHOWN} more")
        return table

    def _cells(self, event: Event) -> tuple[str, ...]:
        name = escape(event.name)
        if event.row is not None:
            spent = "" if event.row.energy is None else f"{event.row.energy:.0f}"
            return name, _coloured(event.row), "", "as before" if event.again else "", "", spent
        began = self._began.get(event.name)
        seconds = "" if began is None else f"{time.monotonic() - began:.0f}"
        stage = f"{event.stage} {100.0 * event.share:.0f} %" if event.share else event.stage
        return name, event.state, escape(_where(event)), escape(stage), seconds, ""


@contextmanager
def interruptible() -> Iterator[None]:
    """End with the exit code of Ctrl-C, and say what becomes of the work."""
    try:
        yield
    except KeyboardInterrupt:
        err.print("interrupted; finished jobs are kept, the same command does the rest")
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def live_table(console: Console) -> Iterator[Listener]:
    """Show events: on a terminal as a live table, elsewhere as lines for the start and the end of a job."""
    board = Board()
    if console.is_terminal:
        with Live(board, console=console, refresh_per_second=4, transient=True):
            yield board.record
        return

    def print_event(event: Event) -> None:
        if board.begins(event):
            console.print(f"{event.name}: runs on worker {_where(event)}", markup=False)
        board.record(event)
        if event.row is not None:
            total = sum(board.count(state) for state in ("done", "running", "waiting"))
            again = ", as before" if event.again else ""
            line = f"{event.name}: {_summary(event.row)}{again} ({board.count('done')} of {total})"
            console.print(line, markup=False)

    yield print_event


def _where(event: Event) -> str:
    return f"{event.worker} (pid {event.pid})" if event.pid is not None else ""


def _summary(row: Row) -> str:
    if row.energy is None:
        return f"{row.status}: {row.message}"
    share = "saving not known" if row.saved is None else f"{100.0 * row.saved:.1f} % less than {row.baseline}"
    saved = f", {share}" if row.baseline else ""
    status = f"{row.status}: {row.message}" if row.message else str(row.status)
    return f"{status}, {row.energy:.0f} J{saved}"


def _coloured(row: Row) -> str:
    return str(row.status) if row.status == "fine" else f"[bold red]{row.status}[/]"


def _print_batch(done: Batch) -> None:
    # Names of a sweep differ at their ends, so they aren't cut; errors are too long for a column.
    out.print("energy of the feed drives (no base load), and the share saved against the baseline")
    rows = ((escape(row.name), _coloured(row), *_figures(row)) for row in done.rows)
    print_table((Column("job", overflow="fold"), "state", *FIGURES), rows)
    for row in done.rows:
        if row.message:
            out.print(f"{row.name}: {row.message}", markup=False, soft_wrap=True)
        for cause in row.summary:
            if cause["severity"] == Severity.ERROR:
                out.print(f"{row.name}: {cause['text']}", markup=False, soft_wrap=True)
    for comparison in done.comparisons:
        _print_comparison(comparison)
    states = {row.status: sum(other.status is row.status for other in done.rows) for row in done.rows}
    resumed = f"; {len(done.resumed)} as before" if done.resumed else ""
    out.print(", ".join(f"{count} {status}" for status, count in states.items()) + resumed)
    for path in (*done.files, *(path for c in done.comparisons for path in c.files)):
        print_written(path)


def _print_comparison(comparison: Comparison) -> None:
    from fiveaxis.job import format_value

    rows = []
    for row in comparison.rows:
        share = comparison.against_first(row)
        against = "" if share is None or row is comparison.rows[0] else f"{100.0 * share:+.1f} %"
        values = (escape(format_value(row.values[key])) for key in comparison.keys)
        rows.append((*values, _coloured(row), *_figures(row), against))
    out.print(f"\nsweep {escape(comparison.name)}")
    print_table((*map(escape, comparison.keys), "state", *FIGURES, "against the first"), rows)


def _figures(row: Row) -> tuple[str, ...]:
    """Return the cells below `FIGURES`."""
    energy = "" if row.energy is None else f"{row.energy:.0f}"
    share = "not known" if row.saved is None else f"{100.0 * row.saved:.1f} % of {row.baseline}"
    saved = share if row.baseline else ""
    counts = ("" if count is None else str(count) for count in (row.starts, row.reversals))
    return energy, saved, "" if row.time is None else f"{row.time:.1f}", *counts


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
            from fiveaxis.job import compare as run

            names = [name.strip() for name in machines.split(",") if name.strip()]
            limits: Any = {"scheduler": scheduler, "workers": workers, "job_timeout": job_timeout}
            how: Any = {**limits, **read_flags(Costs, context.params)}
            done = run(job, names, output, as_placed=as_placed, tell=listener, **how)
        written += (*done.files, *done.batch.files, *(p for c in done.batch.comparisons for p in c.files))
        if as_json:
            print_json(done.as_dict())
        else:
            _print_machines(done)
            for path in written:
                print_written(path)
        if done.exit_code:
            raise typer.Exit(done.exit_code)


def _print_machines(done: MachineComparison) -> None:
    from fiveaxis.job import HEADS, cells

    rows = [cells(candidate) for candidate in done.candidates]
    # What no machine has would only make the others narrow.
    shown = [k for k in range(len(HEADS)) if any(row[k] for row in rows)]
    heads = (Column(HEADS[k].lstrip("#"), justify="right" if HEADS[k][0] == "#" else "left") for k in shown)
    out.print("energy of the feed drives (J) with its range; travel of the axes and margin in mm and deg")
    print_table(heads, ((escape(row[k]) for k in shown) for row in rows))
    for candidate in done.candidates:
        if candidate.row.message:
            out.print(f"{candidate.machine}: {candidate.row.message}", markup=False, soft_wrap=True)
    for claim in done.claims:
        out.print(claim, markup=False, soft_wrap=True)
