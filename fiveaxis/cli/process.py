"""The process of a command: what ends it, other than the command's own result or error.

It is imported before everything else, so it imports nothing slow itself.
"""

from __future__ import annotations

import errno
import gc
import os
import signal
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import TextIO

# Exit codes: a fault of the program, or no room; ended by Ctrl-C and by a closed pipe, as in shells.
BROKEN, INTERRUPTED, CLOSED = 4, 130, 141
# New objects after which garbage is looked for; a first run, with all that it compiles, makes 1.6 million.
GARBAGE = 2_000_000
IMPORTING = "<frozen importlib._bootstrap>"


class NobodyReads(Exception):
    """Whoever read what the command prints has closed the pipe, as `head` does."""


def run(load: Callable[[], Callable[[], object]]) -> None:
    """Run a command line that `load` imports; it ends with one line and an exit code, never a traceback."""
    # Imports make a million objects that stay: at Python's own threshold a quarter of their time is spent on
    # looking for garbage among them.
    gc.set_threshold(GARBAGE)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed before the start
            setattr(sys, name, _nowhere())
        # What the terminal's encoding lacks (a thin space, ≤) mustn't end a command whose files are written.
        getattr(sys, name).reconfigure(errors="replace")
    # Whoever starts a command in the background may have it ignore Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupt)
    try:
        load()()
    except NobodyReads:
        _leave(CLOSED)
    except KeyboardInterrupt:
        _leave(INTERRUPTED, "interrupted")
    except OSError as fault:  # inputs and files of results have errors of their own
        if is_closed_pipe(fault):
            _leave(CLOSED)
        _leave(BROKEN, f"error: the output can't be written: {fault.strerror or fault}")
    except Exception as fault:
        _leave(BROKEN, _describe(fault))
    finally:
        gc.freeze()  # the interpreter would look for garbage once more, among all that ends with it
        # It would interrupt the interpreter's last steps.
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def interrupt(_signal: int, frame: FrameType | None) -> None:
    """Handle Ctrl-C: end the process at once while it imports, otherwise raise `KeyboardInterrupt`.

    Importing takes most of the first second. Some libraries catch an exception that is raised meanwhile, and
    some make an error of their own of it; and nothing is being written.
    """
    while frame is not None:
        if frame.f_code.co_filename == IMPORTING:
            # A line that shows what is done may stand there. What an earlier step wrote isn't known here.
            os.write(2, b"\n" * os.isatty(2) + b"interrupted\n")
            os._exit(INTERRUPTED)
        frame = frame.f_back
    raise KeyboardInterrupt


def write_results(text: str | bytes) -> None:
    """Write text, or the bytes of one, to stdout, through to whoever reads it; else raise `NobodyReads`."""
    try:
        sys.stdout.write(text) if isinstance(text, str) else sys.stdout.buffer.write(text)
        sys.stdout.flush()
    except OSError as fault:
        if not is_closed_pipe(fault):
            raise
        raise NobodyReads from None


def is_closed_pipe(fault: OSError) -> bool:
    """Tell whether nobody reads what is written; Windows calls it an invalid argument, of no file."""
    return fault.errno in (errno.EPIPE, errno.EINVAL) and fault.filename is None


def _leave(code: int, message: str = "") -> None:
    if message:
        sys.stderr.write(f"{message}\n")
    # What a closed pipe or a full disk has kept in the stream would be written again when Python ends.
    sys.stdout = _nowhere()
    raise SystemExit(code)


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123 (`pathlib` is slow)


def _describe(fault: Exception) -> str:
    import logging
    import traceback

    from fiveaxis.base import shorten

    last = traceback.extract_tb(fault.__traceback__)[-1]
    line = (
        f"error: a fault of fiveaxis itself, not of the input: {type(fault).__name__}: {shorten(str(fault))} "
        f"({last.filename.rpartition(os.sep)[2]}:{last.lineno}); please report it with the output of -vv"
    )
    detailed = logging.getLogger("fiveaxis").isEnabledFor(logging.DEBUG)
    return "".join([*traceback.format_exception(fault), line]) if detailed else line
