"""A text file as lines, and errors that point into it."""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path

from fiveaxis.errors import ToolpathError

# What a text file may hold below the space: tab, line ends, form feed, and the end mark of DOS.
_CONTROL_BYTES = bytes(set(range(32)) - set(b"\t\n\r\f\x1a"))


@dataclass(frozen=True)
class Source:
    """A file that is being read.

    Parameters
    ----------
    name : the path as the user gave it
    lines : without line ends; ``lines[0]`` is line 1
    """

    name: str
    lines: list[str]

    def error(self, message: str, line: int | None = None) -> ToolpathError:
        """Make the error for a fault on a line, counted from 1."""
        return ToolpathError(message, file=self.name, line=line)


def load_source(path: str | Path) -> Source:
    r"""Read a text file, unpacked if its name ends in ``.gz``.

    UTF-8 is tried first. A file that isn't UTF-8 is read as Latin-1: the words of every format are ASCII, so
    that concerns names in comments only.

    Raises
    ------
    ToolpathError
        The file is missing, can't be unpacked, or isn't text.
    """
    data = _load_bytes(Path(path))
    found = next((b for b in _CONTROL_BYTES if b in data), None)
    if found is not None:
        raise ToolpathError(f"isn't a text file: it holds the byte 0x{found:02x}", file=path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    # Not `splitlines`: that also splits at form feeds and Unicode separators, and editors count none of them.
    return Source(str(path), text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a").split("\n"))


def _load_bytes(path: Path) -> bytes:
    try:
        data = path.read_bytes()
        return gzip.decompress(data) if path.suffix.lower() == ".gz" else data
    except (gzip.BadGzipFile, EOFError, zlib.error) as fault:
        raise ToolpathError(f"can't be unpacked: {fault}", file=path) from None
    except (OSError, ValueError) as fault:  # ValueError: a null character in the name
        reason = fault.strerror if isinstance(fault, OSError) else str(fault)
        raise ToolpathError(f"can't be read: {reason}", file=path) from None
