"""What a class of faults is: how it is planted in a program, and whether it matters."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planted.measure import Measure
from planted.words import Text


@dataclass(frozen=True)
class Subject:
    """A clean program in which faults are planted.

    Parameters
    ----------
    control, mode : that it is written for, and in
    measure : of its geometry
    """

    text: Text
    control: str
    mode: str
    measure: Measure

    @property
    def is_list(self) -> bool:
        """Whether it is a list of locations, which puts nothing in force but unit and feed."""
        return self.control in ("apt", "points")

    @property
    def is_klartext(self) -> bool:
        return self.control.startswith("heidenhain")

    @cached_property
    def cutting(self) -> list[int]:
        """The lines of the moves that cut."""
        return self.measure.cutting(self.text)

    @property
    def middle(self) -> int:
        """The line of a cut in the middle of the program."""
        return self.cutting[len(self.cutting) // 2]

    @property
    def head(self) -> range:
        """The lines before the first move on the path."""
        return range(self.text.moves[0])


# Yields faulty programs, one for each variant of the fault; none where the program hasn't got what it needs.
Plant = Callable[[Subject, np.random.Generator], Iterator[Text]]
Rule = Callable[[Subject, Text], bool]


def always(_: Subject, __: Text) -> bool:
    """Every variant of the fault matters."""
    return True


def leaves_path(subject: Subject, text: Text) -> bool:
    """Check by measure whether the tool leaves its path, or leans too far."""
    return subject.measure.matters(text)


@dataclass(frozen=True)
class Fault:
    """A class of faults.

    Parameters
    ----------
    matters : whether a faulty program would harm part, tool or machine
    warned : whether a warning is enough, since nothing but time, surface or a tool's edge is lost
    drawn : whether it depends on chance, so that more of it show more
    """

    name: str
    family: str
    plant: Plant
    matters: Rule = always
    warned: bool = False
    drawn: bool = False
