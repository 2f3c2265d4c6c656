"""A user's mask on postures, queried as seldom as possible: only for postures that a search will use.

A mask decides whether a posture is admissible at a location, at the cost of a collision query. So a path is
first found without it (`enforcement`). Where the mask refuses a few of its locations, windows around them are
replanned (`replanning`): a lattice search finds another path, the mask is queried for the states of that path
and some around those that it refuses, and refused states are forbidden, until a path is clean or there is
none. Where it refuses many, the whole path is searched again among roughly admitted postures (`clearance`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol, cast, runtime_checkable

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.lattice import Lattice
from fiveaxis.posture.search.shortest import shortest_path

MaskFunction = Callable[[IntArray, Array], BoolArray]


@runtime_checkable
class RoughMask(Protocol):
    """A mask that can also answer quickly and approximately, to steer searches.

    A mask may be a plain function. If it also has a method `rough`, for example a lookup in a map of tool
    directions, global searches call that for every posture they consider: 10⁵ to 10⁷, in large batches, at
    locations far apart. For a mask without it such a map is sampled on a grid.

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
        here but refused exactly has to be replanned.
        """
        ...


# Most searches of a lattice, each with more states forbidden.
MOST_SEARCHES = 40


@dataclass(eq=False)
class Mask:
    """A mask with a count of its queries.

    Parameters
    ----------
    function : as `RoughMask.__call__`
    calls : of the function
    queried : postures in them
    """

    function: MaskFunction
    calls: int = 0
    queried: int = 0

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
        self.calls += 1
        self.queried += len(rows)
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
        """Query the mask's own rough answers, which it must have, as `admits` does."""
        if not len(rows):
            return np.zeros(0, dtype=bool)
        return _query(cast("RoughMask", self.function).rough, rows, rotary)


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


@dataclass(eq=False)
class CheckedStates:
    """A mask's answers for the states of a lattice.

    Parameters
    ----------
    mask : queried for states that weren't checked before
    rows : (n,), the path's locations of the lattice's rows
    problem : of the lattice
    refused, checked : by row of the lattice, (a, b, c)
    radius : by row, how many lattice steps around a refused state are checked next
    """

    mask: Mask
    rows: IntArray
    problem: Problem
    refused: dict[int, BoolArray] = field(default_factory=dict)
    checked: dict[int, BoolArray] = field(default_factory=dict)
    radius: dict[int, int] = field(default_factory=dict)

    def forbidding(self, lattice: Lattice) -> Lattice:
        """Return the lattice without the states that the mask refused."""

        def states(rows: IntArray) -> tuple[Array, Array]:
            positions, price = lattice.states(rows)
            price = price.copy()
            for number, row in enumerate(rows):
                if int(row) in self.refused:
                    price[number][self.refused[int(row)]] = np.inf
            return positions, price

        return replace(lattice, states=states)

    def check(self, lattice: Lattice, path: Array) -> bool:
        """Check a path through the lattice, (n, k), and states near refused ones; True if none is refused."""
        columns = self.problem.machine.rotary_columns
        unknown: list[tuple[int, tuple[int, int, int]]] = []
        for row in range(len(path)):
            at = _index(lattice, columns, row, path[row])
            if row not in self.checked or not self.checked[row][at]:
                unknown.append((row, at))
        index = np.array([row for row, _ in unknown], dtype=np.int64)
        clean = self.mask.admits(self.rows[index], path[index][:, columns])
        for (row, at), is_clean in zip(unknown, clean, strict=True):
            self._note(lattice, row, [at], np.array([is_clean]))
        refused = [state for state, is_clean in zip(unknown, clean, strict=True) if not is_clean]
        if refused:
            self._check_around(lattice, refused)
        return not refused

    def _check_around(self, lattice: Lattice, refused: list[tuple[int, tuple[int, int, int]]]) -> None:
        """Check the admissible states near refused ones, twice as far each time a row comes back."""
        columns = self.problem.machine.rotary_columns
        near_states: list[tuple[int, IntArray, Array]] = []
        for row, (i, j, _) in refused:
            positions, price = (part[0] for part in lattice.states(np.array([row])))
            radius = self.radius.get(row, 1)
            self.radius[row] = 2 * radius
            spin = np.arange(price.shape[0])
            away = np.abs(spin - i)
            away = np.minimum(away, len(spin) - away) if lattice.period else away
            beside = np.abs(np.arange(price.shape[1]) - j)
            near = (away <= radius)[:, None, None] & (beside <= radius)[:, None]
            states = np.argwhere(near & np.isfinite(price) & ~self.checked[row])
            near_states.append((row, states, positions[tuple(states.T)][:, columns]))
        rows = np.concatenate([np.full(len(states), row) for row, states, _ in near_states])
        answers = self.mask.admits(self.rows[rows], np.concatenate([rotary for *_, rotary in near_states]))
        begin = 0
        for row, states, _ in near_states:
            self._note(lattice, row, [tuple(s) for s in states], answers[begin : begin + len(states)])
            begin += len(states)

    def _note(self, lattice: Lattice, row: int, states: list[tuple[int, int, int]], clean: BoolArray) -> None:
        if row not in self.checked:
            shape = lattice.states(np.array([row]))[1].shape[1:]
            self.checked[row], self.refused[row] = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        for at, is_clean in zip(states, clean, strict=True):
            self.checked[row][at], self.refused[row][at] = True, not is_clean


