"""The program's motion: every move of an NC program, from its approach to its retract."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, HasColumns, IntArray
from fiveaxis.model.kinematics.poses import linear_positions, tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.deviation import turns_on_the_spot
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.timing import STANDSTILL, rapid_speeds
from fiveaxis.model.toolpath.operation import MoveKind

# mm: length of the leads along the tool axis.
LEAD_LENGTH = 5.0
# mm: height above the lead's start at which a leg of Z begins or ends if Z has no limit, and above all of the
# path at which the tip arrives under TCP.
ABOVE = 100.0
# mm: from the end of its travel Z keeps away there, since words of the tip are rounded.
BELOW_TOP = 1.0
# Rows of a motion at which the lead-in ends and the lead-out begins.
FIRST, LAST = 0, -1


class Interpolation(StrEnum):
    """How a control moves between two blocks."""

    JOINT = "joint"
    """All axes run linearly in time."""
    TCP = "tcp"
    """The tool's tip moves straight, and the rotary axes turn in proportion."""


class Phase(IntEnum):
    """The purpose of a move in a program."""

    APPROACH = 0
    LEAD_IN = 1
    PATH = 2
    LEAD_OUT = 3
    RETRACT = 4


@dataclass(frozen=True, eq=False)
class ProgramMotion(HasColumns):
    """Every move of a program, one row per block.

    Parameters
    ----------
    motion : m rows; row 0 is the start of the approach, at which no move ends
    phase : (m,), `Phase` values
    interpolation : of the control, from row to row
    first : the row of the path's first location
    """

    motion: Motion
    phase: IntArray
    interpolation: Interpolation
    first: int

    def __repr__(self) -> str:
        return f"<ProgramMotion: {len(self)} rows, {self.interpolation}>"

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the moves by columns, (m,) each: those of `Motion.columns` and ``phase``.

        That is ``approach``, ``lead-in``, ``path``, ``lead-out`` or ``retract``.
        """
        names = np.array([phase.name.lower().replace("_", "-") for phase in Phase])
        return self.motion.columns() | {"phase": names[self.phase]}

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

        The rotary axes turn first, X and Y move above the first location, and Z comes down to the lead-in.
        Under TCP interpolation X, Y and Z move together to a point straight above it that is higher than all
        of the path, as the height from which they come isn't known. Both leads are straight, at the feed of
        the cut that they lead to or from.

        Parameters
        ----------
        blocks : of the path
        lead_in, lead_out : (k,), mm, from the first or last location off the part; by default `axis_lead`
        retract : mm, axis value of Z to which the program retracts at its end; None for no retract, or one to
            an unknown height
        """
        lead_in = axis_lead(blocks, machine) if lead_in is None else lead_in
        lead_out = axis_lead(blocks, machine, row=LAST) if lead_out is None else lead_out
        leads_in, leads_out = (np.linalg.norm([lead_in, lead_out], axis=1) > STANDSTILL).tolist()
        tcp = interpolation is Interpolation.TCP
        raised, start, _ = lead_positions(blocks, machine, lead_in, above_path=tcp)
        end = blocks.positions[-1] + lead_out
        before = [raised, *[start] * leads_in]
        after = [end] * leads_out
        above = [] if retract is None else [_at_z(end, machine, retract)]
        phase = [
            *[Phase.APPROACH] * len(before),
            Phase.LEAD_IN if leads_in else Phase.APPROACH,
            *[Phase.PATH] * (len(blocks) - 1),
            *[Phase.LEAD_OUT] * len(after),
            *[Phase.RETRACT] * len(above),
        ]
        motion = _extended(blocks, machine, before, [*after, *above], np.array(phase))
        return cls(motion, np.array(phase, dtype=np.int64), interpolation, len(before))

    def __len__(self) -> int:
        return len(self.motion)

    @property
    def blocks(self) -> Motion:
        """The rows of the path, from its first location to its last; the first has no duration."""
        found = self.motion.at(np.arange(self.first, self.last + 1))
        return replace(found, time=np.concatenate([[0.0], found.time[1:]]))

    @property
    def last(self) -> int:
        """The row of the path's last location."""
        return len(self) - 1 - int((self.phase > Phase.PATH).sum())

    @property
    def lead_in(self) -> Array:
        """(k,), mm, from the first location to the start of the lead-in."""
        return self._step(self.first, Phase.LEAD_IN, -1.0)

    @property
    def lead_out(self) -> Array:
        """(k,), mm, from the last location to the end of the lead-out."""
        return self._step(min(self.last + 1, len(self) - 1), Phase.LEAD_OUT, 1.0)

    def _step(self, row: int, phase: Phase, sign: float) -> Array:
        return sign * self.motion.moves[row] * float(self.phase[row] == phase)

    def rewinds(self, machine: Machine) -> BoolArray:
        """Find the moves, (m,), that only turn rotary axes back by whole turns."""
        turned = np.abs(self.motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0) > np.pi
        return np.asarray(turned & turns_on_the_spot(machine, self.motion.moves))


