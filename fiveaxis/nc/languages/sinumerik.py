"""Sinumerik 840D programs as blocks of ISO words: TRAORI, ``X=IC(5)``, frames, drilling cycles.

Supported: plain words and words with ``=``, R parameters and variables with simple arithmetic, TRAORI and
TRAFOOF, direction vectors ``A3= B3= C3=``, frames of TRANS, ATRANS, ROT and AROT (three angles rotate
about Z, then the new Y, then the new X), CYCLE800 axis by axis, drilling cycles with MCALL or alone,
subprograms in files beside the program, repeated parts, and loops of FOR, WHILE and REPEAT. Words
without effect on the path are listed in `Block.ignored`; anything else is refused with its line.
After the *NC Programming Manual* of SINUMERIK 840D sl (Siemens 6FC5398-2BP40-3BA1).
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator

from fiveaxis.nc.languages.block import Block, BlockError, strip_comment
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Reader, Run
from fiveaxis.nc.languages.sinumerik_state import State, is_word
from fiveaxis.nc.languages.sinumerik_statement import SinumerikStatement

_DIRECTIONS = dict(zip(("A3=", "B3=", "C3=", "A5=", "B5=", "C5="), DIRECTION + NORMAL, strict=True))
_NUMBERED = re.compile(r"\s*(?:[N:]\s*[0-9]+)?\s*")
_LABEL = re.compile(r"\s*(?:[N:]\s*[0-9]+)?\s*([A-Z_][A-Z0-9_]*):(?!=)")
_TIMES = r"(?:\s*P\s*=?\s*([0-9]{1,5}))?"
# Folders of the control are beside the point: the file is looked for beside the program.
_CALL = re.compile(
    rf"(?:(?:EXT)?CALL\s*\(?\s*\"(?:[^\"]*[\\/:])?(?:_N_)?([A-Z0-9_.-]+?)(?:_[MS]PF)?\"\s*\)?"
    rf"|(L[0-9]+|[A-Z_]{{2}}[A-Z0-9_]*)){_TIMES}"
)
_PART = re.compile(rf"REPEAT(B)?\s+([A-Z_][A-Z0-9_]*)(?:\s+([A-OQ-Z_][A-Z0-9_]*))?{_TIMES}")
_FOR = re.compile(r"FOR\s+(R[0-9]+|[A-Z_][A-Z0-9_]*)\s*=(.+)\sTO\s(.+)")
_LOOP = re.compile(r"(WHILE|ENDWHILE|FOR|ENDFOR|REPEAT|UNTIL)(?![A-Z0-9_])\s*(.*)")
_COMPARED = re.compile(r"([^=<>]+)(==|<>|<=|>=|<|>)([^=<>]+)")
_IN_BRACKETS = re.compile(r"^\((.*)\)$")
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "==": operator.eq,
    "<>": operator.ne,
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
}
_ENDS = frozenset(("M2", "M30"))
# Relative: numbers that differ by less may be equal on the control.
SAME = 1e-9
_SKIPPED = re.compile(r"\s*(?:N[0-9]+\s*)?/[0-9]?(?![0-9])")


class Sinumerik(Reader):
    """Sinumerik 840D; a drilled hole is several blocks of one line."""

    forms = (PlainLines.of_words("XYZABC", "=?"), PlainLines.of_words("XYZABC", "=?", "[ABC]3=", _DIRECTIONS))
    comments = re.compile(r";[^\n]*+")

    def _begin(self) -> None:
        self.state = State()

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say."""
        return self.state.is_plain

    def follow(self, run: Run) -> None:
        """Remember the last words of a run."""
        state, words = self.state, run.last_words()
        if "G" in words:
            state.motion = f"G{words.pop('G'):g}"
        if run.points:
            state.angles.clear()
        state.remember(words)

    def read(self, line: int, text: str) -> Iterator[Block]:
        """Read a line."""
        code = strip_comment(text)
        if not code or code[0] == "%":
            return
        skipped = _SKIPPED.match(code)
        if skipped is not None and self.block_delete:
            yield Block(line, skipped=True)
            return
        begin = 0 if skipped is None else skipped.end()
        numbered = _NUMBERED.match(code, begin)
        code = code[begin if numbered is None else numbered.end() :]
        if (word := self._follow_order(code)) is not None:
            yield Block(line, ignored=(word,))
            return
        statement = SinumerikStatement(self.source, line, code, self.state)
        statement.read()
        if statement.returns and self.tape.called is None:
            statement.draft.m.append("M17")
        elif self.tape.called is not None and not _ENDS.isdisjoint(statement.draft.m):
            raise BlockError("ends the program within one that is called; end that with M17 or RET")
        yield from (block for block in (statement.before, statement.draft.block()) if block is not None)
        if statement.hole is not None:
            yield from self.state.drill(statement.hole, line)
        if statement.returns and self.tape.called is not None:
            self.tape.leave()

    # The order of lines

    def _follow_order(self, code: str) -> str | None:
        """Call subprograms, repeat parts and run loops; return the word that does, None if there is none."""
        if (part := _PART.fullmatch(code)) is not None:
            self._repeat(*part.groups())
            return "REPEAT"
        if (loop := _LOOP.fullmatch(code)) is not None:
            self._loop(loop[1], loop[2])
            return loop[1]
        call = _CALL.fullmatch(code)
        if call is not None and (call[1] or not is_word(call[2])):
            name, suffixes = call[1] or call[2], (".spf", ".mpf", ".arc")
            # A word that is no file's name may be anything.
            text = self.tape.open_file(name, suffixes) if call[1] else self.tape.file_beside(name, suffixes)
            if text is not None:
                head = next((line for line in map(_code_of, text.lines) if line.startswith("PROC")), "")
                if "(" in head or re.search(r"\bSAVE\b", head):
                    raise BlockError(
                        f"calls {name}, which has parameters or restores modal words (SAVE), which isn't "
                        "supported; post one program with all moves"
                    )
                self.tape.call_file(text, self.state.begin_subprogram(), int(call[3] or 1))
                return "CALL"
        return None

    def _repeat(self, block: str | None, first: str, last: str | None, times: str | None) -> None:
        """Read ``REPEAT A``, from a label to this line or ENDLABEL, ``REPEAT A B``, or ``REPEATB A``."""
        tape, rows = self.tape, self.tape.now.text.labels(_LABEL)
        begin, end = self._row(first), tape.row
        if block or last:
            end = self._row(last or first) + 1
        else:
            end = next((row + 1 for row in rows.get("ENDLABEL", []) if begin < row < end), end)
            if not tape.now.begin <= begin < tape.row:
                raise BlockError(f"repeats from {first}, which isn't before it in the part that runs")
        if not begin < end <= len(tape.now.text.lines):
            raise BlockError(f"repeats from {first} to {last}, which stands before it; correct them")
        tape.repeat(begin, end, int(times or 1))

    def _row(self, label: str) -> int:
        rows = self.tape.now.text.labels(_LABEL).get(label, [])
        if len(rows) != 1:
            raise BlockError(f"repeats from or to {label}, which stands in the program {len(rows)} times")
        return rows[0]

    def _loop(self, word: str, rest: str) -> None:
        """Run a line of FOR, WHILE or REPEAT with UNTIL."""
        tape, loops, values = self.tape, self.tape.now.loops, self.state.variables
        if word == "FOR":
            name, first, last = self._counted(tape.row)
            limit = evaluate(last, values.__getitem__)
            values[name] = evaluate(first, values.__getitem__)
            if values[name] > limit:
                tape.go_to(self._after("FOR"))
            else:
                loops.append((tape.row, limit))
            return
        if word == "WHILE" and not self._holds(rest):
            tape.go_to(self._after("WHILE"))
            return
        if word in ("WHILE", "REPEAT"):
            loops.append((tape.row, 0.0))
            return
        row, limit = loops.pop() if loops else (-1, 0.0)
        begin = _LOOP.match(_code_of(tape.now.text.lines[row])) if row >= 0 else None
        if begin is None or begin[1] != {"UNTIL": "REPEAT"}.get(word, word.removeprefix("END")):
            raise BlockError(f"{word} ends no loop that is begun before it; correct the loops")
        if word == "ENDFOR":
            name, _, last = self._counted(row)
            if evaluate(last, values.__getitem__) != limit:
                raise BlockError(f"the limit of {name} changes in the loop; write it as a number")
            values[name] += 1.0
            if values[name] <= limit:
                loops.append((row, limit))
                tape.go_to(row + 1)
        elif word == "ENDWHILE" or not self._holds(rest):
            tape.go_to(row)

    def _counted(self, row: int) -> tuple[str, str, str]:
        found = _FOR.fullmatch(_code_of(self.tape.now.text.lines[row]))
        if found is None:
            raise BlockError("FOR takes a variable, = and two limits with TO; correct it")
        return found[1], found[2], found[3]

    def _after(self, word: str) -> int:
        """Return the row after the end of the loop that begins here."""
        depth, lines = 0, self.tape.now.text.lines
        for row in range(self.tape.row, self.tape.now.end):
            found = _LOOP.match(_code_of(lines[row]))
            depth += 0 if found is None else (found[1] == word) - (found[1] == f"END{word}")
            if not depth:
                return row + 1
        raise BlockError(f"{word} has no END{word}; write it")

    def _holds(self, condition: str) -> bool:
        found = _COMPARED.fullmatch(_IN_BRACKETS.sub(r"\1", condition))
        if found is None:
            raise BlockError(f"{condition[:40]!r} isn't a comparison of two numbers; write the moves out")
        left, right = (evaluate(text, self.state.variables.__getitem__) for text in (found[1], found[3]))
        if left != right and math.isclose(left, right, rel_tol=SAME, abs_tol=SAME):
            raise BlockError(f"{left!r} and {right!r} differ by rounding only; compare with a number between")
        return _COMPARISONS[found[2]](left, right)


def _code_of(text: str) -> str:
    """Return a line without comment and block number, in upper case."""
    code = strip_comment(text)
    return code[_NUMBERED.match(code).end() :]  # type: ignore[union-attr]