def clean_path(
    lattice: Lattice, states: CheckedStates, searches: int = MOST_SEARCHES, *, or_last: bool = False
) -> Array | None:
    """Find the cheapest path through a lattice that the mask admits everywhere.

    Parameters
    ----------
    searches : most searches of the lattice
    or_last : whether to return the last path found if the mask admits none of them

    Returns
    -------
    (n, k), mm and rad; None where none was found
    """
    last = None
    for _ in range(searches):
        path = shortest_path(states.problem, states.forbidding(lattice))
        if path is None or states.check(lattice, path):
            return last if path is None else path
        last = path if or_last else None
    return last


def precomputed(lattice: Lattice, count: int) -> Lattice:
    """Return the lattice with the states of its rows, `count` of them, computed once."""
    chunks = np.array_split(np.arange(count), -(-count // lattice.chunk))
    positions, price = (np.concatenate(part) for part in zip(*map(lattice.states, chunks), strict=True))
    return replace(lattice, states=lambda rows: (positions[rows], price[rows]))


def pinned(lattice: Lattice, problem: Problem, ends: dict[int, Array]) -> Lattice:
    """Return the lattice with a single state in some rows.

    Parameters
    ----------
    ends : posture by row of the lattice, (2,) rad
    """

    def states(rows: IntArray) -> tuple[Array, Array]:
        positions, price = (part.copy() for part in lattice.states(rows))
        for number, row in enumerate(rows):
            if int(row) in ends:
                values = problem.positions(np.array([row]), ends[int(row)][None])[0]
                _pin(lattice, values, positions[number], price[number])
        return positions, price

    return replace(lattice, states=states)


def _pin(lattice: Lattice, values: Array, positions: Array, price: Array) -> None:
    """Keep one state of a row and set its axis values, (k,); its spin index is the nearest one."""
    spin = lattice.spin_column
    angles = positions[:, 0, 0, spin]
    if lattice.period:
        values[spin] = angles[0] + np.mod(values[spin] - angles[0], TURN)
    nearest = int(np.argmin(np.abs(angles - values[spin])))
    # Neighbours are counted in both coordinates, so the state replaces the one most like it.
    off = np.abs(positions[nearest] - values)
    off[..., spin] = 0.0
    at = np.where(np.isfinite(price[nearest]), off.max(axis=-1), np.inf)
    second, branch = np.unravel_index(int(np.argmin(at)), at.shape)
    price[:] = np.inf
    price[nearest, second, branch] = 0.0
    positions[nearest, :, :, spin] = values[spin]
    positions[nearest, second, branch] = values


def _index(lattice: Lattice, columns: list[int], row: int, position: Array) -> tuple[int, int, int]:
    """Find the state of a row that has given axis values, its spin angle on any turn."""
    positions, price = (part[0] for part in lattice.states(np.array([row])))
    off = np.abs(positions[..., columns] - position[columns])
    spin = columns.index(lattice.spin_column)
    if lattice.period:
        off[..., spin] = np.abs(np.mod(off[..., spin] + np.pi, TURN) - np.pi)
    distance = np.where(np.isfinite(price), off.max(axis=-1), np.inf)
    at = np.unravel_index(int(np.argmin(distance)), distance.shape)
    return int(at[0]), int(at[1]), int(at[2])


def _query(function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
    answer = np.asarray(function(rows.astype(np.int64), rotary.copy()))
    if answer.shape != rows.shape or answer.dtype != np.bool_:
        raise SettingError(
            f"the mask returned shape {answer.shape} of {answer.dtype} for {len(rows)} postures; "
            f"({len(rows)},) of bool is needed, True where a posture is admissible"
        )
    return answer
