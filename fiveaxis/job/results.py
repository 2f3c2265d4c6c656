"""Write the files of an outcome into a folder, all of them or none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from fiveaxis.base import (
    STAGES,
    Infeasible,
    Progress,
    Unverified,
    filled_folder,
    persistently,
    unheard,
    within,
    write_atomically,
)
from fiveaxis.job.revised_program import RevisedProgram
from fiveaxis.job.stages import Outcome
from fiveaxis.nc import DIALECTS, PROGRAM_SUFFIXES, write_motion
from fiveaxis.posture import Mask
from fiveaxis.show import Admits, write_front_figure, write_json, write_preview, write_report

# Folder of a front's solutions, each in a folder named by its number; most solutions of a front.
FRONT, MOST_OF_FRONT = "front", 50
# Folder of an operation of a revised program.
OPERATION = "operation-"
FILES = ("motion.csv", "report.json", "report.html", "preview.html")


def write_outcome(outcome: Outcome, folder: Path, progress: Progress = unheard) -> list[Path]:
    """Write motion, report, preview and NC program into a folder; for a front also those of each solution.

    Everything is made in a temporary folder first, so that a failure leaves the old files as they were and
    no new folder. Without an NC program (errors that the job doesn't accept by name), an NC program of an
    earlier run is removed.

    Returns
    -------
    The files, in order of writing.
    """
    with filled_folder(folder, _stale(folder)) as (temporary, made):
        made += _make_files(outcome, temporary, progress)
        if outcome.front is not None:
            made.append(write_front_figure(outcome.front, temporary / "front.svg"))
            for number, one in enumerate(outcome.members, start=1):
                inner = temporary / FRONT / str(number)
                inner.mkdir(parents=True)
                of_one = within(progress, f"solution {number} of {len(outcome.members)}")
                made += _make_files(one, inner, of_one)
    return made


def write_revised(made: RevisedProgram, folder: Path, progress: Progress = unheard) -> list[Path]:
    """Write a revised program into a folder, and what `write_outcome` writes of each of its operations.

    The files of an operation are in a folder named by its number. All else is as for `write_outcome`.
    """
    with filled_folder(folder, _stale(folder)) as (temporary, files):
        for number, outcome in made.outcomes.items():
            inner = temporary / f"{OPERATION}{number}"
            inner.mkdir()
            of_one = within(progress, f"operation {number}")
            files += _make_files(outcome, inner, of_one, with_program=False)
        if made.ok and made.outcomes:
            suffix = next(iter(made.outcomes.values())).program.text.suffix
            files.append(write_atomically(temporary / f"program{suffix}", made.data))
    return files


@contextmanager
def withdrawing(folder: Path | None) -> Iterator[None]:
    """Remove the NC programs of an earlier run where this one ends without: they would look like its result.

    Parameters
    ----------
    folder : for the results of what runs within; None where nothing is written
    """
    try:
        yield
    except (Infeasible, Unverified):
        if folder is not None:
            withdraw_programs(folder)
        raise


def withdraw_programs(folder: Path) -> None:
    """Remove the NC programs of an earlier run from its folder, with those of a front and of operations."""
    for inner in (folder, *_earlier(folder)):
        for path in _programs(inner):
            persistently(partial(path.unlink, missing_ok=True))


def _earlier(folder: Path) -> list[Path]:
    """List the folders of the solutions of a front, and of operations, in a folder of results."""
    solutions = [folder / FRONT / str(number) for number in range(1, MOST_OF_FRONT + 1)]
    return [each for each in solutions if each.is_dir()] + sorted(folder.glob(f"{OPERATION}[0-9]*"))


def _stale(folder: Path) -> list[Path]:
    """List the files of an earlier run that a new one may not have: programs, and all of inner folders."""
    inner = _earlier(folder)
    programs = [path for each in (folder, *inner) for path in _programs(each)]
    return programs + [each / name for each in inner for name in FILES]


def _programs(folder: Path) -> list[Path]:
    """List where an NC program may stand in a folder of results."""
    suffixes = (*PROGRAM_SUFFIXES, *(dialect.suffix for dialect in DIALECTS.values()))
    return [folder / f"program{suffix}" for suffix in dict.fromkeys(suffixes)]


def _make_files(
    outcome: Outcome, folder: Path, progress: Progress, *, with_program: bool = True
) -> list[Path]:
    solution = outcome.solution
    progress(STAGES["report"], 0, 1)
    made = [
        write_motion(
            solution.motion if outcome.revision is None else outcome.program.blocks,
            folder / "motion.csv",
            solution.machine,
        ),
        write_json(outcome.report, folder / "report.json"),
        write_report(outcome.report, folder / "report.html", admits=clear_postures(outcome)),
    ]
    progress(STAGES["preview"], 0, 1)
    made.append(
        write_preview(
            solution,
            folder / "preview.html",
            program=outcome.program,
            surroundings=outcome.solution.surroundings,
            findings=outcome.verdict.findings,
        )
    )
    if with_program and outcome.gate.is_open:
        made.append(outcome.program.write(folder / f"program{outcome.program.text.suffix}"))
    return made


def clear_postures(outcome: Outcome) -> Admits | None:
    """Return which postures are clear, for the posture map; None where nothing was kept clear of."""
    cleared, location = outcome.cleared, outcome.solution.motion.location
    if cleared is None or cleared.admits is None:
        return None
    return Mask(cleared.admits.rough).along(location).admits
