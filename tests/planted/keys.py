"""Faults by the keys of the controls' tables: lines that are right only if the control had another rule."""

import math
import re
from collections.abc import Iterator

import numpy as np

from fiveaxis.nc.writing.tables import DIALECTS
from planted.between import LINUXCNC, each, in_cut
from planted.fault import Fault, Subject
from planted.states import ISO, TCP
from planted.technology import CHANGE, SENSE, WORK_OFFSET
from planted.words import IN_MACHINE, Text

BY_BRACKETS = ("fanuc", "haas", *LINUXCNC)
# A comment that goes on to the last bracket, or ends at the first one: then words that move follow.
NESTED = dict.fromkeys(BY_BRACKETS, ("(G1 X11. (OLD) Z-20.)",))
# What ends the text of a tape, with cuts behind it.
PERCENT = dict.fromkeys(BY_BRACKETS, ("%",))
# Comments on which the control acts, and signs that end its text or a line.
ACTING = {
    **dict.fromkeys(LINUXCNC, ("(ABORT,WORN)", "(PY,OTHER)")),
    **dict.fromkeys(("fanuc", "haas"), ("(50% F)",)),
}
# s, in the control's own number of them.
DWELL = {
    **dict.fromkeys(LINUXCNC, ("G4 P20",)),
    **dict.fromkeys(("fanuc", "haas"), ("G4 P20000",)),
    "sinumerik": ("G4 F20",),
}
# G94 again, behind which F has to be written anew.
CLEARED = dict.fromkeys(LINUXCNC, ("G94",))
END = re.compile(r"\bM(?:2|30)\b")
SUBPROGRAM = {**dict.fromkeys(BY_BRACKETS, "M99"), "sinumerik": "M17"}
MANY = 20


def skipped(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Lines without which the program does otherwise have the mark of block delete."""
    text = subject.text
    if subject.is_list:
        return
    heads = [text.find(pattern)[:1] for pattern in (SENSE, CHANGE, WORK_OFFSET, TCP, IN_MACHINE)]
    cuts = [line for line in text.moves if line >= subject.middle][:MANY]
    for lines in (*heads, cuts):
        # A block of Klartext may begin on the line before.
        begins = [line - text.lines[line].startswith(" ") for line in lines]
        if begins:
            yield text.rewritten(_deleted, begins)


def _deleted(line: str) -> str:
    """Put the mark before a line, behind its number in Klartext."""
    return re.sub(r"^(\d+ |)", r"\1/ " if line[0].isdigit() else "/", line, count=1)


def other_end(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The word that ends the program is lost, or one that ends subprograms stands in its place."""
    text = subject.text
    if subject.control in ISO:
        for line in text.find(END, text.moves[-1])[:1]:
            yield text.replaced(line)
            yield text.replaced(line, SUBPROGRAM[subject.control])


def too_long(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """A cut stands on a line that is longer than the control reads."""
    if not subject.is_list:
        longest = DIALECTS[subject.control].longest
        yield subject.text.rewritten(lambda was: was.replace(" ", " " * longest, 1), [subject.middle])


def pointless(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The height above the first location is rounded up, and its word has no decimal point."""
    text = subject.text
    if subject.control in ("fanuc", "haas"):
        height = re.compile(r"(?<= Z)-?[0-9]+[.][0-9]+")
        for line in [line for line in text.approach if height.search(text.lines[line])][:1]:
            yield text.rewritten(lambda was: height.sub(lambda m: f"{math.ceil(float(m[0]))}", was), [line])


# Always: the control stops in a cut, moves otherwise, or leaves out what keeps tool and part apart. A warning
# is enough outside of cuts, where a switch that nobody knows of decides, and where surface or time is lost.
FAULTS = (
    Fault("comment in comment", "rules", each(NESTED), warned=True),
    Fault("% in cut", "rules", in_cut(PERCENT)),
    Fault("comment that acts", "rules", in_cut(ACTING), warned=True),
    Fault("dwell in cut", "rules", in_cut(DWELL), warned=True),
    Fault("block delete", "rules", skipped, warned=True),
    Fault("other end", "rules", other_end, warned=True),
    Fault("line too long", "rules", too_long, warned=True),
    Fault("no decimal point", "rules", pointless, warned=True),
)
