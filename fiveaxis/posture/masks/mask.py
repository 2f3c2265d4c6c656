"""A user's mask on postures, asked as seldom as possible: about what a search is going to use.

A mask says of a location and a posture whether it is admissible, and costs what a collision query costs. So
a path is first found without it. Where the mask refuses a few of its locations, they are patched
(`repair`): a lattice search looks for another way, the mask is asked about the states of that way alone and
about some round those that it refuses, and what it refuses is forbidden, until a way is clean or there is
none. Where it refuses many, the whole path is searched again off what it roughly refuses (`clearance`).
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
    """A mask that can also answer quickly and less exactly, which keeps searches off what it refuses.

    A mask need be no more than a function. Where it has a method `rough` too, as one with a map of tool
    directions has, global searches ask that about every posture they look at: some 10⁵ to 10⁷, many at once,
    about locations far apart. Of a mask without it such a map is made by asking it on a grid.

    Every answer must depend on the question alone, never on what was asked before. A rotary axis that turns
    without end may stand on any turn.
    """

    def __call__(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        """Tell exactly which postures are admissible; the last word on every location of the path.

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
        """Tell about which postures are admissible; parameters and answer as above.

        Wrong answers make a path dearer, never wrong. Rather too strict than too lax: a posture that is
        admitted here and refused exactly has to be mended afterwards.
        """
        ...


# How often a lattice is searched again after states were forbidden.
MOST_LOOKS = 40


@dataclass(eq=False)
class Mask:
    """A mask with a count of what it was asked.

    Parameters
    ----------
    function : called with rows (m,) and rotary angles (m, 2), rad, chain order; answers (m,), True where the
        posture is admissible there. A rotary axis that turns without end may stand on any turn
    calls : of the function
    asked : postures in them
    """

    function: MaskFunction
    calls: int = 0
    asked: int = 0

    @property
    def is_rough(self) -> bool:
        """Whether the mask has rough answers of its own."""
        return isinstance(self.function, RoughMask)

    def admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Ask about postures, (m, 2) rad, of locations, (m,).

        Raises
        ------
        SettingError
            The answer isn't one truth value for each posture.
        """
        if not len(rows):
            return np.zeros(0, dtype=bool)
        self.calls += 1
        self.asked += len(rows)
        return _answer(self.function, rows, rotary)

    def along(self, location: Array | None) -> Mask:
        """Return the mask of a path with inserted locations: there both neighbours have to admit a posture.

        Parameters
        ----------
        location : (n,), where each lies among the locations that the mask knows; None for these themselves
        """
        if location is None:
            return self
        ends = np.floor(location).astype(np.int64), np.ceil(location).astype(np.int64)
        function = self.function
        if isinstance(function, RoughMask):
            return Mask(_RoughlyBetween(function, *ends))
        return Mask(_Between(function, *ends))

    def roughly_admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Ask the mask's own rough map, which it must have, as `admits` does."""
        if not len(rows):
            return np.zeros(0, dtype=bool)
        return _answer(cast("RoughMask", self.function).rough, rows, rotary)


