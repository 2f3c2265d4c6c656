"""The command line: each verb is one library call with the same option names.

What a verb answers goes to stdout, everything else (progress, warnings, errors) to stderr. Exit codes: 0
fine, 1 verification found an error, 2 wrong input or usage, 3 no feasible posture.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from fiveaxis.errors import FiveAxisError, Infeasible, SettingError

if TYPE_CHECKING:
    from fiveaxis.energy import PowerSurface
    from fiveaxis.job import Job, Outcome
    from fiveaxis.machine import Machine
    from fiveaxis.toolpath import Toolpath

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Choose the tool posture of a 5-axis path that costs the machine the least energy.",
)
# A pipe or a log has no width of its own; tables need more than the usual 80.
out = Console(width=None if sys.stdout.isatty() else 140, emoji=False)
err = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)

Input = Annotated[Path, typer.Argument(help="mesh (.stl .obj .ply .off), CSV, APT/CLSF, or a job .toml")]
MachineName = Annotated[
    str | None, typer.Option("--machine", "-m", help="name (`fiveaxis machines`) or .toml file")
]
ToolName = Annotated[str | None, typer.Option("--tool", help="ball:10 is a ball end mill of 10 mm diameter")]
Tilt = Annotated[str | None, typer.Option("--tilt", help="angle to the surface normal, MIN:MAX, deg")]
Cone = Annotated[float | None, typer.Option("--cone", help="angle to the programmed tool axis, deg")]
Feed = Annotated[float | None, typer.Option("--feed", help="mm/min, in place of the input's")]
Unit = Annotated[str | None, typer.Option("--unit", help="mm or inch, for an input that doesn't say")]
Part = Annotated[Path | None, typer.Option("--part", help="mesh for the gouge check and the preview")]
Drives = Annotated[str | None, typer.Option("--drives", help="take the axis powers of this machine")]
MaxTurn = Annotated[float | None, typer.Option("--max-turn", help="largest turn in a cutting move, deg")]
UpPenalty = Annotated[float | None, typer.Option("--up-penalty", help="extra price of moving up, J/mm")]
Control = Annotated[str | None, typer.Option("--control", help="NC dialect")]
Stepdown = Annotated[float | None, typer.Option("--stepdown", help="distance of passes in z, mm")]
Spacing = Annotated[float | None, typer.Option("--spacing", help="distance of contact points, mm")]
Overhang = Annotated[bool | None, typer.Option("--overhang/--all-walls", help="which walls to plan")]
Direction = Annotated[str | None, typer.Option("--direction", help="climb or conventional")]
AllowOpen = Annotated[bool | None, typer.Option("--allow-open", help="accept an open mesh")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")]


@app.command()
def machines(as_json: AsJson = False) -> None:
    """List the machines of the library."""
    from fiveaxis.machine import load_machine, machine_names

    with errors_explained(as_json):
        loaded = [load_machine(name) for name in machine_names()]
        if as_json:
            return _print_json([{"name": m.name, "code": str(m.code), "axes": m.letters} for m in loaded])
        table = Table("machine", "code", "axes", "powers", "description", box=None)
        for m in loaded:
            powers = "yes" if m.has_powers else "no"
            table.add_row(m.name, str(m.code), m.letters, powers, escape(m.description))
        out.print(table)


@app.command("import")
def import_machine(
    source: Annotated[Path, typer.Argument(help="LinuxCNC configuration (.ini)", metavar="MACHINE.ini")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="machine .toml; else stdout")] = None,
) -> None:
    """Turn a control's configuration into a machine file, to be kept and completed."""
    with errors_explained(False):
        from fiveaxis.machine import machine_text, read_linuxcnc, save_machine

        machine = read_linuxcnc(source)
        if output is None:
            sys.stdout.write(machine_text(machine))
        else:
            err.print(f"wrote {escape(str(save_machine(machine, output)))}")


