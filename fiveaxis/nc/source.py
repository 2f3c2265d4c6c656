"""Text files as lines, and errors with the line's number."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

from fiveaxis.base import (
    MESH_SUFFIXES,
    MOST_PATH_BYTES,
    Finding,
    Place,
    Severity,
    ToolpathError,
    kept_by_file,
    read_input,
)

# Control characters but tab, line ends, form feed and the end mark of DOS: no text file has them.
_CONTROL_BYTES = bytes(set(range(32)) - set(b"\t\n\r\f\x1a"))
# But these, of paper tapes and serial lines, are left out: NUL, SI, XON and XOFF with their like, DEL.
_OF_TAPES = b"\x00\x0f\x11\x12\x13\x14\x7f"

# Lines that are searched for what a header states.
HEAD = 100
# A comment of any control; a second blank begins the continuation of a longer one.
_SIGN = r"\s*(?:N?[0-9]+ )?[(;] ?"
_COMMENT, _CONTINUED = _SIGN + r"{}: ([^)]*)\)?\s*", re.compile(_SIGN + r"  (\S[^)]*)\)?\s*")

_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True)
class Source:
    """A file that is being read.

    Parameters
    ----------
    name : the path as given by the user
    lines : without line ends; ``lines[0]`` is line 1
    unread : last lines of parts that are left out, empty lines in their place
    notes : what was left out when it was loaded
    language : word of the option, if the caller says that it is a program in one
    data : bytes of the file, unpacked; empty for lines that are no file's
    """

    name: str
    lines: list[str]
    unread: tuple[int, ...] = ()
    notes: tuple[Finding, ...] = ()
    language: str | None = field(default=None, compare=False)
    data: bytes = field(default=b"", compare=False, repr=False)

    def error(self, message: str, line: int | None = None) -> ToolpathError:
        """Create the error for a fault on a line, counted from 1."""
        return ToolpathError(message, file=self.name, line=line)

    def finding(
        self, severity: Severity, code: str, message: str, line: int | None = None, value: float | None = None
    ) -> Finding:
        """Create a finding on a line."""
        return Finding(severity, code, message, Place(line=line, file=self.name), value)

    def stated(self, name: str) -> str | None:
        """Return what the header of a program by this package states under a name, in lower case, or None.

        Only a comment of its own counts, not the same words in the name of a file or a machine.
        """
        pattern = re.compile(_COMMENT.format(re.escape(name)), re.IGNORECASE)
        head = [text[:200] for text in self.lines[:HEAD]]
        first = next((n for n, text in enumerate(head) if pattern.fullmatch(text)), None)
        if first is None:
            return None
        rest = takewhile(bool, (_CONTINUED.fullmatch(text) for text in head[first + 1 :]))
        parts = [match[1] for match in (pattern.fullmatch(head[first]), *rest) if match is not None]
        return re.sub(r"\W*$", "", " ".join(parts).lower())


@kept_by_file(4)
def load_source(path: str | Path) -> Source:
    r"""Read a text file, decompressed if its name ends in ``.gz``.

    A file that isn't UTF-8 is read as Latin-1: this affects only comments, as the words of every format are
    ASCII. Control characters of paper tapes and serial lines are left out, with a note.

    Raises
    ------
    ToolpathError
        The file is missing, too large, can't be unpacked, or isn't text.
    """
    if Path(path).suffix.lower() in MESH_SUFFIXES:
        raise ToolpathError(
            "is a mesh, and a program or a list of locations is needed here; `fiveaxis optimise` plans a "
            "path on it",
            file=path,
        )
    data = read_input(path, MOST_PATH_BYTES, ToolpathError, unpack=True)
    _require_text(data, path)
    notes = _notes(data, path)
    plain = data.translate(None, _OF_TAPES) if notes else data
    text = plain.decode(_encoding(plain)).removeprefix("\ufeff")
    # `splitlines` would also split at form feeds and Unicode separators, which editors don't count.
    lines = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a").split("\n")
    return Source(str(path), lines, notes=notes, data=data)


def with_lines(source: Source, replaced: Mapping[int, tuple[str, ...]]) -> bytes:
    """Return a file with other lines in place of some, and all other bytes as they are: ends of lines, text.

    Parameters
    ----------
    source : of `load_source`
    replaced : line, from 1 -> the lines in its place
    """
    encoding = _encoding(source.data)
    found = re.split(rb"(\r\n|\r|\n)", source.data)
    texts, ends = found[::2], [*found[1::2], b""]
    usual, pieces = ends[0], []
    for line, (text, end) in enumerate(zip(texts, ends, strict=True), start=1):
        own = [text] if line not in replaced else [new.encode(encoding) for new in replaced[line]]
        pieces.append(usual.join(own) + end)
    return b"".join(pieces)


def _encoding(data: bytes) -> str:
    """Return the encoding of a file's text: UTF-8, or else Latin-1, which only comments need."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _notes(data: bytes, path: str | Path) -> tuple[Finding, ...]:
    """Return the note on control characters that are left out."""
    found = {byte: data.index(byte) for byte in _OF_TAPES if byte in data}
    if not found:
        return ()
    count = sum(data.count(byte) for byte in found)
    names = ", ".join(f"0x{byte:02x}" for byte in found)
    message = f"{count} control characters of a tape or a serial line ({names}; the first here) are left out"
    place = Place(line=_line_of(data, min(found.values())), file=str(path))
    return (Finding(Severity.NOTE, "control-characters", message, place, float(count)),)


def _line_of(data: bytes, offset: int) -> int:
    """Return the line, from 1, of a byte."""
    return data[:offset].replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1


def _require_text(data: bytes, path: str | Path) -> None:
    """Raise at the first line with a byte that isn't text, nor of a tape; UTF-16 is recognised."""
    offsets = [data.index(byte) for byte in _CONTROL_BYTES if byte in data]
    if not offsets:
        return
    offset = min(offsets)
    # Every other byte of ASCII in UTF-16 is 0.
    head = data[:200]
    if head[:2] in _UTF_16 or 0.4 * len(head) < head.count(0) < 0.6 * len(head):
        raise ToolpathError("isn't a text file in UTF-8: it looks like UTF-16; save it as UTF-8", file=path)
    if all(byte in _OF_TAPES for byte in _CONTROL_BYTES if byte in data):
        return
    raise ToolpathError(
        f"isn't a text file: it holds the byte 0x{data[offset]:02x}; remove it, or give the original program "
        "file",
        file=path,
        line=_line_of(data, offset),
    )
