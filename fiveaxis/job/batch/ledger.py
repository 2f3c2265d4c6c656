"""The results of a batch in its folder: exactly one whole row per job."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from filelock import FileLock, Timeout

from fiveaxis.base import SettingError, csv_text, write_atomically
from fiveaxis.job.batch.record import COLUMNS, Row, Status

LINES = "results.jsonl"
TABLE = "results.csv"
LOCK = ".fiveaxis-batch.lock"


class Ledger:
    """Rows by name, on the disk as soon as they are known; those of an earlier batch in the folder are kept.

    Both files are replaced in one step, so a reader always finds whole lines, and a crash while writing keeps
    all earlier rows. Only the JSON lines are read again; `SettingError` for a file that can't be.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rows = {row.name: row for row in read_rows(folder / LINES)}

    def record(self, *rows: Row) -> None:
        """Add rows, in place of older ones of the same names, and write both files.

        Files that only the older row lists are removed from the job's folder. A job with wrong input keeps
        the files and the row of its last run, which are valid again once the input is corrected.
        """
        for row in rows:
            if row.status is Status.WRONG_INPUT:
                last = self._last(row.name)
                self.rows[row.name] = replace(row, before=None if last is None else last.as_dict())
            else:
                self._remove_stale_files(row)
                self.rows[row.name] = row
        self.rows = dict(sorted(self.rows.items()))
        every = self.rows.values()
        lines = (json.dumps(row.as_dict(), allow_nan=False) + "\n" for row in every)
        cells = ([column.value(row) for column in COLUMNS.values()] for row in every)
        write_atomically(self.folder / LINES, "".join(lines))
        write_atomically(self.folder / TABLE, csv_text([COLUMNS, *cells]))

    def forget_refused(self, names: Iterable[str]) -> None:
        """Drop rows that only report a wrong input; written with the next `record`."""
        for name in names:
            row = self.rows.get(name)
            if row is not None and row.status is Status.WRONG_INPUT and row.before is None:
                del self.rows[name]

    def _last(self, name: str) -> Row | None:
        """Return the row of a job's last run, if there was one."""
        row = self.rows.get(name)
        if row is None or row.status is not Status.WRONG_INPUT:
            return row
        return None if row.before is None else Row.from_dict(row.before)

    def _remove_stale_files(self, row: Row) -> None:
        before = self._last(row.name) or row
        with suppress(OSError, SettingError):  # a file that stays is no reason to lose the row
            own = own_folder(self.folder, row.name)
            for file in set(before.files) - set(row.files):
                (own / Path(file).name).unlink(missing_ok=True)
            own.rmdir()  # unless something else is in it

    def done(self, name: str, digest: str) -> Row | None:
        """Return the row of a job that needn't run again: same inputs, a final status, all files there."""
        row = self._last(name)
        if row is None or row.digest != digest or not row.status.is_final:
            return None
        return row if all((self.folder / name / file).is_file() for file in row.files) else None


def read_rows(path: Path) -> list[Row]:
    """Read JSON lines of results, without a file none; `SettingError` for a line that isn't one."""
    if not path.exists():
        return []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise SettingError(f"can't be read: {fault}", file=path) from None
    return [_read_line(line, path, number) for number, line in enumerate(lines, start=1)]


def _read_line(line: str, path: Path, number: int) -> Row:
    try:
        return Row.from_dict(json.loads(line))
    except (ValueError, TypeError, AttributeError, RecursionError) as fault:
        message = f"isn't a result of this version ({fault}); move the file away, and all jobs run again"
        raise SettingError(message, file=path, line=number) from None


def own_folder(folder: Path, name: str) -> Path:
    """Return a job's folder inside the batch's; `SettingError` if it is a link that leads out of it."""
    own = folder / name
    try:
        inside = own.resolve().is_relative_to(folder.resolve())
    except RuntimeError:  # its links lead in a circle
        inside = False
    if not inside:
        raise SettingError("is a link out of the folder for the results; remove it", file=own)
    return own


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder against other batches; the system releases the lock whenever the process ends.

    `SettingError` if another batch is running in the folder, or it can't be written.
    """
    lock = FileLock(folder / LOCK, timeout=0.0)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise SettingError("another batch is running in this folder; wait for it", file=folder) from None
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None
    try:
        yield
    finally:
        lock.release()
