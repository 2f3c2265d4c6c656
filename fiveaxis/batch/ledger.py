"""The results of a batch in its folder: a row a job, never half of one, never one twice."""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from fiveaxis.batch.record import Row, Status
from fiveaxis.errors import SettingError
from fiveaxis.files import write_atomically

LINES = "results.jsonl"
TABLE = "results.csv"
LOCK = ".fiveaxis-batch.lock"

# Columns of the table; what they can't hold stands in the JSON lines.
COLUMNS = {
    "job": "name",
    "status": "status",
    "locations": "locations",
    "energy_J": "energy",
    "travel_metric_J": "travel",
    "base_J": "base",
    "time_s": "time",
    "baseline": "baseline",
    "baseline_J": "baseline_energy",
    "saved": "saved",
    "errors": "errors",
    "warnings": "warnings",
    "file": "file",
    "inputs_sha256": "digest",
    "message": "message",
}


class Ledger:
    """Rows by name, on the disk as soon as they are known.

    Both files are written whole under another name and then take their place in one step, so a reader always
    finds whole lines, and a crash in the middle of writing leaves all rows before. Of the two the JSON lines
    are read again; the table follows them.

    Parameters
    ----------
    folder : that holds the results; rows of an earlier batch in it are kept

    Raises
    ------
    SettingError
        A file of results that can't be read.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rows = {row.name: row for row in read_rows(folder / LINES)}

    def record(self, *rows: Row) -> None:
        """Put rows in, in place of older ones of their names, and write both files.

        What an older row lists and its new one doesn't is taken out of the job's folder. A job whose input is
        wrong keeps what its last run left, and the row of that, which counts again once the input is right.

        Raises
        ------
        SettingError
            They can't be written.
        """
        for row in rows:
            if row.status is Status.WRONG_INPUT:
                last = self._last(row.name)
                self.rows[row.name] = replace(row, before=None if last is None else last.as_dict())
            else:
                self._clear(row)
                self.rows[row.name] = row
        self.rows = dict(sorted(self.rows.items()))
        write_atomically(self.folder / LINES, "".join(_line(row) for row in self.rows.values()))
        write_atomically(self.folder / TABLE, _table(list(self.rows.values())))

    def forget_refused(self, names: Iterable[str]) -> None:
        """Take the rows out that only say that an input was wrong; written with the next `record`."""
        for name in names:
            row = self.rows.get(name)
            if row is not None and row.status is Status.WRONG_INPUT and row.before is None:
                del self.rows[name]

    def _last(self, name: str) -> Row | None:
        """Give the row of a job's last run, if there was one."""
        row = self.rows.get(name)
        if row is None or row.status is not Status.WRONG_INPUT:
            return row
        return None if row.before is None else Row.from_dict(row.before)

    def _clear(self, row: Row) -> None:
        before = self._last(row.name) or row
        with suppress(OSError, SettingError):  # a file that stays is no reason to lose the row
            own = own_folder(self.folder, row.name)
            for file in set(before.files) - set(row.files):
                (own / Path(file).name).unlink(missing_ok=True)
            own.rmdir()  # unless something else is in it

    def done(self, name: str, digest: str) -> Row | None:
        """Give the row of a job that needn't run again: same inputs, an end that they decide, its files.

        Parameters
        ----------
        name, digest : of the job, as it is now
        """
        row = self._last(name)
        if row is None or row.digest != digest or not row.status.is_final:
            return None
        return row if all((self.folder / name / file).is_file() for file in row.files) else None


def read_rows(path: Path) -> list[Row]:
    """Read JSON lines of results; no file has no rows.

    Raises
    ------
    SettingError
        A line that is no result, or a file that can't be read.
    """
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
    except (ValueError, TypeError, AttributeError) as fault:
        what = f"isn't a result of this version ({fault}); move the file away, then all jobs run again"
        raise SettingError(what, file=path, line=number) from None


def _line(row: Row) -> str:
    return json.dumps(row.as_dict(), allow_nan=False) + "\n"


def _table(rows: list[Row]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        known = row.as_dict()
        # A message of several lines would be a row of several lines.
        writer.writerow([_cell(known[key]) for key in COLUMNS.values()])
    return text.getvalue()


def _cell(value: object) -> object:
    return " ".join(value.split()) if isinstance(value, str) else value


def own_folder(folder: Path, name: str) -> Path:
    """Give a job's folder inside the batch's.

    Raises
    ------
    SettingError
        A link leads out of it.
    """
    own = folder / name
    if not own.resolve().is_relative_to(folder.resolve()):
        raise SettingError("is a link out of the folder for the results; take it away", file=own)
    return own


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other batches out of a folder; the system lifts the lock when a process ends, however it ends.

    Raises
    ------
    SettingError
        Another batch works in the folder, or it can't be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None
    try:
        _lock(handle, folder)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, folder: Path) -> None:
    if sys.platform == "win32":  # no lock of this kind there: two batches in one folder aren't told apart
        return
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise SettingError("another batch works in this folder; wait for it", file=folder) from None
