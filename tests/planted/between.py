"""Faults in words that no row of a program shows, between its cuts or before them: a list of our own.

They are machine moves, heights of retracts, data of the control, the spindle, and what a control makes of a
path.
"""

import re
from collections.abc import Iterator

import numpy as np

from planted.fault import Fault, Plant, Subject
from planted.states import put
from planted.technology import both
from planted.words import IN_MACHINE, Text

LINUXCNC, HEIDENHAIN = ("linuxcnc", "linuxcnc-switchkins"), ("heidenhain", "heidenhain-m128")

# Words by control, each variant by itself.
MACHINE_MOVES = {
    **dict.fromkeys(("fanuc", "haas", *LINUXCNC), ("G53 G0 X0. Y0.", "G28", "G28 X0. Y0.", "G30 Z0.")),
    "sinumerik": ("SUPA G0 X0 Y0", "G153 G0 X0 Y0", "G75 X1=0 Y1=0", "G74 Z1=0"),
    **dict.fromkeys(HEIDENHAIN, ("L X+0 Y+0 R0 FMAX M91", "L X+0 Y+0 R0 FMAX M92")),
}
DATA = {
    "fanuc": ("#5223=-5.", "G10 L10 P5 R5.", "G10 L11 P5 R5."),
    "haas": ("#5223=-5.", "G10 L10 P5 R5."),
    **dict.fromkeys(LINUXCNC, ("#5223=-5", "G10 L1 P5 Z5", "G10 L11 P5 Z5", "G10 L20 P1 Z5")),
    "sinumerik": ("$P_UIFR[1,Z,TR]=5",),
    **dict.fromkeys(HEIDENHAIN, ("FN 17: SYSWRITE ID210 NR1 IDX3 = +5",)),
}
SPINDLE = {
    **dict.fromkeys(("fanuc", "haas", *LINUXCNC), ("M19",)),
    "sinumerik": ("SPOS=0", "SPOSA=90", "SETMS(2)", "M70"),
    **dict.fromkeys(HEIDENHAIN, ("L M19",)),
}
# Corners rounded and path points left out by millimetres.
TOLERANCE = {
    "fanuc": ("G5.1 Q1", "G5 P10000"),
    "haas": ("G187 P1 E5.",),
    **dict.fromkeys(LINUXCNC, ("G64 P5", "G64")),
    "sinumerik": ("CTOL=5", "COMPCAD", "G641 ADIS=5", "CYCLE832(5,3,1)", "G64"),
    **dict.fromkeys(HEIDENHAIN, ("CYCL DEF 32.1 T5",)),
}
# Another transformation, or another way between two directions of the tool.
ORIENTATION = {
    "sinumerik": ("TRAORI(2)",),
    "heidenhain": ("FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS",),
}
OTHER_WAY = {"tip": "ORIVECT", "vector": "ORIAXES"}
SPEEDS = {
    "sinumerik": ("FGROUP(X)", "OVR=200", "LIMS=500", "ACC[X]=10", "FLIN"),
    **dict.fromkeys(("fanuc", *LINUXCNC), ("M49",)),
    **dict.fromkeys(HEIDENHAIN, ("L M116",)),
}


def each(words: dict[str, tuple[str, ...]]) -> Plant:
    """Put each of a control's lines by itself before the first move on the path, and between the cuts."""

    def plant(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
        for word in words.get(subject.control, ()):
            yield from put({subject.control: (word,)})(subject, rng)

    return plant


def in_cut(words: dict[str, tuple[str, ...]]) -> Plant:
    """Put each of a control's lines by itself between the cuts."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        for word in words.get(subject.control, ()):
            yield subject.text.inserted(subject.middle, word)

    return plant


def other_way(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Between two blocks the tool turns in a plane instead of with the axes, or the other way round."""
    if subject.control == "sinumerik" and subject.mode in OTHER_WAY:
        yield subject.text.inserted(subject.middle, OTHER_WAY[subject.mode])


def other_height(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """A retract goes to the negative of its height: a plunge at rapid."""
    for line in subject.text.find(IN_MACHINE):
        turned = re.sub(r"Z\+?(?=[1-9])", "Z-", subject.text.lines[line])
        if turned != subject.text.lines[line]:
            yield subject.text.replaced(line, turned)


# Always: the spindle crosses the part or plunges, the part is cut elsewhere, the tool breaks, or it leaves
# its path as far as the data of the control let it.
FAULTS = (
    Fault("machine move in cut", "approach", each(MACHINE_MOVES)),
    Fault("other retract height", "approach", other_height),
    Fault("data written", "offsets", each(DATA)),
    Fault("spindle positioned", "spindle", in_cut(SPINDLE)),
    Fault("path tolerance", "path", each(TOLERANCE)),
    Fault("other orientation", "path", both(each(ORIENTATION), other_way)),
    Fault("speeds and feed axes", "feed", in_cut(SPEEDS)),
)
