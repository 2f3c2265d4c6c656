"""The verbosity of a command on stderr: every command has -v and -q."""

from __future__ import annotations

import functools
import inspect
import logging
from collections.abc import Callable
from typing import Annotated, Any, get_type_hints

import typer

from fiveaxis.cli.terminal import alarm, err

Verbose = Annotated[
    int, typer.Option("--verbose", "-v", count=True, help="log the stages to stderr; -vv with details")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="no progress and no notes on stderr, only errors")]

# The parent of the loggers of all modules.
ROOT = "fiveaxis"
LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


class ConsoleHandler(logging.Handler):
    """Print records on stderr, above the progress where there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record: its room and its message."""
        console = alarm if record.levelno >= logging.ERROR else err
        room = record.name.removeprefix(f"{ROOT}.").partition(".")[0]
        console.print(f"{room}: {record.getMessage()}", markup=False)


def set_verbosity(verbose: int, quiet: bool) -> None:
    """Set the verbosity.

    Parameters
    ----------
    verbose : 0 for warnings, 1 for stages, 2 for their details
    quiet : errors only
    """
    err.quiet = quiet
    logger = logging.getLogger(ROOT)
    logger.setLevel(logging.ERROR if quiet else LEVELS[min(verbose, len(LEVELS) - 1)])
    if not any(isinstance(handler, ConsoleHandler) for handler in logger.handlers):
        logger.addHandler(ConsoleHandler())


def is_verbose() -> bool:
    """Whether -v was given."""
    return logging.getLogger(ROOT).isEnabledFor(logging.INFO)


def with_options(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for the verbosity to a command."""
    signature = inspect.signature(verb)
    options = {"verbose": (Verbose, 0), "quiet": (Quiet, False)}
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, (kind, default) in options.items()
    ]
    kinds = get_type_hints(verb, include_extras=True)
    own = [p.replace(annotation=kinds[p.name]) for p in signature.parameters.values()]

    @functools.wraps(verb)
    def with_verbosity(*args: Any, verbose: int = 0, quiet: bool = False, **kwargs: Any) -> Any:
        set_verbosity(verbose, quiet)
        return verb(*args, **kwargs)

    with_verbosity.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined]
    with_verbosity.__annotations__ = kinds | {name: kind for name, (kind, _) in options.items()}
    return with_verbosity
