"""Block delete: what a program does otherwise with its switch in the other position."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, Severity, ToolpathError
from fiveaxis.model import MoveKind
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.technology import Technology, TechnologyTrack
from fiveaxis.nc.options import ReadOptions

_SKIPPED = re.compile(r"\s*(?:N?\s*[0-9]+\s*)?/")
# What differs without harm to the cuts.
_HARMLESS = ("other moves begin or end elsewhere", "cuts have another feed", "cuts have another coolant")
# mm and deg: ends nearer than this are the same.
_SAME = 1e-9
# Lines, or stretches of them, that a message lists.
_LISTED = 6


def note_skipped(
    found: Interpreter, options: ReadOptions, read: Callable[[ReadOptions], Interpreter]
) -> None:
    """Report what a program with ``/`` does otherwise with block delete in the other position.

    An error where a cut of both positions begins or ends elsewhere, or has another spindle, tool, zero,
    length or TCP; where a rapid move goes elsewhere from a cut; and where the program can't be read. The
    options are those by which it was found; `read` reads the program by others.
    """
    source = found.source
    lines = [n for n, text in enumerate(source.lines, start=1) if "/" in text and _SKIPPED.match(text)]
    if not lines or not found.track.rows:
        return
    here, severity = found.track.columns(), Severity.ERROR
    position, how = ("off", "added") if options.block_delete else ("on", "left out")
    places = dict(zip(lines, lines, strict=True))
    try:
        other = read(replace(options, block_delete=not options.block_delete))
    except ToolpathError as fault:
        said = [f"it stops{'' if fault.line is None else f' in line {fault.line}'}: {fault.message}"]
    else:
        there = other.track.columns() if other.track.rows else here.at(slice(0, 0))
        a, b = _common(here, there)
        track = found.modes.technology.track(here.steps[a])
        differ = _differences(here, there, a, b, (track, other.modes.technology.track(there.steps[b])))
        only = np.append(np.delete(here.kinds, a), np.delete(there.kinds, b))
        cuts = int((only == MoveKind.CUT).sum())
        said = [f"{len(only)} moves, {cuts} of them at feed, are {how}"] if len(only) else []
        said += [f"{int(rows.sum())} {what}" for what, rows in differ.items() if rows.any()]
        moves = [{move.line for move in each.modes.technology.machine_moves} for each in (found, other)]
        if aside := len(moves[0] ^ moves[1]):
            said.append(f"{aside} moves in machine coordinates are {how}")
        said += _beside(found, other)
        if not any(rows.any() for what, rows in differ.items() if what not in _HARMLESS):
            severity = Severity.WARNING
        # The first of what differs under each tool, zero and so on is one of an operation of its own.
        rows = np.flatnonzero(np.any(list(differ.values()), axis=0))
        firsts = a[rows[np.unique(track.state[rows], return_index=True)[1]]]
        places |= dict(zip(here.steps[firsts].tolist(), here.lines[firsts].tolist(), strict=True))
    message = (
        f"lines that begin with / ({_listed(lines)}): with block delete {position}, {', '.join(said)}; write "
        "them without / or leave them out, or set the switch as it is read (--block-delete) and keep it so"
    )
    for step, line in places.items() if said else ():
        found.found_at[len(found.findings)] = step
        found.findings.append(source.finding(severity, "skipped-blocks", message, line))


def _differences(
    here: Columns, there: Columns, a: IntArray, b: IntArray, tracks: tuple[TechnologyTrack, TechnologyTrack]
) -> dict[str, BoolArray]:
    """Mark rows that both positions have, (c,), by what differs in them."""
    before, then = np.maximum(a - 1, 0), np.maximum(b - 1, 0)
    ends = ~_same(here.values[a], there.values[b])
    elsewhere = ends | ~_same(here.values[before], there.values[then])
    cuts = (here.kinds[a] == MoveKind.CUT) & here.moved[a]
    from_cut = _traverses(there, b, then) != _traverses(here, a, before)
    paces = (np.column_stack([c.feeds, c.times])[rows] for c, rows in ((here, a), (there, b)))
    pairs, row = np.unique(np.stack([track.state for track in tracks]), axis=1, return_inverse=True)
    states = [(_of_cuts(tracks[0].states[i]), _of_cuts(tracks[1].states[j])) for i, j in pairs.T.tolist()]
    return {
        "cuts begin or end elsewhere": cuts & elsewhere,
        "rapid moves go elsewhere, from a cut": ~cuts & ends & from_cut,
        "cuts have TCP or the tool's length in another state": cuts & (here.counting[a] != there.counting[b]),
        "other moves begin or end elsewhere": ~cuts & elsewhere,
        "cuts have another feed": cuts & ~_same(*paces),
        **{
            f"cuts have another {name}": cuts
            & np.array([x[name] != y[name] for x, y in states], dtype=bool)[row.ravel()]
            for name in _of_cuts(Technology())
        },
    }


def _beside(found: Interpreter, other: Interpreter) -> list[str]:
    """Say what no move shows: modes that only one position switches off, and what is found in the other."""
    here, there = found.modes.technology, other.modes.technology
    modes = (here.cancelled.keys() ^ there.cancelled.keys()) | (here.ended.keys() ^ there.ended.keys())
    codes = {f.code for f in other.findings if f.severity is not Severity.NOTE}
    codes -= {f.code for f in found.findings}
    said = [f"{', '.join(sorted(modes))} stays as it was before"] if modes else []
    return said + [f"it has {', '.join(sorted(codes))}"] * bool(codes)


def _of_cuts(now: Technology) -> dict[str, object]:
    """Return what cuts rely on, by name."""
    return {
        "spindle": (now.sense, now.speed),
        "tool": (now.tool, now.loaded > 0),
        "work offset": now.work_offset,
        "length offset": now.length,
        "coolant": now.coolant,
    }


def _traverses(columns: Columns, rows: IntArray, before: IntArray) -> BoolArray:
    """Mark moves that begin where a cut ended, and aren't along Z alone."""
    step = np.delete(columns.values[rows] - columns.values[before], columns.machine.column("Z"), axis=1)
    return (columns.kinds[before] == MoveKind.CUT) & (np.abs(np.nan_to_num(step)) > _SAME).any(axis=1)


def _same(one: Array, other: Array) -> BoolArray:
    """Mark equal rows of (n, m); NaN equals NaN."""
    return np.asarray(np.isclose(one, other, rtol=0.0, atol=_SAME, equal_nan=True).all(axis=1))


def _common(one: Columns, other: Columns) -> tuple[IntArray, IntArray]:
    """Return the rows of each that the other has too: of the same line, the same time that it runs."""

    def keys(lines: IntArray) -> IntArray:
        order = np.argsort(lines, kind="stable")
        key = np.empty(len(lines), dtype=np.int64)
        time = np.arange(len(lines)) - np.searchsorted(lines[order], lines[order])
        key[order] = lines[order] * 2**32 + time
        return key

    found = np.intersect1d(keys(one.lines), keys(other.lines), assume_unique=True, return_indices=True)
    return found[1], found[2]


def _listed(lines: list[int]) -> str:
    """Return lines as ``4, 7-9``."""
    starts = [n for n in lines if n - 1 not in set(lines)]
    ends = [n for n in lines if n + 1 not in set(lines)]
    parts = [f"{n}" if n == end else f"{n}-{end}" for n, end in zip(starts, ends, strict=True)]
    return ", ".join(parts[:_LISTED]) + (f" and {len(parts) - _LISTED} more" if len(parts) > _LISTED else "")
