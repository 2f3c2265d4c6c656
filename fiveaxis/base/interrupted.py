"""What a job has found so far, kept beside its results until it is done, so that an interrupted job goes on.

The optimiser's long steps are counted, and every one is a list of postures that follows from the job alone:
run again with the same inputs and options, the job does the same steps in the same order, and takes those
that are kept from their files. Everything between them is computed anew, so the result is the same to the
last byte.
"""

from __future__ import annotations

import hashlib
import io
import logging
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base.errors import AlreadyBetter, Infeasible, SettingError
from fiveaxis.base.files import write_atomically
from fiveaxis.base.geometry.vectors import Array
from fiveaxis.base.progress import UNKEPT, Checkpoint, Found

logger = logging.getLogger(__name__)

# Begin of the name of the folder, which ends in the job's hash; s that a step takes at least to be kept.
UNFINISHED = "unfinished-"
LONG = 2.0


class Kept(Checkpoint):
    """Steps kept in a folder, one file each, numbered as they are done; the folder is made with the first.

    The numbers of the steps that several threads do together begin with `before`.
    """

    def __init__(self, folder: Path, before: str = "") -> None:
        self._folder, self._before, self._count = folder, before, 0

    def found(self, find: Callable[[], Found]) -> Found:
        """Return what a step found before it was interrupted, else do it, and keep it if it took long."""
        self._count += 1
        file = self._folder / f"{self._before}{self._count}.npy"
        try:
            known: Array = np.load(file)
        except FileNotFoundError:
            pass
        except (OSError, ValueError, EOFError) as fault:
            logger.warning("%s can't be read, so its step is done again: %s", file, fault)
        else:
            earlier: Any = known if known.size else None
            return earlier
        began = time.monotonic()
        found = find()
        if time.monotonic() - began >= LONG:
            data = io.BytesIO()
            np.save(data, np.empty(0) if found is None else found)
            try:
                write_atomically(file, data.getvalue())
            except SettingError as fault:  # the job goes on without
                logger.warning("what was found isn't kept: %s", fault)
        return found

    def about(self, *columns: NDArray[Any]) -> None:
        """Name the next steps' files by what they are about, too."""
        digest = hashlib.sha256(b"".join(np.ascontiguousarray(column).tobytes() for column in columns))
        self._before = f"{digest.hexdigest()[:16]}-"

    def part(self) -> Kept:
        """Return what keeps the steps of one of several threads that the next steps are done in."""
        self._count += 1
        return Kept(self._folder, f"{self._before}{self._count}-")


@contextmanager
def resumable(digest: str, folder: Path | None) -> Iterator[Checkpoint]:
    """Keep what a job finds in a folder beside its results, and remove it once nothing is left to find.

    A job without a result, since it is infeasible or its program stays, leaves no new folder.

    What another job, or another version, has left there isn't used, and is removed in the end, too, unless it
    goes on writing.

    The digest is that of `fiveaxis.job.digest_job`; without a folder nothing is kept.
    """
    if folder is None:
        yield UNKEPT
        return
    own = folder / f"{UNFINISHED}{digest[:16]}"
    earlier = {other: _names(other) for other in sorted(folder.glob(f"{UNFINISHED}*")) if other.is_dir()}
    for other in earlier:
        if other == own:
            logger.warning("goes on from what is kept in %s", own)
        else:
            logger.warning(
                "%s belongs to other inputs, options or another version: not used, and removed in the end",
                other,
            )
    made = not folder.exists()
    try:
        yield Kept(own)
    except (Infeasible, AlreadyBetter):
        shutil.rmtree(own, ignore_errors=True)
        if made and folder.exists() and not any(folder.iterdir()):
            folder.rmdir()
        raise
    # A job that runs beside this one, into the same folder, goes on writing.
    for done in (*(other for other, names in earlier.items() if _names(other) == names), own):
        shutil.rmtree(done, ignore_errors=True)


def _names(folder: Path) -> set[str]:
    return {file.name for file in folder.glob("*")}
