"""What is in force in a Klartext program from one block to the next."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.nc.languages.block import FrameChange
from fiveaxis.nc.languages.planes import Plane, turns


class PlaneError(ValueError):
    """A plane or a place that isn't determined; the message names the fact, and the caller knows the line."""


@dataclass
class State:
    """A control that knows what its words stand for, and leaves the moves to others.

    The coordinates of a program are shifted by the datum shift, turned by PLANE, shifted again by a datum
    shift that was written after PLANE, and turned by cycle 10, in this order (coordinate systems W-CS, WPL-CS
    and I-CS of the TNC 640 manual).

    Parameters
    ----------
    begun : whether BEGIN PGM was read
    parameters : Q parameters with their values
    tool_feed : of the last TOOL CALL, for F AUTO
    tip_control : whether M128 or FUNCTION TCPM is in force
    spatial : A, B and C in deg, where FUNCTION TCPM takes them for spatial angles (AXIS SPAT); else None
    positioned : whether the control itself has turned the tool into a plane: its angles aren't in the program
    now : the last value of each word of an axis, in the frame in force; without those that aren't known
    pole : X and Y of the last CC
    datum, tilt, shift, spin : the four parts of the frame
    zero : the preset or the line of the datum table in force
    moved : whether a move has been counted from it
    """

    begun: bool = False
    parameters: dict[str, float] = field(default_factory=dict)
    tool_feed: float | None = None
    tip_control: bool = False
    spatial: dict[str, float] | None = None
    positioned: bool = False
    now: dict[str, float] = field(default_factory=dict)
    pole: tuple[float, float] | None = None
    datum: Array = field(default_factory=lambda: np.zeros(3))
    tilt: Array = field(default_factory=lambda: np.eye(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))
    spin: float = 0.0
    zero: str = ""
    moved: bool = False

    @property
    def is_tilted(self) -> bool:
        """Whether PLANE turns the coordinates."""
        return not np.array_equal(self.tilt, np.eye(3))

    def frame(self, word: str) -> FrameChange:
        """Give the sum of all parts, as a change that a word makes; places known before are so no more."""
        self.now.clear()
        self.pole = None
        plane = Plane(self.datum, self.tilt).then(Plane(self.shift, turns("Z", [self.spin])))
        return plane.change(word)

    def shift_datum(self, words: Mapping[str, float], increments: str) -> None:
        """Shift the datum along the named axes: of the workpiece, or of the plane where one is tilted.

        Raises
        ------
        PlaneError
            A shift whose place in the order of shifts and turns isn't determined.
        """
        if self.spin:
            raise PlaneError("a datum shift while cycle 10 turns isn't read; end the turn before")
        if self.is_tilted and self.datum.any():
            raise PlaneError(
                "a datum shift in a tilted plane, while one from before the plane is in force, isn't read; "
                "write PLANE RESET before"
            )
        part = self.shift if self.is_tilted else self.datum
        for letter, value in words.items():
            column = "XYZ".index(letter)
            part[column] = value + (part[column] if letter in increments else 0.0)

    def tilt_plane(self, rotation: Array) -> None:
        """Turn the working plane.

        Raises
        ------
        PlaneError
            A shift or a turn is in force that counts in the plane before.
        """
        if self.shift.any() or self.spin:
            raise PlaneError(
                "a new plane while the last one is shifted or turned isn't read; end that before"
            )
        self.tilt = rotation

    def change_zero(self, name: str) -> None:
        """Take note of a preset or a line of the datum table.

        Raises
        ------
        PlaneError
            Moves have been counted from another.
        """
        if self.moved and name != self.zero:
            raise PlaneError(
                f"{name} moves the program's zero away from {self.zero or 'where the program began'}, and "
                "only the control knows how far; write one program for each"
            )
        self.zero = name

    def remember(self, words: Mapping[str, float], increments: str = "") -> None:
        """Keep where axes are, as far as the words say."""
        if not increments:
            self.now.update(words)
            return
        for letter, value in words.items():
            if letter not in increments:
                self.now[letter] = value
            elif letter in self.now:
                self.now[letter] += value

    def place(self) -> tuple[float, float]:
        """Give X and Y where the tool is.

        Raises
        ------
        PlaneError
            The program doesn't say.
        """
        if "X" not in self.now or "Y" not in self.now:
            raise PlaneError("X and Y of the place before aren't in the program up to here; write them")
        return self.now["X"], self.now["Y"]

    def polar_place(self) -> tuple[float, float]:
        """Give radius and angle in deg where the tool is, about the pole.

        Raises
        ------
        PlaneError
            The program doesn't say.
        """
        x, y = self.place()
        px, py = self.need_pole()
        return math.hypot(x - px, y - py), math.degrees(math.atan2(y - py, x - px))

    def need_pole(self) -> tuple[float, float]:
        """Give the pole.

        Raises
        ------
        PlaneError
            No CC is in force.
        """
        if self.pole is None:
            raise PlaneError("there is no pole in these coordinates; write CC with X and Y before")
        return self.pole
