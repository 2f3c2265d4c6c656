"""Findings on assumptions made while an APT file is read."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.apt.feedrate import Feeds
from fiveaxis.nc.rows import DEFAULT_FEED
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import MoveKind


def note(code: str, text: str, line: int | None, source: Source) -> Finding:
    """Create a finding that needs no action."""
    return Finding(Severity.NOTE, code, text, Place(line=line, file=source.name))


def assumed_feeds(feeds: Feeds, values: Array, kinds: IntArray, lines: IntArray) -> list[Finding]:
    """Note cuts before the first feed.

    Parameters
    ----------
    values : (n,), mm/min, NaN where no feed is in force
    kinds, lines : (n,), of the locations
    """
    unknown = np.flatnonzero(np.isnan(values) & (kinds == MoveKind.CUT))
    if not len(unknown) or feeds.override is not None:
        return []
    used = feeds.first or DEFAULT_FEED
    text = f"{len(unknown)} cuts have no FEDRAT before them; {used:g} mm/min is used"
    return [note("feed-assumed", text, int(lines[unknown[0]]), feeds.source)]


def assumed_axis(count: int, line: int, source: Source) -> list[Finding]:
    """Note the `count` locations before the first tool vector."""
    if count == 0:
        return []
    text = f"{count} locations come before the first tool vector; 0, 0, 1 is used"
    return [note("axis-assumed", text, line, source)]


def doubtful_arcs(along: int, against: int, source: Source) -> list[Finding]:
    """Warn if more arcs begin against the move before them than along it.

    Parameters
    ----------
    along, against : numbers of arcs that begin in the direction of the move before them, and opposite to it
    """
    if against <= along:
        return []
    text = (
        f"{against} arcs begin against the direction of the move before them, {along} along it: the file may "
        "mean the opposite direction of arcs; let the CAM system write GOTO points"
    )
    place = Place(file=source.name)
    return [Finding(Severity.WARNING, "arc-direction", text, place, float(against))]
