"""A path with the locations inserted that a program's blocks need, and without those that need no block."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion.filling import axis_deviation, fill_in, inside_rapids
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.planes import AxisPlanes
from fiveaxis.motion.program_motion import Interpolation
from fiveaxis.motion.thinning import thinned
from fiveaxis.toolpath import Constraints, Toolpath

# rad: a rotary axis turns no farther in a block that stands for several.
LARGEST_TURN = math.radians(15.0)


@dataclass(frozen=True)
class Filling:
    """What blocks that are inserted between locations, or removed, have to keep.

    Parameters
    ----------
    interpolation : of the control; with TCP the tool keeps to its path under both kinds
    hold : letters of rotary axes that stand
    cone : rad, half angle about the singular direction that cuts keep out of
    max_turn : rad, of a rotary axis in a block that stands for several
    """

    interpolation: Interpolation = Interpolation.JOINT
    hold: tuple[str, ...] = ()
    cone: float = 0.0
    max_turn: float = LARGEST_TURN

    @classmethod
    def of(cls, constraints: Constraints, interpolation: Interpolation) -> Filling:
        """Take what a program's constraints ask for."""
        turn = constraints.max_turn
        return cls(
            interpolation,
            tuple(constraints.hold),
            constraints.singular_cone or 0.0,
            LARGEST_TURN if turn is None else min(turn, LARGEST_TURN),
        )

    def fill(self, toolpath: Toolpath, machine: Machine, motion: Motion) -> Fill:
        """Insert the locations that keep the tool on its path (`Fill.of`)."""
        return Fill.of(
            toolpath, machine, motion, interpolation=self.interpolation, hold=self.hold, cone=self.cone
        )

    def thin(self, fill: Fill) -> Fill:
        """Remove the blocks that the control passes by itself, but those that something was found about.

        What is found about the speed is about moves, and names no location that has to be passed in a block.
        """
        places = [f.place for f in fill.given.findings if f.code != "rotary-slows"]
        told = [p.location for p in places if p is not None and p.location is not None]
        return fill.without_redundant(
            interpolation=self.interpolation,
            max_turn=self.max_turn,
            needed=np.isin(fill.path.numbered, told) & (fill.row == np.floor(fill.row)),
        )

    def blocks(self, toolpath: Toolpath, machine: Machine, motion: Motion) -> Motion:
        """Give the blocks of the program that a motion becomes."""
        return self.thin(self.fill(toolpath, machine, motion)).blocks


@dataclass(frozen=True, eq=False)
class Fill:
    """Which locations the blocks of a program stand for.

    Parameters
    ----------
    given : the path
    planes : of the tool axis between its locations
    path, motion : n locations, the given ones and those inserted between them, and the axes there
    row : (n,), where each lies among the given ones: 3.25 is between 3 and 4
    kept : (b,), the locations that have a block
    blocks : b rows, what the blocks say
    """

    given: Toolpath
    planes: AxisPlanes
    path: Toolpath
    motion: Motion
    row: Array
    kept: IntArray
    blocks: Motion

    @classmethod
    def of(
        cls,
        given: Toolpath,
        machine: Machine,
        motion: Motion,
        *,
        interpolation: Interpolation = Interpolation.JOINT,
        hold: Collection[str] = (),
        cone: float = 0.0,
    ) -> Fill:
        """Insert the locations that keep the tool on its path; those inside rapid moves have no block.

        Bounds on rotary axes go before the plane of the tool axis.

        Parameters
        ----------
        given, motion : n locations, and the axes there
        interpolation : of the control; with TCP the tool keeps to its path under both kinds
        hold : letters of rotary axes that stand
        cone : rad, half angle about the singular direction that cuts keep out of
        """
        rotary = motion.positions[:, machine.rotary_columns]
        planes = AxisPlanes.of(given, machine, rotary, hold=hold, cone=cone)
        tcp = interpolation is Interpolation.TCP
        path, filled, row = fill_in(given, machine, rotary, tcp=tcp, planes=planes)
        if path is not given:
            # Findings name the locations that people know: an inserted one is on the way to the next of them.
            path = replace(path, numbers=given.numbered[np.ceil(row).astype(np.int64)])
        whole = cls(given, planes, path, filled, row, np.arange(len(path)), filled)
        if not inside_rapids(path, row).any():
            return whole
        return whole.without_redundant(
            interpolation=interpolation, max_turn=None, needed=np.ones(len(path), dtype=bool)
        )

    @property
    def inserted(self) -> int:
        """How many locations the given path doesn't have."""
        return len(self.path) - len(self.given)

    @property
    def removed(self) -> int:
        """How many locations, given or inserted, have no block of their own."""
        return len(self.path) - len(self.kept)

    def without_redundant(
        self, *, interpolation: Interpolation, max_turn: float | None, needed: BoolArray
    ) -> Fill:
        """Remove the blocks that a control needs none of to pass their locations in time.

        Parameters
        ----------
        max_turn : rad, of a rotary axis in one block
        needed : (n,), locations that keep their block in any case
        """
        if len(self.path) == 1:
            return self
        few = thinned(
            self.path,
            self.planes.machine,
            self.motion,
            max_turn=LARGEST_TURN if max_turn is None else min(max_turn, LARGEST_TURN),
            tcp=interpolation is Interpolation.TCP,
            needed=needed,
            planes=self.planes.demanded(self.row),
            inside=inside_rapids(self.path, self.row),
        )
        return replace(self, kept=few.kept, blocks=few.motion)

    @property
    def place(self) -> Array:
        """(n,), where each location lies among the blocks, in time: 3.25 is after a quarter of block 4."""
        clock = np.cumsum(self.motion.time)
        every = np.arange(len(self.kept), dtype=float)
        # Locations of one moment, as after a turn on the spot that takes none, keep their blocks apart.
        after = np.searchsorted(self.kept, np.arange(len(clock)))
        before = np.maximum(after - 1, 0)
        begin, end = clock[self.kept[before]], clock[self.kept[after]]
        lasting = end > begin
        share = np.where(lasting, (clock - begin) / np.where(lasting, end - begin, 1.0), 1.0)
        # A rapid move has no feed: its path goes evenly from end to end.
        inside = inside_rapids(self.path, self.row)
        share[inside] = self.row[inside] - np.floor(self.row[inside])
        return np.where(after > 0, every[before] + share, 0.0)

    def off_plane(self, rotary: Array) -> Array:
        """Measure how far the tool axis leaves its plane in each cut of the given path, (g − 1,) rad.

        Parameters
        ----------
        rotary : (n, 2), rad, chain order
        """
        worst = np.zeros(len(self.given) - 1)
        every = np.arange(len(self.row) - 1)
        off = axis_deviation(self.planes, self.row, rotary, every, self.planes.cutting)
        np.maximum.at(worst, np.floor(self.row[:-1]).astype(np.int64), off.max(axis=0))
        return worst
