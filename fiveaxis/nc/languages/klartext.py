"""Heidenhain Klartext programs as blocks of ISO words: L, LN, circles, M128, PLANE, datum shifts.

Supported: straight lines ``L`` with axes and ``LN`` with vectors, poles and circles ``CC C CR``, polar ``LP``
and ``CP``, increments, Q parameters with simple arithmetic, M128 and FUNCTION TCPM, datum shifts (cycle 7,
TRANS DATUM), presets, cycle 10, PLANE with spatial angles, Euler angles or vectors, drilling cycles, CALL LBL
with and without REP, CALL PGM of a file beside the program. Lines without effect on the path
are listed in `Block.ignored`; anything else is refused with its line. After the *User's Manual Klartext
Programming* of the TNC 640 (Heidenhain 892903-29).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.base import Severity
from fiveaxis.nc.languages.block import NUMBER, Block, BlockError, require_short, strip_comment
from fiveaxis.nc.languages.klartext_move import MOVES, Move
from fiveaxis.nc.languages.klartext_setup import SetUp
from fiveaxis.nc.languages.klartext_state import END_M, IGNORED_LINES, Line, State, refusal
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Reader, Run

_ENDS = frozenset(f"M{number}" for number in END_M)
_NAME = r'0*([1-9][0-9]*|"[^"]+")'
_LABEL = re.compile(rf"\s*(?:[0-9]+\s+)?LBL\s+{_NAME}")
_CALL_LABEL = re.compile(rf"CALL LBL {_NAME}(?: REP ?([0-9]{{1,5}})(?:/[0-9]+)?)?")
# Folders of the control are beside the point: the file is looked for beside the program.
_CALL_PROGRAM = re.compile(r'CALL PGM "?(?:[^"]*[\\/:])?([^"\\/:]+)"?')
_CYCLE_CALL = re.compile(r"CYCL CALL(?! PAT)(?: (POS)(?= ))? ?")
_AT_ZERO = re.compile(r"(X ?[^IZ]+Y ?[^IZ]+)Z ?[+-]?0+(?:\.0*)?(?![0-9.])(.*)")
_SIMPLIFIED = (
    "drilling cycles are read as one move down and one back; pecks, dwells at the top and the disengagement "
    "in boring are left out"
)

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
        PlainLines(re.compile(rf"(?:(?:{_BEGIN}{_WORDS})?+[ \t]*+\n)*+"), _G1),
        PlainLines(
            re.compile(rf"(?:(?:{_BEGIN}{_WORDS}{_POINTING})?+[ \t]*+\n)*+"),
            _G1,
            dict(zip(("TX", "TY", "TZ", "NX", "NY", "NZ"), DIRECTION + NORMAL, strict=True)),
        ),
    )
    # A comment alone, with its block number; but not one that ends with ~, after which the block goes on.
    comments = re.compile(r"(?:^[ \t]*+[0-9]++[ \t]*+)?;(?![^\n]*~\s*$)[^\n]*+", re.MULTILINE)

    def _begin(self) -> None:
        self.state = State()

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say."""
        return self.state.spatial is None and not self.state.positioned and not self.state.drilling

    def follow(self, run: Run) -> None:
        """Remember the last words of a run."""
        words = run.last_words()
        self.state.now.update((c, value) for c, value in words.items() if c in "XYZABC")
        self.state.feed = words.get("F", self.state.feed)

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
            yield from self._read(line, code)

    def _read(self, line: int, code: str) -> Iterator[Block]:
        """Read one block of any kind."""
        if (word := self._follow_order(code)) is not None:
            yield Block(line, ignored=(word,))
            return
        read = self._line(line, code)
        if self._in_file and not _ENDS.isdisjoint(read.draft.m):
            raise BlockError("ends the program within one that is called, which the control doesn't allow")
        if read.calls:
            read.draft.note(Severity.NOTE, "cycle-simplified", _SIMPLIFIED)
        yield from (block for block in (read.before, read.draft.block()) if block is not None)
        if read.calls:
            yield from self.state.drill(line)
        if read.after is not None:
            yield read.after
        self.ended = code.startswith("END PGM")

    def _line(self, line: int, code: str) -> Line:
        called = _CYCLE_CALL.match(code)
        if called is not None or MOVES.match(code) is not None:
            words = code if called is None else code[called.end() :]
            move = Move(self.source, line, words, self.state)
            if called is not None and self.state.drilling:
                raise BlockError("calls a cycle that M89 calls at every position; write M99 before")
            if called is not None:
                move.code = self._position_of(words) if called[1] else words
                move.draft.ignored.append("CYCL CALL")
                move.calls = True
            move.read()
            return move
        setup = SetUp(self.source, line, code, self.state)
        if setup.read():
            return setup
        ignored = IGNORED_LINES.match(code)
        if ignored is None:
            raise BlockError(refusal(code))
        setup.draft.ignored.append(ignored[0])
        setup.draft.stated.append(code)
        return setup

    def _position_of(self, words: str) -> str:
        """Return the words of CYCL CALL POS without its Z, which shifts the hole unless it is 0."""
        found = _AT_ZERO.fullmatch(words)
        if found is None:
            raise BlockError("CYCL CALL POS needs X, Y and Z+0, with the surface in Q203; write that")
        near, height = self.state.clearance, self.state.now.get("Z")
        if near is not None and height is not None and height < near:
            raise BlockError(
                f"CYCL CALL POS from Z {height:g}, below the set-up clearance at {near:g}, goes up first, "
                "which isn't supported; go up before"
            )
        return f"{found[1]}{found[2]}"

    # The order of lines

    @property
    def _in_file(self) -> bool:
        """Whether a called program is run."""
        called = self.tape.called
        return called is not None and called.is_file

    def _follow_order(self, code: str) -> str | None:
        """Call and end subprograms and repeat parts; return the word that does, None if there is none."""
        tape = self.tape
        if (call := _CALL_LABEL.fullmatch(code)) is not None:
            rows = tape.now.text.labels(_LABEL).get(call[1], [])
            if len(rows) != 1:
                raise BlockError(f"calls LBL {call[1]}, which stands in the program {len(rows)} times")
            if call[2] is None:
                tape.call(rows[0] + 1)
            elif not tape.now.begin <= rows[0] < tape.row:
                raise BlockError(f"repeats from LBL {call[1]}, which isn't before it in the part that runs")
            else:
                tape.repeat(rows[0], tape.row, int(call[2]))
            return "CALL LBL"
        if (call := _CALL_PROGRAM.fullmatch(code)) is not None:
            local = {name: value for name, value in self.state.parameters.items() if name[:2] == "QL"}
            tape.call_file(tape.open_file(call[1], (".h",)), lambda: self._leave(local))
            self._leave({})
            return "CALL PGM"
        if code.startswith("LBL"):
            if code[3:].strip() == "0" and tape.called is not None and not self._in_file:
                tape.leave()
            return "LBL"
        if self._in_file and code.startswith("BEGIN PGM"):
            if code.split()[-1] != self.state.unit:
                raise BlockError(f"the program that calls is in {self.state.unit}; post both in one unit")
            return "BEGIN PGM"
        if code.startswith("END PGM") and tape.called is not None:
            if not self._in_file:
                raise BlockError("the subprogram that is called isn't ended; write LBL 0")
            tape.leave()
            return "END PGM"
        return None

    def _leave(self, local: dict[str, float]) -> None:
        """Set the QL parameters, which are local to a program."""
        others = {name: value for name, value in self.state.parameters.items() if name[:2] != "QL"}
        self.state.parameters = others | local


def _code_of(text: str) -> str:
    """Return a line without its comment, in upper case, with decimal points instead of commas."""
    code = strip_comment(text)
    return _COMMA.sub(".", code) if "," in code else code
