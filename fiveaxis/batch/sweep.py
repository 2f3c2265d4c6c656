"""Sweeps: a table of lists in a job file makes many jobs of it, with stable names."""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fiveaxis.errors import JobError
from fiveaxis.job import SWEEP
from fiveaxis.job.description import COMBINATIONS, COMBINE, LARGEST_SWEEP
from fiveaxis.settings import line_of

# Most characters of a value and of a name; longer ones are cut and end in a hash.
LONGEST_VALUE = 60
LONGEST_NAME = 180


@dataclass(frozen=True)
class Variant:
    """One job of a sweep.

    Parameters
    ----------
    name : of its folder, inside the sweep's
    values : that it sets, by key of a job: ``tilt``, ``setup.offset``
    """

    name: str
    values: Mapping[str, Any]

    def applied_to(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Apply the values to the content of a job file.

        As on the command line, a cone replaces a tilt, and a tilt a cone.

        Raises
        ------
        JobError
            A key inside something that isn't a table.
        """
        made = copy.deepcopy({key: value for key, value in data.items() if key != SWEEP})
        for one, other in (("cone", "tilt"), ("tilt", "cone")):
            if one in self.values and other not in self.values:
                made.pop(other, None)
        for key, value in self.values.items():
            *tables, last = key.split(".")
            inner = made
            for table in tables:
                inner = inner.setdefault(table, {})
                if not isinstance(inner, dict):
                    raise JobError(f"{SWEEP}.{key}: {table} is {inner!r} in the job, not a table with keys")
            inner[last] = copy.deepcopy(value)
        return made


def read_sweep(data: Mapping[str, Any], text: str, path: Path) -> list[Variant]:
    """List the jobs of a job file's ``[sweep]`` in the order of its lists, the last key varying fastest.

    Parameters
    ----------
    data, text : the file's content, and its text
    path : the file

    Returns
    -------
    Empty where the file has no sweep.

    Raises
    ------
    JobError
        No list of values, several lists without `combine`, lists of unequal length to be zipped, too many
        jobs, two jobs of one name; with its line.
    """
    if SWEEP not in data:
        return []
    try:
        return _expand(data[SWEEP])
    except _Fault as fault:
        line = line_of(text, fault.keys) or line_of(text, [SWEEP])
        raise JobError(str(fault), file=path, line=line) from None


class _Fault(Exception):
    """A fault of a sweep, with its key."""

    def __init__(self, message: str, *keys: str) -> None:
        self.keys = [SWEEP, *keys]
        super().__init__(message)


def _expand(table: Any) -> list[Variant]:
    if not isinstance(table, dict):
        raise _Fault(f"{SWEEP} = {table!r} must be a table: keys of a job, each with a list of values")
    lists = dict(_lists({key: value for key, value in table.items() if key != COMBINE}))
    if not lists:
        raise _Fault(f"{SWEEP} varies nothing; give keys of a job, each with a list of values")
    variants = [Variant(_name(values), values) for values in _combine(lists, table.get(COMBINE))]
    seen: set[str] = set()
    for variant in variants:
        if variant.name.casefold() in seen:
            raise _Fault(f"{SWEEP} makes two jobs of the name {variant.name!r}; remove a value")
        seen.add(variant.name.casefold())
    return variants


def _lists(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Yield the lists of a sweep by dotted key; ``setup.offset = …`` is a table inside it."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _lists(value, f"{above}{key}.")
            continue
        if not isinstance(value, list) or not value:
            raise _Fault(
                f"{SWEEP}.{above}{key} = {value!r} must be a list of values, one per job (the key that "
                f"combines several lists is {COMBINE!r})",
                *f"{above}{key}".split("."),
            )
        yield f"{above}{key}", value


def _combine(lists: Mapping[str, list[Any]], combination: Any) -> Iterator[dict[str, Any]]:
    """Combine the values of several lists into those of each variant."""
    if (combination is not None or len(lists) > 1) and combination not in COMBINATIONS:
        found = "doesn't say" if combination is None else f"has {COMBINE} = {combination!r} for"
        known = f'{COMBINE} = "product" (every value with every other) or "zip" (first with first)'
        raise _Fault(f"{SWEEP} {found} how {', '.join(lists)} are combined; give {known}", COMBINE)
    lengths = {key: len(values) for key, values in lists.items()}
    counts = ", ".join(f"{key} {n}" for key, n in lengths.items())
    zipped = combination == "zip"
    if zipped and len(set(lengths.values())) > 1:
        raise _Fault(f"{SWEEP} zips lists of unequal length ({counts}); give as many values in each", COMBINE)
    count = min(lengths.values()) if zipped else math.prod(lengths.values())
    if count > LARGEST_SWEEP:
        raise _Fault(f"{SWEEP} makes {count} jobs ({counts}), more than {LARGEST_SWEEP}; remove values")
    rows = zip(*lists.values(), strict=True) if zipped else itertools.product(*lists.values())
    return (dict(zip(lists, row, strict=True)) for row in rows)


def _name(values: Mapping[str, Any]) -> str:
    """Name a variant by its values, so that its name stays when other values are added to the lists."""
    return _shorten(
        "_".join(f"{key}={_in_name(value)}" for key, value in values.items()), values, LONGEST_NAME
    )


def _in_name(value: Any) -> str:
    """Format a value so that it can be part of a folder's name on every system."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, int | float):
        text = f"{value:.12g}"
    elif isinstance(value, list):
        text = ",".join(map(_in_name, value))
    elif isinstance(value, dict):
        text = ",".join(f"{key}{_in_name(inner)}" for key, inner in value.items())
    else:
        text = str(value)
    return _shorten(re.sub(r"[^\w.,+-]+", "-", text), value, LONGEST_VALUE)


def _shorten(text: str, value: Any, longest: int) -> str:
    if len(text) <= longest:
        return text
    whole = json.dumps(value, sort_keys=True, default=str).encode()
    return f"{text[: longest - 9]}-{hashlib.sha256(whole).hexdigest()[:8]}"
