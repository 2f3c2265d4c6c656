"""Open inputs that are files of bounded size, and write files whole or not at all."""

from __future__ import annotations

import csv
import errno
import gzip
import hashlib
import io
import os
import platform
import shutil
import signal
import stat
import threading
import time
import uuid
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache, partial, wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from fiveaxis.base.errors import InputError, NoSpace, SettingError

T = TypeVar("T")
P = ParamSpec("P")

# Bytes: larger files aren't read. A block takes some 40 bytes and a triangle 50 to 250, as text, so these are
# paths of ten million locations and meshes of four million triangles or more: more than is in use, and less
# than fills the memory of a computer.
MEGABYTE = 1_000_000
MOST_PATH_BYTES = 400 * MEGABYTE
# Files of parts: exact surfaces, and all that meshes come from.
CAD_SUFFIXES = (".step", ".stp", ".iges", ".igs")
MESH_SUFFIXES = (".stl", ".ply", ".obj", ".off", *CAD_SUFFIXES)
MOST_MESH_BYTES = 1000 * MEGABYTE
# TOML and configurations of controls: written by hand, and the largest known ones have some 100 kB.
MOST_SETTINGS_BYTES = MEGABYTE
# Beginning of the names of temporary files and folders.
TEMPORARY = ".fiveaxis-"
# Windows refuses to replace or remove a file that another program has open: an antivirus for a moment, a
# spreadsheet until it is closed. Its error codes; how often it is tried again, and the s in between.
HELD, MOST_TRIES, PAUSE = (5, 32, 33), 40, 0.05
# Path, size, inode, and the times (ns) of the last change of the content, which a copy may set to that of its
# original, and of anything of the file: while they stay, a file is what it was. The clocks of file systems
# are coarse, so this doesn't hold for one that was changed within so many ns; those of memory cards and old
# network drives count whole seconds, or every second one.
State = tuple[str, int, int, int, int]
SECOND = 1_000_000_000
SETTLED, SETTLED_IN_SECONDS = SECOND // 10, 2 * SECOND + SECOND // 10
# Hashes of the files that were read.
_HASHES: dict[State, str] = {}
# A spreadsheet takes text that begins so for a formula; in wide form too, where East Asian text is typed.
FORMULA = tuple("=+-@＝＋－＠")


def require_file(path: str | Path, error: type[InputError]) -> os.stat_result:
    """Raise unless a path, or what it links to, is a regular file, without opening it; return its state.

    A pipe would be waited for without end, a device such as ``/dev/zero`` never ends, and opening one may act
    on it.

    Raises
    ------
    error
        No file of that name, a folder, a pipe, a socket, a device, a name that no file can have.
    """
    try:
        found = Path(path).stat()
    except (FileNotFoundError, NotADirectoryError):
        raise error("no such file", file=path) from None
    except (OSError, ValueError) as fault:  # ValueError: a null character in the name
        raise _unreadable(path, fault, error) from None
    if not stat.S_ISREG(found.st_mode):
        kind = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe, a socket or a device"
        raise error(f"is {kind}; name a file", file=path)
    return found


def is_file(path: str | Path) -> bool:
    """Check whether a path is a regular file; False for a name that no file can have."""
    try:
        require_file(path, InputError)
    except InputError:
        return False
    return True


