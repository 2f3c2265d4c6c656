"""Strict settings files: TOML into a pydantic model, with errors that name place and nearest key."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from fiveaxis.errors import InputError


class StrictModel(BaseModel):
    """Base of every settings model: frozen, unknown keys refused, finite numbers only."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Model = TypeVar("Model", bound=BaseModel)


def read_settings(path: Path, model: type[Model], error: type[InputError]) -> Model:
    """Read a TOML file into a model.

    Parameters
    ----------
    path : the file
    model : what it must look like
    error : class of the errors raised

    Raises
    ------
    error
        Missing file, not TOML, unknown key (with the nearest known one), missing or wrong value; all faults
        of a file are named in one message, the first with its line.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise error(f"can't be read: {fault}", file=path) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        found = re.search(r"line (\d+)", str(fault))
        raise error(f"is not valid TOML: {fault}", file=path, line=int(found[1]) if found else None) from None
    try:
        return model.model_validate(data)
    except ValidationError as fault:
        # A mistyped key shows up twice, as unknown and as missing: the unknown one is the cause.
        problems = sorted(fault.errors(), key=lambda p: p["type"] != "extra_forbidden")
        messages = [_explain(p["loc"], p["type"], p["msg"], model) for p in problems]
        line = line_of(text, problems[0]["loc"])
        raise error("; ".join(messages), file=path, line=line) from None


def line_of(text: str, location: Sequence[str | int]) -> int | None:
    """Find the line, from 1, on which the key at a location of a TOML text stands.

    The search narrows from table header to key, so a key inside an inline table is found on the line of
    the table's own key.
    """
    keys = [str(k) for k in location]
    lines = text.splitlines()
    best: int | None = None
    table: list[str] = []
    for number, line in enumerate(lines, start=1):
        header = re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line)
        key = re.match(r"\s*([\w.-]+)\s*=", line)
        if header:
            table = header[1].split(".")
            if keys[: len(table)] == table:
                best = number
        elif key:
            path = [*table, *key[1].split(".")]
            if keys[: len(path)] == path:
                return number
    return best


def _explain(location: Sequence[str | int], kind: str, message: str, model: type[BaseModel]) -> str:
    name = ".".join(str(part) for part in location)
    if kind != "extra_forbidden":
        text = message.removeprefix("Value error, ")
        return f"{name}: {text}" if name else text
    known = _known_keys(location[:-1], model)
    near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=0.0)
    return f"unknown key {name!r}; the nearest known one is {near[0]!r}" if near else f"unknown key {name!r}"


def _known_keys(location: Sequence[str | int], model: type[BaseModel]) -> list[str]:
    """List the keys that a model knows at a location inside it."""
    models = [model]
    for part in location:
        annotations = [m.model_fields[str(part)].annotation for m in models if str(part) in m.model_fields]
        # A key of a free dictionary, or the tag of a union, stays at the models already found.
        models = [found for a in annotations for found in _models_in(a)] or models
    return sorted({f.alias or n for m in models for n, f in m.model_fields.items()})


def _models_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models_in(part)]
