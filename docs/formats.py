"""The keys of machine, tool, job and control files as Markdown, told from the models that read the files.

A model that a file is read into says type, default and, mostly, meaning of each key. `keys.toml` holds the
meanings that the models don't say; a key that has a meaning in neither place, and an entry of `keys.toml`
that has become needless, stop the build.
"""

from __future__ import annotations

import re
import tomllib
from collections import abc
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fiveaxis.base.entries import bounds_text, docstring_parameters, has_numbers, to_toml
from fiveaxis.base.settings import models_in
from fiveaxis.job import Job, list_job_entries
from fiveaxis.model.machine.tables import Figure, MachineFile
from fiveaxis.model.toolpath.shapes import SHAPES
from fiveaxis.model.toolpath.tool import ToolTable
from fiveaxis.nc.writing.table_parts import TEMPLATES
from fiveaxis.nc.writing.tables import Dialect

SUPPLEMENT = Path(__file__).with_name("keys.toml")
FILES: Mapping[str, type[BaseModel]] = {
    "machine": MachineFile,
    "tool": ToolTable,
    "job": Job,
    "control": Dialect,
}
# Units as the models write them, the longest first; a unit stands at the start or after a comma.
UNITS = (
    "N/(m/s) or N·m/(rad/s)",
    "mm/min (deg/min) or 1/min",
    "W/N2 or W/(N·m)2",
    "mm/min or deg/min",
    "W per N and (m/s)",
    "W per (rev/min)2",
    "kg of CO2 per kWh",
    "W per rev/min",
    "mm and deg",
    "N or N·m",
    "mm or deg",
    "W per N",
    "inch/min",
    "deg/mm",
    "mm/min",
    "rev/min",
    "J/rad2",
    "N/mm2",
    "kg·m2",
    "J/mm",
    "N/mm",
    "W/W",
    "1/W",
    "deg",
    "mm",
    "kg",
    "s",
    "W",
)
PLAIN = {float: "number", int: "whole number", bool: "true or false", str: "text", Path: "file"}
_ANY_UNIT = "|".join(map(re.escape, UNITS))
_UNIT = re.compile(rf"(?:^|, )({_ANY_UNIT})(?=$|[,;.:])|^({_ANY_UNIT})(?= (?:of|at) )")


class KeyFault(Exception):
    """A key without a meaning, or a meaning without a key."""


@dataclass(frozen=True)
class Key:
    """One key of a table.

    Parameters
    ----------
    name : as it stands in the file
    kind : what its value must be
    unit : of its numbers; empty where it has none
    default : in TOML's words; empty where it may be left out and has none
    meaning : a phrase
    """

    name: str
    kind: str
    unit: str
    default: str
    meaning: str


@dataclass(frozen=True)
class Table:
    """One table of a file.

    Parameters
    ----------
    header : as TOML writes it, empty for the keys at the top of the file
    model : that reads it
    about : what the table is
    keys : its own; those that every figure of a machine file has stand in a table of their own
    """

    header: str
    model: type[BaseModel]
    about: str
    keys: tuple[Key, ...]


class Meanings:
    """What `keys.toml` adds to the models, and which of it has been used."""

    def __init__(self, path: Path = SUPPLEMENT) -> None:
        self.texts: dict[str, str] = tomllib.loads(path.read_text(encoding="utf-8"))
        self.used: set[str] = set()

    def find(self, model: type[BaseModel], name: str) -> str:
        """Find what is added to a field of a model, or to a field that it inherits; else empty."""
        keys = [key for owner in model.__mro__ if (key := f"{owner.__name__}.{name}") in self.texts]
        self.used.update(keys[:1])
        return self.texts[keys[0]] if keys else ""

    def require_used(self) -> None:
        """Refuse entries for which there is no key, or no need."""
        if left := sorted(self.texts.keys() - self.used):
            raise KeyFault(f"keys.toml has {', '.join(left)}: there is no such key, or its model says it")


