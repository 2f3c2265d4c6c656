"""Options that several commands share, and those that every command has: -v, -q and --help-all."""

from __future__ import annotations

import functools
import inspect
import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import typer

from fiveaxis.base import (
    Bounds,
    Framing,
    LeanBounds,
    Meshes,
    OnMachine,
    Option,
    Placing,
    Planning,
    ProgramBounds,
    ReadProgram,
    Search,
    Surrounding,
    Workpiece,
    Writing,
    is_one_or_more,
    options_of,
    words_of,
)
from fiveaxis.cli.help import ALL, LAST, RANKS, show_all
from fiveaxis.cli.terminal import (
    alarm,
    err,
    parse_integers,
    parse_named,
    parse_numbers,
    parse_positions,
    parse_words,
)

Verbose = Annotated[
    int,
    typer.Option(
        "--verbose", "-v", count=True, show_default=False, help="log the stages to stderr; -vv with details"
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="no progress and no notes on stderr, only errors")]
HelpAll = Annotated[
    bool, typer.Option(ALL, help="show every option and exit", is_eager=True, callback=show_all)
]
# What every command has: type and default by name.
COMMON: Mapping[str, Any] = {"verbose": (Verbose, 0), "quiet": (Quiet, False), "help_all": (HelpAll, False)}

# The parent of the loggers of all modules.
ROOT = "fiveaxis"
LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
Verb = TypeVar("Verb", bound=Callable[..., None])
# Values of flags that aren't given; of those that may be repeated as a context has it.
NOT_GIVEN = (None, ())
# Numbers of a range; more are a vector.
RANGE = 2


def optional(kind: Any, text: str, flags: str | None = None) -> Any:
    """Declare an option that is None where it isn't given; by default its flag is the setting's name."""
    return Annotated[kind | None, typer.Option(*([] if flags is None else [flags]), help=text)]


Input = Annotated[
    Path,
    typer.Argument(help="part (.stl .ply .obj .off .step .iges), points, APT/CLSF, program, or a job .toml"),
]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", help="dask scheduler, tls://host:8786; default: this computer")
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", help="number of processes on this computer; default: one per core", min=1),
]
JobTimeout = Annotated[
    float | None, typer.Option("--job-timeout", help="s after which a job is stopped and broken")
]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")]

UNIT = optional(str, "mm, inch or, for meshes, m: unit of the input, in place of what it states")


def flags_of(group: type, before: str = "") -> dict[str, Any]:
    """Make the flags of a group of options, in a panel of their own, by name.

    Parameters
    ----------
    before : what the names begin with, so that they differ from those of other groups; the flags don't
    """
    panel = (inspect.getdoc(group) or "").partition("\n")[0].rstrip(".")
    flags: dict[str, Any] = {}
    for name, (kind, option) in options_of(group).items():
        words = "|".join(words_of(kind))
        plain = (
            list[str] if _is_list(kind) or _is_named_text(kind) else str if option.written or words else kind
        )
        # A form of several words is a text, not a name of the value.
        in_words = " " in option.written
        text = f"{option.sentence}: {option.written}" if in_words else option.sentence
        metavar = None if in_words else option.written or words or None
        shown = typer.Option(*_flags(name, option), help=text, metavar=metavar, rich_help_panel=panel)
        flags[before + name] = Annotated[plain | None, shown]
        RANKS.setdefault(before + name, option.rank or LAST)
    return flags


