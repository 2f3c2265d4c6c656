"""Options, each said once: a field of a `TypedDict`, with type, default, range and one sentence.

From it come the keywords of functions (`spelled_out`), which editors complete and mypy checks, the tables of
job files (`table_of`) and the flags of commands.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, TypeVar, get_args, get_type_hints

if TYPE_CHECKING:
    from pydantic import BaseModel

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Option:
    """What an option is, beside its name and type.

    Parameters
    ----------
    about : what it says, with its unit
    default : where nobody gives it
    above, least, below, most : open and closed ends of its range
    written : how a command line writes it, ``MIN:MAX`` or ``X,Y,Z``; empty for a plain number or word
    """

    about: str
    default: Any = None
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    written: str = ""


@cache
def options_of(group: type) -> dict[str, tuple[Any, Option]]:
    """Return type and meaning of a group's options, by name."""
    hints = get_type_hints(group, include_extras=True)
    return {name: get_args(hint)[:2] for name, hint in hints.items()}


def completed(group: type, given: Mapping[str, Any]) -> dict[str, Any]:
    """Add the defaults of a group to what is given.

    Raises
    ------
    TypeError
        An option that the group doesn't have.
    """
    require_known(group, given)
    return {name: option.default for name, (_, option) in options_of(group).items()} | dict(given)


def require_known(group: type, given: Mapping[str, Any]) -> None:
    """Raise `TypeError` for an option that a group doesn't have."""
    known = options_of(group)
    for name in given:
        if name not in known:
            raise TypeError(f"unexpected keyword argument {name!r}; there are {', '.join(known)}")


def table_of(group: type, base: type[BaseModel]) -> type[BaseModel]:
    """Make a model of settings with a field for each option of a group, after those of a base."""
    from pydantic import Field, create_model

    fields: dict[str, Any] = {
        name: (
            kind,
            Field(
                option.default,
                gt=option.above,
                ge=option.least,
                lt=option.below,
                le=option.most,
                description=option.about,
            ),
        )
        for name, (kind, option) in options_of(group).items()
    }
    return create_model(group.__name__, __base__=base, **fields)


def spelled_out(group: type) -> Callable[[F], F]:
    """Let a function's signature and docstring name each option of a group that it takes as ``**``."""
    heading = "Other Parameters"
    lines = [heading, "-" * len(heading)]
    lines += [f"{name} : {option.about}" for name, (_, option) in options_of(group).items()]
    section = "\n".join(lines)

    def spell(function: F) -> F:
        before, raises, after = inspect.cleandoc(function.__doc__ or "").partition("\n\nRaises\n")
        function.__doc__ = f"{before}\n\n{section}{raises}{after}"
        own = inspect.signature(function)
        named = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
        named += [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=option.default, annotation=kind)
            for name, (kind, option) in options_of(group).items()
        ]
        function.__signature__ = own.replace(parameters=named)  # type: ignore[attr-defined]
        return function

    return spell


class ProgramBounds(TypedDict, total=False):
    """Bounds on postures and turns, as far as they can be checked in a program of any source."""

    tilt: Annotated[
        tuple[float, float] | None,
        Option("smallest and largest angle to the surface normal, deg", written="MIN:MAX"),
    ]
    cone: Annotated[
        float | None, Option("largest angle to the programmed tool axis, deg", above=0.0, most=180.0)
    ]
    lead: Annotated[
        tuple[float, float] | None,
        Option(
            "smallest and largest angle by which the tool tips forwards along the feed, deg",
            written="MIN:MAX",
        ),
    ]
    lean: Annotated[
        tuple[float, float] | None,
        Option(
            "smallest and largest angle by which the tool tips to the left of the feed, deg",
            written="MIN:MAX",
        ),
    ]
    plane: Annotated[
        tuple[float, float, float] | None,
        Option("vector normal to a plane that the tool axis stays in", written="X,Y,Z"),
    ]
    hold: Annotated[
        Mapping[str, float] | None,
        Option("rotary axes held at an angle, by letter, deg", written="C30 (4-axis) or A-20,C30 (3+2)"),
    ]
    max_turn: Annotated[
        float | None,
        Option("largest rotary turn in a cutting move, deg; 180 deg/s by default", above=0.0),
    ]
    singular_cone: Annotated[
        float | None,
        Option(
            "half angle of a cone about the first rotary axis; with the tool inside, that axis is held, deg",
            above=0.0,
            below=90.0,
        ),
    ]
    singular_rate: Annotated[
        float, Option("largest turn of that axis in the cone, deg/mm", default=0.0, least=0.0)
    ]


class Bounds(ProgramBounds, total=False):
    """Bounds on postures and turns."""

    turn_rate: Annotated[float | None, Option("largest rotary turn along a cut, deg/mm", above=0.0)]
