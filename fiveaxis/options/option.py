"""What an option is, and what is made of groups of options."""

from __future__ import annotations

import inspect
import math
import operator
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from pydantic import BaseModel

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Option:
    """What an option is, beside its name and type.

    Parameters
    ----------
    about : what it says
    unit : of its numbers; empty where they have none
    default : where nobody gives it
    above, least, below, most : open and closed ends of its range
    written : how a command line writes it, ``MIN:MAX`` or ``X,Y,Z``; empty for a plain number or word
    flags : of a command line, ``--on/--off`` or ``--long -l``; by default its name
    example : for a starter file, where the default is none
    """

    about: str
    unit: str = ""
    default: Any = None
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    written: str = ""
    flags: str = ""
    example: Any = None

    @property
    def sentence(self) -> str:
        """What it says, with its unit, which stands before the first semicolon."""
        fact, stop, rest = self.about.partition("; ")
        return f"{fact}, {self.unit}{stop}{rest}" if self.unit else self.about


def words_of(kind: Any) -> list[str]:
    """List the words that a type allows; none for other types."""
    return [
        word for part in (kind, *get_args(kind)) if get_origin(part) is Literal for word in get_args(part)
    ]


@cache
def options_of(group: type) -> dict[str, tuple[Any, Option]]:
    """Return type and meaning of a group's options, by name."""
    found = {}
    for name, hint in get_type_hints(group, include_extras=True).items():
        kind, option = get_args(hint)[:2]
        # The default of a dataclass's field is the field's own.
        found[name] = kind, replace(option, default=getattr(group, name, option.default))
    return found


def defaults(group: type) -> dict[str, Any]:
    """Return the defaults of a group's options, by name."""
    return {name: option.default for name, (_, option) in options_of(group).items()}


def completed(group: type, given: Mapping[str, Any]) -> dict[str, Any]:
    """Add the defaults of a group to what is given.

    Raises
    ------
    TypeError
        An option that the group doesn't have.
    SettingError
        A value out of its range, or an unknown word.
    """
    require_known(options_of(group), given)
    for name, (kind, option) in options_of(group).items():
        if given.get(name) is not None:
            _require_valid(name, kind, option, given[name])
    return defaults(group) | dict(given)


def _require_valid(name: str, kind: Any, option: Option, value: Any) -> None:
    if isinstance(value, list | tuple):
        if not value and is_one_or_more(kind):
            raise SettingError(f"{name} is an empty list; give a number, or leave it out")
        for each in value:
            _require_valid(name, kind, option, each)
        return
    words = words_of(kind)
    if words and value not in words:
        known = " or ".join(repr(word) for word in words)
        raise SettingError(f"{name} = {value!r} is unknown; give {known}")
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    unit = f" {option.unit}" if option.unit else ""
    wrong = f"{name} = {value:g}{unit} is out of range"
    for end, is_within, text in (
        (option.above, operator.gt, "more than {:g}{}"),
        (option.least, operator.ge, "{:g}{} or more"),
        (option.below, operator.lt, "less than {:g}{}"),
        (option.most, operator.le, "{:g}{} or less"),
    ):
        if end is not None and not (math.isfinite(value) and is_within(value, end)):
            raise SettingError(f"{wrong}; give {text.format(end, unit)}")
    if not math.isfinite(value):
        raise SettingError(f"{wrong}; give a finite number")


def require_known(known: Collection[str], given: Mapping[str, Any]) -> None:
    """Raise `TypeError` for an option that isn't known."""
    for name in given:
        if name not in known:
            raise TypeError(f"unexpected keyword argument {name!r}; there are {', '.join(known)}")


def parted(given: Mapping[str, Any], *groups: type) -> tuple[dict[str, Any], ...]:
    """Part what is given by the groups that it belongs to.

    Raises
    ------
    TypeError
        An option that no group has.
    """
    known = [options_of(group) for group in groups]
    require_known({name for options in known for name in options}, given)
    return tuple({name: given[name] for name in given if name in options} for options in known)


def table_of(group: type, base: type[BaseModel]) -> type[BaseModel]:
    """Make a model of settings with a field for each option of a group, after those of a base."""
    from pydantic import BeforeValidator, Field, create_model

    fields: dict[str, Any] = {}
    for name, (kind, option) in options_of(group).items():
        ends: dict[str, Any] = {"gt": option.above, "ge": option.least, "lt": option.below, "le": option.most}
        if is_one_or_more(kind):
            several = Annotated[tuple[Annotated[int, Field(**ends)], ...], Field(min_length=1)]
            kind, ends = Annotated[several | None, BeforeValidator(as_list)], {}
        shown = None if option.example is None else [option.example]
        fields[name] = kind, Field(option.default, **ends, description=option.sentence, examples=shown)
    return create_model(group.__name__, __base__=base, __doc__=group.__doc__, **fields)


def is_one_or_more(kind: Any) -> bool:
    """Check whether a type is a whole number or a list of some, of which one that stands alone is a list."""
    return tuple[int, ...] in get_args(kind)


def as_list(value: Any) -> Any:
    """Return a whole number as a list of one; all else as it is."""
    return (value,) if isinstance(value, int) else value


def section_of(group: type, heading: str) -> str:
    """Write the section of a docstring that says each option of a group."""
    lines = [heading, "-" * len(heading)]
    lines += [f"{name} : {option.sentence}" for name, (_, option) in options_of(group).items()]
    return "\n".join(lines)


def spelled_out(group: type) -> Callable[[F], F]:
    """Let a function's signature and docstring name each option of a group that it takes as ``**``."""
    section = section_of(group, "Other Parameters")

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