def read_flags(group: type, given: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Read what flags of a group give, as `flags_of` names them; what isn't given is left out.

    `SettingError` for a text that isn't written as its option asks.
    """
    return {
        name: _read(kind, _flags(name, option)[0], given[before + name])
        for name, (kind, option) in options_of(group).items()
        if given.get(before + name) not in NOT_GIVEN
    }


def _flags(name: str, option: Option) -> list[str]:
    return option.flags.split() or [f"--{name.replace('_', '-')}"]


def _is_list(kind: Any) -> bool:
    """Check whether an option is a list of any length, whose flag may be repeated."""
    return Ellipsis in get_args(kind)


def _is_named_text(kind: Any) -> bool:
    """Check whether an option has texts by name, of which each repetition of its flag has one."""
    return get_origin(kind) is Mapping and get_args(kind)[1] is str


def _read(kind: Any, flag: str, value: Any) -> Any:
    """Read a flag's text as its option's type asks; what is no text already has its type."""
    if _is_named_text(kind):
        return parse_named(flag, value)
    if _is_list(kind):
        return tuple(word for text in value for word in parse_words(text) or ())
    whole = next((part for part in (kind, *get_args(kind)) if get_origin(part) in (tuple, Mapping)), None)
    if whole is None:
        return value
    if get_origin(whole) is Mapping:
        return parse_positions(flag, value)
    if _is_list(whole):
        return parse_integers(flag, value) if is_one_or_more(kind) else tuple(parse_words(value) or ())
    count = len(get_args(whole))
    form, separator = ("MIN:MAX", ":") if count == RANGE else ("X,Y,Z", ",")
    return tuple(parse_numbers(value, count, form, separator, flag=flag))


BOUNDS, PROGRAM_BOUNDS = flags_of(Bounds), flags_of(ProgramBounds)
# Groups of options, by the name of the setting.
PLANNING: Mapping[str, Any] = {
    "tool": optional(str, "ball:10, bull:16:4 or a .toml file; default: the input's tool"),
    "feed": optional(float, "mm/min, replaces the input's feed"),
    **flags_of(Planning),
    "unit": UNIT,
    **flags_of(Meshes),
}
LEANING: Mapping[str, Any] = flags_of(LeanBounds)
READING: Mapping[str, Any] = {
    "unit": UNIT,
    "columns": optional(str, "columns of points without header: x,y,z,nx,ny,nz or x,y,z,i,j,k"),
    "written_for": optional(str, "machine of an input program, if it isn't --machine"),
    **flags_of(ReadProgram),
}
ON_MACHINE, PLACING = flags_of(OnMachine), flags_of(Placing)
POSTURE: Mapping[str, Any] = {
    **ON_MACHINE,
    **PLACING,
    **BOUNDS,
    **flags_of(Surrounding),
    "fixtures": optional(Path, "TOML with [[fixture]] and [clearance], as in a job"),
    "path_shape": optional(
        str,
        "between locations: smooth (a curve where they are its samples) or chord; default: as the path says",
    ),
    **flags_of(Search),
    "front": optional(int, "find N solutions, from the cheapest program to the fastest or steadiest"),
    "feed_share": optional(float, "with --front: least share of the feed, where slower cuts save energy"),
    "pick": optional(int, "with --front: number of the solution to deliver; 1 is the cheapest"),
    "allow": optional(str, "what a cheaper program may be in place of one's own: slower, rougher or both"),
    "edge_use": optional(bool, "report where on the cutter's edge the path cuts", "--edge-use/--no-edge-use"),
    "setup_search": optional(
        str, "choose the setup too: auto, or x=-50:50,angle=0:90, or x,angle with a job's ranges", "--setup"
    ),
}
# What stands around a program, and how it is read, where it is shown as it is.
SHOWN: Mapping[str, Any] = {
    **ON_MACHINE,
    **PLACING,
    "tool": PLANNING["tool"],
    **flags_of(Workpiece),
    "fixtures": POSTURE["fixtures"],
    **flags_of(Meshes),
    **READING,
}
# The settings of a program have names of the table "nc" of a job, some of which other flags have too.
NC = "nc_"
WRITING: Mapping[str, Any] = {**flags_of(Writing), **flags_of(Framing, NC)}


def takes(*groups: Mapping[str, Any]) -> Callable[[Verb], Verb]:
    """Make a command of a function: add groups of options, and what every command has.

    Typer reads a command's options from its signature; the command finds those of the groups in its context.

    Parameters
    ----------
    groups : annotated types by name; they stand after the command's arguments and before its own options
    """
    options = {name: (kind, None) for group in groups for name, kind in group.items()}
    for name in options:
        RANKS.setdefault(name, LAST)

    def extend(verb: Verb) -> Verb:
        kinds = get_type_hints(verb, include_extras=True)
        own = [p for p in inspect.signature(verb).parameters.values() if p.kind is not p.VAR_KEYWORD]
        typed = [p.replace(annotation=kinds[p.name]) for p in own]
        first = [p for p in typed if p.default is p.empty]
        last = [p.replace(kind=p.KEYWORD_ONLY) for p in typed if p.default is not p.empty]
        shared, common = (
            [
                inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
                for name, (kind, default) in group.items()
            ]
            for group in (options, COMMON)
        )

        @functools.wraps(verb)
        def run(
            *args: Any, verbose: int = 0, quiet: bool = False, help_all: bool = False, **given: Any
        ) -> Any:
            set_verbosity(verbose, quiet)
            return verb(*args, **given)

        every = [*first, *shared, *last, *common]
        run.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in every}
        return run  # type: ignore[return-value]

    return extend


class ConsoleHandler(logging.Handler):
    """Print records on stderr, above the progress where there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record: its room and its message."""
        console = alarm if record.levelno >= logging.ERROR else err
        room = record.name.removeprefix(f"{ROOT}.").partition(".")[0]
        console.print(f"{room}: {record.getMessage()}", markup=False)


def set_verbosity(verbose: int, quiet: bool) -> None:
    """Log warnings (0), stages (1) or their details (2); only errors if `quiet`."""
    err.quiet = quiet
    logger = logging.getLogger(ROOT)
    logger.setLevel(logging.ERROR if quiet else LEVELS[min(verbose, len(LEVELS) - 1)])
    if not any(isinstance(handler, ConsoleHandler) for handler in logger.handlers):
        logger.addHandler(ConsoleHandler())


def is_verbose() -> bool:
    """Whether -v was given."""
    return logging.getLogger(ROOT).isEnabledFor(logging.INFO)
