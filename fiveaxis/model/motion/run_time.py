"""Prediction of a program's run time: the machine's accelerations, the control's stops at corners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal, Protocol

import numpy as np

from fiveaxis.base import Array, BoolArray, Coordinates
from fiveaxis.model.kinematics.poses import tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.deviation import PATH_TOLERANCE
from fiveaxis.model.motion.limiting import Limiting, law_limiting, programmed_limiting
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.servo_cycles import servo_times
from fiveaxis.model.motion.time_law import time_motion
from fiveaxis.model.motion.timing import axis_times


class Decimals(Protocol):
    """Decimals of a program's words."""

    @property
    def linear(self) -> int:
        """Of mm."""

    @property
    def rotary(self) -> int:
        """Of deg."""


class ControlTiming(Protocol):
    """What the table of a control says about time (`fiveaxis.nc.Dialect`)."""

    @property
    def name(self) -> str:
        """As in the library."""

    @property
    def title(self) -> str:
        """Full name."""

    @property
    def corners(self) -> float | Literal["exact-path", "blended"] | None:
        """How moves join; a number is a tolerance in mm, None a setting of the machine."""

    @property
    def blend(self) -> float:
        """Distance by which blended moves may pass a corner, mm; 0 where nothing but speed counts."""

    @property
    def cycle(self) -> float:
        """Cycle of the control's clock, s."""

    @property
    def jerk(self) -> str:
        """What limits the axes' jerk; empty where nothing does."""

    @property
    def limited(self) -> Literal["axes", "words"]:
        """What highest speeds and accelerations apply to under TCP control."""

    @property
    def number(self) -> Decimals:
        """How words are written."""


@dataclass(frozen=True, eq=False)
class PredictedTime:
    """Run time of a program.

    Parameters
    ----------
    times : (n,), s, of the motion's rows
    limits : finds what limits the speed in each row
    basis : with ``accelerations``, or ``programmed`` where they or the control's corner behaviour are unknown
    missing : reason for programmed times, else empty
    assumed : about corners and accelerations that aren't known
    """

    times: Array
    limits: Callable[[], Limiting]
    basis: Literal["programmed", "accelerations"]
    missing: str = ""
    assumed: str = ""

    @property
    def total(self) -> float:
        """Time of the whole program, s."""
        return float(self.times.sum())

    @cached_property
    def limiting(self) -> Limiting:
        """What limits the speed in each row; computed on first use."""
        return self.limits()


@dataclass(frozen=True, eq=False)
class Clock:
    """Predicts the time of blocks before they are written, as `predicted_time` does for their words.

    Parameters
    ----------
    dialect : the control's table; None, or one that leaves corners to the machine's settings, stands for a
        control that passes corners within `PATH_TOLERANCE`, the deviation of the blocks themselves
    coordinates : of the program
    """

    dialect: ControlTiming | None = None
    coordinates: Coordinates = "axes"

    @property
    def basis(self) -> str:
        """How the control takes corners, in words."""
        if self.dialect is None or self.dialect.corners is None:
            return f"with accelerations, as a control that passes corners within {PATH_TOLERANCE:g} mm"
        return f"with accelerations, as {self.dialect.title} takes corners"

    @property
    def stops_at_turns(self) -> bool:
        """Whether blocks that turn a rotary axis begin and end at rest."""
        return self.dialect is not None and self.dialect.corners == "exact-path"

    @property
    def limits_words(self) -> bool:
        """Whether the linear axes' speed and acceleration limits apply to the tip's words instead."""
        return self.dialect is not None and self.coordinates != "axes" and self.dialect.limited == "words"

    def too_short(self, machine: Machine) -> str:
        """Say why times are lower bounds, since the control limits a jerk that the machine doesn't state."""
        unknown = [axis.letter for axis in machine.axes if axis.max_jerk is None]
        if self.dialect is None or not self.dialect.jerk or not unknown:
            return ""
        return (
            f"{self.dialect.title} limits jerk ({self.dialect.jerk}), and machine {machine.name!r} states no "
            f"max_jerk of {', '.join(unknown)}: times are lower bounds"
        )

    def is_programmed(self, machine: Machine) -> bool:
        """Whether times are the programmed ones, since the machine states too few accelerations.

        That is none, or not all that a planner in cycles works with.
        """
        known = [axis.max_acceleration is not None for axis in machine.axes]
        in_cycles = self.dialect is not None and isinstance(self.dialect.corners, str)
        return not (all(known) if in_cycles else any(known))

    def timed(self, blocks: Motion, machine: Machine) -> Motion:
        """Return blocks, one a row, with the times that the control takes for them."""
        return replace(blocks, time=self(blocks, machine).times)

    def __call__(self, blocks: Motion, machine: Machine) -> PredictedTime:
        """Predict the time of blocks, one a row, from rest to rest."""
        if self.dialect is None:
            return predicted_time(blocks, machine)
        # Axes that move by less than the decimals stand, so a block may need no stop.
        units = np.where(machine.is_rotary, np.degrees(1.0), 1.0)
        number = self.dialect.number
        scale = units * 10.0 ** np.where(machine.is_rotary, number.rotary, number.linear)
        words = replace(
            blocks, positions=np.round(blocks.positions * scale) / scale, source=np.arange(len(blocks))
        )
        return predicted_time(words, machine, self.dialect, self.coordinates)


