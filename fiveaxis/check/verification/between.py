"""The interpolation under which moves are checked, and gouges in links under both."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import IntArray, SettingError, Severity
from fiveaxis.cam import Mesh
from fiveaxis.check.verification.check_context import WORDING, CheckContext
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.gouging import check_gouge
from fiveaxis.check.verification.report import Result
from fiveaxis.model import Interpolation, MoveKind

# rad: a link in which no rotary axis turns by more is the same move under either interpolation.
NO_TURN = 1e-9
# mm above the tip, of the point that a control moves straight under TCP.
TIP = 0.0


@dataclass(frozen=True)
class CheckedInterpolation:
    """The interpolation that each check assumes between locations.

    Parameters
    ----------
    gouges : of the cutter, in all moves
    collisions : of all bodies, in all moves
    links : whether links and rapid moves are checked for gouges under the other interpolation, too
    deviation : whether to report that the tool's centre leaves its chords under joint interpolation; not if a
        program inserts blocks between the locations, and always if ``gouges`` is ``joint``
    height : mm above the tip, of the point that moves straight under TCP; None for the tool's centre in the
        check for gouges, and for the tip in that for collisions
    """

    gouges: Interpolation
    collisions: Interpolation
    links: bool = False
    deviation: bool = False
    height: float | None = None

    @classmethod
    def of(cls, between: Interpolation | str | CheckedInterpolation | None) -> CheckedInterpolation:
        """Use one interpolation for all checks or, by default, each check's usual one.

        Raises
        ------
        SettingError
            An unknown interpolation.
        """
        if between is None:
            return cls(Interpolation.TCP, Interpolation.JOINT, links=True, deviation=True)
        if isinstance(between, CheckedInterpolation):
            return between
        try:
            every = Interpolation(between)
        except ValueError:
            raise SettingError(f"between is {between!r}; write joint or tcp, or leave it out") from None
        return cls(every, every, deviation=True)

    @classmethod
    def of_height(cls, height: float | None) -> CheckedInterpolation:
        """Let one point of the tool move straight in all checks or, if it is None, all axes linearly."""
        return JOINT_ONLY if height is None else cls(Interpolation.TCP, Interpolation.TCP, height=height)

    @property
    def of_collisions(self) -> float | None:
        """Height of the point that moves straight in the check for collisions, mm; None with linear axes."""
        if self.collisions is Interpolation.JOINT:
            return None
        return TIP if self.height is None else self.height

    @property
    def of_deviation(self) -> Severity | None:
        """Severity of leaving a chord with the tool's centre: an error under joint interpolation."""
        if self.gouges is Interpolation.JOINT:
            return Severity.ERROR
        return Severity.NOTE if self.deviation else None


# For rows so close that a straight tip and linear axes are the same move between them.
JOINT_ONLY = CheckedInterpolation(Interpolation.JOINT, Interpolation.JOINT)


def check_gouges(context: CheckContext, mesh: Mesh | None, interpolation: CheckedInterpolation) -> Result:
    """Run `check_gouge`, for links under both interpolations if `CheckedInterpolation.links` is set."""
    centre = context.toolpath.zone.height if interpolation.height is None else interpolation.height
    straight = interpolation.gouges is Interpolation.TCP
    height, other_height = (centre, None) if straight else (None, centre)
    found = check_gouge(context, mesh, tcp_height=height)
    rows = _turning_links(context)
    if mesh is None or not interpolation.links or not len(rows):
        return found
    other = check_gouge(_separate(context, rows), mesh, tcp_height=other_height)
    # Each link is three rows: its begin, its end, and a gap.
    ends = np.flatnonzero(other.rows % 3 == 1)
    where = rows[other.rows[ends] // 3]
    new = ~np.isin(where, found.rows)
    ends, where = ends[new], where[new]
    how = WORDING[Interpolation.JOINT if straight else Interpolation.TCP]
    count = len(found.rows)
    depths = np.array([r.figures["gouge_depth_mm"] for r in (found, other)], dtype=float)

    def message(i: int) -> str:
        return found.text(i) if i < count else f"with {how}, {other.text(int(ends[i - count]))}"

    return replace(
        found,
        rows=np.concatenate([found.rows, where]),
        values=np.concatenate([found.ranks, other.ranks[ends]]),
        message=message,
        figures={"gouge_depth_mm": largest(depths)},
        checked=(*found.checked, f"links and rapid moves with {how}, too"),
    )


def _turning_links(context: CheckContext) -> IntArray:
    """Find the rows, (m,), of links and rapid moves in which a rotary axis turns."""
    turns = np.nan_to_num(context.steps[:, context.machine.rotary_columns].max(axis=1, initial=0.0))
    return np.flatnonzero((context.toolpath.kind != MoveKind.CUT) & (turns > NO_TURN))


def _separate(context: CheckContext, rows: IntArray) -> CheckContext:
    """Select the moves to some rows, with an unknown pose after each to separate them."""
    taken = np.column_stack([rows - 1, rows, rows]).reshape(-1)
    gap = np.where(np.arange(len(taken)) % 3 == 2, np.nan, 0.0)[:, None]
    inserted = context.constraints.inserted
    return replace(
        context,
        positions=context.positions[taken] + gap,
        tip=context.tip[taken] + gap,
        axis=context.axis[taken] + gap,
        toolpath=context.toolpath.at(taken),
        constraints=replace(context.constraints, inserted=None if inserted is None else inserted[taken]),
    )
