"""Faults in modal state: what turns, shifts or scales a program, put before its cuts or between them."""

import re
from collections.abc import Iterator

import numpy as np

from planted.fault import Fault, Plant, Subject
from planted.words import Text

# The word or the line that switches tool centre point control on, in all languages.
TCP = re.compile(r"(?:G43\.[45]|G234) H\d+ |^TRAORI$|^(?:\d+ )?(?:FUNCTION TCPM .*|L M128)$|^M428$")
# What switches it on and off.
TCP_WORDS = {
    "fanuc": ("G43.4 H7", "G49"),
    "haas": ("G234 H7", "G49"),
    "linuxcnc": ("M428", "M429"),
    "linuxcnc-switchkins": ("M428", "M429"),
    "sinumerik": ("TRAORI", "TRAFOOF"),
    "heidenhain": ("FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "FUNCTION RESET TCPM"),
    "heidenhain-m128": ("L M128", "L M129"),
}
ISO = ("fanuc", "haas", "linuxcnc", "linuxcnc-switchkins", "sinumerik")
NEW = {"heidenhain", "heidenhain-m128"}
ROTATION = {
    "fanuc": ("G68 X0. Y0. R30.",),
    "haas": ("G68 X0. Y0. R30.",),
    "linuxcnc": ("G10 L2 P0 R30",),
    "linuxcnc-switchkins": ("G10 L2 P0 R30",),
    "sinumerik": ("ROT Z30",),
    **dict.fromkeys(NEW, ("CYCL DEF 10.0 ROTATION", "CYCL DEF 10.1 ROT+30")),
}
TILT = {
    "fanuc": ("G68.2 X0. Y0. Z0. I0. J20. K0.", "G53.1"),
    "haas": ("G268 X0. Y0. Z0. I0. J20. K0.", "G253"),
    "sinumerik": ('CYCLE800(0,"",0,57,0,0,0,20,0,0,0,0,0,1)',),
    **dict.fromkeys(NEW, ("PLANE SPATIAL SPA+20 SPB+0 SPC+0 STAY",)),
}
SCALING = {
    "fanuc": ("G51 X0. Y0. Z0. P1100",),
    "haas": ("G51 X0. Y0. Z0. P1.1",),
    "sinumerik": ("SCALE X1.1 Y1.1 Z1.1",),
    **dict.fromkeys(NEW, ("CYCL DEF 11.0 SCALING", "CYCL DEF 11.1 SCL 1.1")),
}
MIRROR = {
    "fanuc": ("G51.1 X0.",),
    "haas": ("G101 X0.",),
    "sinumerik": ("MIRROR X0",),
    **dict.fromkeys(NEW, ("CYCL DEF 8.0 MIRROR IMAGE", "CYCL DEF 8.1 X")),
}
SHIFT = {
    "fanuc": ("G52 X0. Y0. Z5.",),
    "haas": ("G52 X0. Y0. Z5.",),
    "linuxcnc": ("G52 Z5",),
    "linuxcnc-switchkins": ("G52 Z5",),
    "sinumerik": ("TRANS Z5",),
    **dict.fromkeys(NEW, ("CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 Z+5")),
    "apt": ("TRANS/0,0,5",),
}
RENAMED = {
    "fanuc": ("G92 X0. Y0. Z0.",),
    "haas": ("G92 X0. Y0. Z0.",),
    "linuxcnc": ("G92 X0 Y0 Z0",),
    "linuxcnc-switchkins": ("G92 X0 Y0 Z0",),
    "sinumerik": ("ATRANS X5",),
    **dict.fromkeys(NEW, ("TRANS DATUM AXIS Z+5",)),
}
COMPENSATION = {
    **dict.fromkeys(ISO, ("G41 D5",)),
    "sinumerik": ("G41",),
}


def put(words: dict[str, tuple[str, ...]]) -> Plant:
    """Put lines before the first move on the path, and into the middle of the cuts."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        texts = words.get(subject.control, ())
        for line in (subject.text.moves[0], subject.middle) if texts else ():
            yield subject.text.inserted(line, *texts)

    return plant


def incremental(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Positions read as distances, from some line on; in Klartext those of one block."""
    text = subject.text
    if subject.control in ISO:
        yield text.inserted(subject.cutting[0], "G91")
        yield text.inserted(subject.middle, "G91")
    elif subject.is_klartext:
        yield text.rewritten(lambda was: re.sub(r" (?=[XYZ][+-])", " I", was), [subject.middle])


def compensated(subject: Subject, rng: np.random.Generator) -> Iterator[Text]:
    """The tool's radius is compensated, although the path is that of its tip."""
    yield from put(COMPENSATION)(subject, rng)
    if subject.is_klartext:
        moves = [line for line in subject.text.moves if line >= subject.middle]
        yield subject.text.rewritten(lambda was: re.sub(r" R0\b", " RL", was), moves)


def tcp_lost(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Tool centre point control isn't switched on."""
    for line in subject.text.find(TCP, 0, subject.cutting[0])[:1]:
        left = TCP.sub("", subject.text.lines[line]).strip()
        yield (subject.text.replaced(line, left) if left else subject.text.replaced(line)).numbered()


def tcp_switched(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """Tool centre point control goes off in a cut, or on in a program of axis positions."""
    if subject.control in TCP_WORDS:
        on, off = TCP_WORDS[subject.control]
        yield subject.text.inserted(subject.middle, on if subject.mode == "axes" else off)


def end_in_cut(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """The program ends before its last cut."""
    ends = {"linuxcnc": "M2", "linuxcnc-switchkins": "M2", "apt": "FINI"}
    if subject.control != "points":
        end = "L M30" if subject.is_klartext else ends.get(subject.control, "M30")
        yield subject.text.inserted(subject.middle, end)


# Each matters always: positions are others from there on, by millimetres at least. Compensation does unless
# the control's table has a radius of 0, which nobody may rely on.
FAULTS = (
    Fault("rotation", "state", put(ROTATION)),
    Fault("tilted plane", "state", put(TILT)),
    Fault("scaling", "state", put(SCALING)),
    Fault("mirror", "state", put(MIRROR)),
    Fault("shift of zero", "state", put(SHIFT)),
    Fault("zero set anew", "state", put(RENAMED)),
    Fault("incremental", "state", incremental),
    Fault("compensation", "state", compensated),
    Fault("end in cut", "state", end_in_cut),
    Fault("TCP not on", "state", tcp_lost),
    Fault("TCP switched in cut", "state", tcp_switched),
)