@dataclass(frozen=True, eq=False)
class _Between:
    """A mask asked at both neighbours of inserted locations; a given one is its own neighbour."""

    function: MaskFunction
    before: IntArray
    after: IntArray

    def __call__(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self._asked(self.function, rows, rotary)

    def _asked(self, function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
        free = np.array(_answer(function, self.before[rows], rotary))
        at = np.flatnonzero(free & (self.after[rows] != self.before[rows]))
        if len(at):
            free[at] = _answer(function, self.after[rows[at]], rotary[at])
        return free


@dataclass(frozen=True, eq=False)
class _RoughlyBetween(_Between):
    """The same with the mask's own rough map."""

    function: RoughMask

    def rough(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self._asked(self.function.rough, rows, rotary)


@dataclass(eq=False)
class Known:
    """What a mask said about the states of a lattice.

    Parameters
    ----------
    mask : asked about states not known yet
    rows : (n,), the path's locations that the lattice's rows are
    problem : of the lattice
    refused, seen : by row of the lattice, (a, b, c)
    radius : by row, how many lattice steps round a refused state are looked at next
    price : J, of a refused state; infinite forbids it
    """

    mask: Mask
    rows: IntArray
    problem: Problem
    refused: dict[int, BoolArray] = field(default_factory=dict)
    seen: dict[int, BoolArray] = field(default_factory=dict)
    radius: dict[int, int] = field(default_factory=dict)
    price: float = np.inf

    def forbidding(self, lattice: Lattice) -> Lattice:
        """Return the lattice without the states that the mask refused."""

        def states(rows: IntArray) -> tuple[Array, Array]:
            positions, price = lattice.states(rows)
            price = price.copy()
            for number, row in enumerate(rows):
                if int(row) in self.refused:
                    price[number][self.refused[int(row)]] += self.price
            return positions, price

        return replace(lattice, states=states)

    def look(self, lattice: Lattice, path: Array) -> bool:
        """Ask about a path through the lattice, (n, k), and round what is refused; tell if all is clean."""
        columns = self.problem.machine.rotary_columns
        unknown: list[tuple[int, tuple[int, int, int]]] = []
        for row in range(len(path)):
            at = _index(lattice, columns, row, path[row])
            if row not in self.seen or not self.seen[row][at]:
                unknown.append((row, at))
        index = np.array([row for row, _ in unknown], dtype=np.int64)
        clean = self.mask.admits(self.rows[index], path[index][:, columns])
        for (row, at), is_clean in zip(unknown, clean, strict=True):
            self._note(lattice, row, [at], np.array([is_clean]))
        dirty = [place for place, is_clean in zip(unknown, clean, strict=True) if not is_clean]
        if dirty:
            self._look_around(lattice, dirty)
        return not dirty

    def _look_around(self, lattice: Lattice, dirty: list[tuple[int, tuple[int, int, int]]]) -> None:
        """Ask about the admissible states near refused ones, twice as far each time a row comes back."""
        columns = self.problem.machine.rotary_columns
        asked: list[tuple[int, IntArray, Array]] = []
        for row, (i, j, _) in dirty:
            positions, price = (part[0] for part in lattice.states(np.array([row])))
            radius = self.radius.get(row, 1)
            self.radius[row] = 2 * radius
            spin = np.arange(price.shape[0])
            away = np.abs(spin - i)
            away = np.minimum(away, len(spin) - away) if lattice.period else away
            near = (away <= radius)[:, None, None] & (np.abs(np.arange(price.shape[1]) - j) <= radius)[
                :, None
            ]
            places = np.argwhere(near & np.isfinite(price) & ~self.seen[row])
            asked.append((row, places, positions[tuple(places.T)][:, columns]))
        rows = np.concatenate([np.full(len(places), row) for row, places, _ in asked])
        answers = self.mask.admits(self.rows[rows], np.concatenate([rotary for *_, rotary in asked]))
        begin = 0
        for row, places, _ in asked:
            self._note(lattice, row, [tuple(p) for p in places], answers[begin : begin + len(places)])
            begin += len(places)

    def _note(self, lattice: Lattice, row: int, places: list[tuple[int, int, int]], clean: BoolArray) -> None:
        if row not in self.seen:
            shape = lattice.states(np.array([row]))[1].shape[1:]
            self.seen[row], self.refused[row] = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        for at, is_clean in zip(places, clean, strict=True):
            self.seen[row][at], self.refused[row][at] = True, not is_clean


def clean_path(lattice: Lattice, known: Known, looks: int = MOST_LOOKS) -> Array | None:
    """Find the cheapest path through a lattice whose every state the mask admits.

    Parameters
    ----------
    looks : how often the lattice is searched

    Returns
    -------
    (n, k), mm and rad; None where there is none, or none was found in so many searches
    """
    for _ in range(looks):
        path = shortest_path(known.problem, known.forbidding(lattice))
        if path is None or known.look(lattice, path):
            return path
    return None


def way_among(lattice: Lattice, known: Known, looks: int) -> Array | None:
    """Find the cheapest path through a lattice that the mask admits, or at last one that it does nearly.

    Returns
    -------
    (n, k), mm and rad; None where there is no way
    """
    path = None
    for _ in range(looks):
        found = shortest_path(known.problem, known.forbidding(lattice))
        if found is None or known.look(lattice, found):
            return found if found is not None else path
        path = found
    return path


def stored(lattice: Lattice, count: int) -> Lattice:
    """Return the lattice with the states of its rows, so many, worked out once."""
    chunks = np.array_split(np.arange(count), -(-count // lattice.chunk))
    positions, price = (np.concatenate(part) for part in zip(*map(lattice.states, chunks), strict=True))
    return replace(lattice, states=lambda rows: (positions[rows], price[rows]))


def pinned(lattice: Lattice, problem: Problem, ends: dict[int, Array]) -> Lattice:
    """Return the lattice with rows that have one state only.

    Parameters
    ----------
    ends : by row of the lattice, its posture, (2,) rad
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
    """Leave one state of a row, with given axis values (k,); its spin index is the nearest one."""
    spin = lattice.spin_column
    angles = positions[:, 0, 0, spin]
    if lattice.period:
        values[spin] = angles[0] + np.mod(values[spin] - angles[0], TURN)
    nearest = int(np.argmin(np.abs(angles - values[spin])))
    # Neighbours are counted in both coordinates, so the state stands among those that are like it.
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


def _answer(function: MaskFunction, rows: IntArray, rotary: Array) -> BoolArray:
    answer = np.asarray(function(rows.astype(np.int64), rotary.copy()))
    if answer.shape != rows.shape or answer.dtype != np.bool_:
        raise SettingError(
            f"the mask answered with shape {answer.shape} of {answer.dtype} to {len(rows)} postures; "
            f"({len(rows)},) of bool is needed, True where a posture is admissible"
        )
    return answer
