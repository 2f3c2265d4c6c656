"""Reading a program's lines: long runs of plain blocks together, as most are, and all others one by one.

Comments, block numbers and blank lines don't end a run.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray
from fiveaxis.nc.languages.block import NUMBER, Block, BlockError, Triple
from fiveaxis.nc.languages.tape import Tape
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.tables import Dialect

# Shorter runs take longer together than block by block.
SHORTEST = 16

# Components of a tool direction, and of a surface normal; small letters, as words have capital ones.
DIRECTION, NORMAL = "ijk", "uvw"

_BLANKS = bytes(32 if chr(code).isalpha() or code == ord("=") else code for code in range(128))
_MOTIONS = {0.0: "G0", 1.0: "G1"}


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive blocks of G0, G1 or neither and at least one word of an axis or F, each letter once.

    Either all blocks give the tool direction, or none does.

    Parameters
    ----------
    lines : (n,), of the blocks
    begins : (n + 1,), index of the first word of each block, and their number
    letters : (w,), ASCII codes of G, axes and F, and of the letters of `DIRECTION` and `NORMAL`
    values : (w,), as written
    steps : (n,), as `Block.step`
    called : file that the blocks are in, where it is called on `lines`, and the step before its first line
    """

    lines: IntArray
    begins: IntArray
    letters: NDArray[np.uint8]
    values: Array
    steps: IntArray
    called: tuple[str, int] = ("", 0)

    def __len__(self) -> int:
        return len(self.begins) - 1

    def columns(self) -> dict[str, Array]:
        """Return the values of each letter, (n,), NaN where a block doesn't have it."""
        rows = np.repeat(np.arange(len(self)), np.diff(self.begins))
        found = {}
        for code in np.unique(self.letters).tolist():
            column = np.full(len(self), np.nan)
            named = self.letters == code
            column[rows[named]] = self.values[named]
            found[chr(code)] = column
        return found

    def last_words(self) -> dict[str, float]:
        """Return the last value of each letter."""
        return dict(zip(map(chr, self.letters.tolist()), self.values.tolist(), strict=True))

    @property
    def points(self) -> bool:
        """Whether its blocks give the tool direction."""
        return bool(np.isin(self.letters[: self.begins[1]], _codes(DIRECTION)).any())

    def block(self, row: int) -> Block:
        """Return one block."""
        words = slice(self.begins[row], self.begins[row + 1])
        given = dict(zip(map(chr, self.letters[words].tolist()), self.values[words].tolist(), strict=True))
        motion = given.pop("G", None)
        vector, normal = _pop_direction(given, DIRECTION), _pop_direction(given, NORMAL)
        g = () if motion is None else (_MOTIONS[motion],)
        line, step = int(self.lines[row]), int(self.steps[row])
        block = Block(line, g, (), given, vector=vector, normal=normal, step=0 if step == line else step)
        name, before = self.called
        return block._replace(within=f"in {name}, line {step - before}, ") if name else block

    def blocks(self) -> Iterator[Block]:
        """Iterate over its blocks."""
        return map(self.block, range(len(self)))

    def since(self, row: int) -> Run:
        """Return the blocks from one on."""
        begins, words = self.begins[row:], self.begins[row]
        lines, steps = self.lines[row:], self.steps[row:]
        return Run(lines, begins - words, self.letters[words:], self.values[words:], steps, self.called)


def _pop_direction(given: dict[str, float], letters: str) -> Triple | None:
    """Remove a direction from the words of a block and return it; missing components are 0."""
    if given.keys().isdisjoint(letters):
        return None
    x, y, z = (given.pop(letter, 0.0) for letter in letters)
    return x, y, z


def _codes(letters: str) -> list[int]:
    return list(letters.encode("ascii"))


