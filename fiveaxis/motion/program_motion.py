"""The program's motion: every move that an NC program makes, from its approach to its lead-out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion.filling import turns_on_the_spot
from fiveaxis.motion.leads import LAST, clear_way, lead_places
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.timing import STANDSTILL, rapid_speeds
from fiveaxis.toolpath import MoveKind


class Interpolation(StrEnum):
    """How a control moves between two blocks."""

    JOINT = "joint"
    """All axes run linearly in time."""
    TCP = "tcp"
    """The control leads the tool's tip straight, and the rotary axes turn in proportion."""


class Phase(IntEnum):
    """What a move of a program is for."""

    APPROACH = 0
    LEAD_IN = 1
    PATH = 2
    LEAD_OUT = 3
    RETRACT = 4


@dataclass(frozen=True, eq=False)
class ProgramMotion:
    """Every move of a program, one row a block.

    Parameters
    ----------
    motion : m rows; row 0 is where the approach begins, and no move ends there
    phase : (m,), `Phase` values
    interpolation : how the control moves from row to row
    first : the row of the path's first location
    """

    motion: Motion
    phase: IntArray
    interpolation: Interpolation
    first: int

    @classmethod
    def around(
        cls,
        blocks: Motion,
        machine: Machine,
        interpolation: Interpolation,
        *,
        lead_in: Array | None = None,
        lead_out: Array | None = None,
        retract: float | None = None,
    ) -> ProgramMotion:
        """Put approach, lead-in, lead-out and retract around the blocks of a path.

        The rotary axes turn where the tool stands, X and Y go above the first location, and Z comes down to
        the lead-in; a tip under TCP comes there in one move, from anywhere. Both leads are straight, at the
        feed of the cut that they lead to or from.

        Parameters
        ----------
        blocks : of the path, the first row where it begins
        lead_in, lead_out : (k,), mm, from the first or last location off the part; by default `clear_way`
        retract : mm, axis value of Z to which the program goes up at its end; None where it doesn't, or
            nobody knows where that is
        """
        lead_in = clear_way(blocks, machine) if lead_in is None else lead_in
        lead_out = clear_way(blocks, machine, row=LAST) if lead_out is None else lead_out
        raised, start, _ = lead_places(blocks, machine, lead_in)
        before = [raised] if interpolation is Interpolation.JOINT else []
        before += [start] if _length(lead_in) > STANDSTILL else []
        after = [blocks.positions[-1] + lead_out] if _length(lead_out) > STANDSTILL else []
        above = [] if retract is None else [_at_z(blocks.positions[-1] + lead_out, machine, retract)]
        phase = [
            *(Phase.APPROACH for _ in before),
            Phase.LEAD_IN if _length(lead_in) > STANDSTILL else Phase.APPROACH,
            *(Phase.PATH for _ in blocks.time[1:]),
            *(Phase.LEAD_OUT for _ in after),
            *(Phase.RETRACT for _ in above),
        ]
        motion = _extended(blocks, machine, before, [*after, *above], np.array(phase))
        return cls(motion, np.array(phase, dtype=np.int64), interpolation, len(before))

    def __len__(self) -> int:
        return len(self.motion)

    @property
    def blocks(self) -> Motion:
        """The path's own rows, from its first location to its last, with no duration before the first."""
        found = self.motion.at(np.arange(self.first, self.last + 1))
        return replace(found, time=np.concatenate([[0.0], found.time[1:]]))

    @property
    def last(self) -> int:
        """The row of the path's last location."""
        return len(self) - 1 - int((self.phase > Phase.PATH).sum())

    @property
    def lead_in(self) -> Array:
        """(k,), mm, from the first location to where the lead-in begins."""
        return self._step(self.first, Phase.LEAD_IN, -1.0)

    @property
    def lead_out(self) -> Array:
        """(k,), mm, from the last location to where the lead-out ends."""
        return self._step(min(self.last + 1, len(self) - 1), Phase.LEAD_OUT, 1.0)

    def _step(self, row: int, phase: Phase, sign: float) -> Array:
        return sign * self.motion.moves[row] * float(self.phase[row] == phase)

    def rewinds(self, machine: Machine) -> BoolArray:
        """(m,), moves in which nothing but rotary axes turns, back by whole turns."""
        turned = np.abs(self.motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0) > np.pi
        return np.asarray(turned & turns_on_the_spot(machine, self.motion.moves))


def _extended(
    blocks: Motion, machine: Machine, before: list[Array], after: list[Array], phase: IntArray
) -> Motion:
    """Add rows before and after a motion: rapid moves, but for the leads, which go at the feed of the cut."""
    owner = np.concatenate(
        [np.zeros(len(before), int), np.arange(len(blocks)), np.full(len(after), len(blocks) - 1)]
    )
    found = blocks.at(owner)
    positions = np.concatenate([*(p[None] for p in before), blocks.positions, *(p[None] for p in after)])
    rapid = (phase == Phase.APPROACH) | (phase == Phase.RETRACT)
    rapid[len(before)] &= bool(before)
    kind = np.where(rapid, MoveKind.RAPID, found.kind)
    kind[phase == Phase.LEAD_OUT] = MoveKind.CUT
    moves = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))
    quick = (moves / rapid_speeds(machine, found.feed)).max(axis=1)
    at_feed = np.linalg.norm(moves[:, machine.linear_columns], axis=1) / found.feed
    time = np.concatenate([np.zeros(len(before)), blocks.time, np.zeros(len(after))])
    time = np.where(phase == Phase.PATH, time, np.where(rapid, quick, at_feed))
    return replace(found, positions=positions, time=time, kind=kind)


def _at_z(place: Array, machine: Machine, z: float) -> Array:
    above = place.copy()
    above[machine.column("Z")] = z
    return above


def _length(way: Array) -> float:
    return float(np.linalg.norm(way))