def list_tables(model: type[BaseModel], meanings: Meanings, path: str = "", header: str = "") -> list[Table]:
    """List a model's tables, the keys at the top first."""
    skipped = Figure.model_fields if issubclass(model, Figure) and model is not Figure else {}
    fields = {name: field for name, field in model.model_fields.items() if name not in skipped}
    keys = tuple(_key(name, field, model, meanings) for name, field in fields.items())
    tables = [Table(header, model, _first_line(model), keys)]
    for name, field in fields.items():
        inner = models_in(field.annotation)
        for table in inner:
            inside = ".".join(filter(None, (path, name, _placeholder(field))))
            title = f"[[{inside}]]" if _is_list(field.annotation) else f"[{inside}]"
            if len(inner) > 1:
                title += f", {_choice(table)}"
            tables += list_tables(table, meanings, inside, title)
    return tables


def _key(name: str, field: FieldInfo, model: type[BaseModel], meanings: Meanings) -> Key:
    inner = models_in(field.annotation)
    text, unit = _split_unit(_told(name, field, model))
    if not text:
        added, added_unit = _split_unit(meanings.find(model, name))
        text, unit = added or (_first_line(inner[0]) if inner else ""), unit or added_unit
    if not text:
        raise KeyFault(
            f"{model.__name__}.{name} has no description; write one at the model, or in docs/keys.toml"
        )
    if not unit and field.description and has_numbers(field.annotation):
        unit = _split_unit(_first_line(model).rstrip("."))[1]
    if not unit and issubclass(model, Figure) and has_numbers(field.annotation):
        unit = next((f"`{key}`" for key in (f"{name}_unit", "unit") if key in model.model_fields), "")
    return Key(name, _kind(field.annotation, field.metadata), unit, _default(field), text.rstrip("."))


def _told(name: str, field: FieldInfo, model: type[BaseModel]) -> str:
    """Give what a model says about a field: its description, or the docstring's line that is for it alone."""
    if field.description:
        return field.description
    for names, text in docstring_parameters(model):
        if names == [name]:
            return (
                re.sub(r"``|`", "`", text)
                .replace("None where", "leave out where")
                .replace("None for", "leave out for")
            )
    return ""


def _split_unit(text: str) -> tuple[str, str]:
    found = _UNIT.search(text)
    if not found:
        return text.strip(), ""
    rest = (text[: found.start()] + text[found.end() :]).lstrip(",;: ").strip()
    return rest, found[1] or found[2]


def _first_line(model: type[BaseModel]) -> str:
    return (model.__doc__ or "").strip().splitlines()[0]


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or isinstance(value, BaseModel) or models_in(field.annotation):
        return ""
    if isinstance(value, frozenset):
        value = sorted(value)
    return f"`{to_toml(value)}`"


