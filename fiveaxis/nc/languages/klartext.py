"""Heidenhain Klartext programs as blocks of ISO words: L, LN, circles, M128, PLANE, datum shifts.

Supported: straight lines ``L`` with axes and ``LN`` with vectors, poles and circles ``CC C CR``, polar ``LP``
and ``CP``, increments, Q parameters with simple arithmetic, M128 and FUNCTION TCPM, datum shifts (cycle 7,
TRANS DATUM), cycle 10, PLANE with spatial angles, Euler angles or vectors. Lines without effect on the path
are listed in `Block.ignored`; anything else is refused with its line. After the *User's Manual Klartext
Programming* of the TNC 640 (Heidenhain 892903-29).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.languages.block import Block, BlockError
from fiveaxis.nc.languages.draft import NUMBER, require_short, strip_comment
from fiveaxis.nc.languages.klartext_move import MOVES, Move
from fiveaxis.nc.languages.klartext_setup import SetUp
from fiveaxis.nc.languages.klartext_state import Line, State
from fiveaxis.nc.languages.klartext_words import IGNORED_LINES, refusal
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Reader, Run
from fiveaxis.nc.source import Source

_BEGIN, _WORDS = r"[ \t]*+(?:[0-9]++[ \t]++)?+LN?+[ \t]++", rf"[XYZABC]{NUMBER}(?:[ \t]++[XYZABCF]{NUMBER})*+"
# A normal alone may be the tool direction, too: such lines aren't plain.
_POINTING = rf"(?:[ \t]++N[XYZ]{NUMBER})*+(?:[ \t]++T[XYZ]{NUMBER})++(?:[ \t]++F{NUMBER})?+"
_G1 = re.compile(r"^[ \t]*(?:[0-9]+[ \t]+)?LN?", re.MULTILINE)
_NUMBERED = re.compile(r"\s*(?:[0-9]+\s+|[0-9]+$)?")
_SKIPPED = re.compile(r"\s*(?:[0-9]+\s*)?/\s*(?:[0-9]+\s+)?")
_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")


class Klartext(Reader):
    """Klartext, up to END PGM."""

    forms = (
        PlainLines(re.compile(rf"(?:{_BEGIN}{_WORDS}[ \t]*+\n)*+"), _G1),
        PlainLines(
            re.compile(rf"(?:{_BEGIN}{_WORDS}{_POINTING}[ \t]*+\n)*+"),
            _G1,
            dict(zip(("TX", "TY", "TZ", "NX", "NY", "NZ"), DIRECTION + NORMAL, strict=True)),
        ),
    )

    def __init__(self, source: Source, *, block_delete: bool = False) -> None:
        super().__init__(source, block_delete=block_delete)
        self.state = State()

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say."""
        return self.state.spatial is None and not self.state.positioned

    def follow(self, run: Run) -> None:
        """Remember the last words of a run."""
        self.state.now.update((c, value) for c, value in run.last_words().items() if c in "XYZABC")
        self.state.moved = True

    def continues(self, text: str) -> bool:
        """Whether the line ends with ``~``, which may follow a comment."""
        return text.rstrip().endswith("~")

    def read(self, line: int, text: str) -> Iterator[Block]:
        """Read a line with its continuations."""
        code = " ".join(_code_of(part).rstrip("~") for part in text.split("\n"))
        skipped = _SKIPPED.match(code)
        if skipped is not None and self.block_delete:
            yield Block(line, skipped=True)
            return
        require_short(code)
        numbered = _NUMBERED.match(code) if skipped is None else skipped
        code = " ".join(code[0 if numbered is None else numbered.end() :].split())
        if code:
            read = _read(self.source, line, code, self.state)
            yield from (b for b in (read.before, read.draft.block(), read.after) if b is not None)
        self.ended = code.startswith("END PGM")


def _read(source: Source, line: int, code: str, state: State) -> Line:
    """Read one block of any kind."""
    if MOVES.match(code) is not None:
        move = Move(source, line, code, state)
        move.read()
        return move
    setup = SetUp(source, line, code, state)
    if setup.read():
        return setup
    ignored = IGNORED_LINES.match(code)
    if ignored is None:
        raise BlockError(refusal(code))
    setup.draft.ignored.append(ignored[0])
    return setup


def _code_of(text: str) -> str:
    """Return a line without its comment, in upper case, with decimal points instead of commas."""
    code = strip_comment(text)
    return _COMMA.sub(".", code) if "," in code else code
