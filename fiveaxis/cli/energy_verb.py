"""The command that computes the energy of NC programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from fiveaxis.base import OnMachine, Progress
from fiveaxis.cli.options import ON_MACHINE, PLACING, AsJson, read_flags, takes
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    load_powered,
    out,
    print_budget,
    print_causes,
    print_json,
    print_table,
    print_written,
    require_machine,
)
from fiveaxis.cli.verify_verb import PROGRAM, operations_apart, reading_of, set_up
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.lab import ProgramEnergy
    from fiveaxis.model import Machine

# Blocks of the table on the terminal: to lay out a million would take half an hour.
MOST_SHOWN = 1000


@takes(ON_MACHINE, PLACING, PROGRAM)
def energy(
    context: typer.Context,
    programs: Annotated[
        list[Path], typer.Argument(help="NC programs, CL files or motion.csv", metavar="PROGRAM…")
    ],
    tool: Annotated[
        str | None,
        typer.Option("--tool", help="the feed is the speed of its centre; default: header, or tip"),
    ] = None,
    corners: Annotated[
        str,
        typer.Option(
            "--corners",
            help="times: of the control, programmed, or by a time law: exact-stop, tolerance in mm",
        ),
    ] = "control",
    control: Annotated[
        str | None, typer.Option("--control", help="whose times; default: the one that the header names")
    ] = None,
    process: Annotated[
        Path | None,
        typer.Option(
            "--process",
            help="TOML file of the cut, with the keys of a job's [process]: adds the energy of all consumers",
        ),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            *("--output", "-o"),
            help="table of the blocks (.csv), or figure of power over time and energy by axis "
            "(.svg, .html); repeatable",
        ),
    ] = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Compute the energy of programs in the feed drives, by block and by axis; several are compared.

    Time and energy of moves whose start or end isn't known are left out, with a finding.
    """
    with errors_explained(as_json) as written:
        with shown_work(err, hidden=as_json) as work:
            from fiveaxis.base import ToolpathError, require_file, require_suffix
            from fiveaxis.lab import Pricing, price_program
            from fiveaxis.model import parse_tool
            from fiveaxis.nc import load_source
            from fiveaxis.show import DRAWN_SUFFIXES

            for path in output or ():
                require_suffix(path, DRAWN_SUFFIXES, "a table or a figure")
            for path in programs:
                require_file(path, ToolpathError)
            used = _machine(context.params)
            given = reading_of(context.params)
            how: Any = {"corners": _corners(corners), "control": control, "process": process}
            how["tool"] = None if tool is None else parse_tool(tool)

            def compute(step: Progress) -> Iterator[ProgramEnergy]:
                for number, path in enumerate(programs):
                    for _, read in operations_apart(path, used, given):
                        step("computing the energy of programs", number, len(programs))
                        yield price_program(load_source(path), used, Pricing.of(read, **how))

            found = work.run(lambda step: list(compute(step)))
            for path in output or ():
                work.step("writing", 0, 1)
                written.append(_write(path, found))
        for path in written:
            print_written(path)
        for program in found:
            print_causes(program.summary, err, f"{_name(program, found)}: ")
        if as_json:
            return print_json(found[0].as_dict() if len(found) == 1 else [p.as_dict() for p in found])
        if len(found) == 1:
            _print_blocks(found[0])
        _print_totals(found)
        for program in found:
            if program.budget is not None:
                print_budget(program.budget, f"{_name(program, found)}: whole program")


def _write(path: Path, found: Sequence[ProgramEnergy]) -> Path:
    from fiveaxis.base import csv_text, write_atomically
    from fiveaxis.show import write_program_figure

    if path.suffix.lower() == ".csv":
        rows = [{"program": _name(p, found)} | row for p in found for row in p.rows]
        return write_atomically(path, csv_text([rows[0], *(row.values() for row in rows)]))
    return write_program_figure(
        path,
        # Folders would leave no room for the figure.
        [Path(p.motion.name).name for p in found],
        [p.energy for p in found],
        [p.motion.time for p in found],
        [p.by_block for p in found],
    )


def _machine(options: Mapping[str, Any]) -> Machine:
    name = require_machine(options["machine"])
    machine = load_powered(name, options["drives"], read_flags(OnMachine, options).get("assume"))
    load = options["load"]
    loaded = machine if load is None else machine.with_load(load, machine.load.centre)
    return set_up(loaded, options)


def _corners(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _print_blocks(program: ProgramEnergy) -> None:
    letters = program.machine.letters
    rows, shown = program.each_row(), []
    for row in islice(rows, MOST_SHOWN):
        joules = (f"{row[c]:.2f}" for c in letters)
        cells = (f"{row['time']:.3f}", f"{row['feed_mm_min']:.0f}", *joules, f"{row['energy']:.2f}")
        shown.append((str(row["line"]), escape(row["block"]), *cells))
    print_table(("line", "block", "s", "mm/min", *(f"{c} J" for c in letters), "J"), shown)
    if next(rows, None) is not None:
        out.print(f"the first {MOST_SHOWN} blocks are shown; -o FILE.csv and --json have all")


def _name(program: ProgramEnergy, found: Sequence[ProgramEnergy]) -> str:
    """Return the program's name, with the operation where several of one program are compared."""
    name, operation = program.motion.name, program.motion.operation
    several = sum(other.motion.name == name for other in found) > 1
    return f"{name}, operation {operation.number}" if several and operation is not None else name


def _print_totals(found: Sequence[ProgramEnergy]) -> None:
    """Print one line per program, with its difference to the first."""
    from fiveaxis.show import time_shares

    letters = found[0].machine.letters
    axes = (f"{c} J" for c in letters)
    totals = ("drives J", "base J", "with base J", "starts", "reversals", "against the first")
    rows: list[tuple[str, ...]] = []
    first = found[0].energy.total
    for program in found:
        spent = program.energy
        joules = (f"{spent.by_axis[c]:.2f}" for c in letters)
        base, total = (("unknown" if v is None else f"{v:.2f}") for v in (spent.base, spent.with_base))
        share = f"{100.0 * (spent.total / first - 1.0):+.1f} %" if program is not found[0] else ""
        own = (escape(_name(program, found)), f"{spent.time:.2f}", *joules, f"{spent.total:.2f}", base, total)
        rows.append((*own, str(spent.starts), str(spent.reversals), share))
    if len(found) > 1 and len({program.motion.name for program in found}) == 1:
        time, spent_in_all = sum(p.energy.time for p in found), sum(p.energy.total for p in found)
        rows.append(("all of these", f"{time:.2f}", *("" for _ in letters), f"{spent_in_all:.2f}"))
    print_table(("program", "s", *axes, *totals), rows)
    for program in found:
        error = program.energy.travel_error
        off = "" if error is None else f"; the travel metric is {round(100.0 * error, 1) + 0.0:+.1f} % off it"
        out.print(f"{escape(_name(program, found))}: power integral of the feed drives, no base power{off}")
        if program.energy.limited:
            out.print(f"limited by: {time_shares(program.energy.limited)}", soft_wrap=True)
        if program.energy.band is not None:
            out.print(program.energy.band, soft_wrap=True)
