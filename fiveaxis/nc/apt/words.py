"""Words of APT that move the tool, or what it counts from, in a way that isn't read: they are refused."""

from __future__ import annotations

import difflib
from functools import lru_cache

from fiveaxis.nc.apt.statements import CREO, Statement
from fiveaxis.nc.source import Source

_CURVE = "is a curve that isn't read, and a chord would be wrong; let the CAM system write GOTO points"
_COPY = "repeats or moves other statements, which isn't expanded; let the CAM system write GOTO points"
_TABLE = "turns or moves what coordinates count from, which isn't read; let the CAM system write tool vectors"
_STEPS = "makes coordinates increments, which isn't read; let the CAM system write absolute ones"
_PLANE = "moves the tool to a height that isn't stated; let the CAM system write GOTO points"

REFUSED = {
    **dict.fromkeys(("ARC", "HELIX", "HELICAL"), _CURVE),
    **dict.fromkeys(
        ("GOFWD", "GOBACK", "GOLFT", "GORGT", "GOUP", "GODOWN", "TLON", "TLLFT", "TLRGT"), _CURVE
    ),
    **dict.fromkeys(
        ("NURBS", "SPLINE", "BSPLIN", "BSPLINE", "POLYNOMIAL", "POCKET", "SCURV", "THREAD"), _CURVE
    ),
    **dict.fromkeys(
        ("COPY", "TRACUT", "CALL", "CALSUB", "DEFSUB", "MACRO", "LOOPST", "INDEX", "MIRROR"), _COPY
    ),
    **dict.fromkeys(("ROTATE", "ROTABL", "ROTHED"), _TABLE),
    **dict.fromkeys(("SET", "MODE"), _STEPS),
    "DNTCUT": "hides the moves that follow from the machine; let the CAM system leave them out",
    **dict.fromkeys(("RETRCT", "GOCLER", "PROBE"), _PLANE),
}

# A word that is so much like one of these, by difflib's ratio, may be a slip that loses a move.
MOTIONS, NEAR, LONGEST_WORD = (
    ("GOTO", "FROM", "CIRCLE", "CYCLE", "GODLTA", "GOHOME", "MOVARC", "RAPID"),
    0.8,
    10,
)


def require_harmless(statement: Statement, source: Source) -> None:
    """Refuse a statement without an action if leaving it out would lose or change a move.

    Raises
    ------
    ToolpathError
        With the reason, and what to do.
    """
    word = statement.word
    if word.startswith(CREO):
        return
    if word[:1] in set("0123456789+-."):
        raise statement.error(
            source, "has no word; continue a statement with $ at the end of the line before"
        )
    for part in word.split(","):
        reason = REFUSED.get(part)
        if reason is not None and not _is_usual(part, statement):
            raise statement.error(source, reason)
    if "GOTO" in word or word.startswith(("GO", "MOVE", "MOVARC")) or "CIRCLE" in word:
        raise statement.error(source, "isn't understood; write GOTO/x,y,z or GOTO/x,y,z,i,j,k")
    near = _like_motion(word[:LONGEST_WORD])
    if near is not None:
        raise statement.error(source, f"isn't known, and {near} would move the tool; correct the word")


@lru_cache(maxsize=1000)
def _like_motion(word: str) -> str | None:
    """Find a word of motion that a word resembles; a file repeats few words many times."""
    return next(iter(difflib.get_close_matches(word, MOTIONS, n=1, cutoff=NEAR)), None)


def _is_usual(word: str, statement: Statement) -> bool:
    """Tell whether a word that may change moves only confirms what holds anyway."""
    minors = statement.minors
    if word in ("SET", "MODE"):
        # SET/HOLDER, MODE/MILL and others of their kind only name things.
        return "INCR" not in minors
    return minors in (["OFF"], ["NOMORE"])
