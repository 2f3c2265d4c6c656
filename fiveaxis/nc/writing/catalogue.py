"""The known controls: tables of the package, and custom ones."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

from fiveaxis.errors import SettingError
from fiveaxis.nc.writing.tables import Dialect
from fiveaxis.settings import read_document, validate_settings

FOLDER = Path(__file__).parents[1] / "controls"


def find_dialect(control: str | Path) -> Dialect:
    """Find the dialect of a control: one of `DIALECTS` by its name, or a custom table by its path.

    Parameters
    ----------
    control : a name, or the path of a ``.toml`` file

    Raises
    ------
    SettingError
        An unknown name, with the nearest and all known ones; a table that can't be read, with file and line.
    """
    name = str(control)
    if name.lower().endswith(".toml"):
        return read_dialect(Path(name))
    if name not in DIALECTS:
        near = difflib.get_close_matches(name, DIALECTS, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]!r}? " if near else ""
        known = ", ".join(DIALECTS)
        raise SettingError(f"unknown control {name!r}; {hint}known: {known} (or the path of a .toml file)")
    return DIALECTS[name]


def read_dialect(path: Path) -> Dialect:
    """Read a control's table; keys that it lacks come from the table named by ``based_on``.

    Raises
    ------
    SettingError
        With file and line: not TOML, an unknown key (with the nearest known one), an invalid value, a
        template with an unknown placeholder, tables that are based on each other.
    """
    text, data = _merged(path, ())
    return validate_settings({"name": path.stem, **data}, text, path, Dialect, SettingError)


def _merged(path: Path, above: tuple[Path, ...]) -> tuple[str, dict[str, Any]]:
    text, data = read_document(path, SettingError)
    base = data.pop("based_on", None)
    if base is None:
        return text, data
    below = _base_of(path, base)
    if below in (*above, path):
        raise SettingError(f"based_on = {base!r} leads back to this table; remove one of them", file=path)
    _, whole = _merged(below, (*above, path))
    whole.pop("name", None)
    return text, _overlay(whole, data)


def _base_of(path: Path, base: object) -> Path:
    """Find the file that a table is based on: in the package by its name, or relative to the table."""
    if not isinstance(base, str):
        raise SettingError(f"based_on = {base!r} must be text in quotes", file=path)
    if base.lower().endswith(".toml"):
        return path.parent / base
    if not (FOLDER / f"{base}.toml").is_file():
        known = ", ".join(sorted(p.stem for p in FOLDER.glob("*.toml")))
        raise SettingError(f"based_on = {base!r} isn't a known control; known: {known}", file=path)
    return FOLDER / f"{base}.toml"


def _overlay(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Override the values of one document by another's, table by table."""
    merged = dict(below)
    for key, value in above.items():
        are_tables = isinstance(below.get(key), dict) and isinstance(value, dict)
        merged[key] = _overlay(below[key], value) if are_tables else value
    return merged


DIALECTS: dict[str, Dialect] = {
    path.stem: read_dialect(path) for path in sorted(FOLDER.glob("*.toml"), key=lambda p: p.stem)
}
