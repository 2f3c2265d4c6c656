"""Masks: which postures are admissible at a location, beyond the bounds, at the cost of a collision query.

A search asks for the postures that it is about to keep, location by location. At an inserted location both
neighbours have to admit a posture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, SettingError
from fiveaxis.model import TURN, Machine, into_limits

# Which postures, (m, 2) rad, chain order, are admissible at locations, (m,), which come in any order and
# repeated; (m,). Every answer has to depend on its arguments alone, never on earlier calls. A rotary axis of
# unlimited travel may be on any turn.
MaskFunction = Callable[[IntArray, Array], BoolArray]
# rad: postures this near to one that was refused are refused, too; doubled each time a location comes up.
RADIUS = np.radians(4.0)


@dataclass(frozen=True)
class Wording:
    """How it is said what a mask does.

    Parameters
    ----------
    admitted : of postures that it admits
    some, none : it admits some of a location's postures, or refuses each
    refused : it refuses the posture
    remedy : what to do about it
    """

    admitted: str = "that the mask admits"
    some: str = "the mask admits postures here"
    none: str = "the mask refuses each of the admissible postures that were tried"
    refused: str = "the mask refuses the posture"
    remedy: str = "change what the mask stands for"


@dataclass(frozen=True, eq=False)
class Mask:
    """Which postures are admissible, exactly, and quickly but roughly.

    Parameters
    ----------
    exact : decides at every location of the path; None admits everything
    rough : steers searches over all postures, some 10⁵ of them; None where `exact` is quick enough. Wrong
        answers make a path dearer, never wrong: err on the strict side
    wording : how it is said what the mask does
    """

    exact: MaskFunction | None = None
    rough: MaskFunction | None = None
    wording: Wording = Wording()

    @classmethod
    def of(cls, function: Mask | Callable[..., Any] | None) -> Mask | None:
        """Make a mask of a function, whose attribute `rough`, if it has one, is the quick one."""
        if function is None or isinstance(function, Mask):
            return function
        return cls(function, getattr(function, "rough", None))

    def admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Query postures, (m, 2) rad, of locations, (m,).

        `SettingError` if the answer isn't one truth value for each posture.
        """
        return _query(self.exact, rows, rotary)

    def roughly_admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Query roughly as `admits` does; exactly where there is no rough answer."""
        return _query(self.rough or self.exact, rows, rotary)

    def along(self, location: Array | None) -> Mask:
        """Return the mask of a path with inserted locations, where both neighbours have to admit a posture.

        `location` is (n,), their fractional indices among the mask's locations; None for these themselves.
        """
        if location is None:
            return self
        before, after = np.floor(location).astype(np.int64), np.ceil(location).astype(np.int64)

        def between(function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
            free = np.array(_query(function, before[rows], rotary))
            at = np.flatnonzero(free & (after[rows] != before[rows]))
            free[at] = _query(function, after[rows[at]], rotary[at])
            return free

        return self._each(between)

    def halfway(self, location: Array) -> Mask:
        """Return the mask of locations, (n,), as rows 2 i, and of those halfway to them, 2 i − 1."""
        last = len(location) - 1
        return self.along(np.interp(np.linspace(0.0, last, 2 * last + 1), np.arange(last + 1), location))

    def wrapped(self, machine: Machine) -> Mask:
        """Return the mask of unwrapped paths.

        A whole turn leaves the tool where it is, but a mask may count angles as the machine does.
        """
        return self._each(lambda function, rows, rotary: function(rows, into_limits(machine, rotary)))

    def refusing(self, spots: Spots) -> Mask:
        """Return the mask that refuses spots, too; they may grow in number afterwards."""
        return Mask(spots.avoided).within(self)

    def within(self, own: Mask) -> Mask:
        """Return the mask that admits what both admit, with the other's wording; this one is asked first."""

        def both(
            first: MaskFunction | None, second: MaskFunction | None, rows: IntArray, rotary: Array
        ) -> BoolArray:
            free = np.array(_query(first, rows, rotary))
            at = np.flatnonzero(free)
            free[at] = _query(second, rows[at], rotary[at])
            return free

        rough = None
        if self.rough is not None or own.rough is not None:
            rough = partial(both, self.rough or self.exact, own.rough or own.exact)
        return replace(own, exact=partial(both, self.exact, own.exact), rough=rough)

    def _each(self, of: Callable[[MaskFunction, IntArray, Array], BoolArray]) -> Mask:
        """Change how both functions are asked."""

        def changed(function: MaskFunction | None) -> MaskFunction | None:
            return None if function is None else lambda rows, rotary: of(function, rows, rotary)

        return replace(self, exact=changed(self.exact), rough=changed(self.rough))


class Spots:
    """Postures that were refused by location, (2,) rad, each with the radius about it that is refused, rad.

    A map of tool directions covers neither bodies that depend on the axis values, such as a trunnion, nor the
    moves between locations. Verification finds those collisions, and they are refused here.
    """

    def __init__(self) -> None:
        self._known: dict[int, list[tuple[Array, float]]] = {}

    def add(self, rows: IntArray, rotary: Array) -> None:
        """Refuse postures, (m, 2) rad, at locations, (m,), and those near them.

        What is refused at one call has the same radius, however many postures of a location it has.
        """
        last = {row: known[-1][1] for row, known in self._known.items()}
        for row, posture in zip(rows.tolist(), rotary, strict=True):
            radius = 2.0 * last[row] if row in last else RADIUS
            self._known.setdefault(row, []).append((np.array(posture, dtype=float), radius))

    def avoided(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Find which postures, (m, 2) rad, of locations, (m,), are none of them; (m,)."""
        free = np.ones(len(rows), dtype=bool)
        # The first spot of each location, then the second ones, and so on: a search asks for thousands of
        # postures, and few locations have many spots.
        for number in range(max((len(known) for known in self._known.values()), default=0)):
            spots = {row: known[number] for row, known in self._known.items() if len(known) > number}
            known_rows = np.sort(np.fromiter(spots, dtype=np.int64, count=len(spots)))
            at = np.flatnonzero(np.isin(rows, known_rows))
            which = np.searchsorted(known_rows, rows[at])
            postures = np.array([spots[row][0] for row in known_rows.tolist()])
            radii = np.array([spots[row][1] for row in known_rows.tolist()])
            off = np.abs(np.mod(rotary[at] - postures[which] + TURN / 2.0, TURN) - TURN / 2.0)
            free[at] &= off.max(axis=1, initial=0.0) > radii[which]
        return free


def _query(function: MaskFunction | None, rows: IntArray, rotary: Array) -> BoolArray:
    if function is None or not len(rows):
        return np.ones(len(rows), dtype=bool)
    answer = np.asarray(function(rows.astype(np.int64), rotary.copy()))
    if answer.shape != rows.shape or answer.dtype != np.bool_:
        raise SettingError(
            f"the mask returned shape {answer.shape} of {answer.dtype} for {len(rows)} postures; "
            f"({len(rows)},) of bool is needed, True where a posture is admissible"
        )
    return answer
