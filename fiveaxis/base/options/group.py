"""What an option is, and what is made of groups of options."""

from __future__ import annotations

import difflib
import inspect
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, wraps
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Concatenate,
    Literal,
    ParamSpec,
    Protocol,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

from fiveaxis.base.errors import SettingError

if TYPE_CHECKING:
    from pydantic import BaseModel

P = ParamSpec("P")
A = TypeVar("A")
B = TypeVar("B")
C = TypeVar("C")
R = TypeVar("R")
S = TypeVar("S")
T = TypeVar("T")
R_co = TypeVar("R_co", covariant=True)

# Key of a field's metadata.
OPTION = "option"


@dataclass(frozen=True)
class Option:
    """What an option is, beside its name and type.

    Parameters
    ----------
    about : what it says
    unit : of its numbers; empty where they have none
    default : that of its field
    above, least, below, most : open and closed ends of its range
    written : how a command line writes it, ``MIN:MAX`` or ``X,Y,Z``; empty for a plain number or word
    flags : of a command line, ``--on/--off`` or ``--long -l``; by default its name
    example : for a starter file, where the default is none
    rank : place in the help of commands, 1 first; 0 where only ``--help-all`` shows it
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
    rank: int = 0

    @property
    def sentence(self) -> str:
        """What it says, with its unit, which stands before the first semicolon."""
        fact, stop, rest = self.about.partition("; ")
        return f"{fact}, {self.unit}{stop}{rest}" if self.unit else self.about


def option(default: T, about: str, **more: Any) -> T:
    """Make the field of an option: its default, what it says, and what else `Option` has."""
    metadata = {OPTION: Option(about, default=default, **more)}
    if isinstance(default, dict):
        made: Any = field(default_factory=default.copy, metadata=metadata)
    else:
        made = field(default=default, metadata=metadata)
    return made


def with_default(group: Any, name: str, default: T) -> T:
    """Make the field of an option as a group has it, with another default."""
    kept = replace(options_of(group)[name][1], default=default)
    return field(default=default, metadata={OPTION: kept})


def words_of(kind: Any) -> list[str]:
    """List the words that a type allows; none for other types."""
    return [
        word for part in (kind, *get_args(kind)) if get_origin(part) is Literal for word in get_args(part)
    ]


@dataclass(frozen=True, kw_only=True)
class Group:
    """Base of the groups of options: frozen records with a field ``name: type = option(…)`` each.

    Raises
    ------
    SettingError
        A value out of its range, or an unknown word.
    """

    def __post_init__(self) -> None:
        group: Any = type(self)
        for name, (kind, option) in options_of(group).items():
            value = getattr(self, name)
            if value is not None:
                _require_kind(name, kind, option, value)
                _require_valid(name, kind, option, value)

    @classmethod
    def of(cls, *records: object, **others: Any) -> Self:
        """Take the fields of this group that records have, the last one's where several do.

        Parameters
        ----------
        others : fields by name, in place of those of the records
        """
        names = [field.name for field in fields(cls)]
        taken = {name: getattr(each, name) for each in records for name in names if hasattr(each, name)}
        return cls(**taken | others)


@cache
def options_of(group: Any) -> dict[str, tuple[Any, Option]]:
    """Return type and meaning of a group's options, by name; fields without an `Option` aren't among them."""
    kinds = get_type_hints(group)
    return {f.name: (kinds[f.name], f.metadata[OPTION]) for f in fields(group) if OPTION in f.metadata}


def _require_kind(name: str, kind: Any, option: Option, value: Any) -> None:
    """Raise `SettingError` for a value that is none of its kind: a word for a number, one number for two."""
    either = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    kinds = [each for each in either if each is not NoneType]
    if not any(_is_of(each, value) for each in kinds):
        counts = [len(get_args(each)) for each in kinds if get_origin(each) is tuple]
        form = "a number" if float in kinds or int in kinds else f"something such as {option.example!r}"
        if counts and Ellipsis not in get_args(kinds[0]):
            form = f"({', '.join(['a number'] * counts[0])})"
        unit = f", {option.unit}" if option.unit else ""
        raise SettingError(f"{name} = {value!r} is of the wrong kind; give {form}{unit}")


def _is_of(kind: Any, value: Any) -> bool:
    """Check whether a value may be meant as one of a kind; of kinds that aren't known here, every one is."""
    if kind in (float, int):
        return isinstance(value, Real if kind is float else Integral) and not isinstance(value, bool)
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        if isinstance(value, str) or not hasattr(value, "__len__"):
            return False
        if Ellipsis in parts:
            return all(_is_of(parts[0], each) for each in value)
        return len(value) == len(parts) and all(map(_is_of, parts, value))
    if get_origin(kind) is Mapping:
        return isinstance(value, Mapping) and all(_is_of(get_args(kind)[1], each) for each in value.values())
    return True


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


def section_of(group: Any, heading: str) -> str:
    """Write the section of a docstring that says each option of a group."""
    lines = [heading, "-" * len(heading)]
    lines += [f"{name} : {option.sentence}" for name, (_, option) in options_of(group).items()]
    return "\n".join(lines)


class Spread(Protocol[P, R_co]):
    """Gives a function keywords in place of the record that it takes last."""

    @overload
    def __call__(self, function: Callable[[A, R_co], S], /) -> Callable[Concatenate[A, P], S]: ...
    @overload
    def __call__(self, function: Callable[[A, B, R_co], S], /) -> Callable[Concatenate[A, B, P], S]: ...
    @overload
    def __call__(self, function: Callable[[A, B, C, R_co], S], /) -> Callable[Concatenate[A, B, C, P], S]: ...


def keywords_of(record: Callable[P, R]) -> Spread[P, R]:
    """Let callers give the fields of the record that a function takes last as keywords.

    Editors and type checkers read them from the record's constructor. Signature and docstring are set for
    `help()` and notebooks, which see neither; written out by hand, every list of options would stand twice.
    """
    group: Any = record
    section = section_of(group, "Other Parameters")

    def spread(function: Any) -> Any:
        *own, last = inspect.signature(function).parameters.values()
        keywords = inspect.signature(record).parameters.values()
        known = [each.name for each in (*own, *keywords)]
        required = [each.name for each in keywords if each.default is each.empty]

        @wraps(function)
        def call(*args: Any, **given: Any) -> Any:
            wrong = next((name for name in given if name not in known), None)
            if wrong is not None:
                near = difflib.get_close_matches(wrong, known, n=1)
                hint = f"; did you mean {near[0]!r}?" if near else ""
                raise TypeError(f"{function.__name__}() got an unexpected keyword argument {wrong!r}{hint}")
            lacking = next((name for name in required if name not in given), None)
            if lacking is not None:
                raise TypeError(f"{function.__name__}() misses the keyword argument {lacking!r}")
            named = {each.name: given.pop(each.name) for each in own if each.name in given}
            return function(*args, **named, **{last.name: group(**given)})

        before, raises, after = inspect.cleandoc(function.__doc__ or "").partition("\n\nRaises\n")
        call.__doc__ = f"{before}\n\n{section}{raises}{after}"
        kinds = {name: kind for name, (kind, _) in options_of(group).items()}
        spelled = [each.replace(annotation=kinds.get(each.name, each.annotation)) for each in keywords]
        call.__signature__ = inspect.signature(function).replace(parameters=[*own, *spelled])  # type: ignore[attr-defined]
        return call

    return spread