def read_input(path: str | Path, most: int, error: type[InputError], *, unpack: bool = False) -> bytes:
    """Read a file of bounded size, also when it is unpacked; every reader opens its input here.

    Parameters
    ----------
    most : bytes, unpacked, the largest size allowed
    unpack : decompress a file whose name ends in ``.gz``

    Raises
    ------
    error
        No regular file (`require_file`), no permission, too large, damaged compression.
    """
    packed = unpack and Path(path).suffix.lower() == ".gz"
    _require_size(path, require_file(path, error).st_size, most, error)
    try:
        # A small compressed file may unpack to any size, and a file may grow, so reading is limited too.
        with Path(path).open("rb") as stream:
            state, data = _state(path, os.fstat(stream.fileno())), stream.read(most + 1)
        if len(data) <= most:
            _HASHES[state] = hashlib.sha256(data).hexdigest()
        if packed:
            with gzip.open(io.BytesIO(data)) as stream:
                data = stream.read(most + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as fault:
        raise error(f"can't be unpacked: {fault}", file=path) from None
    except OSError as fault:
        raise _unreadable(path, fault, error) from None
    _require_size(path, len(data), most, error)
    return data


def hash_input(path: str | Path, error: type[InputError]) -> str:
    """Compute the SHA-256 of a file, hexadecimal; of one that was read and hasn't changed, of what was read.

    It raises an `error` as `require_file`, and without permission.
    """
    state = _state(path, require_file(path, error))
    if state in _HASHES and _is_settled(state):
        return _HASHES[state]
    try:
        with Path(path).open("rb") as stream:
            _HASHES[state] = hashlib.file_digest(stream, "sha256").hexdigest()
            return _HASHES[state]
    except OSError as fault:
        raise _unreadable(path, fault, error) from None


def kept_by_file(most: int) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorate the reader of a file, its first argument, so that a file which stays as it is is read once.

    One run asks for the same file in several stages: to check, to plan, to verify and to show. What is
    returned is shared, so nobody may change it. The last files are kept, `most` of them.
    """

    def decorate(read: Callable[P, T]) -> Callable[P, T]:
        @lru_cache(most)
        def kept(_state: State, *args: P.args, **how: P.kwargs) -> T:
            return read(*args, **how)

        @wraps(read)
        def reading(*args: P.args, **how: P.kwargs) -> T:
            path: Any = args[0]
            named: dict[str, Any] = dict(how)
            try:
                state = _state(path, Path(path).stat())
            except (OSError, ValueError):  # the reader says what is wrong
                return read(*args, **how)
            return kept(state, *args, **named) if _is_settled(state) else read(*args, **how)

        return reading

    return decorate


def _state(path: str | Path, found: os.stat_result) -> State:
    return os.path.realpath(path), found.st_size, found.st_ino, found.st_mtime_ns, found.st_ctime_ns


def _is_settled(state: State) -> bool:
    changed = state[3]
    return time.time_ns() - changed > (SETTLED if changed % SECOND else SETTLED_IN_SECONDS)


def _require_size(path: str | Path, size: int, most: int, error: type[InputError]) -> None:
    if size > most:
        raise error(
            f"holds more than {most // MEGABYTE} MB, the most that is read; check that it is the right file, "
            "split it, or make it coarser",
            file=path,
        )


def _unreadable(path: str | Path, fault: OSError | ValueError, error: type[InputError]) -> InputError:
    reason = fault.strerror if isinstance(fault, OSError) else None
    return error(f"can't be read: {reason or fault}", file=path)


def require_suffix(path: str | Path, known: Collection[str], what: str) -> str:
    """Return the suffix of a file to be written, in lower case: it says the format.

    `SettingError` if it is none of those that are known for `what`, the kind of the file.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        *others, last = known
        listed = f"{', '.join(others)} or {last}" if others else last
        raise SettingError(f"is not a name for {what}; let it end in {listed}", file=path)
    return suffix


def require_new(path: Path, cure: str = "name another file, or move it") -> None:
    """Raise `SettingError` for a file that exists, with what to do then."""
    if os.path.lexists(path):  # not `Path.exists`, which raises for a name that is too long
        raise SettingError(f"exists already and isn't overwritten; {cure}", file=path)


def write_atomically(path: str | Path, content: str | bytes) -> Path:
    r"""Write a file whole or not at all, and return its path.

    The content is written under a temporary name in the same folder and then renamed in one step
    (`Path.replace`): a reader, or a control that loads programs over the network, sees the old file or the
    new one. Missing folders are made.

    Parameters
    ----------
    path : the file; an existing one is replaced, and for a link the file that it leads to
    content : text is written as UTF-8 with its own line ends (``\n``), on every platform

    Raises
    ------
    SettingError
        The file can't be written, or `path` isn't a file (a device, a pipe, a folder); nothing is left
        behind.
    """
    target = Path(path)
    data = content.encode("utf-8") if isinstance(content, str) else content
    try:
        real = _follow_link(target)
        real.parent.mkdir(parents=True, exist_ok=True)
        remove_leftovers(real.parent)
        # Not `tempfile`: its files are readable by their owner alone, and the rename would keep that.
        temporary = real.parent / _temporary_name()
        try:
            _write_to_disk(temporary, data)
            persistently(lambda: temporary.replace(real))
        finally:
            temporary.unlink(missing_ok=True)
    except (OSError, ValueError) as fault:  # ValueError: a null character in the name
        raise unwritable(target, fault) from None
    return target


def persistently(act: Callable[[], T]) -> T:
    """Do what Windows may refuse for a moment, and raise its error if it still does after two seconds."""
    for _ in range(MOST_TRIES):
        try:
            return act()
        except OSError as fault:
            if getattr(fault, "winerror", None) not in HELD:
                raise
            time.sleep(PAUSE)
    return act()


def unwritable(path: Path, fault: OSError | ValueError) -> SettingError:
    """Make the error of a file or folder that can't be written; a full disk is no wrong input."""
    reason = fault.strerror if isinstance(fault, OSError) else None
    if isinstance(fault, OSError) and fault.errno in (errno.ENOSPC, errno.EDQUOT):
        return NoSpace(f"can't be written: {reason}; make room, and run it again", file=path)
    return SettingError(f"can't be written: {reason or fault}", file=path)


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """Make a folder for files that are renamed once they are whole, and remove it with the context."""
    remove_leftovers(parent)
    made = parent / _temporary_name()
    made.mkdir()  # with a mode of its own, Windows would let only this user read what is moved out of it
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)


