"""The command that writes a machine file from answers: of options, or of a dialogue in a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from fiveaxis.cli.options import optional, takes
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import err, errors_explained, print_written
from fiveaxis.errors import SettingError
from fiveaxis.files import require_suffix
from fiveaxis.findings import Finding, Severity

KIND = (
    "trunnion-ac, trunnion-bc, nutating-table, table-head, nutating-head, head-head-ac, head-head-bc, 3-axis"
)
# Options by the name of their question; those of several axes name each.
ANSWERS: Mapping[str, Any] = {
    "name": optional(str, "name of the machine; default: that of the file"),
    "structure": optional(str, f"form-shaping code, or {KIND}"),
    "vertical": optional(str, "axis that is vertical: X, Y, Z; -Z if it counts downwards"),
    "limits": optional(str, "travels: X=-300:300,A=-120:30,C=endless; mm, deg"),
    "counts": optional(str, "what turns by the right-hand rule, seen from the other: A=table,C=tool"),
    "points": optional(str, "points on the lines of rotary axes: A=0,12.5,50,C=0,0,0; mm"),
    "spindle": optional(str, "gauge point with every axis at 0: X,Y,Z; mm"),
    "speeds": optional(str, "highest speeds: X=40,A=20; m/min, rpm"),
    "accelerations": optional(str, "highest accelerations: X=5,A=500; m/s2, deg/s2"),
    "masses": optional(str, "moved masses, without the part: X=800,Y=1200; kg"),
    "motors": optional(str, "nameplates: X=3.1,Y=8.5 A 400 V; kW"),
    "mass": optional(str, "mass of the whole machine: 8000 kg, 8 t"),
    "size": optional(str, "desktop, machining-centre or portal, where travels aren't known"),
    "base_power": optional(str, "power at standstill, W"),
    "control": optional(str, "its control (`fiveaxis controls`)"),
}

machine = typer.Typer(no_args_is_help=True, help="Describe a machine.")


@takes(ANSWERS)
def new(
    context: typer.Context,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="machine file (.toml) to write; default: stdout")
    ] = None,
    source: Annotated[
        Path | None, typer.Option("--from", help="file with figures: .ini, .urdf, .mch or .toml")
    ] = None,
    **_: Any,
) -> None:
    """Write a commented machine file: asks in a terminal for what no option states."""
    with errors_explained(False) as written:
        from fiveaxis.cli.machine_dialogue import ask
        from fiveaxis.files import write_atomically
        from fiveaxis.machine import check_text, draft_machine, load_machine
        from fiveaxis.machine.drafting import DEFAULT_NAME
        from fiveaxis.nc import find_dialect

        _require_new(output)
        answers = _answers(context.params)
        base = None if source is None else load_machine(source)
        name = base.name if base is not None else DEFAULT_NAME if output is None else output.stem
        if ("control", "") in answers:
            find_dialect(answers["control", ""])
        if sys.stdin.isatty():
            answers = ask(answers, base, name, {"control": find_dialect})
        answers.setdefault(("name", ""), name)
        draft = draft_machine(answers, base)
        _report(check_text(draft.text, output or Path("machine.toml")))
        if output is None:
            write_results(draft.text)
            return
        written.append(write_atomically(output, draft.text))
        print_written(output, f"see it with `fiveaxis info {output}`")


def _require_new(output: Path | None) -> None:
    """Raise before the dialogue if its file couldn't be written."""
    if output is None:
        return
    require_suffix(output, [".toml"], "a machine file")
    if os.path.lexists(output):  # not `Path.exists`, which raises for a name that is too long
        raise SettingError("exists already and isn't overwritten; name another file, or move it", file=output)
    if not output.absolute().parent.is_dir():
        raise SettingError("has no folder; make the folder first", file=output)


def _answers(options: Mapping[str, Any]) -> dict[tuple[str, str], str]:
    """Collect what the options answer."""
    from fiveaxis.machine.answers import BY_NAME, parse_axis_answers

    answers: dict[tuple[str, str], str] = {}
    for name, question in BY_NAME.items():
        text = options[name.replace("-", "_")]
        if text is not None:
            answers |= parse_axis_answers(name, text) if question.axes else {(name, ""): text.strip()}
    return answers


def _report(findings: tuple[Finding, ...]) -> None:
    """Print what the check found.

    Raises
    ------
    SettingError
        It found an error.
    """
    worst = next((f for f in findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        raise SettingError(f"{worst.message}; no file was written")
    for finding in findings:
        err.print(f"{finding.severity}: {finding.message}", markup=False)
