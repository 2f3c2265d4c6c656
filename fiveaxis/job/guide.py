"""Explain job files from their model: every field with its meaning, and a commented starter file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from fiveaxis.base import Entry, list_entries, require_new, require_suffix, to_toml, write_atomically
from fiveaxis.job.description import COMBINATIONS, COMBINE, LARGEST_SWEEP, SWEEP, Job

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


def list_job_entries() -> list[Entry]:
    """List the fields of a job file, and of the table that makes many jobs of one file."""
    return [
        *list_entries(Job),
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
    """Write a new starter job file with every field, the optional ones as comments."""
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
    for entry in list_job_entries():
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
