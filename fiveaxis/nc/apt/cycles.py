"""Drilling cycles of APT files, expanded to moves.

While a cycle is on, each ``GOTO`` is a hole: the tool approaches to the clearance, feeds to the depth and
retracts along its axis. Depths count from the ``GOTO`` point: NX's ``FEDTO`` is an offset along the tool
axis, negative into the material; ``DEPTH`` of Creo and the depth of a cycle without keywords are positive
(Creo: CL Output for Holemaking Cycles; ISO 4343:2000, 10.8).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from fiveaxis.base import Finding
from fiveaxis.model import MoveKind
from fiveaxis.nc.apt.feedrate import FEED_WORDS
from fiveaxis.nc.apt.statements import LONGEST_SHOWN, Statement, parse_minors

# Kind of cycle -> whether the tool retracts at the feed.
KINDS = {"DRILL": False, "DEEP": False, "BRKCHP": False, "FACE": False, "THRU": False, "BORE": False}
KINDS |= {"TAP": True, "REAM": True}

# Kinds that feed in steps; they are read as one feed to the depth.
PECKING = {"DEEP", "BRKCHP"}

DEPTH, BACK = ("DEPTH", "FEDTO"), ("RTRCTO", "RETURN")
CLEAR = ("CLEAR", "RAPTO")

# Words of a cycle without effect on the path -> the most numbers that follow.
SIDE_WORDS = {"DWELL": 1, "REV": 1, "STEP": 1, "INCR": 1, "TIMES": 1, "ORIENT": 1, "CAM": 1, "OPTION": 1}
SIDE_WORDS |= {"AUTO": 0, "MANUAL": 0, "ON": 0}


@dataclass
class Cycle:
    """What a cycle does at each hole.

    Parameters
    ----------
    statement : that defines it
    kind : a key of `KINDS`
    depth : below the ``GOTO`` point, unit of the file
    clear, rapto : above the point, where the feed begins; `rapto` is used where `clear` is None
    back : above the point, where the tool retracts to
    feed : number and unit word, None for that of ``FEDRAT``
    pecks : whether it feeds in steps, which are omitted
    signed : whether the depth is a positive ``FEDTO``
    """

    statement: Statement
    kind: str
    depth: float = math.nan
    clear: float | None = None
    rapto: float | None = None
    back: float | None = None
    feed: tuple[float, str] | None = None
    pecks: bool = False
    signed: bool = False

    def heights(self) -> tuple[float, float, float]:
        """Return heights above the ``GOTO`` point: where the feed begins and ends, and of the retract."""
        clear = max((self.rapto if self.clear is None else self.clear) or 0.0, 0.0)
        return clear, -self.depth, max(self.back or 0.0, 0.0) or clear


def read_cycle(statement: Statement) -> Cycle:
    """Read a ``CYCLE`` that starts drilling; `ToolpathError` for words that aren't known, or no depth."""
    parts = deque(parse_minors([m for m in statement.minors if m]))
    kinds = []
    while parts and parts[0] in KINDS:
        kinds.append(parts.popleft())
    if not kinds:
        known = ", ".join(KINDS)
        raise statement.error(f"is a cycle that isn't supported; known: {known}; write its moves as GOTO")
    cycle = Cycle(statement, str(kinds[-1] if kinds[-1] not in PECKING else kinds[0]))
    cycle.pecks = bool(PECKING & set(kinds))
    _take_parts(cycle, parts)
    if not math.isfinite(cycle.depth):
        raise statement.error("has no depth; write DEPTH or FEDTO and a number, or GOTO points")
    if not all(math.isfinite(h) for h in cycle.heights()):
        raise statement.error("has a height that isn't finite; correct it")
    return cycle


def _take_parts(cycle: Cycle, parts: deque[float | str]) -> None:
    bare: list[float] = []
    while parts:
        part = parts.popleft()
        if isinstance(part, float):
            bare.append(part)
        elif part in SIDE_WORDS:
            for _ in range(SIDE_WORDS[part]):
                if parts and isinstance(parts[0], float):
                    parts.popleft()
        elif part in FEED_WORDS and len(bare) == 2:
            # Creo's fixed format has depth, feed, unit; others write the unit first.
            cycle.feed = (bare.pop(), part)
        elif part in BACK and not (parts and isinstance(parts[0], float)):
            pass  # RTRCTO,AUTO: the clearance
        else:
            _take_couplet(cycle, part, parts)
    _take_bare(cycle, bare)


def _take_couplet(cycle: Cycle, word: str, parts: deque[float | str]) -> None:
    """Read a word and the number that follows it."""
    if word not in (*DEPTH, *CLEAR, *BACK, *FEED_WORDS):
        raise cycle.statement.error(
            f"has the word {word[:LONGEST_SHOWN]!r}, which isn't known; write GOTO points"
        )
    number = parts.popleft() if parts else None
    if not isinstance(number, float):
        raise cycle.statement.error(f"has no number after {word}; add it")
    if word in FEED_WORDS:
        cycle.feed = (number, word)
    elif word in DEPTH:
        cycle.depth, cycle.signed = abs(number), word == "FEDTO" and number > 0.0
    elif word in BACK:
        cycle.back = max(number, cycle.back or 0.0)
    elif word == "CLEAR":
        cycle.clear = number
    else:
        # With CLEAR this is a further rapid advance and doesn't change the path; alone it is the clearance.
        cycle.rapto = number


def _take_bare(cycle: Cycle, bare: list[float]) -> None:
    """Read the numbers without a word: the depth, then the clearance."""
    clear_of_kind = 2 if cycle.kind in ("DRILL", "BORE", "REAM", "FACE") and not cycle.pecks else 1
    known = [] if not math.isnan(cycle.depth) else ["depth"]
    if cycle.feed is not None and cycle.clear is None:
        known.append("clear")
    if len(bare) > min(len(known), clear_of_kind):
        shown = ", ".join(f"{number:g}" for number in bare)
        raise cycle.statement.error(
            f"has numbers of unknown meaning: {shown[:LONGEST_SHOWN]}; name them (DEPTH, CLEAR)"
        )
    for name, number in zip(known, bare, strict=False):
        setattr(cycle, name, abs(number))


def hole_points(cycle: Cycle, point: list[float], vector: list[float]) -> list[tuple[list[float], MoveKind]]:
    """Return the ends of approach, feed to the depth and retract of a hole, along the tool axis.

    Point and tool vector are those of the hole's ``GOTO``, the point in the unit of the file.
    """
    length = math.hypot(*vector)
    # A zero vector is kept: the reader checks all vectors together.
    axis = [component / length for component in vector] if length > 0.0 else vector
    clear, bottom, back = cycle.heights()
    out = MoveKind.CUT if KINDS[cycle.kind] else MoveKind.RAPID
    heights = ((clear, MoveKind.RAPID), (bottom, MoveKind.CUT), (back, out))
    return [
        ([p + height * component for p, component in zip(point, axis, strict=True)], kind)
        for height, kind in heights
    ]


def remark_on_cycle(cycle: Cycle) -> list[Finding]:
    """Return findings on what was assumed about a cycle, or omitted."""
    remarks = {
        "cycle-simplified": cycle.pecks and "the steps of the cycle are read as one feed to its depth",
        "cycle-depth": cycle.signed and f"FEDTO,{cycle.depth:g} is read as a depth below the GOTO point",
        "cycle-clearance": cycle.clear is None
        and cycle.rapto is None
        and "the cycle states no clearance: it feeds from its GOTO point",
    }
    return [cycle.statement.note(code, text) for code, text in remarks.items() if text]
