"""A user's mask on postures: whether one is admissible at a location, at the cost of a collision query.

A search asks for the postures that it is about to keep, location by location. At an inserted location both
neighbours have to admit a posture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray, IntArray

MaskFunction = Callable[[IntArray, Array], BoolArray]


@runtime_checkable
class RoughMask(Protocol):
    """A mask that can also answer quickly and approximately, to steer searches.

    A mask may be a plain function. If it also has a method `rough`, for example a lookup in a map of tool
    directions, searches over all postures call that instead, for some 10⁵ postures.

    Every answer must depend on its arguments alone, never on earlier calls. A rotary axis of unlimited travel
    may be on any turn.
    """

    def __call__(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        """Return exactly which postures are admissible; this decides at every location of the path.

        Parameters
        ----------
        rows : (m,), locations of the path, in any order and repeated
        rotary : (m, 2), rad, chain order

        Returns
        -------
        (m,), True where admissible
        """
        ...

    def rough(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        """Return approximately which postures are admissible; same arguments and result.

        Wrong answers make a path more costly, never wrong. Err on the strict side: a posture that is admitted
        here but refused exactly makes a path dearer.
        """
        ...


@dataclass(eq=False)
class Mask:
    """A mask, and what follows from it.

    Parameters
    ----------
    function : as `RoughMask.__call__`
    """

    function: MaskFunction

    @property
    def is_rough(self) -> bool:
        """Whether the mask has its own rough answers."""
        return isinstance(self.function, RoughMask)

    def admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Query postures, (m, 2) rad, of locations, (m,).

        Raises
        ------
        SettingError
            The answer isn't one truth value for each posture.
        """
        if not len(rows):
            return np.zeros(0, dtype=bool)
        return _query(self.function, rows, rotary)

    def along(self, location: Array | None) -> Mask:
        """Return the mask of a path with inserted locations, where both neighbours have to admit a posture.

        Parameters
        ----------
        location : (n,), fractional index of each among the mask's locations; None for these themselves
        """
        if location is None:
            return self
        ends = np.floor(location).astype(np.int64), np.ceil(location).astype(np.int64)
        function = self.function
        if isinstance(function, RoughMask):
            return Mask(_RoughlyBetween(function, *ends))
        return Mask(_Between(function, *ends))

    def roughly_admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Query the mask's own rough answers as `admits` does; the exact ones where it has none."""
        if not isinstance(self.function, RoughMask):
            return self.admits(rows, rotary)
        return _query(self.function.rough, rows, rotary) if len(rows) else np.zeros(0, dtype=bool)


@dataclass(frozen=True, eq=False)
class _Between:
    """A mask queried at both neighbours of inserted locations; a given one is its own neighbour."""

    function: MaskFunction
    before: IntArray
    after: IntArray

    def __call__(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self._at_both(self.function, rows, rotary)

    def _at_both(self, function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
        free = np.array(_query(function, self.before[rows], rotary))
        at = np.flatnonzero(free & (self.after[rows] != self.before[rows]))
        if len(at):
            free[at] = _query(function, self.after[rows[at]], rotary[at])
        return free


@dataclass(frozen=True, eq=False)
class _RoughlyBetween(_Between):
    """The same with the mask's own rough answers."""

    function: RoughMask

    def rough(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self._at_both(self.function.rough, rows, rotary)


def _query(function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
    answer = np.asarray(function(rows.astype(np.int64), rotary.copy()))
    if answer.shape != rows.shape or answer.dtype != np.bool_:
        raise SettingError(
            f"the mask returned shape {answer.shape} of {answer.dtype} for {len(rows)} postures; "
            f"({len(rows)},) of bool is needed, True where a posture is admissible"
        )
    return answer
