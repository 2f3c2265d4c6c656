"""Pages of the reference: one for each room of the package, with every public name."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib import import_module
from typing import Literal, get_args, get_origin

import fiveaxis as fx

ROOMS = (
    "batch",
    "collision",
    "contour",
    "energy",
    "geometry",
    "job",
    "kinematics",
    "machine",
    "mesh",
    "motion",
    "nc",
    "posture",
    "report",
    "toolpath",
    "verification",
    "viewer",
    "errors",
    "findings",
)


def pages() -> dict[str, str]:
    """Write the reference: file name → reStructuredText."""
    return {"index.rst": _index()} | {f"{room}.rst": _room(room) for room in ROOMS}


def public_names(room: str) -> list[str]:
    """List the public names of a room: what its folder's face imports, or what its module defines."""
    module = import_module(f"fiveaxis.{room}")
    is_folder = hasattr(module, "__path__")
    return sorted(
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and not inspect.ismodule(value)
        and (is_folder or getattr(value, "__module__", "") == module.__name__)
    )


def _first_sentence(thing: object) -> str:
    text = inspect.getdoc(thing) or ""
    return text.split("\n\n")[0].replace("\n", " ").replace("|", "\\|").replace("*", "\\*")


def _heading(title: str, sign: str = "=") -> list[str]:
    return [title, sign * len(title), ""]


def _index() -> str:
    lines = [
        *_heading("Reference"),
        "``import fiveaxis as fx`` gives the names below. The rooms of the package have more.",
        "",
        ".. list-table::",
        "   :widths: 30 70",
        "",
    ]
    for name in fx.__all__:
        thing = getattr(fx, name)
        home = fx._HOMES[name]
        role = "class" if inspect.isclass(thing) else "func"
        role = "exc" if inspect.isclass(thing) and issubclass(thing, Exception) else role
        lines += [
            f"   * - :py:{role}:`fx.{name} <fiveaxis.{home}.{name}>`",
            f"     - {_first_sentence(thing)}",
        ]
    rooms = [f"   {name}" for name in ("examples", *ROOMS)]
    return "\n".join([*lines, "", ".. toctree::", "   :caption: Rooms", "   :maxdepth: 1", "", *rooms, ""])


def _room(room: str) -> str:
    module = import_module(f"fiveaxis.{room}")
    lines = [
        *_heading(f"fiveaxis.{room}"),
        f".. automodule:: fiveaxis.{room}",
        "   :no-members:",
        "",
        f".. currentmodule:: fiveaxis.{room}",
        "",
    ]
    for name in public_names(room):
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