@app.command()
def info(machine: Annotated[str, typer.Argument(help="name or .toml file")], as_json: AsJson = False) -> None:
    """Show a machine: chain, limits, and every figure with its source."""
    from fiveaxis.machine import load_machine

    with errors_explained(as_json):
        loaded = load_machine(machine)
        if as_json:
            return _print_json(_machine_document(loaded))
        _print_machine(loaded)


@app.command()
def plan(
    context: typer.Context,
    source: Input,
    tool: ToolName = None,
    stepdown: Stepdown = None,
    spacing: Spacing = None,
    overhang: Overhang = None,
    direction: Direction = None,
    feed: Feed = None,
    allow_open: AllowOpen = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="CSV file of the locations")] = None,
    as_json: AsJson = False,
) -> None:
    """Plan waterline passes on a mesh."""
    with errors_explained(as_json):
        from fiveaxis.job import is_mesh, load_job_toolpath
        from fiveaxis.nc import write_toolpath

        job = _job(context.params)
        if not is_mesh(job.input):
            raise SettingError("passes are planned on a mesh (.stl .obj .ply .off)", file=job.input)
        with progress_bars() as progress:
            toolpath = load_job_toolpath(job, progress)
        if output is not None:
            write_toolpath(toolpath, output)
        document = _toolpath_document(toolpath)
        if as_json:
            return _print_json(document)
        for name, value in document.items():
            out.print(f"{name}: {value}")


@app.command()
def optimise(
    context: typer.Context,
    source: Input,
    machine: MachineName = None,
    tool: ToolName = None,
    tilt: Tilt = None,
    cone: Cone = None,
    feed: Feed = None,
    unit: Unit = None,
    part: Part = None,
    drives: Drives = None,
    up_penalty: UpPenalty = None,
    max_turn: MaxTurn = None,
    control: Control = None,
    stepdown: Stepdown = None,
    spacing: Spacing = None,
    overhang: Overhang = None,
    direction: Direction = None,
    allow_open: AllowOpen = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="folder for the results")] = None,
    as_json: AsJson = False,
) -> None:
    """Choose the posture of every cutter location, verify it, and write motion, report, preview and NC."""
    with errors_explained(as_json):
        from fiveaxis.job import require_folder, write_outcome

        if output is not None:
            require_folder(output)
        outcome = _run(_job(context.params))
        for path in [] if output is None else write_outcome(outcome, output):
            err.print(f"wrote {escape(str(path))}")
        if as_json:
            _print_json(outcome.document)
        else:
            _print_outcome(outcome)
        if not outcome.ok:
            err.print("[bold red]verification found errors[/]: no NC program was written")
            raise typer.Exit(1)