def _kind(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """Say what a value must be, as people who write TOML say it."""
    if models_in(annotation):
        return "list of tables" if _is_list(annotation) else "table"
    parts, origin = [part for part in get_args(annotation) if part is not NoneType], get_origin(annotation)
    if annotation in PLAIN:
        bounds = bounds_text(metadata).replace(">=", "≥").replace("<=", "≤")
        return f"{PLAIN[annotation]} {bounds}".strip()
    if origin is Literal:
        return ", ".join(f"`{to_toml(part)}`" for part in parts)
    if origin is Annotated:
        return _kind(parts[0], parts[1:])
    if origin in (tuple, list, frozenset):
        if origin is not tuple or Ellipsis in parts:
            return f"list: {_kind(parts[0])}"
        return f"{len(parts)} values in a list: {_kind(parts[0])}"
    if origin in (dict, abc.Mapping):
        return f"table: {_kind(parts[1])} by {_kind(parts[0])}"
    if origin in (Union, UnionType):
        return ", or ".join(_kind(part, metadata) for part in parts)
    raise KeyFault(f"docs/formats.py has no words for the type {annotation}; add them to PLAIN")


def _placeholder(field: FieldInfo) -> str:
    """Name the level between a table of tables and one of them: ``axes.X``."""
    annotation: Any = field.annotation
    if get_origin(annotation) is not dict:
        return ""
    return {"X": "LETTER", "axes": "COORDINATES", "tip": "COORDINATES", "inverse_time": "MODE", "mm": "UNIT"}[
        get_args(get_args(annotation)[0])[0]
    ]


def _choice(model: type[BaseModel]) -> str:
    """Say by which value a table of several kinds is one of this kind: ``model = "friction"``."""
    return next(
        f"{name} = {to_toml(get_args(field.annotation)[0])}"
        for name, field in model.model_fields.items()
        if get_origin(field.annotation) is Literal and field.is_required()
    )


def _is_list(annotation: Any) -> bool:
    if get_origin(annotation) in (list, tuple):
        return True
    parts = [part for part in get_args(annotation) if part is not NoneType]
    return get_origin(annotation) is not dict and any(_is_list(part) for part in parts)


def pages() -> dict[str, str]:
    """Write the tables of every file: name of the file's kind → Markdown.

    Raises
    ------
    KeyFault
        A key that nobody describes; an entry of `keys.toml` that nobody needs.
    """
    meanings = Meanings()
    made = {name: list_tables(model, meanings) for name, model in FILES.items()}
    figure = list_tables(Figure, meanings, header="Where a figure comes from")[0]
    meanings.require_used()
    texts = {name: "\n".join(_section(table) for table in tables) for name, tables in made.items()}
    texts["machine"] += "\n" + _section(figure)
    texts["tool"] += "\n" + _shapes()
    texts["job"] += "\n" + _sweep()
    texts["control"] = f"{_based_on()}\n{texts['control']}\n{_templates()}"
    return texts


def _section(table: Table) -> str:
    title = f"`{table.header}`" if table.header.startswith("[") else table.header or "Top of the file"
    head, _, choice = table.header.partition(", ")
    if choice:
        title = f"`{head}` with `{choice}`"
    lines = [f"## {title}", "", table.about, ""]
    if table.keys:
        rows = ((f"`{k.name}`", k.kind, k.unit, k.default, k.meaning) for k in table.keys)
        lines += [_grid(("key", "type", "unit", "default", "meaning"), rows), ""]
    if issubclass(table.model, Figure) and table.model is not Figure:
        lines += ["Also: the keys of [every figure](#where-a-figure-comes-from).", ""]
    return "\n".join(lines)


def _grid(head: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> str:
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    lines += [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows]
    return "\n".join(lines)


def _shapes() -> str:
    rows = ((f"`{shape}`", ", ".join(f"`{name}`" for name in names)) for shape, (_, names) in SHAPES.items())
    short = "The short form lists the same figures in the same order: `bull:16:4`."
    return "\n".join(["## Figures of each shape", "", short, "", _grid(("shape", "keys"), rows), ""])


def _sweep() -> str:
    table, *keys = [entry for entry in list_job_entries() if entry.key.split(".")[0] == "sweep"]
    rows = (
        (
            f"`{entry.key.partition('.')[2]}`",
            ", ".join(f"`{p}`" if p.startswith('"') else p for p in entry.kind.split(" | ")),
            entry.description,
        )
        for entry in keys
    )
    head = [f"## `[{table.key}]`", "", f"{table.description}.", ""]
    return "\n".join([*head, _grid(("key", "type", "meaning"), rows), ""])


def _based_on() -> str:
    """Write the one key that is read before the model: `fiveaxis.nc.writing.tables`."""
    row = (
        "`based_on`",
        "text",
        "a known control, or a table beside this one; it says what isn't said here",
    )
    return "\n".join(["## What it starts from", "", _grid(("key", "type", "meaning"), iter([row])), ""])


def _templates() -> str:
    shown = {"reset_block": "reset.block", "modulo_word": "modulo.word", "comment": "comment.template"}
    rows = (
        (
            f"`{shown.get(name, name)}`",
            ", ".join(f"`{{{field}}}`" for field in sorted([*needed, *optional])),
            ", ".join(f"`{{{field}}}`" for field in sorted(needed)),
        )
        for name, (needed, optional) in TEMPLATES.items()
    )
    text = "A template is text with names in curly brackets. The program's values take their place."
    return "\n".join(
        ["## Names in templates", "", text, "", _grid(("template", "may have", "must have, once"), rows), ""]
    )
