"""Faults at start and end: what a program may have left on stays on, or is switched on again."""

import re
from collections.abc import Iterable, Iterator

import numpy as np

from planted.fault import Fault, Plant, Subject
from planted.states import COMPENSATION, ISO, MIRROR, NEW, ROTATION, SCALING, SHIFT, TILT
from planted.words import Text

_FANUC = {
    "rotation, plane": r"^G69$",
    "polar coordinates": r"^G15$",
    "scaling": r"^G50$",
    "mirror": r"^G50\.1 .*",
    "shift": r"^G52 .*",
}
_HAAS = _FANUC | {"mirror": r"^G100 .*", "plane": "^G269$", "dynamic offset": "^G255$", "brake": "^M1[13]$"}
_HEIDENHAIN = {
    "plane": r"^\d+ PLANE RESET.*",
    "shift": r"^\d+ CYCL DEF 7\.3.*",
    "mirror": r"^\d+ CYCL DEF 8\.1.*",
    "rotation": r"^\d+ CYCL DEF 10\.1.*",
    "scaling": r"^\d+ CYCL DEF 11\.1.*",
    "TCP": r"^\d+ (?:FUNCTION RESET TCPM|L M129)$",
    "tolerance": r"^\d+ CYCL DEF 32\.1.*",
    "short way": r"^\d+ L M127$",
}
_LINUXCNC = {"shift": r"^G92\.1$", "path mode": r"^G61$"}
# Control -> name of what an earlier program may have left on -> the words that switch it off or set it.
STALE = {
    "fanuc": _FANUC,
    "haas": {name: words for name, words in _HAAS.items() if name != "polar coordinates"},
    "linuxcnc": _LINUXCNC,
    "linuxcnc-switchkins": _LINUXCNC | {"TCP": "^M429$"},
    "sinumerik": {
        "frame": "^TRANS$",
        "plane": r"^CYCLE800\(\)$",
        "TCP": "^TRAFOOF$",
        "cycle": "^MCALL$",
        "corners": "^G642$",
    },
    **dict.fromkeys(NEW, _HEIDENHAIN),
}
# Words in a line with others.
WORDS = {**dict.fromkeys(ISO, ("G40", "G49", "G80")), "sinumerik": ("G40",)}


def _stale_words(subject: Subject) -> Iterable[str]:
    # LinuxCNC has a word for TCP only where it is configured, so its other programs have none.
    tcp = ["^M429$"] if (subject.control, subject.mode) == ("linuxcnc", "tip") else []
    return [*STALE.get(subject.control, {}).values(), *tcp]


def stale(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """One thing that an earlier program may have left on isn't switched off."""
    text, begin = subject.text, subject.text.approach[0] if subject.text.approach else 0
    for words in _stale_words(subject):
        (line, *_rest) = text.find(re.compile(words), 0, begin)
        yield text.replaced(line).numbered()
    for word in WORDS.get(subject.control, ()):
        (line, *_rest) = text.find(re.compile(rf" {word}\b"), 0, begin)
        yield text.rewritten(lambda was, word=word: re.sub(rf" {word}\b", "", was), [line])


def too_late(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """What is left on is switched off only after the first move."""
    text, begin = subject.text, subject.text.approach[0] if subject.text.approach else 0
    for words in _stale_words(subject):
        line = text.find(re.compile(words), 0, begin)[0]
        was = re.sub(r"^\d+ (?=\D)", "", text.lines[line])
        yield text.inserted(begin + 1, was).replaced(line).numbered()


# What the end of a program switches off, as its control does.
_G49, _RESET = ("^G49$",), r"^\d+ PLANE RESET STAY$"
OFF = {
    "fanuc": _G49,
    "haas": _G49,
    "linuxcnc": ("^M429$",),
    "linuxcnc-switchkins": ("^M429$",),
    "sinumerik": ("^TRAFOOF$",),
    "heidenhain": (r"^\d+ FUNCTION RESET TCPM$", _RESET),
    "heidenhain-m128": (r"^\d+ L M129$", _RESET),
}


def left_on(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
    """One thing that the program has on isn't switched off at its end."""
    text = subject.text
    for words in OFF.get(subject.control, ()):
        for line in text.find(re.compile(words), text.moves[-1]):
            yield text.replaced(line).numbered()


def switched_on(modes: dict[str, tuple[str, ...]]) -> Plant:
    """Put what switches a mode on between the safe start and the first move."""

    def plant(subject: Subject, _: np.random.Generator) -> Iterator[Text]:
        texts = modes.get(subject.control, ())
        if texts and subject.text.approach:
            yield subject.text.inserted(subject.text.approach[0], *texts)

    return plant


POLAR = {
    "fanuc": ("G16",),
    "sinumerik": ("TRANSMIT",),
    **dict.fromkeys(NEW, ("FUNCTION POLARKIN AXES X Y C",)),
}

# Always: in each of these modes the same words lead elsewhere, by millimetres at least, and a brake that
# holds stops the machine or tears.
FAULTS = (
    Fault("stale at the start", "start", stale),
    Fault("cancelled too late", "start", too_late),
    # Always: the next program, or a move by hand, begins under tool centre point control or in a plane.
    Fault("left on at the end", "start", left_on),
    *(
        Fault(f"begins in {name}", "start", switched_on(words))
        for name, words in {
            "polar mode": POLAR,
            "a tilted plane": TILT,
            "a rotation": ROTATION,
            "scaling": SCALING,
            "mirror": MIRROR,
            "a shift": SHIFT,
            "cutter compensation": COMPENSATION,
        }.items()
    ),
)
