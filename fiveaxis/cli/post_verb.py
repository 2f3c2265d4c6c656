"""Verbs about controls: which there are, and a motion or a program written for one of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from fiveaxis.cli.options import (
    AsJson,
    BlockDelete,
    GougeTolerance,
    MachineName,
    Override,
    ProgramZero,
    Rapid,
    Start,
    ToolLength,
    ToolName,
    Unit,
    Winding,
    WorkOffset,
    Wrap,
    takes,
)
from fiveaxis.cli.terminal import (
    err,
    errors_explained,
    out,
    parse_numbers,
    parse_places,
    print_causes,
    print_json,
    required,
)
from fiveaxis.cli.verify_verb import path_and_tool
from fiveaxis.cli.work import work_aside
from fiveaxis.cli.writing_options import WRITING, coordinates_of, settings_of
from fiveaxis.findings import group_findings

if TYPE_CHECKING:
    from fiveaxis.machine import Machine
    from fiveaxis.nc.gate import Verdict

POSTING: Mapping[str, Any] = {
    "machine": MachineName,
    "gouge_tolerance": GougeTolerance,
    "winding": Winding,
    "unit": Unit,
    "program_zero": ProgramZero,
    "start": Start,
    "rapid": Rapid,
    "block_delete": BlockDelete,
    "wrap": Wrap,
    "tool_length": ToolLength,
    "work_offset": WorkOffset,
}


def controls(as_json: AsJson = False) -> None:
    """List the controls that programs are written for."""
    with errors_explained(as_json):
        from fiveaxis.nc import DIALECTS

        rows = {
            name: {
                "title": dialect.title,
                "suffix": dialect.suffix,
                "coordinates": list(dialect.modes),
                "windings": list(dialect.windings),
                "notes": {what: [*dialect.notes, *mode.notes] for what, mode in dialect.modes.items()},
            }
            for name, dialect in DIALECTS.items()
        }
        if as_json:
            return print_json(rows)
        table = Table("control", "what it is", "file", "coordinates", "winding", box=None)
        for name, dialect in DIALECTS.items():
            windings = ", ".join(dialect.windings)
            table.add_row(name, dialect.title, dialect.suffix, ", ".join(dialect.modes), windings)
        out.print(table)
        out.print("more: --control MY.toml, a table that says what differs from one of these (based_on)")


@takes(POSTING, WRITING)
def post(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="motion.csv, or a program of any language that is read")],
    control: Annotated[str, typer.Option("--control", "-c", help="`fiveaxis controls`, or a .toml file")],
    output: Annotated[Path, typer.Option("--output", "-o", help="the new program")],
    tool: ToolName = None,
    part: Annotated[Path | None, typer.Option("--part", help="mesh of the part: verified against it")] = None,
    path: Annotated[
        Path | None, typer.Option("--path", help="toolpath, or job .toml: verified against it")
    ] = None,
    override: Override = None,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Write a motion, or a program of another control, for a control.

    With --tool, --part or --path it is verified first, as by `verify`; else it says NOT VERIFIED.
    """
    with errors_explained(as_json) as written:
        from fiveaxis.job import post_program

        options = context.params
        machine = _machine(options)
        posted = post_program(
            source,
            machine,
            report=work_aside(lambda: _verdict(source, machine, options)),
            override=tuple(override or ()),
            control=control,
            output=output,
            coordinates=coordinates_of(options),
            winding=options["winding"] or "unwound",
            settings=settings_of(options),
            unit=options["unit"],
            rapid_mm_min=options["rapid"],
            block_delete=bool(options["block_delete"]),
            wrap=options["wrap"],
            start=parse_places("--start", options["start"]),
            program_zero=parse_places("--program-zero", options["program_zero"]),
        )
        written.append(output)
        program = posted.program
        document = {
            "program": str(output),
            "control": program.control,
            "coordinates": program.coordinates,
            "locations": len(posted.motion),
            "lines": len(program.lines),
            "dropped": program.dropped,
            "summary": [cause.as_dict() for cause in group_findings(posted.findings)],
            "findings": [finding.as_dict() for finding in posted.findings],
        }
        print_causes(group_findings(posted.findings), err)
        if as_json:
            return print_json(document)
        written_as = f"{len(program.lines)} lines for {program.control}, {program.coordinates}"
        out.print(f"wrote {escape(str(output))}: {written_as}", soft_wrap=True)


def _verdict(source: Path, machine: Machine, options: Mapping[str, Any]) -> Verdict | None:
    """Verify what is to be written, where something to hold it against is given."""
    if all(options[name] is None for name in ("tool", "part", "path")):
        return None
    from fiveaxis.job import verify_program

    gouge = options["gouge_tolerance"]
    return verify_program(
        source,
        machine,
        part=options["part"],
        **({} if gouge is None else {"gouge_tolerance": gouge}),
        **path_and_tool(options["path"], options, machine),
        unit=options["unit"],
        rapid_mm_min=options["rapid"],
        block_delete=bool(options["block_delete"]),
        wrap=options["wrap"],
        start=parse_places("--start", options["start"]),
        program_zero=parse_places("--program-zero", options["program_zero"]),
    )


def _machine(options: Mapping[str, Any]) -> Machine:
    from fiveaxis.machine import load_machine

    machine = load_machine(required(options["machine"], "machine"))
    if options["work_offset"] is not None:
        x, y, z = parse_numbers(options["work_offset"], 3, "X,Y,Z")
        machine = machine.with_setup((x, y, z))
    length = options["tool_length"]
    return machine if length is None else machine.with_tool_length(length)
