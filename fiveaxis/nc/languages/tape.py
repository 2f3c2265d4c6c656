"""The order in which the lines of a program are run: subprograms, repeated parts, loops, files that it calls.

A language says where a call or a repetition leads; what is common is here: the stack of stretches, the step
and the line of what is run, and the bounds of all that.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from pathlib import Path

from fiveaxis.base import ToolpathError
from fiveaxis.nc.languages.block import BlockError, block_error, upper_ascii
from fiveaxis.nc.source import Source, load_source

# Lines that are prepared at a time: their arrays fit into the processor's cache.
PART = 10_000
# Prepared parts that are kept: a subprogram may lie across the border of two.
MOST_PARTS = 4

# Subprograms and repetitions within one another: controls allow from 8 (Sinumerik) to 20 (Klartext).
DEEPEST = 20
# Lines that run beyond those of the file, as many of them as are read one by one, and calls and repetitions:
# what is more doesn't end. They bound the time to some seconds.
MOST_REPEATED, MOST_SINGLE, MOST_JUMPS = 1_000_000, 60_000, 25_000


class Text:
    """The lines of a file, and the same in upper case without comments, part by part.

    Parameters
    ----------
    source : the file
    comments : pattern of comments in plain lines
    """

    def __init__(self, source: Source, comments: re.Pattern[str]) -> None:
        self.source, self.lines, self._comments = source, source.lines, comments
        self._parts: dict[int, tuple[str, list[int]]] = {}
        self._labels: dict[re.Pattern[str], dict[str, list[int]]] = {}

    def plain(self, row: int) -> tuple[str, int]:
        """Return the prepared part that has a row, and the index at which the row begins in it."""
        first = row - row % PART
        if first not in self._parts:
            if len(self._parts) == MOST_PARTS:
                del self._parts[next(iter(self._parts))]
            some = upper_ascii("\n".join(self.lines[first : first + PART])) + "\n"
            text = self._comments.sub("", some)
            self._parts[first] = text, [0, *accumulate(len(line) + 1 for line in text.split("\n"))]
        text, offsets = self._parts[first]
        return text, offsets[row - first]

    def labels(self, pattern: re.Pattern[str]) -> Mapping[str, list[int]]:
        """Return the rows of each label, by the first group of a pattern of the beginning of a line."""
        if pattern not in self._labels:
            found: dict[str, list[int]] = {}
            for row, line in enumerate(self.lines):
                if (label := pattern.match(upper_ascii(line))) is not None:
                    found.setdefault(label[1], []).append(row)
            self._labels[pattern] = found
        return self._labels[pattern]


@dataclass
class Stretch:
    """Lines that are run: of the program, of a subprogram, or a part that is repeated.

    Parameters
    ----------
    text : the file
    begin, end : first row, and the one after the last
    left : how often they are run again after this time
    called : whether it is a subprogram, which a return ends; the program itself is none
    line : of the program, of the call, where the file is another one; else 0
    row : the next one
    loops : rows of the loops that it is in, with what they count
    leave : restores what was local before the subprogram
    """

    text: Text
    begin: int
    end: int
    left: int = 0
    called: bool = False
    line: int = 0
    row: int = 0
    loops: list[tuple[int, float]] = field(default_factory=list)
    leave: Callable[[], None] | None = None

    @property
    def is_file(self) -> bool:
        """Whether it is another file that is called."""
        return self.leave is not None


class Tape:
    """Where a program is run; `comments` is as for `Text`.

    `step` is that of the line that is being run, from 1; the line itself up to the first jump.
    """

    def __init__(self, source: Source, comments: re.Pattern[str]) -> None:
        self._comments = comments
        self._files: dict[Path, Text] = {}
        text = Text(source, comments)
        self.stack = [Stretch(text, 0, len(text.lines))]
        self.step, self.jumps = 0, 0
        self._begun = 0
        self.source, self._single = source, 0

    @property
    def now(self) -> Stretch:
        """The stretch that is being run."""
        return self.stack[-1]

    @property
    def line(self) -> int:
        """Line of the program that is being run: of the call, in another file."""
        return self.now.line or self._begun + 1

    @property
    def row(self) -> int:
        """Row, in its file, of the line that is being run."""
        return self._begun

    @property
    def called(self) -> Stretch | None:
        """The subprogram that is being run; None in the program itself."""
        return next((stretch for stretch in reversed(self.stack) if stretch.called), None)

    def goes_on(self) -> bool:
        """Go to the next line; return whether there is one."""
        while self.now.row >= self.now.end:
            if len(self.stack) == 1:
                return False
            if self.now.called and not self.now.is_file:
                raise self.error("the subprogram that ends here has no return; write it")
            self._end()
        self._begun = self.now.row
        return True

    def take(self, count: int = 1) -> str:
        """Take lines; return the first."""
        text = self.now.text.lines[self.now.row]
        self.now.row += count
        self.step += count
        if self.jumps:
            self._single += count == 1
            own = len(self.stack[0].text.lines)
            if self.step > own + MOST_REPEATED or self._single > own + MOST_SINGLE:
                raise self.error(f"{self.step - own} lines are repeated, too many to be meant; {_ENDLESS}")
        return text

    @cached_property
    def _beside(self) -> dict[str, Path]:
        """The files of the program's folder, by their names in lower case."""
        with suppress(OSError, ValueError):
            paths = sorted(Path(self.source.name).parent.iterdir(), reverse=True)
            return {path.name.lower(): path for path in paths}
        return {}

    # What a line may ask for

    def repeat(self, begin: int, end: int, count: int) -> None:
        """Run rows of the same file a number of times, then go on after this line."""
        if count > 0:
            now = self.now
            self._push(Stretch(now.text, begin, end, count - 1, line=now.line, row=begin))

    def call(self, row: int, count: int = 1) -> None:
        """Run a subprogram of the same file from a row to its return, a number of times."""
        if count > 0:
            now, end = self.now, len(self.now.text.lines)
            self._push(Stretch(now.text, row, end, count - 1, called=True, line=now.line, row=row))

    def call_file(self, text: Text, leave: Callable[[], None] | None, count: int = 1, row: int = 0) -> None:
        """Run another file from a row on, a number of times; its lines count as that of the call."""
        if count > 0:
            end, line = len(text.lines), 0 if text is self.stack[0].text else self.line
            self._push(Stretch(text, row, end, count - 1, called=True, line=line, row=row, leave=leave))

    def leave(self) -> None:
        """Return from the subprogram that is being run, or begin it again."""
        while not self.now.called:
            self.stack.pop()
        self.now.loops.clear()
        self._end()

    def _end(self) -> None:
        """End a stretch, or begin it again."""
        if self.now.leave is not None:
            self.now.leave()
        if self.now.left:
            self.now.left -= 1
            self.go_to(self.now.begin)
        else:
            self.stack.pop()

    def go_to(self, row: int) -> None:
        """Go on at another row of the stretch."""
        self._count()
        self.now.row = row

    def open_file(self, name: str, suffixes: tuple[str, ...]) -> Text:
        """Load a file beside the program, whatever the case of its name, which may be without its suffix.

        The language's suffixes are tried in their order. `BlockError` if there is no file, or it can't be
        read.
        """
        found = self.file_beside(name, suffixes)
        if found is None:
            raise BlockError(f"calls {name}, and no such file is beside the program; put it there")
        return found

    def file_beside(self, name: str, suffixes: tuple[str, ...]) -> Text | None:
        """Load a file beside the program, as `open_file`; None if there is none."""
        wanted = [name.lower(), *(f"{name}{suffix}".lower() for suffix in suffixes)]
        path = next((self._beside[key] for key in wanted if key in self._beside), None)
        if path is None:
            return None
        if path not in self._files:
            try:
                self._files[path] = Text(load_source(path), self._comments)
            except ToolpathError as fault:
                raise BlockError(f"calls {path.name}: {fault.message}") from None
        return self._files[path]

    def error(self, fault: object) -> ToolpathError:
        """Return an error on the line that is being run, which may be one of another file."""
        if self.now.line:
            fault = self.within + block_error(self.now.text.source, self._begun + 1, fault).message
        return block_error(self.source, self.line, fault)

    @property
    def within(self) -> str:
        """The file and the line in it that is being run, where the program calls another file; else empty."""
        now = self.now
        return f"in {Path(now.text.source.name).name}, line {self._begun + 1}, " if now.line else ""

    def _push(self, stretch: Stretch) -> None:
        if len(self.stack) > DEEPEST:
            raise BlockError(f"more than {DEEPEST} calls and repetitions within one another; {_ENDLESS}")
        self._count()
        self.stack.append(stretch)

    def _count(self) -> None:
        self.jumps += 1
        if self.jumps > MOST_JUMPS:
            raise self.error(f"more than {MOST_JUMPS} calls and repetitions; {_ENDLESS}")


_ENDLESS = "correct what doesn't end, or post one program with all moves"
