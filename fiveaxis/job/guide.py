"""Explain job files from their model: every field with its meaning, and a commented starter file."""

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

from fiveaxis.base import models_in, require_new, require_suffix, write_atomically
from fiveaxis.job.description import COMBINATIONS, COMBINE, LARGEST_SWEEP, SWEEP, Job

# Units as descriptions write them, at their start or after a comma; the longest first.
_UNIT = re.compile(
    r"(?:^|, )(mm and deg|mm/min|m/min|deg/mm|deg/min|rev/min|J/mm|J/rad2|N/mm2|N/mm|kg of CO2 per kWh"
    r"|deg|mm|kg|W|N)(?=$|[,;.: ])"
)
_BOUNDS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_PLAIN = {float: "number", int: "whole number", bool: "true or false", str: "text", Path: "file"}

# Fields that a new job file sets, for the user to change.
SET = {"input": "part.stl", "machine": "hayashi-640123", "tool": "ball:10", "tilt": [15, 75]}
# An example of a sweep; a file with one is for `fiveaxis batch` alone.
SWEEP_EXAMPLE = (
    f"[{SWEEP}]",
    f'{COMBINE} = "product"',
    "tilt = [[15, 75], [30, 60]]",
    '"setup.offset" = [[0, 0, 0], [0, 0, 50]]',
)
# A fixture is one of several kinds: the example shows one of them.
LEFT_OUT = ("fixture.cylinder", "fixture.mesh", "fixture.scale", "fixture.box.size", "fixture.box.center")


@dataclass(frozen=True)
class Entry:
    """One field of a job file.

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


def list_entries(model: type[BaseModel] = Job, above: str = "") -> list[Entry]:
    """List the fields of a settings file, tables after the plain fields.

    Parameters
    ----------
    model : of the file
    above : key of the table that the fields belong to
    """
    every = [(_entry(name, field, model, above), field) for name, field in model.model_fields.items()]
    plain = [entry for entry, _ in every if not entry.is_table]
    tables = [
        part
        for entry, field in every
        if entry.is_table
        for part in (entry, *list_entries(models_in(field.annotation)[0], entry.key))
    ]
    return [*plain, *tables, *(_sweep_entries() if model is Job else ())]


def _sweep_entries() -> list[Entry]:
    """List the table that makes many jobs of one file; it isn't a field of the job's model."""
    return [
        Entry(
            SWEEP,
            "table",
            "",
            "",
            f"Many jobs of one file, {LARGEST_SWEEP} at most, for `fiveaxis batch`: fields of a job, each "
            "with a list of values",
            is_table=True,
        ),
        Entry(
            f"{SWEEP}.{COMBINE}",
            " | ".join(map(json.dumps, COMBINATIONS)),
            "",
            "",
            "how several lists are combined: every value with every other, or the first with the first and "
            "so on; required with several lists",
        ),
        Entry(
            f"{SWEEP}.KEY",
            "list of values",
            "",
            "",
            "any field of a job, one job per value; the key of a table's field has a dot and quotes, "
            '"setup.offset"',
        ),
    ]


def write_starter(path: Path) -> Path:
    """Write a starter job file with every field, the optional ones as comments.

    Raises
    ------
    SettingError
        The file exists, or can't be written.
    """
    require_suffix(path, [".toml"], "a job file")
    require_new(path)
    return write_atomically(path, starter_text())


def starter_text() -> str:
    """Compose a job file that is valid as soon as its input exists."""
    lines = [
        "# A job of fiveaxis: `fiveaxis optimise THIS_FILE -o FOLDER`.",
        "# Paths are relative to this file. Remove a # to set a field; the value shown is the default, or an",
        "# example where there is none. `fiveaxis job --explain` explains every field.",
    ]
    return "\n".join([*lines, *_starter_lines()]) + "\n"


def _starter_lines() -> Iterator[str]:
    left = tuple(f"{key}." for key in LEFT_OUT)
    for entry in list_entries():
        if entry.key in LEFT_OUT or entry.key.startswith(left):
            continue
        if entry.is_table and entry.example is None:
            yield f"\n# {entry.description}" if entry.description else ""
            if entry.key == SWEEP:
                yield "# With a sweep the file is for `fiveaxis batch`:"
                yield from (f"#   {line}" for line in SWEEP_EXAMPLE)
                return
            yield f"# [[{entry.key}]]" if entry.is_list else f"# [{entry.key}]"
            continue
        value = to_toml(SET[entry.key]) if entry.key in SET else entry.shown
        parts = (entry.description, entry.unit, entry.kind if "|" in entry.kind else "")
        sign = "" if entry.key in SET else "# "
        yield f"{sign}{entry.key.rpartition('.')[2]} = {value}  # {'; '.join(filter(None, parts))}"


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
