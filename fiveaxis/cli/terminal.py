"""What commands print: results on stdout, everything else on stderr."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from fiveaxis.base import (
    AlreadyBetter,
    Cause,
    FiveAxisError,
    Infeasible,
    SettingError,
    Unverified,
    group_findings,
)
from fiveaxis.cli.process import INTERRUPTED, NobodyReads, write_results
from fiveaxis.cli.work import leave_if_working

if TYPE_CHECKING:
    from fiveaxis.check import Gate
    from fiveaxis.lab import Budget
    from fiveaxis.model import Machine

FIRST_RUN = "compiling, once per installation: this first run takes about 15 s longer"


class Terminal(Console):
    """A console for people."""

    def on_broken_pipe(self) -> None:
        """End the command, which nobody reads any more."""
        raise NobodyReads

    def show_cursor(self, show: bool = True) -> bool:
        """Leave the cursor as it is: a process that Ctrl-C ends at once couldn't show it again."""
        return False


# Characters in a line of what is read at a glance.
WIDTH = 80
# A pipe or a log has no width; tables need more than the usual 80 characters.
out = Terminal(width=None if sys.stdout.isatty() else 140, emoji=False)
# Progress and notes, which -q silences; errors, which nothing does.
err = Terminal(stderr=True, highlight=False, soft_wrap=True, emoji=False)
alarm = Terminal(stderr=True, highlight=False, soft_wrap=True, emoji=False)


@contextmanager
def errors_explained(as_json: bool) -> Iterator[list[Path]]:
    """Turn an error into one message on stderr and its exit code; yield the list of files written."""
    written: list[Path] = []
    try:
        yield written
    except FiveAxisError as fault:
        findings = fault.findings if isinstance(fault, Infeasible | Unverified) else ()
        if isinstance(fault, AlreadyBetter):
            print_json(fault.facts) if as_json else out.print(str(fault), markup=False, soft_wrap=True)
            raise typer.Exit(fault.exit_code) from None
        alarm.print(f"[bold red]error:[/] {escape(str(fault))}")
        causes = group_findings(findings)
        print_causes(causes, alarm, "  ")
        if len(findings) > len(causes):
            alarm.print(f"  --json lists all {len(findings)} findings")
        if as_json:
            summary = [cause.as_dict() for cause in causes]
            listed = [finding.as_dict() for finding in findings]
            print_json({"error": str(fault), "summary": summary, "findings": listed})
        raise typer.Exit(fault.exit_code) from None
    except KeyboardInterrupt:
        files = ", ".join(map(str, written)) or "nothing"
        alarm.print(f"interrupted; {files} {'were' if len(written) > 1 else 'was'} written", markup=False)
        leave_if_working(INTERRUPTED)
        raise typer.Exit(INTERRUPTED) from None


def print_json(document: Any) -> None:
    """Print a document, in ASCII, which every terminal and pipe accepts."""
    write_results(json.dumps(document, indent=2) + "\n")


def print_table(heads: Iterable[str | Column], rows: Iterable[Iterable[str]]) -> None:
    """Print a table on stdout."""
    table = Table(*heads, box=None)
    for row in rows:
        table.add_row(*row)
    out.print(table)


def print_causes(causes: Iterable[Cause], console: Console, before: str = "") -> None:
    """Print one line for each cause of findings, after a prefix."""
    for cause in causes:
        console.print(f"{before}{cause}", markup=False, soft_wrap=True)


def print_filled(text: str) -> None:
    """Print a line on stdout, indented, and wrapped to at most `WIDTH` characters."""
    out.print(fill(text, WIDTH, initial_indent="  ", subsequent_indent="    "), markup=False, highlight=False)


def print_written(path: Path, *facts: str) -> None:
    """Say that a file was written, and what is in it."""
    err.print(f"wrote {path}" + ": " * bool(facts) + ", ".join(facts), markup=False)


def print_release(gate: Gate) -> None:
    """Print which errors were accepted by name, and which keep the program back."""
    for code in gate.accepted:
        alarm.print(f"[bold red]overridden[/]: {code} ({gate.report.counts[code]})")
    if gate.kept:
        worst = next(cause for cause in gate.report.summary() if cause.code in gate.kept)
        codes = ", ".join(f"{code} ({count})" for code, count in gate.kept.items())
        alarm.print(
            f"[bold red]verification found errors[/]: no NC program was written, because of {codes}: "
            f"{escape(worst.worst.remedy)}; or accept each code by name (--override)"
        )