@dataclass(frozen=True)
class PlainLines:
    """A form in which a language writes plain blocks: all with a tool direction, or all without.

    Parameters
    ----------
    pattern : any number of whole lines of the form, without comments, and of blank ones, with their line ends
    begin : pattern of what stands for G1 at the beginning of a line, if not G1 itself
    directions : how the components of directions are written: ``A3=`` -> a letter of `DIRECTION` or `NORMAL`
    """

    pattern: re.Pattern[str]
    begin: re.Pattern[str] | None = None
    directions: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of_words(
        cls, axes: str, between: str, pointing: str = "", directions: Mapping[str, str] = MappingProxyType({})
    ) -> PlainLines:
        """Return the form of ISO words, ``N10 G1 X1.5 F100``; `axes` are letters of words besides F.

        `between` is the pattern between letter and number, `pointing` that of a word that every block has,
        as it gives the tool direction. `directions` are those of the form.
        """
        names = "|".join([*directions, f"[{axes}F]{between}"])
        ahead = rf"(?=[^\n]*(?:{pointing}))" if pointing else ""
        words = rf"{ahead}(?:G0?[01](?![0-9.])[ \t]*+)?+(?:(?:{names}){NUMBER}[ \t]*+)++"
        pattern = rf"(?:[ \t]*+(?:N[0-9]++[ \t]*+)?+(?:{words})?+\n)*+"
        return cls(re.compile(pattern), directions=directions)

    def lines(self, text: str, begin: int) -> str:
        """Return the lines of the form from an index on, empty if the first isn't one of them."""
        found = self.pattern.match(text, begin)
        return "" if found is None else found[0]

    def parse(self, text: str, line: int) -> tuple[Run, int]:
        """Split lines of the form into their blocks, and count these lines.

        The first one has the number `line`. Lines from the first one on that has a letter twice are left
        out.
        """
        plain = text if self.begin is None else self.begin.sub("G1 ", text)
        for written, letter in self.directions.items():
            plain = plain.replace(written, letter)
        data = plain.encode("ascii")
        codes = np.frombuffer(data, dtype=np.uint8)
        at = np.flatnonzero(codes >= ord("A"))
        values = np.fromstring(data.translate(_BLANKS.ljust(256)), sep=" ")
        row = np.searchsorted(np.flatnonzero(codes == ord("\n")), at)
        kept = codes[at] != ord("N")
        row, letters = row[kept], codes[at][kept]
        order = np.argsort(row * 128 + letters, kind="stable")
        twice = (np.diff(row[order]) == 0) & (np.diff(letters[order]) == 0)
        count = int(row[order][1:][twice].min()) if twice.any() else plain.count("\n")
        begins = np.searchsorted(row, np.arange(count + 1))
        filled, end = np.flatnonzero(np.diff(begins)), begins[-1]
        lines, begins = line + filled, np.append(begins[filled], end)
        run = Run(lines, begins, letters[:end], values[kept][:end], lines)
        return run, count


class Reader(ABC):
    """Reads the blocks of a program in one language, line by line, and follows what they change.

    Source, block delete and control are as for `Language.split`.
    """

    # The forms of the language's plain blocks, and its comments in lines of that form.
    forms: ClassVar[Sequence[PlainLines]]
    comments: ClassVar[re.Pattern[str]]

    def __init__(self, source: Source, *, block_delete: bool = False, control: Dialect | None = None) -> None:
        self.source, self.block_delete, self.ended = source, block_delete, False
        self.control, self.tape = control, Tape(source, self.comments)
        self._begin()

    @abstractmethod
    def _begin(self) -> None:
        """Set the state in which a program begins."""

    @abstractmethod
    def read(self, line: int, text: str) -> Iterable[Block]:
        """Read a line, or several that make one block; raises BlockError if it can't be read completely."""

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say, in the present state."""
        return True

    def follow(self, run: Run) -> None:  # noqa: B027
        """Update the state by a run, as `read` does by its lines; by default there is none."""

    def continues(self, text: str) -> bool:
        """Whether a block goes on after this line."""
        return False

    def blocks(self) -> Iterator[Block | Run]:
        """Yield the blocks of the program in the order in which they run, and runs of plain ones.

        `ToolpathError`, with file, line and text, for a block that can't be read.
        """
        tape = self.tape
        while tape.goes_on():
            run, count = self._run_here()
            if run is not None:
                self.follow(run)
                yield run
                continue
            for _ in range(count):
                tape.goes_on()
                line, step, parts = tape.line, tape.step + 1, [tape.take()]
                while self.continues(parts[-1]) and tape.now.row < len(tape.now.text.lines):
                    parts.append(tape.take())
                try:
                    for block in self.read(line, "\n".join(parts)):
                        yield block._replace(step=step, within=tape.within) if tape.jumps else block
                except BlockError as fault:
                    raise tape.error(fault) from None
                if self.ended:
                    return

    def _run_here(self) -> tuple[Run | None, int]:
        """Take the run that begins at the next line; without one, the number of lines to read one by one."""
        tape, now = self.tape, self.tape.now
        if not self.is_plain or (now.row and self.continues(now.text.lines[now.row - 1])):
            return None, 1
        text, begin = now.text.plain(now.row)
        run, count = self._run_at(text, begin, now.row + 1)
        if run is None or now.row + count > now.end:
            return None, min(count, now.end - now.row)
        if tape.jumps:
            before = tape.step - now.row
            run = replace(run, steps=run.lines + before)
            if now.line:
                called = Path(now.text.source.name).name, before
                run = replace(run, lines=np.full(len(run), now.line), called=called)
        tape.take(count)
        return run, count

    def _run_at(self, text: str, begin: int, line: int) -> tuple[Run | None, int]:
        """Return the run that begins at an index of lines without comments, and the number of its lines.

        None if it is too short, with the number of lines to read one by one.
        """
        plain, form = max(((form.lines(text, begin), form) for form in self.forms), key=lambda p: len(p[0]))
        count = plain.count("\n")
        if count < SHORTEST:
            return None, count + 1
        run, count = form.parse(plain, line)
        return (run, count) if len(run) >= SHORTEST else (None, count + 1)