# Unknown options pass as arguments, since a tip like -10,0,5 looks like one.
@app.command(context_settings={"ignore_unknown_options": True})
def surface(
    tip: Annotated[str, typer.Argument(help="where the tool tip is held: X,Y,Z in mm, workpiece frame")],
    machine: MachineName = None,
    drives: Drives = None,
    feed: Annotated[float, typer.Option("--feed", help="mm/min")] = 1000.0,
    step: Annotated[float, typer.Option("--step", help="grid of the rotary angles, deg")] = 10.0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="CSV file; stdout without it")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute the power surface S_W = S_WL + S_WR over the rotary angles at a cutter location."""
    with errors_explained(as_json):
        from fiveaxis.energy import power_surface
        from fiveaxis.files import write_atomically
        from fiveaxis.machine import load_machine

        place = _numbers(tip, 3, "X,Y,Z")
        _require_between("--feed", feed, 1e-3, 1e6, "mm/min")
        _require_between("--step", step, 0.1, 90.0, "deg")
        loaded = load_machine(_required(machine, "machine"))
        if drives is not None:
            loaded = loaded.with_drives_of(load_machine(drives))
        grid = tuple(_angles(loaded, letter, step) for letter in loaded.rotaries[:2])
        columns = _surface_columns(power_surface(loaded, place, feed, grid))
        if as_json:
            return _print_json(columns)
        lines = (",".join(f"{v:.6f}" for v in row) for row in zip(*columns.values(), strict=True))
        text = "\n".join([",".join(columns), *lines]) + "\n"
        if output is None:
            sys.stdout.write(text)
        else:
            write_atomically(output, text)


@app.command()
def preview(
    context: typer.Context,
    source: Input,
    machine: MachineName = None,
    tool: ToolName = None,
    tilt: Tilt = None,
    cone: Cone = None,
    feed: Feed = None,
    unit: Unit = None,
    part: Part = None,
    drives: Drives = None,
    up_penalty: UpPenalty = None,
    max_turn: MaxTurn = None,
    stepdown: Stepdown = None,
    spacing: Spacing = None,
    overhang: Overhang = None,
    direction: Direction = None,
    allow_open: AllowOpen = None,
    browser: Annotated[bool, typer.Option(help="open the page in a browser")] = True,
) -> None:
    """Optimise and show the result live, on this computer only, until Ctrl-C."""
    with errors_explained(False):
        from fiveaxis.job import part_of
        from fiveaxis.viewer import preview as show

        outcome = _run(_job(context.params))
        with show(outcome.solution, part=part_of(outcome.job), open_browser=browser) as viewer:
            out.print(f"preview at {viewer.url()} until Ctrl-C")
            viewer.wait()


def main() -> None:
    """Run the command line."""
    app()


@contextmanager
def errors_explained(as_json: bool) -> Iterator[None]:
    """Turn an error into one clear message on stderr, and its exit code."""
    try:
        yield
    except FiveAxisError as fault:
        findings = fault.findings if isinstance(fault, Infeasible) else ()
        err.print(f"[bold red]error:[/] {escape(str(fault))}")
        for finding in findings:
            err.print(f"  {finding}", markup=False)
        if as_json:
            _print_json({"error": str(fault), "findings": [f.as_dict() for f in findings]})
        raise typer.Exit(fault.exit_code) from None
    except KeyboardInterrupt:
        err.print("interrupted; nothing was written")
        raise typer.Exit(130) from None


@contextmanager
def progress_bars() -> Iterator[Any]:
    """Show one bar a stage on stderr; gives the callback (stage, steps done, steps in all)."""
    bars: dict[str, TaskID] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, disable=not err.is_terminal) as shown:

        def step(stage: str, done: int, total: int) -> None:
            if stage not in bars:
                bars[stage] = shown.add_task(stage, total=total)
            shown.update(bars[stage], completed=done, total=total)

        yield step


def _job(options: Mapping[str, Any]) -> Job:
    """Make the job of a verb's options; a job file's own settings give way to them."""
    from fiveaxis.job import Job, PlanTable, make_job, read_job

    settings = {name: value for name, value in options.items() if name in Job.model_fields}
    settings["plan"] = {name: value for name, value in options.items() if name in PlanTable.model_fields}
    if settings.get("tilt") is not None:
        settings["tilt"] = tuple(_numbers(settings["tilt"], 2, "MIN:MAX", ":"))
    source = options["source"]
    if source.suffix.lower() == ".toml":
        return read_job(source, **settings)
    return make_job(input=source, **settings | {"tool": _required(settings["tool"], "tool")})


def _run(job: Job) -> Outcome:
    from fiveaxis.job import run_job

    started = time.perf_counter()
    with progress_bars() as progress:
        outcome = run_job(job, progress)
    err.print(f"done in {time.perf_counter() - started:.1f} s")
    return outcome


def _required(value: str | None, name: str) -> str:
    if value is None:
        raise SettingError(f"--{name} is missing")
    return value


def _numbers(text: str, count: int, form: str, separator: str = ",") -> list[float]:
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise SettingError(f"{text!r} isn't of the form {form} ({count} numbers)")
    return values


def _require_between(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise SettingError(f"{name} is {value:g} {unit}; it must lie between {low:g} and {high:g} {unit}")


def _angles(machine: Machine, letter: str, step: float) -> Any:
    """Grid of a rotary axis over its range, one turn where it has no end; rad."""
    import numpy as np

    limits = machine.axis(letter).limits
    low, high = (limits.low, limits.high) if limits.high - limits.low < 2.0 * np.pi else (-np.pi, np.pi)
    return np.linspace(low, high, max(2, round(np.degrees(high - low) / step) + 1))


def _surface_columns(surface: PowerSurface) -> dict[str, list[float]]:
    """Lay a surface out as columns, one row per posture, the second angle fastest."""
    import numpy as np

    first, second = np.meshgrid(surface.first, surface.second, indexing="ij")
    parts = (np.degrees(first), np.degrees(second), surface.linear, surface.rotary, surface.total)
    names = (*(f"{c}_deg" for c in surface.letters), "S_WL_J", "S_WR_J", "S_W_J")
    return {name: part.ravel().tolist() for name, part in zip(names, parts, strict=True)}


def _print_json(document: Any) -> None:
    """Print a document; in ASCII, which every terminal and pipe can take."""
    sys.stdout.write(json.dumps(document, indent=2) + "\n")


def _machine_document(machine: Machine) -> dict[str, Any]:
    joints = [
        {"axis": j.letter, "direction": list(j.line.direction)}
        | ({"point": list(j.line.point)} if j.is_rotary else {})
        for j in machine.chain.joints
    ]
    figures = [
        {"figure": p.figure, "value": p.shown, "source": p.source or p.note, "assumed": p.assumed}
        for p in machine.provenance
    ]
    names = {"name": machine.name, "code": str(machine.code), "description": machine.description}
    axes = {"axes": machine.letters, "reversed": [a.letter for a in machine.axes if a.reversed]}
    return names | axes | {"chain": joints, "figures": figures}


def _print_machine(machine: Machine) -> None:
    out.print(f"[bold]{machine.name}[/]  {escape(machine.description)}")
    chain = " - ".join(["workpiece", *machine.code.table, "bed", *machine.code.head, "tool"])
    out.print(f"code {machine.code}: {chain}")
    table = Table("figure", "value", "source", box=None)
    for p in machine.provenance:
        table.add_row(p.figure, escape(p.shown), escape(p.origin))
    out.print(table)


def _toolpath_document(toolpath: Toolpath) -> dict[str, Any]:
    cuts = int(toolpath.cutting.sum())
    counts = {"locations": len(toolpath), "cutting": cuts, "links": len(toolpath) - cuts}
    length = round(float(toolpath.lengths.sum()), 3)
    return counts | {"length_mm": length, "left_out": dict(toolpath.ignored)}


def _print_outcome(outcome: Outcome) -> None:
    from fiveaxis.job import RESULT

    solution, program = outcome.solution, outcome.program
    savings = solution.savings()
    axes = (f"{c} J" for c in solution.machine.letters)
    table = Table("posture", "J", *axes, "s", "saved", "program J", "saved", box=None)
    rows = {RESULT: solution.energy} | solution.baselines
    for name, energy in rows.items():
        joules = (f"{joule:.0f}" for joule in energy.by_axis.values())
        saved = f"{100 * savings[name]:.1f} %" if name in savings else ""
        driven = program.energy[name].total
        share = 100.0 * (1.0 - program.energy[RESULT].total / driven) if driven else 0.0
        programs = f"{driven:.0f}", "" if name == RESULT else f"{share:.1f} %"
        table.add_row(name, f"{energy.total:.0f}", *joules, f"{energy.time:.1f}", saved, *programs)
    out.print(f"{len(solution.toolpath)} locations; travel metric of the feed drives (no base load)")
    out.print(table)
    out.print(f"program: {program.inserted} blocks inserted, so that the ball stays on its path without TCP")
    for name, reason in solution.missing.items():
        out.print(f"no baseline {name}: {escape(reason)}")
    for subject, verdict in {"finding": outcome.verdict, "finding in the program": program.verdict}.items():
        for code, count in verdict.counts.items():
            out.print(f"{subject} {code}: {count}")
    out.print("verification: " + ("no errors" if outcome.ok else "[bold red]errors[/]"))


if __name__ == "__main__":
    main()