def print_budget(budget: Budget, what: str = "whole job") -> None:
    """Print the energy of a whole job or program."""
    known = [share for share in budget.shares if share.energy is not None]
    parts = ", ".join(f"{share.name} {share.energy:.0f} J ({share.basis})" for share in known)
    money = "" if budget.cost is None else f"; {budget.cost:.4f} {budget.factors.currency}"
    emitted = "" if budget.co2 is None else f"; {1000.0 * budget.co2:.1f} g CO2"
    unknown = [share.name for share in budget.shares if share.energy is None]
    rest = f"; not known: {', '.join(unknown)}" if unknown else ""
    out.print(f"{what} {budget.total:.0f} J: {parts}{money}{emitted}{rest}", markup=False, soft_wrap=True)


def print_first_run(kernel: Any) -> None:
    """Say that loops are being compiled, unless an earlier run has kept them.

    Parameters
    ----------
    kernel : a function that numba compiles and keeps; one stands for all
    """
    folder = kernel.stats.cache_path
    name = f"{kernel.py_func.__module__.rpartition('.')[2]}.{kernel.py_func.__qualname__}-*.nbi"
    if folder is not None and not any(Path(folder).glob(name)):
        err.print(FIRST_RUN)


def require_machine(name: str | None) -> str:
    """Return the value of `--machine`, or raise if it is missing."""
    if name is None:
        raise SettingError("--machine is missing")
    return name


def load_powered(name: str, drives: str | None, assume: Mapping[str, str] | None = None) -> Machine:
    """Load a machine with its own drives, borrowed or estimated ones, and say which."""
    from fiveaxis.model import load_machine, power_findings, with_powers

    machine = with_powers(load_machine(name, assume), drives)
    print_causes(group_findings(power_findings(machine)), err)
    return machine


def parse_numbers(text: str, count: int, form: str, separator: str = ",", *, flag: str = "") -> list[float]:
    """Parse an option of several finite numbers; `form` shows the user what it should look like."""
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise SettingError(f"{flag} {text!r} isn't of the form {form} ({count} numbers)".lstrip())
    return values


def parse_integers(flag: str, text: str) -> tuple[int, ...]:
    """Parse whole numbers that are separated by commas."""
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise SettingError(f"{flag} {text!r} isn't of the form 3 or 3,5 (whole numbers)") from None


_POSITION = re.compile(r"((?:G[0-9.]+(?:P[0-9]+)?)?[A-Z])=?(.*)")
# Between two positions, and not between a letter and its value.
_BETWEEN = re.compile(r"\s*,\s*|\s+(?=[A-Z])")


def parse_words(text: str | None) -> tuple[str, ...] | None:
    """Read words that are separated by commas; None where there is no text."""
    return None if text is None else tuple(word.strip() for word in text.split(","))


def parse_named(flag: str, texts: Iterable[str]) -> dict[str, str]:
    """Read texts by name, ``A.points=0,0,50``."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (equals and name and value):
            raise SettingError(f"{flag} {text!r} isn't of the form NAME=VALUE, for example A.points=0,0,50")
        if name in found:
            raise SettingError(f"{flag} names {name} twice")
        found[name] = value
    return found


def parse_positions(name: str, text: str | None) -> dict[str, float] | None:
    """Parse axis positions, ``X18,Y74,A0``, also ``X18 Y74`` or ``X=18``; with several offsets ``G55X18``."""
    if text is None:
        return None
    try:
        found = [_POSITION.match("".join(part.split())) for part in _BETWEEN.split(text.strip().upper())]
        pairs = [("" if f is None else f[1], float("" if f is None else f[2])) for f in found]
    except ValueError:
        raise SettingError(f"{name} {text!r} isn't of the form X18,Y74,Z0,A0,C90 (mm and deg)") from None
    if len(dict(pairs)) < len(pairs):
        raise SettingError(f"{name} {text!r} names an axis twice")
    return dict(pairs)


def require_between(name: str, value: float, low: float, high: float, unit: str) -> None:
    """Raise if an option is outside its range."""
    if not low <= value <= high:
        raise SettingError(f"{name} is {value:g} {unit}; it must be between {low:g} and {high:g} {unit}")