# Of a control whose corners aren't known.
USUAL_CLOCK = Clock()


def predicted_time(
    motion: Motion, machine: Machine, dialect: ControlTiming | None = None, coordinates: Coordinates = "axes"
) -> PredictedTime:
    """Predict the time that a control takes for the moves of a program.

    Controls with ``corners = "exact-path"`` (LinuxCNC's G61) and ``"blended"`` (its G64) plan the blocks in
    cycles of their clock, as `servo_times` says. A number for ``corners`` is the tolerance in mm within which
    the control passes them (`time_motion`). Where the table says nothing about corners, or there is none,
    that is `PATH_TOLERANCE`, the deviation of the blocks themselves.

    Parameters
    ----------
    motion : a program read back, with the programmed times
    machine : with highest speeds, accelerations and jerks. Without any acceleration, or with some unknown on
        a control that plans in cycles, the programmed times are returned, but none below that of an axis at
        its highest speed; else an axis whose acceleration isn't known changes its speed at once
    dialect : the control's table, if it is known
    coordinates : of the program; under TCP control rows of one block share its source line

    Raises
    ------
    ToolpathError, MachineError
        As `time_motion`.
    """
    unknown = [a.letter for a in machine.axes if a.max_acceleration is None]
    lacking = f"machine {machine.name!r} states no max_acceleration of {', '.join(unknown)}"
    clock = Clock(dialect, coordinates)
    if clock.is_programmed(machine):
        return replace(programmed_time(motion, machine), missing=lacking)
    last = np.ones(len(motion), dtype=bool) if coordinates == "axes" else block_ends(motion)
    # One row for each block.
    time = np.diff(np.cumsum(motion.time)[last], prepend=0.0)
    blocks = replace(motion.at(np.flatnonzero(last)), time=time, location=None)
    if clock.limits_words:
        # The tool tip in place of the linear axes, as in words under M428.
        positions = blocks.positions.copy()
        positions[:, machine.linear_columns], _axis = tool_poses(machine, blocks.positions)
        blocks = replace(blocks, positions=positions)
    assumptions = [f"{lacking}: their speed changes at once"] if unknown else []
    corners = None if dialect is None else dialect.corners
    limits: Callable[[], Limiting]
    if dialect is not None and isinstance(corners, str):
        blends = corners == "blended"
        run = servo_times(blocks, machine, dialect.cycle, blends=blends, tolerance=dialect.blend)
        times, limits = run.times, lambda: run
    else:
        if corners is None:
            assumptions.append(f"corners are assumed to be passed within {PATH_TOLERANCE:g} mm")
            if dialect is not None:
                assumptions[-1] += (
                    f", since how control {dialect.name!r} takes them is a setting of the machine"
                )
        assumptions += filter(None, [clock.too_short(machine)])
        law = time_motion(blocks, machine, corners=PATH_TOLERANCE if corners is None else float(corners))
        times, limits = law.motion.time, partial(law_limiting, law)

    def of_rows() -> Limiting:
        found = limits()
        return replace(found, time=_distribute(found.time, motion.time, last))

    return PredictedTime(
        _distribute(times[:, None], motion.time, last)[:, 0],
        of_rows,
        "accelerations",
        assumed="; ".join(assumptions),
    )


def programmed_time(motion: Motion, machine: Machine) -> PredictedTime:
    """Return the programmed times, but none below that of an axis at its highest speed: F can't exceed it."""
    slowed = replace(motion, time=np.maximum(motion.time, axis_times(machine, motion.moves)))
    return PredictedTime(slowed.time, partial(programmed_limiting, slowed, machine), "programmed")


def block_ends(motion: Motion) -> BoolArray:
    """Mark the last row of every block, (n,): rows of one block share its source line."""
    ends = np.append((np.diff(motion.source) != 0) | (np.diff(motion.kind) != 0), True)
    ends[0] = True
    return ends


def _distribute(times: Array, programmed: Array, last: BoolArray) -> Array:
    """Distribute times of blocks, (b, c) s, over rows, (n, c), in proportion to the programmed times."""
    block = np.concatenate([[0], np.cumsum(last)[:-1]])
    whole = np.bincount(block, programmed)[:, None]
    share = np.divide(times, whole, out=np.zeros_like(times), where=whole > 0.0)
    return np.asarray(programmed[:, None] * share[block])
