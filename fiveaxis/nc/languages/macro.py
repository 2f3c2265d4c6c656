"""Macro statements of G-code: variables, arithmetic, subprograms, loops and jumps.

Of Fanuc, Haas and their kind: ``#1=5``, ``M98 P1000 L2``, ``M97 P10``, ``G65 P1000 A5``, ``M99``,
``GOTO 10``, ``IF [#1 GT 5] GOTO 10``, ``IF [#1 GT 5] THEN #1=0``, ``WHILE [#1 LT 5] DO1``, ``END1``. Of
LinuxCNC: O words, ``sub``, ``call``, ``while``, ``do``, ``repeat``, ``if``. A subprogram stands in the same
file, most often after M30, or in a file of its name beside it. A variable that only the control knows has no
value, so no jump depends on it.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from itertools import pairwise
from pathlib import PurePath
from typing import NamedTuple

from fiveaxis.nc.languages.block import BlockError, number_of, put_word
from fiveaxis.nc.languages.expressions import evaluate, evaluate_prefix
from fiveaxis.nc.languages.tape import Tape, Text
from fiveaxis.nc.writing.table_parts import Arithmetic

_SIGN = re.compile("[();]")
# Block delete and number before a block.
_HEAD = re.compile("^(?:/[1-9]?)?(?:N[0-9]+)?(?:/[1-9]?)?")
_NAME = r"#(?:[0-9]+|<[A-Z0-9_]+>)"
_ASSIGNED = re.compile(f"({_NAME})=")
# Value of a word: one variable or one pair of brackets. No control accepts X#1+2.
_VALUE = re.compile(rf"([A-Z])([+-]?)(?:({_NAME})(?![-+*/=])|(?=\[))")
_BRACKET = re.compile(r"[\[\]]")

# O words of LinuxCNC; WHILE […] DO1 and END1 of Fanuc are read as O1 WHILE […] and O1 ENDWHILE.
_O_WORD = re.compile(
    "O(<[A-Z0-9_.+-]+>|[0-9]+)(ENDSUB|SUB|CALL|RETURN|ENDWHILE|WHILE|DO|ENDREPEAT|REPEAT|ENDIF|IF|ELSEIF|ELSE"
    "|BREAK|CONTINUE)(.*)"
)
_LOOP = re.compile(r"(?:WHILE(\[.*\]))?DO([0-9]+)|END([0-9]+)")
_LOOPS = ("DO", "WHILE", "REPEAT")
_JUMP = re.compile(r"GOTO(?=[0-9#\[])")
_CALL = re.compile(r"M0*(9[78])(?![0-9.])|G0*(65)(?![0-9.])")
_RETURN = re.compile(r"M0*99(?![0-9.])")
_WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")

# The beginnings of lines that have a name: of programs, blocks, O words and loops.
_N = r"\s*(?:N\s*[0-9]+)?\s*"
_PROGRAMS = re.compile(rf"{_N}[O:]\s*0*([0-9]+)(?![0-9])\s*(?!\s*[0-9A-Z.\[])")
_BLOCKS = re.compile(r"\s*/?\s*N\s*0*([0-9]+)")
_O_WORDS = re.compile(rf"{_N}O\s*0*(<[^\s>]+>|[0-9]+)\s*(?=[A-Z])")
_DO_LOOPS = re.compile(rf"{_N}(?:WHILE\s*\[.*\]\s*)?(?:DO|END)\s*([0-9]+)\s*(?:[(;].*)?$")

# Word of G65 -> number of the variable that it gives.
_ARGUMENTS = dict(
    zip("ABCDEFHIJKMQRSTUVWXYZ", (1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, *range(17, 27)), strict=True)
)
# Variables of a called macro alone: of Fanuc, and of a LinuxCNC subroutine, whose arguments they are.
_OWN, _OWN_LINUXCNC = 33, 30
_ALARM = "#3000"
# Of files that hold a subprogram, after that of the program; none is usual on controls.
_SUFFIXES = ("", ".nc", ".ngc", ".tap", ".cnc", ".eia", ".min", ".prg", ".sub", ".txt")


def compact_code(text: str) -> str:
    """Return a line without comments and blanks, in upper case: ``x 1. (to)`` is ``X1.``.

    An unclosed opening bracket is kept.
    """
    code = text if "(" not in text and ";" not in text else _without_comments(text)
    # The upper case of characters like the long s is ASCII: only ASCII text may become words.
    return "".join(code.upper().split()) if code.isascii() else "".join(code.split())


def without_head(code: str) -> str:
    """Return a line from `compact_code` without its block number and block delete."""
    return _HEAD.sub("", code)


def _without_comments(text: str) -> str:
    kept, begin, depth = [], 0, 0
    for mark in _SIGN.finditer(text):
        sign = mark[0]
        if sign == "(":
            if depth == 0:
                kept.append(text[begin : mark.start()])
                begin = mark.start()
            depth += 1
        elif sign == ")" and depth > 0:
            depth -= 1
            begin = mark.end() if depth == 0 else begin
        elif sign == ";" and depth == 0:
            kept.append(text[begin : mark.start()])
            return "".join(kept)
    kept.append(text[begin:])
    return "".join(kept)


class _Mark(NamedTuple):
    """An O word of LinuxCNC, or a loop of Fanuc: its name, what it does, what with, and its row."""

    name: str
    word: str
    rest: str
    row: int

    @classmethod
    def of(cls, code: str, row: int) -> _Mark | None:
        """Read a block; None if it is another one."""
        if (word := _O_WORD.fullmatch(code)) is not None:
            return cls(word[1].lstrip("0"), word[2], word[3], row)
        if (loop := _LOOP.fullmatch(code)) is not None:
            return cls(f"DO{loop[2] or loop[3]}", "ENDWHILE" if loop[3] else "WHILE", loop[1] or "[1]", row)
        return None


class Macros:
    """Runs the macro statements of a program: values of variables, and where on its tape it goes on."""

    def __init__(self, tape: Tape, rules: Arithmetic) -> None:
        self.tape, self.rules = tape, rules
        # Of all lines, and of those that were called.
        self.shared: dict[str, float] = {}
        self.own: dict[str, float] = {}
        self.own_up_to = _OWN
        # Assignments of the last line, as #5=2.
        self.assigned: tuple[str, ...] = ()

    def take(self, code: str) -> str:
        """Run the statements of a block; return what is left of it to be read, with numbers for variables.

        The block is without comments, blanks and block number, in upper case. `BlockError` for a variable
        without a value, a result or a jump that isn't certain, or a call of what isn't there.
        """
        self.assigned = ()
        if (mark := _Mark.of(code, self.tape.row)) is not None:
            self._run(mark)
            return ""
        if code[:3] == "IF[":
            truth, end = evaluate_prefix(code, 2, self._value, self.rules)
            begins = 4 if code.startswith("THEN", end) else 0
            if not begins and _JUMP.match(code, end) is None:
                raise BlockError(f"{code[end : end + 20]!r} after IF; write THEN or GOTO")
            if not truth:
                return ""
            code = code[end + begins :]
        if _JUMP.match(code) is not None:
            self.tape.go_to(self._block(_counted(self._evaluate(code[4:]))))
            return ""
        code = self._filled(code) if "#" in code or "[" in code else code
        if (call := _CALL.search(code)) is not None:
            return self._call(code, call)
        back = _RETURN.search(code)
        return code if back is None else self._return(code[: back.start()], code[back.start() :])

    # Variables

    def _filled(self, code: str) -> str:
        """Replace variables and brackets by numbers, and assign; what is neither is left for the reader."""
        if (found := _ASSIGNED.match(code)) is None:
            return self._with_numbers(code)
        end, values = 0, {}
        while found is not None:
            # As in RS274/NGC, all values take effect after the block.
            values[_key(found[1])], end = evaluate_prefix(code, found.end(), self._value, self.rules)
            found = _ASSIGNED.match(code, end)
        if end < len(code):
            return code[end:] if "=" in code[end:] else f"={code[end:]}"
        if _ALARM in values:
            raise BlockError(f"{_ALARM} stops the program with an alarm; correct what leads here")
        for key, value in values.items():
            self._home(key)[key] = value
        self.assigned = tuple(f"{key}={value:g}" for key, value in values.items())
        return ""

    def _with_numbers(self, code: str) -> str:
        parts, begin = [], 0
        while (found := _VALUE.search(code, begin)) is not None:
            end = found.end() if found[3] else _closing(code, found.end())
            value = self._value(found[3]) if found[3] else self._evaluate(code[found.end() : end])
            # Without an exponent, as controls accept it.
            number = f"{-value if found[2] == '-' else value:.12f}".rstrip("0")
            parts.append(f"{code[begin : found.start()]}{found[1]}{number}")
            begin = end
        return "".join(parts) + code[begin:]

    def _home(self, key: str) -> dict[str, float]:
        """Return where the value of a variable is kept: by the lines that were called, or for all."""
        own = key[2] != "_" if key[1] == "<" else int(key[1:]) <= self.own_up_to
        return self.own if own else self.shared

    def _value(self, name: str) -> float:
        key = _key(name)
        try:
            return self._home(key)[key]
        except KeyError:
            raise BlockError(f"{name} has no value yet; write the number") from None

    def _evaluate(self, text: str) -> float:
        return evaluate(text, self._value, self.rules)

    # Calls and jumps

    def _block(self, number: int) -> int:
        """Return the row of the block of a number, in the program to which the present line belongs."""
        text = self.tape.now.text
        heads = sorted(row for rows in text.labels(_PROGRAMS).values() for row in rows)
        at = bisect_right(heads, self.tape.now.row - 1)
        begin, end = [0, *heads, len(text.lines)][at : at + 2]
        found = [row for row in text.labels(_BLOCKS).get(f"{number}", ()) if begin <= row < end]
        if len(found) != 1:
            raise BlockError(
                f"goes to block N{number}, which {len(found) or 'none'} of the program's blocks is; "
                "number the blocks once each"
            )
        return found[0]

    def _call(self, code: str, call: re.Match[str]) -> str:
        """Run M98, M97 or G65; return the block's other words."""
        word, words, others = "G65" if call[2] else f"M{call[1]}", dict[str, float](), ""
        rest = code[: call.start()] + code[call.end() :]
        for letter, number in _WORD.findall(rest):
            if letter in "PL" or (word == "G65" and letter in _ARGUMENTS):
                put_word(words, letter, number_of(letter, number))
            elif letter in "QH":
                raise BlockError(f"{word} with {letter}{number} isn't supported; call a program of its own")
            else:
                others += letter + number
        if "".join(map("".join, _WORD.findall(rest))) != rest or "P" not in words:
            raise BlockError(f"{word} needs P with the number of what it calls, and plain words; correct it")
        number, count = _counted(words.pop("P")), _counted(words.pop("L", 1.0))
        if count == 0:
            raise BlockError(f"{word} with L0 depends on the control; leave the call out")
        if word == "M97":
            self.tape.call(self._block(number), count)
        elif word == "G65":
            own = {f"#{_ARGUMENTS[letter]}": value for letter, value in words.items()}
            self._enter(*self._required(number), count, own)
        else:
            self._enter(*self._numbered(number, count), None)
        return others

    def _numbered(self, number: int, count: int) -> tuple[Text, int, int]:
        """Return file, row and count of M98: P31000 is O31000, or O1000 three times."""
        times, last = divmod(number, 10_000)
        repeated = self._program(last) if times else None
        if repeated is None:
            return *self._required(number), count
        if self._program(number) is not None:
            raise BlockError(
                f"P{number} is O{number}, or O{last:04d} {times} times; both exist, write L{times}"
            )
        return *repeated, count * times

    def _required(self, number: int) -> tuple[Text, int]:
        found = self._program(number)
        if found is None:
            raise BlockError(
                f"calls the program O{number:04d}, which is neither in this file nor in one of this name "
                "beside it; put the file there, or post one program with all moves"
            )
        return found

    def _program(self, number: int) -> tuple[Text, int] | None:
        """Return file and first row of a program, in this file, the main one or one beside it."""
        for text in (self.tape.now.text, self.tape.stack[0].text):
            rows = text.labels(_PROGRAMS).get(f"{number}", ())
            if len(rows) > 1:
                raise BlockError(f"calls O{number:04d}, which its file has {len(rows)} times; leave one")
            if rows:
                return text, rows[0] + 1
        names = (f"{head}{number:0{digits}d}" for head in ("O", "") for digits in (4, 1, 5, 8))
        beside = self._beside(names)
        return (
            None if beside is None else (beside, (beside.labels(_PROGRAMS).get(f"{number}") or [-1])[0] + 1)
        )

    def _beside(self, names: Iterable[str]) -> Text | None:
        suffixes = (PurePath(self.tape.source.name).suffix, *_SUFFIXES)
        return next((text for name in names if (text := self.tape.file_beside(name, suffixes))), None)

    def _enter(self, text: Text, row: int, count: int, own: dict[str, float] | None) -> None:
        """Call lines of a file, with variables of their own unless they share those of the caller."""
        tape, outer = self.tape, self.own
        if text is tape.now.text:
            tape.call(row, count)
        else:
            tape.call_file(text, None, count, row)
        if own is None:
            return
        called, self.own = tape.now, dict(own)

        def leave() -> None:
            self.own = dict(own) if called.left else outer

        called.leave = leave

    def _return(self, code: str, back: str) -> str:
        """Run M99: a subprogram returns, to the line after the call or to a block; a main program ends."""
        called, resume = self.tape.called, re.fullmatch("M0*99P([0-9]+)", back)
        if called is None and resume is None:
            return code + back
        if called is None or (called.left if resume else _RETURN.sub("", back)):
            raise BlockError(f"{back!r} goes where only the control says; write M99 alone")
        self.tape.leave()
        if resume is not None:
            self.tape.go_to(self._block(int(resume[1])))
        return code

    # Loops and branches

    def _run(self, mark: _Mark) -> None:
        """Run an O word of LinuxCNC, or a loop of Fanuc."""
        tape, loops, (name, word, rest, row) = self.tape, self.tape.now.loops, mark
        marks = _marks(tape.now.text, name)
        before, after = [m for m in reversed(marks) if m.row < row], [m for m in marks if m.row > row]

        def find(marks: Iterable[_Mark], *words: str) -> int:
            found = next((mark.row for mark in marks if mark.word in words), None)
            if found is None:
                raise BlockError(f"{word} of {name} without {' or '.join(words)}; write it")
            return found

        target = None
        match word:
            case "SUB":
                target = find(after, "ENDSUB") + 1
            case "CALL":
                self._call_subroutine(name, rest)
            case "ENDSUB" | "RETURN":
                self.shared |= {"#<_VALUE>": self._evaluate(rest)} if rest else {}
                if tape.called is None:
                    raise BlockError("ends a subroutine that wasn't called; call it")
                tape.leave()
            case "IF":
                target = self._branch([mark, *after])
            case "ELSEIF" | "ELSE":
                target = find(after, "ENDIF")
            case "WHILE" if next((mark.word for mark in before if mark.word in _LOOPS), "") == "DO":
                target = find(before, "DO") + 1 if self._holds(rest) else None
            case "WHILE":
                target = None if self._holds(rest) else find(after, "ENDWHILE") + 1
            case "ENDWHILE":
                target = find(before, "WHILE")
            case "REPEAT":
                loops.append((row, _counted(self._evaluate(rest))))
                target = None if loops[-1][1] else find(after, "ENDREPEAT")
            case "ENDREPEAT":
                first = find(before, "REPEAT")
                left = next((left for begin, left in reversed(loops) if begin == first), 0) - 1
                loops[:] = [loop for loop in loops if loop[0] != first]
                if left > 0:
                    loops.append((first, left))
                    target = first + 1
            case "BREAK" if "ENDWHILE" in [m.word for m in after] and _in_do(tape.now.text, name, row):
                raise BlockError("ends the do around its while, too, on LinuxCNC 2.9; write the do as repeat")
            case "BREAK" | "CONTINUE":
                target = find(after, "ENDWHILE", "ENDREPEAT", "WHILE") + (word == "BREAK")
        if target is not None:
            tape.go_to(target)

    def _holds(self, condition: str) -> bool:
        return self._evaluate(condition) != 0.0

    def _branch(self, marks: Iterable[_Mark]) -> int:
        """Return the row at which IF goes on."""
        for mark in marks:
            if mark.word in ("ELSE", "ENDIF") or (mark.word in ("IF", "ELSEIF") and self._holds(mark.rest)):
                return mark.row + 1
        raise BlockError("IF without ENDIF; write it")

    def _call_subroutine(self, name: str, rest: str) -> None:
        """Call a subroutine of LinuxCNC; arguments that aren't given are 0."""
        own, values, at = {f"#{number}": 0.0 for number in range(1, _OWN_LINUXCNC + 1)}, [], 0
        while at < len(rest):
            end = _closing(rest, at)
            values.append(self._evaluate(rest[at:end]))
            at = end
        if len(values) > _OWN_LINUXCNC:
            raise BlockError(f"a call with {len(values)} arguments, of at most {_OWN_LINUXCNC}; correct it")
        own |= {f"#{number}": value for number, value in enumerate(values, start=1)}
        self.own_up_to = _OWN_LINUXCNC
        for text in (self.tape.now.text, self.tape.stack[0].text, self._beside([name.strip("<>")])):
            for mark in [] if text is None else _marks(text, name):
                if text is not None and mark.word == "SUB":
                    return self._enter(text, mark.row + 1, 1, own)
        raise BlockError(
            f"calls the subroutine O{name}, which is neither in this file nor in one of this name beside it; "
            "put the file there, or post one program with all moves"
        )


