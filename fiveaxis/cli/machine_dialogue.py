"""The dialogue of `fiveaxis machine new`: the questions that no option has answered, one line each."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from fiveaxis.cli.terminal import alarm
from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from fiveaxis.machine import Machine
    from fiveaxis.machine.answers import Question

Answers = dict[tuple[str, str], str]
Check = Callable[[str], object]
ROTARY = "ABC"
FIRST = ("name", "structure")
UNKNOWN = "?"
INTRODUCTION = (
    f"Enter takes what stands in brackets; {UNKNOWN} leaves a figure out, which the file then says. "
    "Ctrl-C ends without a file."
)


def ask(given: Answers, base: Machine | None, name: str, checks: Mapping[str, Check]) -> Answers:
    """Ask in the terminal for what isn't answered yet.

    Parameters
    ----------
    given : answers of the options
    base : machine read from a file, whose figures aren't asked for again
    name : of the machine, where no other is stated
    checks : of answers, by question; each raises what is wrong with one

    Returns
    -------
    All answers. A wrong one is explained and asked for again.

    Raises
    ------
    SettingError
        The input ends before the last question.
    """
    from fiveaxis.machine.answers import QUESTIONS
    from fiveaxis.machine.drafting import draft_machine

    alarm.print(INTRODUCTION, markup=False)
    answers = dict(given)
    for question in QUESTIONS:
        # The first two, name and structure, are answered before there is a machine.
        machine = None if question.name in FIRST else draft_machine(answers, base).machine
        if question.name == "points" and machine is not None:
            _print_pivots(machine)
        for letter in question.axes or ("",):
            if (question.name, letter) in answers or not _is_needed(question, letter, answers, machine, base):
                continue
            default = name if question.name == "name" else _default(question, letter, answers, machine)
            _ask(question, letter, answers, base, default, checks.get(question.name))
    return answers


def _ask(
    question: Question,
    letter: str,
    answers: Answers,
    base: Machine | None,
    default: str,
    check: Check | None,
) -> None:
    """Ask one question until its answer fits all others; keep the answer, if there is one."""
    from fiveaxis.machine.answers import KINDS
    from fiveaxis.machine.drafting import draft_machine

    if question.name == "structure":
        for kind, meaning in KINDS.items():
            alarm.print(f"  {kind} ({meaning.code}): {meaning.text}", markup=False)
    of = f"{letter}: " if letter else ""
    while True:
        asked = f"{of}{question.text} ({question.form_of(letter)}) [{default or UNKNOWN}]: "
        alarm.print(asked, end="", markup=False)
        # A terminal may send bytes that are no text.
        line = sys.stdin.buffer.readline().decode("utf-8", errors="replace")
        if not line:
            raise SettingError(f"the input ended at {of}{question.text}; nothing was written")
        answer = line.strip() or default
        try:
            if answer in ("", UNKNOWN) and question.name != "structure":
                return
            question.table(letter, answer)
            if check is not None:
                check(answer)
            if question.name not in FIRST:
                draft_machine({**answers, (question.name, letter): answer}, base)
        except SettingError as fault:
            alarm.print(f"  {fault}", markup=False)
            continue
        answers[question.name, letter] = answer
        return


def _is_needed(
    question: Question, letter: str, answers: Answers, machine: Machine | None, base: Machine | None
) -> bool:
    """Tell whether a question is asked: of an axis that is there, about a figure that nothing states yet."""
    if machine is None:
        return question.name == "name" or base is None
    if letter and letter not in machine.letters:
        return False
    stated = set() if base is None else {p.figure for p in base.provenance}
    if question.name == "counts":
        return base is None
    if question.name in ("masses", "motors"):
        return not {f"{letter} {key}" for key in ("moved_mass", "motor", "drive")} & stated and not (
            question.name == "motors" and ("masses", letter) in answers
        )
    if question.name == "size" and any(not a.is_rotary and not a.limits.unlimited for a in machine.axes):
        return False
    return f"{letter} {question.key}".strip() not in stated


def _default(question: Question, letter: str, answers: Answers, machine: Machine | None) -> str:
    """Return the answer that Enter gives; empty where there is none."""
    if question.name == "vertical":
        return "Z"
    if machine is not None and question.name in ("points", "spindle") and _is_zero(letter, machine):
        return "0,0,0"
    if not question.again:
        return ""
    like = [c for c in question.axes if (c in ROTARY) is (letter in ROTARY) and c < letter]
    return next((answers[question.name, c] for c in reversed(like) if (question.name, c) in answers), "")


def _is_zero(letter: str, machine: Machine) -> bool:
    """Tell whether zero is chosen on an axis's line, or at the gauge point (no letter)."""
    table = [c for c in machine.code.table if c in ROTARY]
    return letter == (table[0] if table else "")


def _print_pivots(machine: Machine) -> None:
    """Show which dimensions the next answers state."""
    from fiveaxis.machine.measuring import dimensions, draw, zero_of

    missing = dimensions(machine)
    if missing:
        alarm.print(f"Zero of the machine frame is {zero_of(machine)}, every axis at 0.", markup=False)
        for line in [*draw(machine).splitlines(), *map(str, missing)]:
            alarm.print(f"  {line}", markup=False)
