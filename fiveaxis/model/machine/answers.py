"""What a machine's owner is asked about it.

The same questions stand behind the dialogue and the options of `fiveaxis machine new`: an answer is a text,
and the same texts give the same file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from pydantic import BaseModel

from fiveaxis.base import CodeError, SettingError
from fiveaxis.model.machine.axis_tables import EVERY, AxisTable
from fiveaxis.model.machine.chain import Triple
from fiveaxis.model.machine.code import parse_code
from fiveaxis.model.machine.figures import ROTARY, Question, Stage, Table, figure_models
from fiveaxis.model.machine.tables import MachineFile

# Question and axis letter (empty for the machine itself) -> text as it was written.
Answers = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Kind:
    """A common structure.

    Parameters
    ----------
    code : form-shaping code
    text : in words
    inclined : directions of axes that don't lie along their letter's, by letter
    """

    code: str
    text: str
    inclined: tuple[tuple[str, Triple], ...] = ()


KINDS = {
    "trunnion-ac": Kind("640123", "table-table, C in a trunnion A"),
    "trunnion-bc": Kind("650123", "table-table, C in a trunnion B"),
    "nutating-table": Kind("650123", "table-table, C on a B at 45 deg", (("B", (0.0, 1.0, -1.0)),)),
    "table-head": Kind("620135", "table-head, C in the table and a swivelling head B"),
    "nutating-head": Kind(
        "620135", "table-head, C in the table and a head B at 45 deg", (("B", (0.0, 1.0, 1.0)),)
    ),
    "head-head-ac": Kind("012364", "head-head, a fork C that carries A"),
    "head-head-bc": Kind("012365", "head-head, a fork C that carries B"),
    "3-axis": Kind("1203", "3-axis mill with a cross table"),
}


def parse_axis_answers(name: str, text: str) -> dict[tuple[str, str], str]:
    """Split an option's answers about several axes, ``X=-300:300,C=endless``, one for each letter."""
    found: dict[tuple[str, str], str] = {}
    for part in re.split(r",\s*(?=[A-Za-z]\s*=)", text):
        letter, equals, answer = part.partition("=")
        letter = letter.strip().upper()
        if not equals or len(letter) != 1 or letter not in EVERY or not answer.strip():
            raise SettingError(f"{name}: {part!r} isn't of the form AXIS=ANSWER, for example X=…,Y=…")
        if (name, letter) in found:
            raise SettingError(f"{name}: {letter} is named twice")
        found[name, letter] = answer.strip()
    return found


def read_structure(answer: str) -> tuple[str, Kind | None]:
    """Return the code of a kind or of a code, and the kind; `SettingError` if it is neither."""
    if answer in KINDS:
        return KINDS[answer].code, KINDS[answer]
    try:
        code = parse_code(answer)
    except CodeError as fault:
        known = ", ".join(KINDS)
        raise SettingError(f"{answer!r} is none of {known}; as a {fault.message}") from None
    lacking = [letter for letter in "XYZ" if letter not in code.letters]
    if lacking:
        raise SettingError(
            f"{answer!r} as a form-shaping code has no axis {' and no '.join(lacking)}; write a kind, or a "
            "code with X, Y and Z (1, 2, 3), for example 640123"
        )
    return code.text, None


def _answer_counts(letter: str, answer: str) -> Table:
    words = ("tool", "table")
    if answer not in words:
        raise SettingError(f"{answer!r} is neither tool nor table")
    return {"reversed": answer == "table"}


def _answer_text(letter: str, answer: str) -> Table:
    if not answer or not answer.isprintable():
        raise SettingError(f"{answer!r} isn't a name")
    return {"text": answer}


def _asked(tables: type[BaseModel], axes: str) -> list[Question]:
    """List the questions about the figures of an axis, or of the machine."""
    return [
        replace(question, key=key, axes=question.axes or axes)
        for key, models in figure_models(tables).items()
        for model in models
        for question in model.questions
    ]


# What is asked beside the figures.
OTHERS = (
    Question("name", Stage.STRUCTURE, "name of the machine", "text", answer=_answer_text),
    Question(
        "structure",
        Stage.STRUCTURE,
        "structure: a kind, or a form-shaping code",
        "KIND or CODE",
        ", ".join(KINDS),
        answer=lambda letter, answer: {"code": read_structure(answer)[0]},
    ),
    Question(
        "counts",
        Stage.TRAVEL,
        "what turns by the right-hand rule as its value grows, seen from the other",
        "tool or table",
        "A=table,C=tool",
        ROTARY,
        answer=_answer_counts,
    ),
    Question(
        "control",
        Stage.CONTROL,
        "control that programs are for, as `fiveaxis controls` lists them, or a control table",
        "name or FILE.toml",
        answer=_answer_text,
    ),
)
# In the order of the dialogue.
QUESTIONS = tuple(
    sorted((*_asked(AxisTable, EVERY), *_asked(MachineFile, ""), *OTHERS), key=lambda q: q.stage)
)
BY_NAME = {question.name: question for question in QUESTIONS}
