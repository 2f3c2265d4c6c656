"""What F per minute counts of each axis, and G4's P, by the table of the program's control and its words."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import Finding, Severity
from fiveaxis.model import Machine, MoveKind
from fiveaxis.nc.control.axis_track import Columns, travel_of
from fiveaxis.nc.languages.choice import ISO, control_of, find_language
from fiveaxis.nc.own_header import DEGREE, stated_control
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.table_parts import MixedFeed
from fiveaxis.nc.writing.tables import DIALECTS, Dialect, find_dialect

# Sinumerik: axes of the path feed, and the radius at which a rotary one counts. By default it counts 1 mm a
# degree, in inches too (6FC5398-1BP10-2BA0, 7.1 Feedrate, pp. 268-271).
_GROUP = re.compile(r"FGROUP\(([A-Z,]*)\)")
_RADIUS = re.compile(r"FGREF\[([A-Z])\]=(.+)")
# A radius of 360 mm / 2π to 4 figures is the default.
_DIGITS = 4
# Heidenhain (TNC 640, 34059x-02, 12.5): F CONT is the feed of the axes that are programmed.
_TCPM = re.compile(r"FUNCTION (RESET )?TCPM.*?( F CONT.*)?")
_BY_AXES = "F CONT makes it that of the axes, of which the manual says no more"
# TNC 640, 34059x-01, 11.4: the feed of the block is computed at its start, for turns of the table.
_AT_RADIUS = "M116 makes it mm/min for rotary axes, too, at the tool's distance from the axis"
_NO_CONTROL = (
    "neither the program's words nor the machine file (control) say which control it is for, and controls "
    "differ, so state it"
)
# Times closer than this share are the same.
_SAME = 0.01


@dataclass
class FeedMeaning:
    """What F counts, and what says so.

    Parameters
    ----------
    machine : whose axes they are
    table : of the control; the default one says nothing
    dwell : s that a whole number of G4's P counts
    unknown : why F isn't known in words that are in force; empty if it is
    group, radii : axes of FGROUP, None by default, and mm of FGREF by letter
    """

    machine: Machine
    table: MixedFeed
    dwell: float = 1.0
    unknown: str = ""
    group: str | None = None
    radii: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, source: Source, machine: Machine, dialect: Dialect | None) -> FeedMeaning:
        """Return what a control's table, or the program's header, says."""
        stated = DEGREE.number(source)
        name = control_of(source, find_language(source))
        table = MixedFeed(unknown=f"no table says it for control {name!r}" if name else _NO_CONTROL)
        table = table if dialect is None else dialect.mixed_feed
        table = table if stated is None else MixedFeed(degree=stated, source="the program's header")
        return cls(machine, table, 1.0 if dialect is None else dialect.dwell)

    def take(self, word: str, scale: float) -> bool:
        """Apply a word that sets what F counts; return whether it makes it unknown.

        The scale is mm of a length of 1.
        """
        if found := _GROUP.fullmatch(word):
            self.group = found[1].replace(",", "") or None
        elif found := _RADIUS.fullmatch(word):
            self.radii[found[1]] = float(found[2]) * scale
        elif found := _TCPM.fullmatch(word):
            self.unknown = _BY_AXES if found[2] else ""
            return bool(found[2])
        elif word in ("M116", "M117"):
            self.unknown = _AT_RADIUS if word == "M116" else ""
            return word == "M116"
        return False

    def counted(self, unit: str, *, of_tip: bool) -> tuple[float, ...]:
        """Return the mm that F counts of a mm or degree of each axis, (k,), NaN where nobody says it."""
        degree = math.nan if self.table.degree is None else self.table.degree * MILLIMETRES[unit]
        degree = math.nan if self.unknown else 0.0 if of_tip else degree
        if self.group is None:
            return tuple(degree if axis.is_rotary else 1.0 for axis in self.machine.axes)
        radians = {letter: round(math.radians(radius), _DIGITS) for letter, radius in self.radii.items()}
        each = ((a.letter, radians.get(a.letter, 1.0) if a.is_rotary else 1.0) for a in self.machine.axes)
        return tuple(mm if letter in self.group else 0.0 for letter, mm in each)

    def findings(self, columns: Columns, scale: float, unit: str, source: Source) -> list[Finding]:
        """Report moves of which nobody says what F counts, with their time by both readings.

        Columns and scale are as for `travel_of`.
        """
        nobody = np.isnan(columns.counted)
        if not nobody.any():
            return []
        travel = travel_of(columns, scale)
        rows = travel.unknown & (columns.kinds == MoveKind.CUT) & np.isnan(columns.times)
        alike = replace(columns, counted=np.where(nobody, MILLIMETRES[unit], columns.counted))
        alone, together = (float(t.time[rows].sum()) for t in (travel, travel_of(alike, scale)))
        if not together > alone * (1.0 + _SAME):
            return []
        message = (
            f"F of {int(rows.sum())} moves that turn axes along their way, the first here: "
            f"{self.unknown or self.table.unknown}; they take {alone:.4g} s where F is along X, Y and Z "
            f"alone (LinuxCNC), as it is taken here, and {together:.4g} s where a degree counts as a {unit} "
            "(Fanuc); post with G93 or TCP"
        )
        line = int(columns.lines[np.argmax(rows)])
        return [source.finding(Severity.WARNING, "feed-meaning", message, line)]


def program_dialect(source: Source, machine: Machine) -> Dialect | None:
    """Return the table of a program's control; None where nothing tells it, or its table isn't at hand.

    That is the control that the header names; or of G-code the machine's, if its file states one; or else the
    one that the words tell.
    """
    language, stated = find_language(source), stated_control(source)[0]
    if stated not in DIALECTS and language == ISO and machine.control:
        return find_dialect(machine.control)
    return DIALECTS.get(control_of(source, language))


def dialect_of(source: Source, machine: Machine) -> Dialect | None:
    """Return `program_dialect`, or else what all tables with the file's suffix have in common, or None."""
    known = [d for d in DIALECTS.values() if source.name.lower().endswith(d.suffix)]
    same = {(d.mixed_feed.degree, d.dwell, d.reading) for d in known}
    return program_dialect(source, machine) or (known[0] if len(same) == 1 else None)
