"""The ways that a tool can take between two rows, and gouges in links on each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.findings import Severity
from fiveaxis.geometry import IntArray
from fiveaxis.toolpath import MoveKind
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.report import Result
from fiveaxis.verification.subject import Subject

if TYPE_CHECKING:
    import trimesh

# All axes linear in time, or the tool led straight by the control.
Between = Literal["axes", "led"]
# rad: a link in which no rotary axis turns by more takes one way, whoever leads it.
NO_TURN = 1e-9


@dataclass(frozen=True)
class Ways:
    """On which ways between locations a motion is checked.

    Parameters
    ----------
    gouges : of the cutter, in all moves
    collisions : of all bodies, in all moves
    links : whether gouges in links and rapid moves are looked for on the other way, too
    deviation : whether to tell that the tool's centre leaves its chords where all axes are linear in time:
        not where a program inserts blocks between the locations, and in any case where ``gouges`` says
        ``axes``
    """

    gouges: Between
    collisions: Between
    links: bool = False
    deviation: bool = False

    @classmethod
    def asked(cls, between: Between | Ways | None) -> Ways:
        """Give what is asked for: one way, or, where none is named, what holds for most of both.

        Raises
        ------
        SettingError
            An unknown way.
        """
        if between is None:
            return cls("led", "axes", links=True, deviation=True)
        if isinstance(between, Ways):
            return between
        if between not in ("axes", "led"):
            raise SettingError(f"between {between!r}: write axes, led, or leave it out")
        return cls(between, between, deviation=True)

    @property
    def of_deviation(self) -> Severity | None:
        """How bad it is that the tool's centre leaves a chord: an error in what blocks of axis words say."""
        if self.gouges == "axes":
            return Severity.ERROR
        return Severity.NOTE if self.deviation else None


def check_gouges(subject: Subject, mesh: trimesh.Trimesh | None, ways: Ways) -> Result:
    """Check for gouges as `check_gouge` does, links on both ways where it is asked for.

    Raises
    ------
    MeshError
        As `check_gouge`.
    """
    centre = subject.toolpath.zone.height
    led, other_led = (centre, None) if ways.gouges == "led" else (None, centre)
    found = check_gouge(subject, mesh, led=led)
    rows = _turning_links(subject)
    if mesh is None or not ways.links or not len(rows):
        return found
    other = check_gouge(_apart(subject, rows), mesh, led=other_led)
    # Each link is three rows: where it begins, where it ends, and a gap.
    ends = np.flatnonzero(other.rows % 3 == 1)
    where = rows[other.rows[ends] // 3]
    new = ~np.isin(where, found.rows)
    ends, where = ends[new], where[new]
    how = "all axes linear in time" if other_led is None else "the tool led straight"
    count = len(found.rows)

    def message(i: int) -> str:
        return found.message(i) if i < count else f"with {how}, {other.message(int(ends[i - count]))}"

    return replace(
        found,
        rows=np.concatenate([found.rows, where]),
        values=np.concatenate([found.values, other.values[ends]]),
        message=message,
        figures=_deepest(found, other),
        checked=(*found.checked, f"links and rapid moves with {how}, too"),
    )


def _turning_links(subject: Subject) -> IntArray:
    """Find the rows, (m,), of links and rapid moves in which a rotary axis turns."""
    turns = np.nan_to_num(subject.steps[:, subject.machine.rotary_columns].max(axis=1, initial=0.0))
    return np.flatnonzero((subject.toolpath.kind != MoveKind.CUT) & (turns > NO_TURN))


def _apart(subject: Subject, rows: IntArray) -> Subject:
    """Take the moves to some rows apart from each other, an unknown place after each."""
    taken = np.column_stack([rows - 1, rows, rows]).reshape(-1)
    gap = np.where(np.arange(len(taken)) % 3 == 2, np.nan, 0.0)[:, None]
    inserted = subject.asked.inserted
    return replace(
        subject,
        positions=subject.positions[taken] + gap,
        tip=subject.tip[taken] + gap,
        axis=subject.axis[taken] + gap,
        toolpath=subject.toolpath.at(taken),
        asked=replace(subject.asked, inserted=None if inserted is None else inserted[taken]),
    )


def _deepest(found: Result, other: Result) -> dict[str, float | None]:
    depths = [r.figures["gouge_depth_mm"] for r in (found, other)]
    known = [depth for depth in depths if depth is not None]
    return {"gouge_depth_mm": max(known, default=None)}
