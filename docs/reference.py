"""Pages of the reference: one for each house of the package, with every name of its door."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib import import_module
from typing import Literal, get_args, get_origin

import fiveaxis as fx

HOUSES = ("model", "cam", "nc", "posture", "check", "lab", "show", "job", "base")


def pages() -> dict[str, str]:
    """Write the reference: file name → reStructuredText."""
    return {"index.rst": _index()} | {f"{house}.rst": _house(house) for house in HOUSES}


def public_names(house: str) -> list[str]:
    """List the names of a house's door."""
    door = import_module(f"fiveaxis.{house}")
    return [name for name in door.__all__ if not inspect.ismodule(getattr(door, name))]


def _first_sentence(thing: object) -> str:
    text = inspect.getdoc(thing) or ""
    return text.split("\n\n")[0].replace("\n", " ").replace("|", "\\|").replace("*", "\\*")


def _heading(title: str, sign: str = "=") -> list[str]:
    return [title, sign * len(title), ""]


def _index() -> str:
    lines = [
        *_heading("Reference"),
        "``import fiveaxis as fx`` gives the names below. The houses of the package have more.",
        "",
        ".. list-table::",
        "   :widths: 30 70",
        "",
    ]
    for name in fx.__all__:
        thing = getattr(fx, name)
        home = thing.__module__.split(".")[1]
        role = "class" if inspect.isclass(thing) else "func"
        role = "exc" if inspect.isclass(thing) and issubclass(thing, Exception) else role
        lines += [
            f"   * - :py:{role}:`fx.{name} <fiveaxis.{home}.{name}>`",
            f"     - {_first_sentence(thing)}",
        ]
    houses = [f"   {name}" for name in ("examples", *HOUSES)]
    return "\n".join([*lines, "", ".. toctree::", "   :caption: Houses", "   :maxdepth: 1", "", *houses, ""])


def _house(house: str) -> str:
    module = import_module(f"fiveaxis.{house}")
    lines = [
        *_heading(f"fiveaxis.{house}"),
        f".. automodule:: fiveaxis.{house}",
        "   :no-members:",
        "",
        f".. currentmodule:: fiveaxis.{house}",
        "",
    ]
    for name in public_names(house):
        thing = getattr(module, name)
        if inspect.isclass(thing):
            lines += [f".. auto{'exception' if issubclass(thing, Exception) else 'class'}:: {name}", ""]
        elif inspect.isroutine(thing):
            lines += [f".. autofunction:: {name}", ""]
        else:
            lines += [f".. py:data:: {name}", "", f"   {_value(thing)}", ""]
    return "\n".join(lines)


def _value(thing: object) -> str:
    """Say what a constant or an alias of a type is."""
    if get_origin(thing) is Literal:
        return f"One of {', '.join(f'``{part!r}``' for part in get_args(thing))}."
    if isinstance(thing, Mapping):
        return f"A mapping with {', '.join(f'``{key}``' for key in thing)}."
    if isinstance(thing, str | int | float | tuple):
        return f"``{thing!r}``"
    if get_args(thing):
        return f"The type ``{thing}``."
    return f"A :py:class:`{type(thing).__name__}`."
