"""What a program asks of its control beyond the control's table: numbers, offsets, lines, acting comments."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.base import Finding, Severity
from fiveaxis.nc.languages.choice import KLARTEXT, bare_code, find_language
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.table_parts import Counted
from fiveaxis.nc.writing.tables import Dialect

Told = tuple[str, Severity, str]

_COUNTED: dict[str, Counted] = {"T": "tool_number", "S": "spindle_rpm", "H": "length_offset"}
# Other lines have nothing to look at.
_WORTH = re.compile("[TSHPtshp(;]")
_NUMBERS = re.compile(r"(?<![A-Z0-9_.\[#<$])([TSH]) *([0-9]+(?:\.[0-9]*)?)")
_TOOL_CALL = re.compile(r"(TOOL CALL|(?<![A-Z0-9])S) *([0-9]+(?:\.[0-9]*)?)")
# Work offsets beyond the first six, of Fanuc and Haas.
_OFFSET = re.compile(r"(?<![A-Z0-9])(G *54\.1|G *154) *P *([0-9]+)")
_COMMENT = re.compile(r"\(([^()]*)|;(.*)")


def beyond_table(source: Source, dialect: Dialect) -> Iterator[Finding]:
    """Report lines that the control refuses, or on whose comments it acts: the first of each kind."""
    told: set[str] = set()
    numbers = _TOOL_CALL if find_language(source) == KLARTEXT else _NUMBERS
    for line, text in enumerate(source.lines, start=1):
        if len(text) <= dialect.longest and not _WORTH.search(text):
            continue
        for kind, severity, message in _beyond(text, dialect, numbers):
            if kind not in told:
                told.add(kind)
                yield source.finding(severity, "beyond-control", message, line)


def _beyond(text: str, dialect: Dialect, numbers: re.Pattern[str]) -> Iterator[Told]:
    """Find what in a line the control doesn't take, by kind."""
    whose = dialect.short_title
    if len(text) > dialect.longest:
        what = f"{len(text)} characters, more than the {dialect.longest} of a line of {whose}; divide it"
        yield "line", Severity.WARNING, what
    for comment in _COMMENT.finditer(text):
        yield from _commented(comment[1] or comment[2] or "", dialect)
    code = bare_code(text.upper())
    for word, number in numbers.findall(code):
        most = dialect.most.get(_COUNTED[word[0]])
        if most is not None and float(number) > most:
            what = f"{word} {number} is above {most:g}, the most of {whose}; correct it"
            yield word, Severity.WARNING, what
    if (offset := _OFFSET.search(code)) and dialect.work_offsets:
        name = f"{offset[1].replace(' ', '')} P{offset[2]}"
        if not re.fullmatch(dialect.work_offsets, name):
            yield "offset", Severity.WARNING, f"{name} is no work offset of {whose}; correct it"


def _commented(comment: str, dialect: Dialect) -> Iterator[Told]:
    """Find what a comment does all the same."""
    whose, form = dialect.short_title, dialect.comment
    for sign in sorted(set(form.forbidden) & set(comment)):
        what = f"{sign} in a comment ends the text, or continues the line, on {whose}; leave it out"
        yield sign, Severity.WARNING, what
    word, comma, _ = comment.partition(",")
    does = form.active.get(word.strip().lower()) if comma else None
    if does == "stops":
        what = f"({comment.strip()}) isn't a comment: {whose} stops the program here; leave it out"
        yield "stops", Severity.ERROR, what
    elif does == "runs":
        what = f"({comment.strip()}) isn't a comment: {whose} runs it, and what it does isn't read"
        yield "runs", Severity.WARNING, what
