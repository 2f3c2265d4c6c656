"""What was assumed while an APT file was read."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.apt.feedrate import Feeds
from fiveaxis.nc.rows import DEFAULT_FEED
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units
from fiveaxis.toolpath import MoveKind


def note(code: str, text: str, line: int | None, source: Source) -> Finding:
    """Make a finding that needs no action."""
    return Finding(Severity.NOTE, code, text, Place(line=line, file=source.name))


def assumed_unit(units: Units) -> list[Finding]:
    """Remark on lengths whose unit nobody stated."""
    if units.stated is not None or units.asked is not None:
        return []
    return [note("unit-assumed", "the file states no UNITS; its lengths are read as mm", None, units.source)]


def assumed_feeds(feeds: Feeds, values: Array, kinds: IntArray, lines: IntArray) -> list[Finding]:
    """Remark on cuts before the first feed.

    Parameters
    ----------
    values : (n,), mm/min, NaN where no feed was in force
    kinds, lines : (n,), of the locations
    """
    unknown = np.flatnonzero(np.isnan(values) & (kinds == MoveKind.CUT))
    if not len(unknown) or feeds.asked is not None:
        return []
    taken = feeds.first or DEFAULT_FEED
    text = f"{len(unknown)} cuts have no FEDRAT before them; {taken:g} mm/min is taken"
    return [note("feed-assumed", text, int(lines[unknown[0]]), feeds.source)]


def assumed_axis(count: int, line: int, source: Source) -> list[Finding]:
    """Remark on locations before the first tool vector of a file that has some."""
    if count == 0:
        return []
    text = f"{count} locations come before the first tool vector; 0, 0, 1 is taken"
    return [note("axis-assumed", text, line, source)]


def doubtful_arcs(along: int, against: int, source: Source) -> list[Finding]:
    """Warn of arcs that most moves lead into against their direction.

    Parameters
    ----------
    along, against : numbers of arcs that the move before leads into, and that it leads into backwards
    """
    if against <= along:
        return []
    text = (
        f"of the moves that lead into an arc {against} go against its direction, and {along} with it: the "
        "file may mean its arcs the other way round; let the CAM system write GOTO points"
    )
    place = Place(file=source.name)
    return [Finding(Severity.WARNING, "arc-direction", text, place, float(against))]
