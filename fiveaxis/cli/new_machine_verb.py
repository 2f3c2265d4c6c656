"""The command that writes a machine file from answers: of options, or of a dialogue in a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from fiveaxis.base import Finding, SettingError, Severity, require_new, require_suffix, write_atomically
from fiveaxis.cli.options import optional, takes
from fiveaxis.cli.process import write_results
from fiveaxis.cli.terminal import alarm, err, errors_explained, print_written
from fiveaxis.model import (
    CONTROL_TABLE,
    DEFAULT_NAME,
    KINDS,
    QUESTIONS,
    ROTARY,
    Machine,
    Question,
    Stage,
    check_text,
    dimensions,
    draft_machine,
    draw,
    load_machine,
    parse_axis_answers,
    path_from,
    zero_of,
)
from fiveaxis.nc import find_dialect

Answers = dict[tuple[str, str], str]
Check = Callable[[str], object]
# What is wrong with an answer that the machine's own rules don't know.
CHECKS: Mapping[str, Check] = {"control": find_dialect}
UNKNOWN = "?"
INTRODUCTION = (
    f"Enter takes what stands in brackets; {UNKNOWN} leaves a figure out, which the file then says. "
    "Ctrl-C ends without a file."
)
# Options by the name of their question; those of several axes name each.
ANSWERS: Mapping[str, Any] = {
    q.name.replace("-", "_"): optional(str, f"by axis: {q.help}" if q.axes else q.help) for q in QUESTIONS
}


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
        _require_new(output)
        answers = _read_answers(context.params)
        base = None if source is None else load_machine(source)
        name = base.name if base is not None else DEFAULT_NAME if output is None else output.stem
        for question, check in CHECKS.items():
            if (question, "") in answers:
                check(answers[question, ""])
        if sys.stdin.isatty():
            answers = ask(answers, base, name)
        answers.setdefault(("name", ""), name)
        if (control := answers.get(("control", ""), "")).lower().endswith(CONTROL_TABLE):
            answers["control", ""] = path_from(None if output is None else output.parent, Path(control))
        draft = draft_machine(answers, base)
        _report(check_text(draft.text, output or Path("machine.toml")))
        if output is None:
            write_results(draft.text)
            return
        written.append(write_atomically(output, draft.text))
        print_written(output, f"see it with `fiveaxis info {output}`")


def ask(given: Answers, base: Machine | None, name: str) -> Answers:
    """Ask in the terminal for what isn't answered yet, one line each; explain wrong answers, and ask again.

    `SettingError` if the input ends before the last question. Figures of `base`, a machine read from a file,
    aren't asked for; `name` is the machine's, where no other is stated.
    """
    alarm.print(INTRODUCTION, markup=False)
    answers = dict(given)
    for question in QUESTIONS:
        # Name and structure are answered before there is a machine.
        machine = None if question.stage is Stage.STRUCTURE else draft_machine(answers, base).machine
        if question.name == "points" and machine is not None:
            _print_pivots(machine)
        for letter in question.axes or ("",):
            if (question.name, letter) in answers or not _is_needed(question, letter, machine, base):
                continue
            default = name if question.name == "name" else _default(question, letter, answers, machine)
            _ask(question, letter, answers, base, default)
    return answers


def _ask(question: Question, letter: str, answers: Answers, base: Machine | None, default: str) -> None:
    """Ask one question until its answer fits all others; keep the answer, if there is one."""
    if question.name == "structure":
        for kind, meaning in KINDS.items():
            alarm.print(f"  {kind} ({meaning.code}): {meaning.text}", markup=False)
    of = f"{letter}: " if letter else ""
    while True:
        # Without a structure there is no machine: nothing stands in for it.
        required = question.name == "structure"
        offer = "" if required else f" [{default or UNKNOWN}]"
        prompt = f"{of}{question.text} ({question.form_of(letter)}){offer}: "
        alarm.print(prompt, end="", markup=False)
        # A terminal may send bytes that are no text.
        line = sys.stdin.buffer.readline().decode("utf-8", errors="replace")
        if not line:
            raise SettingError(f"the input ended at {of}{question.text}; nothing was written")
        answer = line.strip() or default
        try:
            if answer in ("", UNKNOWN):
                if not required:
                    return
                raise SettingError("the structure can't be left out; write a kind of the list, or a code")
            question.table(letter, answer)
            if question.name in CHECKS:
                CHECKS[question.name](answer)
            if question.stage is not Stage.STRUCTURE:
                draft_machine({**answers, (question.name, letter): answer}, base)
        except SettingError as fault:
            alarm.print(f"  {fault}", markup=False)
            continue
        answers[question.name, letter] = answer
        return


def _is_needed(question: Question, letter: str, machine: Machine | None, base: Machine | None) -> bool:
    """Tell whether a question is asked: of an axis that is there, about a figure that nothing states yet."""
    if machine is None:
        return question.name == "name" or base is None
    if letter and letter not in machine.letters:
        return False
    if question.name == "counts":
        return base is None
    if question.name == "control":
        return base is None or not base.control
    if question.name == "size" and any(not a.is_rotary and not a.limits.unlimited for a in machine.axes):
        return False
    known = machine if question.instead else base
    stated = set() if known is None else {p.figure for p in known.provenance}
    return stated.isdisjoint(f"{letter} {key}".strip() for key in question.instead or (question.key,))


def _default(question: Question, letter: str, answers: Answers, machine: Machine | None) -> str:
    """Return the answer that Enter gives; empty where there is none."""
    if machine is not None and question.stage is Stage.PIVOTS and _is_zero(letter, machine):
        return "0,0,0"
    if not question.again:
        return question.default
    like = [c for c in question.axes if (c in ROTARY) is (letter in ROTARY) and c < letter]
    return next((answers[question.name, c] for c in reversed(like) if (question.name, c) in answers), "")


def _is_zero(letter: str, machine: Machine) -> bool:
    """Tell whether zero is chosen on an axis's line, or at the gauge point (no letter)."""
    table = [c for c in machine.code.table if c in ROTARY]
    return letter == (table[0] if table else "")


def _print_pivots(machine: Machine) -> None:
    missing = dimensions(machine)
    if missing:
        alarm.print(f"Zero of the machine frame is {zero_of(machine)}, every axis at 0.", markup=False)
        for line in [*draw(machine).splitlines(), *map(str, missing)]:
            alarm.print(f"  {line}", markup=False)


def _require_new(output: Path | None) -> None:
    """Raise before the dialogue if its file couldn't be written."""
    if output is None:
        return
    require_suffix(output, [".toml"], "a machine file")
    require_new(output)
    if not output.absolute().parent.is_dir():
        raise SettingError("has no folder; make the folder first", file=output)


def _read_answers(options: Mapping[str, Any]) -> Answers:
    answers: Answers = {}
    for question in QUESTIONS:
        name, text = question.name, options[question.name.replace("-", "_")]
        if text is not None:
            answers |= parse_axis_answers(name, text) if question.axes else {(name, ""): text.strip()}
    return answers


def _report(findings: tuple[Finding, ...]) -> None:
    worst = next((f for f in findings if f.severity is Severity.ERROR), None)
    if worst is not None:
        raise SettingError(f"{worst.message}; no file was written")
    for finding in findings:
        err.print(f"{finding.severity}: {finding.message}", markup=False)
