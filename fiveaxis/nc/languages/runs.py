"""Runs: consecutive plain blocks, split into words together, as most lines of a long program are."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.draft import NUMBER

# Lines that are searched for runs at a time: their arrays fit into the processor's cache.
PART = 10_000
# Shorter runs take longer together than block by block.
SHORTEST = 16

_BLANKS = bytes(32 if chr(code).isalpha() or code == ord("=") else code for code in range(128))
_MOTIONS = {0.0: "G0", 1.0: "G1"}


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive blocks of G0, G1 or neither and at least one word of an axis or F, each letter once.

    Parameters
    ----------
    line : of the first block
    begins : (n + 1,), index of the first word of each block, and their number
    letters : (w,), ASCII codes, G included
    values : (w,), as written
    """

    line: int
    begins: IntArray
    letters: NDArray[np.uint8]
    values: Array

    def __len__(self) -> int:
        return len(self.begins) - 1

    @property
    def last_line(self) -> int:
        """Line of the last block."""
        return self.line + len(self) - 1

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

    def block(self, row: int) -> Block:
        """Return one block."""
        words = slice(self.begins[row], self.begins[row + 1])
        given = dict(zip(map(chr, self.letters[words].tolist()), self.values[words].tolist(), strict=True))
        motion = given.pop("G", None)
        return Block(self.line + row, () if motion is None else (_MOTIONS[motion],), (), given)

    def since(self, row: int) -> Run:
        """Return the blocks from one on."""
        begins, words = self.begins[row:], self.begins[row]
        return Run(self.line + row, begins - words, self.letters[words:], self.values[words:])

    def upto(self, count: int) -> Run:
        """Return the first blocks."""
        words = self.begins[count]
        return Run(self.line, self.begins[: count + 1], self.letters[:words], self.values[:words])


@dataclass(frozen=True)
class PlainLines:
    """How a language writes plain blocks.

    Parameters
    ----------
    pattern : any number of whole lines of the form, with their line ends
    begin : pattern of what stands for G1 at the beginning of a line, if not G1 itself
    """

    pattern: re.Pattern[str]
    begin: re.Pattern[str] | None = None

    @classmethod
    def of_words(cls, axes: str, between: str) -> PlainLines:
        """Return the form of ISO words, ``N10 G1 X1.5 F100``, with a pattern between letter and number."""
        words = rf"(?:[{axes}F]{between}{NUMBER}[ \t]*+)++"
        return cls(re.compile(rf"(?:[ \t]*+(?:N[0-9]++[ \t]*+)?+(?:G0?[01](?![0-9.])[ \t]*+)?+{words}\n)*+"))

    def parse(self, text: str, line: int) -> Run:
        """Split lines of the form; those after the first that has a letter twice are left out."""
        plain = text if self.begin is None else self.begin.sub("G1 ", text)
        data = plain.encode("ascii")
        codes = np.frombuffer(data, dtype=np.uint8)
        at = np.flatnonzero(codes >= ord("A"))
        values = np.fromstring(data.translate(_BLANKS.ljust(256)), sep=" ")
        row = np.searchsorted(np.flatnonzero(codes == ord("\n")), at)
        kept = codes[at] != ord("N")
        row, letters = row[kept], codes[at][kept]
        count = plain.count("\n")
        run = Run(line, np.searchsorted(row, np.arange(count + 1)), letters, values[kept])
        order = np.argsort(row * 128 + letters, kind="stable")
        twice = (np.diff(row[order]) == 0) & (np.diff(letters[order]) == 0)
        return run.upto(int(row[order][1:][twice].min())) if twice.any() else run


def lines_and_runs(
    lines: Sequence[str], form: PlainLines, ready: Callable[[], bool] = lambda: True
) -> Iterator[tuple[int, str | Run]]:
    """Yield each line with its number, and runs of plain ones in their place.

    Parameters
    ----------
    lines : of the program
    form : of its plain blocks
    ready : whether plain blocks mean in the present state what they say; asked before each run
    """
    for first in range(0, len(lines), PART):
        some = lines[first : first + PART]
        text = "\n".join(some) + "\n"
        text = text.upper() if text.isascii() else text
        offsets = [0, *accumulate(len(line) + 1 for line in some)]
        row = 0
        while row < len(some):
            line = first + row + 1
            # In Klartext ~ continues a block on the next line.
            continued = line > 1 and lines[line - 2].rstrip().endswith("~")
            found = None if continued or not ready() else form.pattern.match(text, offsets[row])
            count = 0 if found is None else text.count("\n", offsets[row], found.end())
            if found is not None and count >= SHORTEST:
                run = form.parse(found[0], line)
                count = len(run)
                if count >= SHORTEST:
                    yield line, run
                    row += count
                    continue
            for _ in range(min(count + 1, len(some) - row)):
                yield first + row + 1, some[row]
                row += 1
