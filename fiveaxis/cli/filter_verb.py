"""The command that LinuxCNC runs on a program before it loads it, as `[FILTER]` of a machine's INI says."""

from __future__ import annotations

import os
import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.base import Meshes, Meter, Progress, ProgressReport, SettingError
from fiveaxis.cli.help import HELP
from fiveaxis.cli.options import NOT_GIVEN, PLANNING, POSTURE, READING, flags_of, takes
from fiveaxis.cli.path_verbs import job_of
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import err, errors_explained
from fiveaxis.cli.work import shown_work

if TYPE_CHECKING:
    from fiveaxis.job import RevisedProgram
    from fiveaxis.nc import Source

# The environment's name for the INI file of the machine that runs.
INI = "INI_FILE_NAME"
# Options in a comment of either style, among the first lines of a program.
OPTIONS, HEAD = re.compile(r"[(;]\s*fiveaxis:([^()]*)", re.IGNORECASE), 100
# Of wrong options. Since typer keeps click to itself, only a child of it has a public name.
UsageError: type[Exception] = typer.BadParameter.__mro__[1]


@takes({"tool": PLANNING["tool"]}, POSTURE, flags_of(Meshes), READING)
def filter_program(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="program for LinuxCNC", metavar="PROGRAM")],
    **_: Any,
) -> None:
    """Print a program with better postures, else as it is: for [FILTER] of a LinuxCNC INI.

    A comment of the program may have options, too: (fiveaxis: --tool ball:6). The machine is the one that
    runs, INI_FILE_NAME, by default.
    """
    with errors_explained(False):
        from fiveaxis.job import operations_of, revise_operations, revises
        from fiveaxis.nc import load_source

        program = load_source(source)
        line, stated = _stated_options(context, source, program)
        options = {"machine": os.environ.get(INI)} | {
            name: value
            for each in (context.params, stated)
            for name, value in each.items()
            if value not in NOT_GIVEN
        }
        if options["machine"] is None:
            raise SettingError(f"--machine is missing, and so is {INI}, which LinuxCNC sets")
        job = job_of(options)
        if not revises(job):
            raise SettingError(
                "new postures can't go into its own lines: it is no program for this control, or --setup or "
                "--written-for is given; use `fiveaxis optimise`",
                file=source,
            )
        if not any(each.kind in ("simultaneous", "unread") for each in operations_of(job)):
            err.print("no operation turns the tool while it cuts")
            return write_results(program.data)
        with shown_work(err, hidden=True) as work:
            made = work.run(lambda progress: revise_operations(job, on_the_bar(progress)))
        for outcome in made.outcomes.values():
            outcome.gate.require_open()
        told = _what_became(made)
        for text in told:
            err.print(text, markup=False)
        write_results(_commented(made, line, told) if made.outcomes else program.data)


def _stated_options(
    context: typer.Context, source: Path, program: Source
) -> tuple[int | None, dict[str, Any]]:
    """Return the line of a program's comment with options, from 1, and what they say; None and {} without."""
    found = ((n, OPTIONS.search(text)) for n, text in enumerate(program.lines[:HEAD], start=1))
    line, comment = next(((n, match[1]) for n, match in found if match), (None, ""))
    try:
        words = shlex.split(comment)
        if any(f"--{name.replace('_', '-')}" in words for name in HELP):
            raise ValueError("help isn't for a comment")
        # The command's own options, so that they mean what they do there.
        again = context.command.make_context(context.info_name, [*words, "--", str(source)])
    except (ValueError, UsageError) as fault:
        said = getattr(fault, "format_message", fault.__str__)()
        raise SettingError(f"options in the comment: {said}", file=source, line=line) from None
    return line, again.params


def on_the_bar(progress: Progress) -> Progress:
    """Return a progress that also writes to stderr what LinuxCNC's bar reads, ``FILTER_PROGRESS=n``."""
    shown = -1

    def show(report: ProgressReport) -> None:
        nonlocal shown
        percent = int(100.0 * (report.share or 0.0))
        # One line for each number: LinuxCNC reads one every 0.1 s, and a full pipe would stop the work.
        if percent > shown and not err.quiet:
            shown = percent
            sys.stderr.write(f"FILTER_PROGRESS={percent}\n")
            sys.stderr.flush()

    meter = Meter(show)

    def step(stage: str, done: int, total: int) -> None:
        progress(stage, done, total)
        meter(stage, done, total)

    return step


def _what_became(made: RevisedProgram) -> list[str]:
    """Say of each operation what it gained, and how well that is verified, or why it stays."""
    told = []
    for part in made.parts:
        name = f"operation {part.operation.number}"
        if part.outcome is None:
            told.append(f"{name} stays: {part.why}")
            continue
        gained = part.verdict if part.outcome.chosen is None else part.outcome.chosen.comparison
        told.append(f"{name}, postures by fiveaxis: {gained}")
        told.append(f"{name}, safe to run? {part.outcome.report.answers.safe.text}")
    return told


def _commented(made: RevisedProgram, line: int | None, texts: list[str]) -> bytes:
    """Return the new program with comments after its line of options; else at its head, but after a ``%``."""
    from fiveaxis.nc import comment_lines, control_for, find_dialect, with_lines

    machine = next(iter(made.outcomes.values())).program.machine
    form = find_dialect(control_for(machine)).comment
    comments = [comment for text in texts for comment in comment_lines(text, form)]
    lines = made.source.lines
    at = line or next(n for n, text in enumerate(lines, start=1) if text.strip())
    own = made.replaced.get(at, (lines[at - 1],))
    after = line is not None or own[0].lstrip().startswith("%")
    return with_lines(made.source, {**made.replaced, at: (*own, *comments) if after else (*comments, *own)})
