"""The command line: each command is one library call with the same option names.

Results go to stdout, everything else (progress, warnings, errors) to stderr. Exit codes: 0 fine, 1
verification or a check found an error, 2 wrong input or usage, 3 no feasible posture, 4 a fault of the
program itself or no room for its output, 130 interrupted, 141 nobody reads the output any more; a batch
has that of its worst job.

The commands and the libraries that they need are imported when they are used: importing takes most of the
first second, in which Ctrl-C is answered too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from fiveaxis.cli.commands import app

__all__ = ["app", "main"]


def main() -> None:
    """Run the command line."""
    from fiveaxis.cli.process import run

    run(lambda: __getattr__("app"))


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from fiveaxis.cli.commands import app

    return app
