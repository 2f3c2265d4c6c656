"""The files that an outcome leaves in a folder, all of them or none."""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fiveaxis.errors import SettingError
from fiveaxis.job.loading import load_surroundings
from fiveaxis.job.stages import Outcome
from fiveaxis.nc import DIALECTS, write_motion
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.report import write_json, write_report
from fiveaxis.report.landscape import Admits
from fiveaxis.report.plots import write_front_figure
from fiveaxis.viewer import write_preview

# Where the solutions of a front are, each in a folder named after its number; a job asks for at most so many.
FRONT, MOST_OF_FRONT = "front", 50
FILES = ("motion.csv", "report.json", "report.html", "preview.html")


def write_outcome(outcome: Outcome, folder: Path) -> list[Path]:
    """Write motion, report, preview and NC program into a folder; those of a front's solutions by number.

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
            made = _make_files(outcome, Path(temporary))
            for number, one in enumerate(outcome.of_front, start=1):
                place = Path(temporary) / FRONT / str(number)
                place.mkdir(parents=True)
                made += _make_files(one, place, alone=True)
            return _move_in(made, Path(temporary), folder)
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


def _move_in(made: Sequence[Path], source: Path, folder: Path) -> list[Path]:
    """Put finished files into a folder, in place of those of an earlier run."""
    targets = [folder / path.relative_to(source) for path in made]
    suffixes = [dialect.suffix for dialect in DIALECTS.values()]
    earlier = [folder / FRONT / str(number) for number in range(1, MOST_OF_FRONT + 1)]
    stale = [folder / f"program{suffix}" for suffix in suffixes]
    stale += [place / name for place in earlier for name in (*FILES, *(f"program{s}" for s in suffixes))]
    taken = next((path for path in (*targets, *stale) if path.is_dir()), None)
    if taken is not None:
        raise SettingError("is a folder, and a file of that name is to be written", file=taken)
    with undisturbed():
        for place in {folder, *(target.parent for target in targets)}:
            place.mkdir(parents=True, exist_ok=True)
        for path in stale:
            path.unlink(missing_ok=True)
        moved = [path.replace(target) for path, target in zip(made, targets, strict=True)]
        # Of an earlier front that had more solutions no empty folders stay.
        for place in (*earlier, folder / FRONT):
            if place.is_dir() and not any(place.iterdir()):
                place.rmdir()
        return moved


@contextmanager
def undisturbed() -> Iterator[None]:
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


def _make_files(outcome: Outcome, folder: Path, *, alone: bool = False) -> list[Path]:
    """Write an outcome's files; `alone`, without those of its front."""
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
    if outcome.front is not None and not alone:
        made.append(write_front_figure(outcome.front, folder / "front.svg"))
    if outcome.gate.is_open:
        made.append(outcome.program.write(folder / f"program{outcome.program.text.suffix}"))
    return made


def _admits(outcome: Outcome) -> Admits | None:
    """Give what the posture map asks about collisions, where something was kept clear of."""
    cleared, location = outcome.cleared, outcome.solution.motion.location
    if cleared is None or cleared.admits is None:
        return None
    return Mask(cleared.admits).along(location).roughly_admits
