"""Work offsets: where the zeros of a program's words are, as far as the caller says it."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fiveaxis.errors import SettingError
from fiveaxis.machine import Machine


class WorkOffsets:
    """Machine positions of the zeros of G54, G55 and so on, in the control's own sign.

    Parameters
    ----------
    given : axis letter -> mm or deg, of the program's one work offset; or word and letter (``G55X``,
        ``G54.1P3Z``) of one among several; None where nobody has said
    machine : whose axes they are

    Raises
    ------
    SettingError
        A number that isn't finite.
    MachineError
        A letter that isn't an axis of the machine.
    """

    def __init__(self, given: Mapping[str, float] | None, machine: Machine) -> None:
        self.machine = machine
        self.by_frame: dict[str, dict[int, float]] = {}
        for key, value in ({} if given is None else given).items():
            name = "".join(key.split()).upper()
            frame, letter = name[:-1], name[-1:]
            if not math.isfinite(value):
                raise SettingError(
                    f"program_zero of {key} is {value:g}; it must be a finite number, mm or deg"
                )
            self.by_frame.setdefault(frame, {})[machine.column(letter)] = float(value)
        self.given = given is not None

    def knows(self, frame: str) -> bool:
        """Whether the caller has named this one among several."""
        return frame in self.by_frame

    def of(self, frame: str) -> list[float] | None:
        """Give the zero of a work offset, (k,) mm and deg; None where nobody has said."""
        if not self.given:
            return None
        values = self.by_frame.get("", {}) | self.by_frame.get(frame, {})
        return [values.get(column, 0.0) for column in range(len(self.machine.axes))]
