"""The fields of a settings file, told from the model that reads it: key, type, unit, default, meaning."""

from __future__ import annotations

import inspect
import json
import re
from collections import abc
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fiveaxis.base.settings import models_in

# Units as descriptions write them, at their start or after a comma; the longest first.
_UNIT = re.compile(
    r"(?:^|, )(mm and deg|mm/min|m/min|deg/mm|deg/min|rev/min|J/mm|J/rad2|N/mm2|N/mm|kg of CO2 per kWh"
    r"|deg|mm|kg|W|N)(?=$|[,;.: ])"
)
_BOUNDS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_PLAIN = {float: "number", int: "whole number", bool: "true or false", str: "text", Path: "file"}


@dataclass(frozen=True)
class Entry:
    """One field of a settings file.

    Parameters
    ----------
    key : as in TOML, ``plan.stepdown``
    kind : type of its value, with bounds
    unit : of its numbers; empty where it has none
    default : as in TOML; None where it must be given, ``""`` where there is none
    description : its meaning
    example : as in TOML, of a value; None where the default serves
    is_table, is_list : whether it is a table of further fields, and whether there may be several
    """

    key: str
    kind: str
    unit: str
    default: str | None
    description: str
    example: str | None = None
    is_table: bool = False
    is_list: bool = False

    @property
    def shown(self) -> str:
        """What a starter file shows."""
        return self.example or self.default or '""'

    def as_dict(self) -> dict[str, Any]:
        """Return the entry as plain data for JSON."""
        return {
            "key": self.key,
            "type": self.kind,
            "unit": self.unit or None,
            "default": self.default,
            "description": self.description,
        }


def list_entries(model: type[BaseModel], above: str = "") -> list[Entry]:
    """List the fields of a settings file's model, or of a table of it, tables after the plain fields."""
    every = [(_entry(name, field, model, above), field) for name, field in model.model_fields.items()]
    plain = [entry for entry, _ in every if not entry.is_table]
    tables = [
        part
        for entry, field in every
        if entry.is_table
        for part in (entry, *list_entries(models_in(field.annotation)[0], entry.key))
    ]
    return [*plain, *tables]


def _entry(name: str, field: FieldInfo, model: type[BaseModel], above: str) -> Entry:
    models = models_in(field.annotation)
    about = (models[0].__doc__ or "").strip().partition("\n")[0] if models else ""
    text = field.description or _from_docstring(name, model) or about
    found = _UNIT.search(text) or (None if field.description is None else _UNIT.search(model.__doc__ or ""))
    without_unit = _UNIT.sub("", text, count=1).lstrip(",;: ") if found else text
    return Entry(
        key=f"{above}.{name}" if above else name,
        kind=_kind(field.annotation, field.metadata),
        unit="" if models or not found or not has_numbers(field.annotation) else found[1],
        default=_default(field, bool(models)),
        description=(text if models else without_unit or text).removesuffix("."),
        example=to_toml(field.examples[0]) if field.examples else None,
        is_table=bool(models),
        is_list=bool(models) and _is_list(field.annotation),
    )


def _default(field: FieldInfo, is_table: bool) -> str | None:
    if field.is_required():
        return None
    value = field.get_default(call_default_factory=True)
    return "" if is_table or value is None else to_toml(value)


def _from_docstring(name: str, model: type[BaseModel]) -> str:
    """Find the text of a parameter in a model's numpydoc docstring."""
    texts = (text for names, text in docstring_parameters(model) if name in names)
    return next(texts, "").replace("``", "")


def docstring_parameters(model: type[BaseModel]) -> Iterator[tuple[list[str], str]]:
    """Yield the parameters of a model's numpydoc docstring: the names that share a text, and the text."""
    _, _, parameters = (inspect.getdoc(model) or "").partition("----------\n")
    for names, text in re.findall(r"^(\w[\w, ]*) : (.*(?:\n[ \t]+.*)*)", parameters, re.MULTILINE):
        yield names.split(", "), " ".join(text.split())


def _kind(annotation: Any, metadata: list[Any]) -> str:
    """Return the type of a value in the words of TOML users."""
    parts = [part for part in get_args(annotation) if part is not NoneType]
    if NoneType in get_args(annotation):
        return _kind(parts[0], metadata)
    if get_origin(annotation) is Literal:
        return " | ".join(json.dumps(part) for part in parts)
    if models_in(annotation):
        return "list of tables" if _is_list(annotation) else "table"
    if get_origin(annotation) is tuple:
        inner = [_kind(part, []) for part in parts if part is not Ellipsis]
        return f"[{', '.join(inner)}{', ...' if Ellipsis in parts else ''}]"
    if get_origin(annotation) in (dict, abc.Mapping):
        return f"table of a {_kind(parts[1], [])} by {'name' if parts[1] is str else 'letter'}"
    plain = _PLAIN.get(annotation) or (_kind(parts[0], []) if parts else str(annotation))
    return f"{plain} {bounds_text(metadata)}".strip()


def bounds_text(metadata: Iterable[Any]) -> str:
    """Return the bounds in a field's metadata: ``> 0 and <= 180``."""
    return " and ".join(
        f"{sign} {getattr(m, name):.15g}"
        for m in metadata
        for name, sign in _BOUNDS.items()
        if hasattr(m, name)
    )


def has_numbers(annotation: Any) -> bool:
    """Check whether a type is a number, or holds some."""
    return annotation in (float, int) or any(has_numbers(part) for part in get_args(annotation))


def _is_list(annotation: Any) -> bool:
    return Ellipsis in get_args(annotation) or any(_is_list(part) for part in get_args(annotation))


def to_toml(value: Any) -> str:
    """Write a value on one line of TOML."""
    if isinstance(value, Mapping):
        # A bare key with a dot would be a table in a table.
        keys = {key: json.dumps(key) if "." in key else key for key in value}
        inner = ", ".join(f"{keys[key]} = {to_toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple | frozenset):
        value = sorted(value) if isinstance(value, frozenset) else value
        return f"[{', '.join(map(to_toml, value))}]"
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return json.dumps(str(value) if isinstance(value, Path) else value, ensure_ascii=False)
