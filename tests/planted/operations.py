"""Faults of a second operation among the cuts: for some cuts another tool, offset, plane, spindle or coolant.

Further on all is as it was, so that neither the begin nor the end of the program shows it.
"""

from collections.abc import Callable, Iterator

import numpy as np

from planted.fault import Fault, Plant, Subject
from planted.states import NEW, TILT
from planted.technology import LENGTH_ON, SENSE
from planted.words import Text

# The cuts between the two changes.
CUTS = 6
ISO = ("fanuc", "haas", "linuxcnc", "linuxcnc-switchkins")
# Lines that change something, and those that undo it.
Change = tuple[tuple[str, ...], tuple[str, ...]]


def preset(number: int) -> tuple[str, ...]:
    """Return the lines that select a preset in Klartext."""
    return ("CYCL DEF 247 DATUM SETTING ~", f"    Q339=+{number} ; DATUM NUMBER")


TOOLS: dict[str, Change] = {
    **dict.fromkeys(ISO, (("T6 M6",), ("T5 M6",))),
    "sinumerik": (("T6 D1 M6",), ("T5 D1 M6",)),
    **dict.fromkeys(NEW, (("TOOL CALL 6 Z S8000",), ("TOOL CALL 5 Z S8000",))),
}
OFFSETS: dict[str, Change] = {
    **dict.fromkeys(ISO, (("G54",), ("G55",))),
    "sinumerik": (("G54",), ("G505",)),
    **dict.fromkeys(NEW, (preset(4), preset(3))),
}
LEVEL = {
    "fanuc": ("G69",),
    "haas": ("G269",),
    "sinumerik": ("CYCLE800()",),
    **dict.fromkeys(NEW, ("PLANE RESET STAY",)),
}
PLANES: dict[str, Change] = {control: (words, LEVEL[control]) for control, words in TILT.items()}
SPEEDS: dict[str, Change] = {
    **dict.fromkeys((*ISO, "sinumerik"), (("S800",), ("S8000",))),
    **dict.fromkeys(NEW, (("TOOL CALL S800",), ("TOOL CALL S8000",))),
}
COOLANT: dict[str, Change] = {
    **dict.fromkeys((*ISO, "sinumerik"), (("M9",), ("M8",))),
    **dict.fromkeys(NEW, (("L M9",), ("L M8",))),
}


def listed(changes: dict[str, Change]) -> Callable[[Subject], list[Change]]:
    """Return what gives a control's change."""
    return lambda subject: [changes[subject.control]] if subject.control in changes else []


def spindle(subject: Subject) -> list[Change]:
    """The spindle stands, or turns the other way."""
    lines = subject.text.find(SENSE, 0, subject.cutting[0])
    if not lines:
        return []
    own = SENSE.findall(subject.text.lines[lines[0]])[0]
    other = "M4" if own == "M3" else "M3"
    words = "L {}" if subject.is_klartext else "{}"
    return [((words.format(word),), (words.format(own),)) for word in ("M5", other)]


def length(subject: Subject) -> list[Change]:
    """Another length offset is in force, or, in Klartext, a tool longer by 2 mm."""
    if subject.is_klartext:
        return [(("TOOL CALL 5 Z S8000 DL+2",), ("TOOL CALL 5 Z S8000",))]
    if subject.control == "sinumerik":
        return [(("D2",), ("D1",))]
    on = subject.text.find(LENGTH_ON, 0, subject.cutting[0])
    if not on:
        return []
    found = LENGTH_ON.search(subject.text.lines[on[0]])
    assert found is not None
    return [((f"{found[0].split()[0]} H8",), (found[0].strip(),))]


def for_some_cuts(changes: Callable[[Subject], list[Change]]) -> Plant:
    """Put each change into the middle of the cuts, and what undoes it some cuts later."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        text, begin = subject.text, subject.middle
        end = subject.cutting[subject.cutting.index(begin) + CUTS]
        for on, back in [] if subject.is_list else changes(subject):
            yield text.inserted(end, *back).inserted(begin, *on)

    return plant


# Always: the job names tool, length, offset, spindle and coolant, and a plane turns the path. Without coolant
# a tool's edge is lost, so a warning tells it.
FAULTS = (
    Fault("tool, some cuts", "operations", for_some_cuts(listed(TOOLS))),
    Fault("offset, some cuts", "operations", for_some_cuts(listed(OFFSETS))),
    Fault("plane, some cuts", "operations", for_some_cuts(listed(PLANES))),
    Fault("speed, some cuts", "operations", for_some_cuts(listed(SPEEDS))),
    Fault("spindle, some cuts", "operations", for_some_cuts(spindle)),
    Fault("length, some cuts", "operations", for_some_cuts(length)),
    Fault("coolant, some cuts", "operations", for_some_cuts(listed(COOLANT)), warned=True),
)