def require_folder(folder: Path) -> Path:
    """Raise `SettingError` unless a folder for results can be made and written; called before the work.

    Returned is the folder, or the nearest one above it that exists.
    """
    try:
        there = next(above for above in (folder, *folder.absolute().parents) if above.exists())
        if not there.is_dir():
            raise SettingError("is a file; name a folder for the results", file=there)
        with temporary_folder(there):
            # An earlier run, which made this folder, may have left something in the one above.
            remove_leftovers(there.parent)
            return there
    except OSError as fault:
        raise unwritable(folder, fault) from None


@contextmanager
def filled_folder(folder: Path, stale: Sequence[Path] = ()) -> Iterator[tuple[Path, list[Path]]]:
    """Give a temporary folder and a list for its files, which are moved into a folder in the end.

    The folder is made if it is missing. Stale files in it are removed then, with the folders that this leaves
    empty. `SettingError` if it can't be made or written.
    """
    made: list[Path] = []
    try:
        with temporary_folder(require_folder(folder)) as temporary:
            yield temporary, made
            made[:] = _move_in(made, temporary, folder, stale)
    except OSError as fault:
        raise unwritable(folder, fault) from None


def _move_in(made: Sequence[Path], source: Path, folder: Path, stale: Sequence[Path]) -> list[Path]:
    """Move finished files into a folder, in place of those of an earlier run."""
    targets = [folder / path.relative_to(source) for path in made]
    taken = next((path for path in (*targets, *stale) if path.is_dir()), None)
    if taken is not None:
        raise SettingError("is a folder, and a file of that name is to be written", file=taken)
    with undisturbed():
        for inner in {folder, *(target.parent for target in targets)}:
            inner.mkdir(parents=True, exist_ok=True)
        for path in stale:
            persistently(partial(path.unlink, missing_ok=True))
        moved = [
            persistently(partial(path.replace, target)) for path, target in zip(made, targets, strict=True)
        ]
        parents = {path.parent for path in stale}
        emptied = {inner for each in parents for inner in (each, *each.parents) if folder in inner.parents}
        for inner in sorted(emptied, reverse=True):
            if inner.is_dir() and not any(inner.iterdir()):
                inner.rmdir()
        return moved


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore Ctrl-C for a moment: it would leave files of two runs side by side."""
    before = signal.getsignal(signal.SIGINT)
    # Only the main thread receives Ctrl-C, and only it may set the handler.
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _temporary_name() -> str:
    return f"{TEMPORARY}{_computer()}-{os.getpid()}-{uuid.uuid4().hex}"


def _computer() -> str:
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def remove_leftovers(folder: Path, *, alone: bool = False) -> None:
    """Remove temporary files and folders that killed processes have left in a folder.

    Parameters
    ----------
    folder : where to look; none that is made or written here
    alone : whether nobody else writes into it; otherwise what processes that still run have there stays, and
        what another computer has, whose processes aren't known here
    """
    with suppress(OSError):  # what is wrong with the folder is told by what writes into it
        for left in folder.glob(f"{TEMPORARY}*-*-*"):
            _, computer, pid, *_ = left.name.split("-")
            if not alone and (computer != _computer() or _is_running(pid)):
                continue
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)


def _is_running(pid: str) -> bool:
    import psutil

    try:
        return psutil.Process(int(pid)).status() != psutil.STATUS_ZOMBIE
    except psutil.AccessDenied:
        return True
    except (ValueError, psutil.NoSuchProcess):
        return False


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
    """Compose the text of a CSV table.

    Text of several lines becomes one, and an apostrophe goes before what a spreadsheet would take for a
    formula: names and messages come from files of others.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_as_data(cell) for cell in row] for row in rows)
    return text.getvalue()


def columns_text(columns: Mapping[str, Iterable[object]]) -> str:
    """Compose the text of a CSV table from columns of one length: 6 decimals, and nothing for None."""
    rows = zip(*columns.values(), strict=True)
    return csv_text([columns, *([f"{c:.6f}" if isinstance(c, float) else c for c in row] for row in rows)])


def _as_data(cell: object) -> object:
    if not isinstance(cell, str):
        return cell
    text = " ".join(cell.split())
    try:
        float(text)
    except ValueError:
        return f"'{text}" if text.startswith(FORMULA) else text
    return text
