"""The files that an outcome leaves in a folder, all of them or none."""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.files import write_atomically
from fiveaxis.job.stages import Outcome, load_surroundings
from fiveaxis.nc import DIALECTS, Program, compose_program, write_motion
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
        program = compose_outcome(outcome)
        made.append(write_atomically(folder / f"program{program.suffix}", program.text))
    return made


def compose_outcome(outcome: Outcome) -> Program:
    """Write the blocks of an outcome's program; its findings are what that assumed.

    Raises
    ------
    FiveAxisError
        As `compose_program`.
    """
    job = outcome.job
    settings = job.nc if job.nc.name else job.nc.model_copy(update={"name": job.input.stem[:60] or None})
    return compose_program(
        outcome.program.motion,
        machine=outcome.solution.machine,
        control=job.control,
        coordinates=job.coordinates,
        header=_header(outcome),
        winding=job.winding,
        report=outcome.gate.report,
        override=outcome.gate.accepted,
        settings=settings,
    )


def _admits(outcome: Outcome) -> Admits | None:
    """Give what the posture map asks about collisions, where something was kept clear of."""
    cleared = outcome.cleared
    return None if cleared is None or cleared.admits is None else cleared.admits.rough


def _header(outcome: Outcome) -> dict[str, str]:
    """Say in the program where it comes from and what it costs."""
    solution = outcome.solution
    lines = {"tool": str(solution.toolpath.tool)}
    feeds = np.unique(solution.toolpath.feed[solution.toolpath.cutting])
    if len(feeds) == 1:
        lines["feed"] = f"{60.0 * feeds[0]:.7g} mm/min along the path"
    chosen = outcome.document.get("setup_search")
    if chosen is not None:
        lines["workpiece"] = f"set up elsewhere than given: {solution.machine.setup}"
    for number, source in enumerate(outcome.document["inputs"], start=1):
        lines[f"source {number}"] = f"{source['name']} sha256 {source['sha256'][:16]}"
    what = "travel metric of the feed drives, ways in and out apart"
    for name, energy in outcome.program.energy.items():
        lines[f"energy {name}"] = f"{energy.total:.1f} J {what}"
    return lines