def _marks(text: Text, name: str) -> list[_Mark]:
    """Return the O words of a name, or the loops of a number, in a file."""
    rows = text.labels(_DO_LOOPS if name.startswith("DO") else _O_WORDS).get(name.removeprefix("DO"), ())
    found = (_Mark.of(without_head(compact_code(text.lines[row])), row) for row in rows)
    return [mark for mark in found if mark is not None]


def _in_do(text: Text, name: str, row: int) -> bool:
    """Check whether a row is between the DO and the WHILE of a loop of another name."""
    for other in text.labels(_O_WORDS).keys() - {name.strip("<>"), name}:
        loop = [mark for mark in _marks(text, other) if mark.word in ("DO", "WHILE")]
        if any(a.word == "DO" and a.row < row < b.row for a, b in pairwise(loop)):
            return True
    return False


def _counted(value: float) -> int:
    """Return a number that counts; raises BlockError if it isn't whole, within rounding, or is negative."""
    number = round(value)
    if number < 0 or abs(value - number) > 1e-4:
        raise BlockError(f"{value:g} where a whole number from 0 is expected; correct it")
    return number


def _key(name: str) -> str:
    """Return the same key for ``#1`` and ``#001``; KeyError for a name of another language, such as R1."""
    if name[0] != "#":
        raise KeyError(name)
    return name if name[1] == "<" else f"#{int(name[1:20])}"


def _closing(code: str, start: int) -> int:
    """Return the index after the closing bracket; the end of the block if it isn't closed."""
    depth = 0
    for sign in _BRACKET.finditer(code, start):
        depth += 1 if sign[0] == "[" else -1
        if depth == 0:
            return sign.end()
    return len(code)