def axis_lead(
    motion: Motion,
    machine: Machine,
    direction: Array | None = None,
    length: float = LEAD_LENGTH,
    *,
    row: int = FIRST,
) -> Array:
    """Compute a straight lead, (k,) mm, from the first or last location off the part, within axis limits.

    It is zero if the path doesn't begin, or end, with a cut. With fixed rotary axes the linear axes are
    linear in the tip, so a limit shortens the lead in proportion. It goes a length, mm, along a unit vector,
    (3,) in the workpiece frame, or along the tool axis; `row` is `FIRST` or `LAST`.
    """
    location = motion.positions[row : row + 1 or None]
    if motion.kind[row] != MoveKind.CUT:
        return np.zeros(location.shape[1])
    tip, axis = tool_poses(machine, location)
    end = tip + length * (axis if direction is None else direction)
    lead = (linear_positions(machine, end, location[:, machine.rotary_columns]) - location)[0]
    room = np.where(lead > 0.0, machine.high - location[0], location[0] - machine.low)
    moving = np.abs(lead) > STANDSTILL
    fraction = float(np.min(room[moving] / np.abs(lead[moving]), initial=1.0))
    return max(fraction, 0.0) * np.where(moving, lead, 0.0)


def lead_positions(
    motion: Motion, machine: Machine, lead: Array, *, row: int = FIRST, above_path: bool = False
) -> Array:
    """Return the positions of an approach, (3, k): start and end of its leg of Z, and the location.

    A lead-out passes the same positions in reverse.

    Parameters
    ----------
    lead : (k,), mm, from the location to the end of the leg of Z
    row : `FIRST` or `LAST`
    above_path : whether the leg begins above all of the path at the location's angles, and not at the end of
        the travel
    """
    location = motion.positions[row]
    end = location + lead
    if "Z" not in machine.letters:
        return np.array([end, end, location])
    column = machine.column("Z")
    top = float(machine.high[column])
    height = max(top, end[column]) if np.isfinite(top) else end[column] + ABOVE
    if above_path:
        turned = np.broadcast_to(location[machine.rotary_columns], (len(motion), len(machine.rotary_columns)))
        path = linear_positions(machine, tool_poses(machine, motion.positions)[0], turned)
        highest = float(path[:, column].max())
        height = max(min(top - BELOW_TOP, max(highest, end[column]) + ABOVE), end[column])
    return np.array([_at_z(end, machine, height), end, location])


def _extended(
    blocks: Motion, machine: Machine, before: list[Array], after: list[Array], phase: IntArray
) -> Motion:
    """Add rows before and after a motion: rapid moves, except leads, which have the feed of the cut."""
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


def _at_z(position: Array, machine: Machine, z: float) -> Array:
    above = position.copy()
    above[machine.column("Z")] = z
    return above
