"""Strict settings files: TOML into a pydantic model, with errors that name the line and the nearest key."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from fiveaxis.base.errors import InputError, shorten
from fiveaxis.base.files import MOST_SETTINGS_BYTES, kept_by_file, read_input

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

# Settings are written by hand: the parser needs seconds for a key of thousands of parts, and pydantic's and
# JSON's recursion ends where tables are nested hundreds deep. TOML promises integers of 64 bits only.
LONGEST_LINE = 20_000
DEEPEST = 20
LARGEST_INTEGER = 2**63
DEEP_KEY = re.compile(rf"(?<![\w\"'-])[\w\"'-]++(?:[ \t]*+\.[ \t]*+[\w\"'-]++){{{DEEPEST}}}")
# Faults of a file that are explained; each searches the nearest known key.
MOST_FAULTS = 10
# Characters of one fault and of a value in it.
LONGEST_FAULT, LONGEST_VALUE = 600, 200
# Type of a pydantic error -> what the value must be; other types keep pydantic's text.
MUST_BE = {
    **dict.fromkeys(("float_type", "float_parsing", "int_type", "int_parsing"), "a number"),
    "finite_number": "a finite number",
    "greater_than": "above {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "below {lt:g}",
    "less_than_equal": "at most {le:g}",
    **dict.fromkeys(("string_type", "path_type"), "text in quotes"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    "literal_error": "{expected}",
    **dict.fromkeys(("tuple_type", "list_type"), "a list in square brackets"),
    **dict.fromkeys(("model_type", "dict_type"), "a table of keys and values"),
    "string_too_short": "text that isn't empty",
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
}


class StrictModel(BaseModel):
    """Base of every settings model: frozen, unknown keys refused, finite numbers only."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


Model = TypeVar("Model", bound=BaseModel)


def read_settings(path: Path, model: type[Model], error: type[InputError]) -> Model:
    """Read a TOML file into a model of its content.

    Raises
    ------
    error
        Missing file, not TOML, unknown key (with the nearest known one), missing or wrong value; one message
        names all faults of a file, with the line of the first.
    """
    text, data = read_document(path, error)
    return validate_settings(data, text, path, model, error)


@kept_by_file(16)
def read_content(path: Path, *, error: type[InputError]) -> bytes:
    """Read the bytes of a file of settings."""
    return read_input(path, MOST_SETTINGS_BYTES, error)


def read_document(path: Path, error: type[InputError]) -> tuple[str, dict[str, Any]]:
    """Read a TOML file: its text and its content.

    Raises
    ------
    error
        Missing file, too large, not UTF-8, not TOML.
    """
    content = read_content(path, error=error)
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")  # editors on Windows add a byte order mark
    except UnicodeDecodeError:
        raise error("can't be read: it isn't UTF-8 text", file=path) from None
    lines = text.split("\n")
    line = next((i for i, line in enumerate(lines, start=1) if len(line) > LONGEST_LINE), None)
    if line is not None:
        raise error(
            f"has {len(lines[line - 1])} characters, beyond {LONGEST_LINE}; divide the line",
            file=path,
            line=line,
        )
    too_deep = f"nests lists or tables more than {DEEPEST} deep; no setting does"
    deep = DEEP_KEY.search(text)
    if deep is not None:
        raise error(too_deep, file=path, line=text.count("\n", 0, deep.start()) + 1)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        found = re.search(r"line (\d+)", str(fault))
        line = int(found[1]) if found else len(text.splitlines())  # without a line it is at the end
        raise error(f"is not valid TOML: {fault}", file=path, line=line) from None
    except RecursionError:
        raise error(too_deep, file=path) from None
    except ValueError as fault:  # an integer of thousands of digits, a date that doesn't exist
        raise error(f"has a value that can't be read: {fault}", file=path) from None
    for depth, value in _values_of(data):
        if depth > DEEPEST:
            raise error(too_deep, file=path)
        if isinstance(value, int) and not -LARGEST_INTEGER <= value < LARGEST_INTEGER:
            raise error("has an integer beyond 64 bits; write it with a point or an exponent", file=path)
    return text, data


def _values_of(data: object) -> Iterator[tuple[int, object]]:
    """Yield every value of a document with its depth; without recursion, so at any depth."""
    waiting = [(0, data)]
    while waiting:
        depth, value = waiting.pop()
        yield depth, value
        inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        waiting += [(depth + 1, item) for item in inner]


def validate_settings(
    data: dict[str, Any], text: str, path: Path, model: type[Model], error: type[InputError]
) -> Model:
    """Validate the content of a TOML file against a model.

    Raises
    ------
    error
        As `read_settings`, of values.
    """
    try:
        return model.model_validate(data)
    except ValidationError as fault:
        line = line_of(text, list_faults(fault, data)[0]["loc"])
        raise error(explain(fault, model, data), file=path, line=line) from None


