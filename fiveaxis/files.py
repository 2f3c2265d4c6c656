"""Writing files so that nobody ever finds half of one, and refusing those too large to be read."""

from __future__ import annotations

import os
import uuid
from pathlib import Path

from fiveaxis.errors import InputError, SettingError

# Bytes: larger files aren't read. A block takes some 40 bytes and a triangle 50, so these are paths of ten
# million locations and meshes of twenty million triangles: more than anybody has been seen to use, and less
# than what fills the memory of a computer.
MEGABYTE = 1_000_000
MOST_PATH_BYTES = 400 * MEGABYTE
MOST_MESH_BYTES = 1000 * MEGABYTE


def require_size(path: str | Path, size: int, most: int, error: type[InputError]) -> None:
    """Refuse what is too large to be read.

    Parameters
    ----------
    path : the file, for the message
    size, most : bytes, what it holds, unpacked, and what it may hold
    error : class of the error raised

    Raises
    ------
    error
        It is larger.
    """
    if size > most:
        raise error(
            f"holds more than {most // MEGABYTE} MB, the most that is read; split it, or make it coarser",
            file=path,
        )


def write_atomically(path: str | Path, content: str | bytes) -> Path:
    r"""Write a whole file or leave things as they were.

    The content goes to a temporary name in the same folder, which then takes the place of `path` in one
    step (`Path.replace`): a reader, or a control that loads programs over the network, sees the old file or
    the new one. Missing folders are made.

    Parameters
    ----------
    path : the file; one that exists is replaced, and where `path` is a link the file that it leads to
    content : text is written as UTF-8 with line ends as they are (``\n``), on every platform

    Returns
    -------
    `path`

    Raises
    ------
    SettingError
        The file can't be written there, or what stands there isn't a file (a device, a pipe, a folder);
        nothing is left behind.
    """
    target = Path(path)
    data = content.encode("utf-8") if isinstance(content, str) else content
    # Not `tempfile`: its files are readable by their owner alone, and the rename would keep that.
    name = f".{uuid.uuid4().hex}.part"
    try:
        place = _place_of(target)
        place.parent.mkdir(parents=True, exist_ok=True)
        temporary = place.parent / name
        try:
            _write_through(temporary, data)
            temporary.replace(place)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=target) from None
    return target


def _place_of(target: Path) -> Path:
    """Follow links, and refuse what a rename would take away for good: a device, a pipe, a socket."""
    try:
        place = target.resolve() if target.is_symlink() else target
    except RuntimeError:  # what `pathlib` raises before Python 3.13
        raise SettingError("can't be written: its links lead in a circle", file=target) from None
    if place.exists() and not place.is_file():
        kind = "a folder" if place.is_dir() else "no regular file"
        raise SettingError(f"can't be written: it is {kind}; name a file", file=target)
    return place


def _write_through(path: Path, data: bytes) -> None:
    """Write a new file down to the disk, so that a power cut after the rename can't leave it empty."""
    with path.open("xb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
