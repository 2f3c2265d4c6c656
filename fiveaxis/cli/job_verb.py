"""The command that explains job files and writes a starter file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from fiveaxis.base import SettingError
from fiveaxis.cli.options import AsJson, takes
from fiveaxis.cli.terminal import err, errors_explained, print_json, print_table, print_written
from fiveaxis.cli.work import shown_work

STARTER = Path("job.toml")


@takes()
def job(
    file: Annotated[Path | None, typer.Argument(help=f"file that --init writes; default: {STARTER}")] = None,
    explain: Annotated[bool, typer.Option("--explain", help="explain every field of a job file")] = False,
    init: Annotated[bool, typer.Option("--init", help="write a job file with every field commented")] = False,
    as_json: AsJson = False,
) -> None:
    """Explain the fields of job files, or write a commented job file."""
    with errors_explained(as_json) as written:
        if explain == init:
            raise SettingError("give either --explain or --init [FILE]")
        if explain and file is not None:
            raise SettingError(f"{file} is for --init; --explain is about every job file")
        with shown_work(err, hidden=as_json):
            from fiveaxis.job import list_job_entries, write_starter
        if init:
            written.append(write_starter(file or STARTER))
            print_written(written[0], "fill in input, then run `fiveaxis optimise` on it")
            return print_json({"written": [str(path) for path in written]}) if as_json else None
        entries = list_job_entries()
        if as_json:
            return print_json([entry.as_dict() for entry in entries])
        rows = (
            (e.key, e.kind, e.unit, "required" if e.default is None else e.default, e.description)
            for e in entries
        )
        print_table(("field", "type", "unit", "default", "meaning"), (map(escape, row) for row in rows))