def explain(fault: ValidationError, model: type[BaseModel], data: object = None) -> str:
    """Explain the faults of settings in one line: each key with its value and what it must be."""
    faults = list_faults(fault, data)
    more = len(faults) - MOST_FAULTS
    told = [shorten(explain_one(f, model), LONGEST_FAULT) for f in faults[:MOST_FAULTS]]
    return "; ".join([*told, f"and {more} more faults"] if more > 0 else told)


def list_faults(fault: ValidationError, data: object = None) -> list[ErrorDetails]:
    """List the faults, unknown keys first: a mistyped key is often reported as missing too.

    Parameters
    ----------
    data : that was validated; with it, locations don't contain pydantic's tags of unions
    """
    faults = sorted(fault.errors(), key=lambda f: f["type"] != "extra_forbidden")
    for found in faults:
        found["loc"] = _without_tags(found["loc"], data)
    return faults


def _without_tags(location: tuple[str | int, ...], data: object) -> tuple[str | int, ...]:
    """Remove tags from a location: values of the table that aren't keys of it."""
    kept: list[str | int] = []
    here = data
    for part in location:
        if isinstance(here, dict) and part not in here and part in list(here.values()):
            continue
        kept.append(part)
        if isinstance(here, dict):
            here = here.get(part)
        elif isinstance(here, list) and isinstance(part, int) and part < len(here):
            here = here[part]
    return tuple(kept)


def line_of(text: str, location: Sequence[str | int]) -> int | None:
    """Find the line, from 1, of the key at a location of a TOML text.

    The search narrows from table header to key, so a key inside an inline table is found on the line of the
    inline table's key.
    """
    keys = [str(k) for k in location]
    best: int | None = None
    table: list[str] = []
    seen: Counter[str] = Counter()
    for number, line in enumerate(text.splitlines(), start=1):
        header = re.match(r"\s*+(\[++)([^\]]++)\]", line)
        key = re.match(r"\s*([\w.-]+)\s*=", line)
        if header:
            name = header[2].strip()
            table = name.split(".")
            if len(header[1]) > 1:  # [[bodies]]: the index of the table in its list is part of its name
                table = [*table, str(seen[name])]
                seen[name] += 1
            if keys[: len(table)] == table:
                best = number
        elif key:
            path = [*table, *key[1].split(".")]
            if keys[: len(path)] == path:
                return number
    return best


def explain_one(fault: ErrorDetails, model: type[BaseModel]) -> str:
    """Explain one fault of settings in one line."""
    name = _format_key(fault["loc"])
    if fault["type"] == "extra_forbidden":
        return _explain_unknown(fault["loc"], model)
    if fault["loc"][-1:] == ("[key]",):
        return f"unknown table {_format_key(fault['loc'][:-1])!r}: {fault['msg']}"
    if fault["type"] == "value_error":
        text = fault["msg"].removeprefix("Value error, ")
        return f"{name}: {text}" if name not in text else text
    if fault["type"] == "missing":
        return f"{name} is missing"
    if fault["type"] in MUST_BE:
        bound = MUST_BE[fault["type"]].format_map(fault.get("ctx", {}))
        return f"{name} = {shorten(repr(fault['input']), LONGEST_VALUE)} must be {bound}"
    return f"{name}: {fault['msg']}" if name else fault["msg"]


def _explain_unknown(location: Sequence[str | int], model: type[BaseModel]) -> str:
    known = _known_keys(location[:-1], model)
    wrong = str(location[-1])
    last = {key.rpartition(".")[-1]: key for key in reversed(known)}
    near = difflib.get_close_matches(wrong, last, n=1, cutoff=0.6)
    near = near or difflib.get_close_matches(wrong, known, n=1, cutoff=0.0)
    fact = f"unknown key {_format_key(location)!r}"
    return f"{fact}; the nearest known one is {last.get(near[0], near[0])!r}" if near else fact


def _format_key(location: Sequence[str | int]) -> str:
    """Write a key as in TOML: ``plan.stepdown``, ``tilt[0]``."""
    return "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in location).removeprefix(".")


def _known_keys(location: Sequence[str | int], model: type[BaseModel]) -> list[str]:
    """List the keys of a model at a location inside it: its own first, then those of its tables."""
    models = [model]
    for part in location:
        annotations = [m.model_fields[str(part)].annotation for m in models if str(part) in m.model_fields]
        # A key of a free dictionary, or the tag of a union, keeps the models found so far.
        models = [found for a in annotations for found in models_in(a)] or models
    fields = [(f.alias or n, f.annotation) for m in models for n, f in m.model_fields.items()]
    inner = [
        f"{name}.{key}"
        for name, table in fields
        if isinstance(table, type) and issubclass(table, BaseModel)
        for key in table.model_fields
    ]
    return [*sorted({name for name, _ in fields}), *sorted(inner)]


def models_in(annotation: object) -> list[type[BaseModel]]:
    """List the models that a field's annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in models_in(part)]
