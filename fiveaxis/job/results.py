"""The files that an outcome leaves in a folder, all of them or none."""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fiveaxis.errors import SettingError
from fiveaxis.job.stages import Outcome, load_surroundings
from fiveaxis.nc import DIALECTS, write_motion
from fiveaxis.report import write_json, write_report
from fiveaxis.report.front_figure import write_front_figure
from fiveaxis.report.landscape import Admits
from fiveaxis.viewer import write_preview


def write_outcome(outcome: Outcome, folder: Path) -> list[Path]:
    """Write motion, report, preview and NC program into a folder.

    Everything is made in a temporary folder first, so that a failure leaves the old files as they were, and
    no new folder. A motion with errors that the job doesn't accept by name gets no NC program, and one from
    an earlier run is taken away.

    Returns
    -------
    The files, in order of writing.

    Raises
    ------
    SettingError
        The folder can't be made or written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".fiveaxis-", dir=require_folder(folder)) as temporary:
            return _move_in(_make_files(outcome, Path(temporary)), folder)
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None


def require_folder(folder: Path) -> Path:
    """Refuse a folder for results that can't be made or written, before any work is done for it.

    Returns
    -------
    The folder, or the nearest one above it that exists.

    Raises
    ------
    SettingError
        A file in its place, no permission.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise SettingError("is a file; name a folder for the results", file=there)
    try:
        with tempfile.TemporaryDirectory(prefix=".fiveaxis-", dir=there):
            return there
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None


def _move_in(made: Sequence[Path], folder: Path) -> list[Path]:
    """Put finished files into a folder, in place of those of an earlier run."""
    targets = [folder / path.name for path in made]
    programs = [folder / f"program{dialect.suffix}" for dialect in DIALECTS.values()]
    taken = next((path for path in (*targets, *programs) if path.is_dir()), None)
    if taken is not None:
        raise SettingError("is a folder, and a file of that name is to be written", file=taken)
    with _undisturbed():
        folder.mkdir(parents=True, exist_ok=True)
        for path in programs:
            path.unlink(missing_ok=True)
        return [path.replace(target) for path, target in zip(made, targets, strict=True)]


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let a Ctrl-C come too late: files of two runs side by side would be worse than the moment's wait."""
    before = signal.getsignal(signal.SIGINT)
    # Only the main thread hears a Ctrl-C, and only it may say who handles one.
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _make_files(outcome: Outcome, folder: Path) -> list[Path]:
    job, solution = outcome.job, outcome.solution
    made = [
        write_motion(solution.motion, folder / "motion.csv", solution.machine),
        write_json(outcome.document, folder / "report.json"),
        write_report(solution, outcome.document, folder / "report.html", admits=_admits(outcome)),
        write_preview(
            solution,
            folder / "preview.html",
            surroundings=load_surroundings(job),
            findings=outcome.verdict.findings,
        ),
    ]
    if outcome.front is not None:
        made.append(write_front_figure(outcome.front, folder / "front.svg"))
    if outcome.gate.is_open:
        made.append(outcome.program.write(folder / f"program{outcome.program.text.suffix}"))
    return made


def _admits(outcome: Outcome) -> Admits | None:
    """Give what the posture map asks about collisions, where something was kept clear of."""
    cleared = outcome.cleared
    return None if cleared is None or cleared.admits is None else cleared.admits.rough
