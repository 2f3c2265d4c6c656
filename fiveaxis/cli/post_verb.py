"""The commands that list the controls and write a motion or a program for one of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.base import Framing, Progress, SettingError, Writing, group_findings, require_new
from fiveaxis.cli.options import NC, WRITING, AsJson, read_flags, takes
from fiveaxis.cli.terminal import (
    alarm,
    err,
    errors_explained,
    out,
    print_causes,
    print_json,
    print_release,
    print_table,
    print_written,
)
from fiveaxis.cli.verify_verb import CHECKING, PathToFollow, load_checked, reading_of
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.base import Finding
    from fiveaxis.job import Posted


@takes()
def controls(as_json: AsJson = False) -> None:
    """List the controls that programs can be written for."""
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
        listed = (
            (name, dialect.title, dialect.suffix, ", ".join(dialect.modes), ", ".join(dialect.windings))
            for name, dialect in DIALECTS.items()
        )
        print_table(("control", "title", "file", "coordinates", "winding"), listed)
        out.print("others: --control MY.toml, a table with the differences to one of these (based_on)")


@takes(CHECKING, WRITING)
def post(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="motion.csv, a CL file, or an NC program in any language")],
    output: Annotated[Path, typer.Option("--output", "-o", help="file for the new program")],
    path: PathToFollow = None,
    unverified: Annotated[
        bool, typer.Option("--unverified", help="exit code 0 without anything to verify the program against")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an existing program")] = False,
    as_json: AsJson = False,
    **_: Any,
) -> None:
    """Write a motion, or a program of another control, for a control, and verify the new program.

    It is verified against --path, --tool and --part, a CL file also against its own path. Without any of them
    its header says NOT VERIFIED, and the exit code is 1 unless --unverified is given.
    """
    with errors_explained(as_json) as written:
        options = context.params
        writing = read_flags(Writing, options)
        if not overwrite:
            require_new(output, "name another file, or give --overwrite")

        def work(step: Progress) -> tuple[Posted, tuple[Finding, ...]]:
            step("reading part and path", 0, 1)
            machine, against, told = load_checked(path, options)
            if "control" not in writing and not machine.control:
                raise SettingError(
                    "--control is missing; give a name (`fiveaxis controls`) or a control table, here or in "
                    "the machine's file (control)"
                )
            step("writing and verifying the program", 0, 1)
            posted = post_program(
                source,
                machine,
                output=output,
                against=against,
                settings=ProgramSettings(**read_flags(Framing, options, NC)),
                unverified=True,
                **writing,
                **vars(reading_of(options)),
            )
            return posted, told

        with shown_work(err, hidden=as_json) as shown:
            from fiveaxis.job import post_program
            from fiveaxis.nc import ProgramSettings

            posted, told = shown.run(work)
        written.append(output)
        made = posted.made
        if as_json:
            print_json(_document(posted, output))
        print_causes(
            group_findings((*told, *posted.findings, *made.report.findings), made.report.counts), err
        )
        print_written(output, f"{len(made.text.lines)} lines for {made.text.control}", made.text.coordinates)
        print_release(made.gate)
        if made.gate.kept:
            raise typer.Exit(1)
        if not made.gate.verified:
            alarm.print(
                "[bold red]NOT VERIFIED[/]: there is nothing to verify the program against; give --path, "
                "--tool and --part, or --unverified"
            )
            raise typer.Exit(0 if unverified else 1)


def _document(posted: Posted, output: Path) -> dict[str, Any]:
    text, report = posted.made.text, posted.made.report
    return {
        "program": str(output),
        "control": text.control,
        "coordinates": text.coordinates,
        "locations": len(posted.motion),
        "lines": len(text.lines),
        "dropped": text.dropped,
        "verified": posted.made.gate.verified,
        "verification": report.as_dict(),
        "summary": [cause.as_dict() for cause in group_findings(posted.findings)],
        "findings": [finding.as_dict() for finding in posted.findings],
    }
