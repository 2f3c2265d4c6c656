"""Programs of every control and mode, and the two checks of their text: as a file, and read back."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

import fiveaxis as fx
from fiveaxis.collision import Surroundings
from fiveaxis.errors import FiveAxisError
from fiveaxis.geometry import IntArray
from fiveaxis.job import verify_program
from fiveaxis.job.planned_program import PlannedProgram
from fiveaxis.job.program import MadeProgram, expected_text, read_back
from fiveaxis.job.program_options import ProgramOptions
from fiveaxis.nc import DIALECTS, ProgramSettings
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.verification import DEFAULT_TOLERANCES, Leads, verify_text
from planted.geometric import CHANGES, changed, dropped, rewritten
from planted.measure import Meaning, Measure
from planted.modal import FAULTS
from planted.words import Text

MODES = [(name, mode) for name, dialect in DIALECTS.items() for mode in dialect.modes]
TILT = (15.0, 75.0)
CLEAN, DROP = "clean", "drop"
GEOMETRIC = (*(change.__name__ for change in CHANGES), DROP)
MODAL = tuple(fault.__name__ for fault in FAULTS)


def cone_wall(rise: float) -> Toolpath:
    """A pass around a quarter of a cone, whose normals rise by so much per length of 1."""
    turn = np.radians(np.linspace(0.0, 90.0, 40))
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full_like(turn, rise)])
    contact = np.column_stack([25.0 * np.cos(turn), 25.0 * np.sin(turn), np.full_like(turn, 20.0)])
    return Toolpath.from_contacts(contact, normal, Tool.ball(8), name="wall")


def on_hayashi() -> fx.Solution:
    """An overhanging wall on a table-table machine without offsets."""
    return fx.optimise(cone_wall(-0.5), fx.load_machine("hayashi-640123"), tilt=TILT, effort="quick")


def on_trunnion() -> fx.Solution:
    """An upright wall, on a machine whose rotary axes are reversed and offset."""
    machine = fx.load_machine("linuxcnc-xyzac-trt").with_drives_of(fx.load_machine("hayashi-640123"))
    return fx.optimise(cone_wall(0.0), machine, tilt=TILT, effort="quick")


@dataclass(frozen=True, eq=False)
class Trial:
    """A program in which faults are planted."""

    solution: fx.Solution
    control: str
    mode: str

    @property
    def settings(self) -> ProgramSettings:
        """Settings with a spindle, unless it is a list of locations."""
        return ProgramSettings(spindle_rpm=None if DIALECTS[self.control].language != "blocks" else 8000)

    @cached_property
    def made(self) -> MadeProgram:
        return self.solution.program(control=self.control, coordinates=self.mode, settings=self.settings)

    @cached_property
    def text(self) -> Text:
        return Text(self.made.text.lines, self.made.text.rows)

    @cached_property
    def measure(self) -> Measure:
        meaning = Meaning(self.solution.machine, self.mode)
        return Measure(meaning, self.solution.toolpath, TILT)

    def found_by_program(self, text: Text, folder: Path) -> bool:
        """Check whether the text is refused as a foreign program, with path and machine."""
        file = folder / f"program{self.made.text.suffix}"
        file.write_text("\n".join(text.lines) + "\n")
        path = self.solution.toolpath
        try:
            return not verify_program(file, self.solution.machine, toolpath=path, tilt=TILT).ok
        except FiveAxisError:
            return True

    def found_by_read_back(self, text: Text) -> bool:
        """Check whether the text is refused as that of the planned motion."""
        options = ProgramOptions(control=self.control, coordinates=self.mode, settings=self.settings)
        wording = options.wording(self.solution.machine)
        draft = replace(self.made.text, lines=text.lines, rows=text.rows)
        try:
            back = read_back(draft, self.made.motion, wording, self.settings)
            report = verify_text(
                back,
                self.made.fill,
                self._path_rows,
                self.solution.constraints,
                surroundings=Surroundings(),
                tolerances=DEFAULT_TOLERANCES,
                expected=expected_text(draft, wording, self.settings),
            )
        except FiveAxisError:
            return True
        return not report.merge(back.unsaid()).ok

    @cached_property
    def _path_rows(self) -> IntArray:
        none = np.zeros(len(self.solution.machine.axes))
        return PlannedProgram(self.made.motion, self.made.fill, Leads(none, none)).path_rows

    def clean(self) -> list[Text]:
        """Return the program as it is, and with its numbers rewritten."""
        return [self.text, rewritten(self.text)]

    def geometric(self, count: int, rng: np.random.Generator) -> Iterator[tuple[str, Text]]:
        """Plant `count` faults of each class in the words of moves."""
        for _ in range(count):
            for change in CHANGES:
                text = changed(self.text, change, self.measure, rng)
                if text is not None:
                    yield change.__name__, text
            yield DROP, dropped(self.text, self.measure, rng)

    def modal(self, rng: np.random.Generator) -> Iterator[tuple[str, Text]]:
        """Plant one fault of each class in the modal state, of those that apply to the program."""
        for fault in FAULTS:
            text = fault(self.text, rng)
            if text is not None:
                yield fault.__name__, text


@dataclass
class Count:
    """Numbers of faults of one class: made, mattered, found by each check; and those missed."""

    made: int = 0
    mattered: int = 0
    by_program: int = 0
    by_read_back: int = 0
    missed: list[str] = field(default_factory=list)


def first_difference(clean: Text, faulty: Text) -> str:
    """Return the first different line, for messages."""
    for number, (a, b) in enumerate(zip(clean.lines, faulty.lines, strict=False), start=1):
        if a != b:
            return f"line {number}: {a!r} became {b!r}"
    return "no line"


def try_program(trial: Trial, folder: Path, count: int, seed: int) -> dict[str, Count]:
    """Plant `count` geometric faults of each class and a modal one of each in a program; by class."""
    rng = np.random.default_rng(seed)
    counts: dict[str, Count] = defaultdict(Count)
    cases = [
        *((CLEAN, text) for text in trial.clean()),
        *trial.geometric(count, rng),
        *trial.modal(rng),
    ]
    for name, text in cases:
        tally = counts[name]
        tally.made += 1
        if name in GEOMETRIC and not trial.measure.matters(text):
            continue
        tally.mattered += name != CLEAN
        found = trial.found_by_program(text, folder), trial.found_by_read_back(text)
        tally.by_program += found[0]
        tally.by_read_back += found[1]
        if not all(found):
            checks = "program" * (not found[0]) + " read-back" * (not found[1])
            tally.missed.append(f"{name} by {checks.strip()}, {first_difference(trial.text, text)}")
    return counts
