"""A text file as lines, and errors that point into it."""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path

from fiveaxis.errors import ToolpathError
from fiveaxis.files import MOST_PATH_BYTES, require_size

# What a text file may hold below the space: tab, line ends, form feed, and the end mark of DOS.
_CONTROL_BYTES = bytes(set(range(32)) - set(b"\t\n\r\f\x1a"))

_UTF_16 = (b"\xff\xfe", b"\xfe\xff")

# Of cutter locations in APT, by the names that CAM systems give them.
APT_SUFFIXES = (".apt", ".cls", ".clsf", ".ncl", ".aptsource")


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


def lists_locations(path: str | Path) -> bool:
    """Tell whether a file is a list of cutter locations, by its name: it says nothing of axes."""
    suffixes = [s.lower() for s in Path(path).suffixes if s.lower() != ".gz"]
    return bool(suffixes) and suffixes[-1] in APT_SUFFIXES


def load_source(path: str | Path) -> Source:
    r"""Read a text file, unpacked if its name ends in ``.gz``.

    UTF-8 is tried first. A file that isn't UTF-8 is read as Latin-1: the words of every format are ASCII, so
    that concerns names in comments only.

    Raises
    ------
    ToolpathError
        The file is missing, too large, can't be unpacked, or isn't text.
    """
    data = _load_bytes(Path(path))
    _require_text(data, path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    # Not `splitlines`: that also splits at form feeds and Unicode separators, and editors count none of them.
    return Source(str(path), text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a").split("\n"))


def _require_text(data: bytes, path: str | Path) -> None:
    """Refuse what holds bytes of no text, and name the line; UTF-16 is full of them and named itself."""
    places = [data.index(byte) for byte in _CONTROL_BYTES if byte in data]
    if not places:
        return
    place = min(places)
    # Every other byte of ASCII in UTF-16 is 0.
    head = data[:200]
    if head[:2] in _UTF_16 or 0.4 * len(head) < head.count(0) < 0.6 * len(head):
        raise ToolpathError("isn't a text file in UTF-8: it looks like UTF-16; save it as UTF-8", file=path)
    before = data[:place].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    raise ToolpathError(
        f"isn't a text file: it holds the byte 0x{data[place]:02x}; take it out, or give the file that the "
        "program was written to",
        file=path,
        line=before.count(b"\n") + 1,
    )


def _load_bytes(path: Path) -> bytes:
    try:
        require_size(path, path.stat().st_size, MOST_PATH_BYTES, ToolpathError)
        # A small packed file may unpack to any size: no more of it is unpacked than may be read.
        with gzip.open(path) if path.suffix.lower() == ".gz" else path.open("rb") as stream:
            data = stream.read(MOST_PATH_BYTES + 1)
        require_size(path, len(data), MOST_PATH_BYTES, ToolpathError)
        return data
    except (gzip.BadGzipFile, EOFError, zlib.error) as fault:
        raise ToolpathError(f"can't be unpacked: {fault}", file=path) from None
    except (OSError, ValueError) as fault:  # ValueError: a null character in the name
        reason = fault.strerror if isinstance(fault, OSError) else str(fault)
        raise ToolpathError(f"can't be read: {reason}", file=path) from None
