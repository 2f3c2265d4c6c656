"""Vocabulary of Heidenhain Klartext: what has no effect on the path, and what is refused.

After the *User's Manual Klartext Programming* of the TNC 640 (Heidenhain 892903-29) and of the iTNC 530
(737759-23). A line that matches nothing here and doesn't consist of words is refused.
"""

from __future__ import annotations

import re

from fiveaxis.nc.languages.block import IS_CYCLE, IS_JUMP, reasons

# Beginnings of lines without effect on the path.
IGNORED_LINES = re.compile(
    r"\*|BLK FORM|TOOL DEF|STOP\b|LBL\b|SEL (?:CORR-)?TABLE|FUNCTION MODE MILL|FUNCTION RESET (?!TCPM)[A-Z]+"
    r"|FUNCTION (?:S-PULSE|FEED|COUNT|DCM|FIXTURE|LIFTOFF|STRLEN|CORRDATA RESET|PROG PATH OFF|AFC)\b"
    r"|FN ?1[56] ?:|FUNCTION PROG PATH IS TCP|MONITORING|QS[0-9]+ ?= ?\"[^\"]*\"$"
)

_EXTRA = "generates moves, which isn't supported; post L, C and CR"
_TURN = "sets a coordinate system that isn't supported; post PLANE SPATIAL"
_SYSTEM = "reads data of the control, which the program doesn't contain; write the number"

# The first pattern that matches the beginning of a line gives the reason.
REFUSED_LINES = reasons(
    (r"CALL LBL|CALL PGM|PGM CALL|CALL SELECTED|SEL PGM|CALL|IF\b", IS_JUMP),
    (r"FN ?(?:9|1[012]) ?:", IS_JUMP),
    (r"CYCL CALL|CYCL DEF|TCH PROBE|PATTERN DEF|SEL PATTERN|CONTOUR DEF|SEL CONTOUR", IS_CYCLE),
    (r"RND|CHF|APPR|DEP|CT\b|FPOL|FL\b|FC\b|FLT|FCT|FSELECT|SPL", _EXTRA),
    (r"PLANE|TRANS", _TURN),
    (r"FN|SYSREAD|QS", _SYSTEM),
    (r"FUNCTION (?:TURNDATA|MODE TURN|PARAX|POLARKIN|PROG PATH)", "changes what the words mean"),
)

# M words that change the path or the meaning of other words.
REFUSED_M = {
    **dict.fromkeys((89, 99), IS_CYCLE),
    103: "reduces the feed of plunging moves, which isn't supported; write the feeds",
    112: "rounds the path, which isn't supported; post without it",
    114: "compensates the tilted axes as on older controls; post with M128",
    118: "superimposes handwheel moves; post without it",
    144: "contains the tilted axes in the positions; post with M128",
    130: "means positions in untilted coordinates, which isn't supported; write PLANE RESET before",
    **dict.fromkeys((200, 201, 202, 203, 204), "controls a laser, which isn't supported; post for a mill"),
}

END_M = (2, 30)

# Numbers of cycles that only set up the control.
IGNORED_CYCLES = frozenset((13, 32, 239, 247, 332))


def refusal(line: str) -> str:
    """Return the reason why a line is refused."""
    for pattern, reason in REFUSED_LINES:
        found = pattern.match(line)
        if found is not None:
            return f"{found[0]} {reason}"
    first = line.split(maxsplit=1)[0][:20]
    return f"{first!r} begins no supported line; post the program with L, LN, CC, C, CR, LP and CP"
