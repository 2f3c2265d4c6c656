"""Write files whole or not at all, and refuse those too large to be read."""

from __future__ import annotations

import csv
import io
import os
import uuid
from collections.abc import Iterable
from pathlib import Path

from fiveaxis.errors import InputError, SettingError

# Bytes: larger files aren't read. A block takes some 40 bytes and a triangle 50, so these are paths of ten
# million locations and meshes of twenty million triangles: more than is in use, and less than fills the
# memory of a computer.
MEGABYTE = 1_000_000
MOST_PATH_BYTES = 400 * MEGABYTE
MOST_MESH_BYTES = 1000 * MEGABYTE


def require_size(path: str | Path, size: int, most: int, error: type[InputError]) -> None:
    """Raise if a file is too large to be read.

    Parameters
    ----------
    path : the file, for the message
    size, most : bytes, unpacked, and the largest size allowed
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
    r"""Write a file whole or not at all.

    The content is written under a temporary name in the same folder and then renamed in one step
    (`Path.replace`): a reader, or a control that loads programs over the network, sees the old file or the
    new one. Missing folders are made.

    Parameters
    ----------
    path : the file; an existing one is replaced, and for a link the file that it leads to
    content : text is written as UTF-8 with its own line ends (``\n``), on every platform

    Returns
    -------
    `path`

    Raises
    ------
    SettingError
        The file can't be written, or `path` isn't a file (a device, a pipe, a folder); nothing is left
        behind.
    """
    target = Path(path)
    data = content.encode("utf-8") if isinstance(content, str) else content
    # Not `tempfile`: its files are readable by their owner alone, and the rename would keep that.
    name = f".{uuid.uuid4().hex}.part"
    try:
        real = _follow_link(target)
        real.parent.mkdir(parents=True, exist_ok=True)
        temporary = real.parent / name
        try:
            _write_to_disk(temporary, data)
            temporary.replace(real)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=target) from None
    return target


def _follow_link(target: Path) -> Path:
    """Follow a link, and refuse what a rename would destroy: a device, a pipe, a socket."""
    try:
        real = target.resolve() if target.is_symlink() else target
    except RuntimeError:  # what `pathlib` raises before Python 3.13
        raise SettingError("can't be written: its links lead in a circle", file=target) from None
    if real.exists() and not real.is_file():
        kind = "a folder" if real.is_dir() else "no regular file"
        raise SettingError(f"can't be written: it is {kind}; name a file", file=target)
    return real


def _write_to_disk(path: Path, data: bytes) -> None:
    """Write a new file through to the disk, so that a power cut after the rename can't leave it empty."""
    with path.open("xb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Compose the text of a CSV table."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
