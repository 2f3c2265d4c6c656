"""Faults in the table of a motion (motion.csv), and the checks of it: `verify`, and `post` to a control."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import fiveaxis as fx
from fiveaxis.base import Array
from fiveaxis.check import Against, Report, verify_program
from fiveaxis.job import post_program
from fiveaxis.job.program import MadeProgram
from fiveaxis.model import Constraints
from fiveaxis.nc import write_motion
from planted.fault import Fault, always
from planted.measure import Meaning, Measure, Way
from planted.trial import TILT, Verdict, verdict_of
from planted.words import COMMENT


@dataclass(frozen=True)
class Table:
    """The rows of a table, as text; the first is its header."""

    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def read(cls, file: Path) -> Table:
        return cls(tuple(tuple(line.split(",")) for line in file.read_text().splitlines()))

    @property
    def lines(self) -> list[str]:
        return [",".join(row) for row in self.rows]

    def column(self, name: str) -> int:
        return self.rows[0].index(name)

    def changed(self, name: str, change: Callable[[str], str], rows: range | list[int]) -> Table:
        """Change the words of a column in some rows."""
        column = self.column(name)
        own = list(self.rows)
        for i in rows:
            own[i] = (*own[i][:column], change(own[i][column]), *own[i][column + 1 :])
        return Table(tuple(own))

    @property
    def all(self) -> range:
        """All rows but the header."""
        return range(1, len(self.rows))

    def numbers(self, names: str) -> Array:
        """Read columns, (n, len(names))."""
        columns = [self.column(name) for name in names]
        return np.array([[float(row[c]) for c in columns] for row in self.rows[1:]])


@dataclass(frozen=True)
class TableSubject:
    """A clean table in which faults are planted."""

    text: Table
    measure: Measure

    def ways(self, table: Table) -> list[Way]:
        """Sample the tool's centre along the rows: it moves in straight lines."""
        machine = self.measure.meaning.machine
        positions = table.numbers(machine.letters)
        positions[:, machine.rotary_columns] = np.radians(positions[:, machine.rotary_columns])
        tip, axis = self.measure.meaning.poses(positions)
        centre = tip + self.measure.path.zone.height * axis
        share = np.linspace(0.0, 1.0, 5)[:, None]
        return [
            Way(i + 1, False, a + share * (b - a), m + share * (n - m))
            for i, (a, b, m, n) in enumerate(
                zip(centre[:-1], centre[1:], axis[:-1], axis[1:], strict=True), 1
            )
        ]

    @cached_property
    def cutting(self) -> list[int]:
        """The rows at which cuts end."""
        return self.measure.cutting_of(self.ways(self.text))


def leaves_path(subject: TableSubject, table: Table) -> bool:
    """Check by measure whether the tool leaves its path, or an axis its travel."""
    machine = subject.measure.meaning.machine
    positions = table.numbers(machine.letters)
    positions[:, machine.rotary_columns] = np.radians(positions[:, machine.rotary_columns])
    if subject.measure.meaning.beyond_travel(positions):
        return True
    return subject.measure.strays(subject.ways(table))


def never(_: TableSubject, __: Table) -> bool:
    return False


def times(factor: float) -> Callable[[str], str]:
    return lambda was: f"{factor * float(was):.9f}"


def in_column(name: str, *changes: Callable[[str], str]) -> Callable[..., Iterator[Table]]:
    """Change a column as a whole, and in one row of a cut."""

    def plant(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
        for change in changes if name in subject.text.rows[0] else ():
            yield subject.text.changed(name, change, subject.text.all)
            yield subject.text.changed(name, change, [int(rng.choice(subject.cutting))])

    return plant


def row_lost(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
    """A row is lost: the next one's duration is too short for its way."""
    i = int(rng.choice(subject.cutting[:-1]))
    rows = subject.text.rows
    yield Table((*rows[:i], *rows[i + 1 :]))


def rows_lost(subject: TableSubject, _: np.random.Generator) -> Iterator[Table]:
    """The end is lost, as of a file that was written in part; or the first rows."""
    rows = subject.text.rows
    yield Table(rows[: 2 * len(rows) // 3])
    yield Table((rows[0], *rows[5:]))


def rows_swapped(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
    """Two rows change places."""
    i = int(rng.choice(subject.cutting[1:]))
    rows = subject.text.rows
    yield Table((*rows[: i - 1], rows[i], rows[i - 1], *rows[i + 1 :]))


def row_doubled(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
    """A row stands twice."""
    i = int(rng.choice(subject.cutting))
    rows = subject.text.rows
    yield Table((*rows[:i], rows[i], *rows[i:]))


def columns_swapped(subject: TableSubject, _: np.random.Generator) -> Iterator[Table]:
    """The numbers of X and Y change places, or of the two rotary axes."""
    table, machine = subject.text, subject.measure.meaning.machine
    rotary = [machine.letters[c] for c in machine.rotary_columns]
    for one, two in (("X", "Y"), rotary):
        order = list(range(len(table.rows[0])))
        a, b = table.column(one), table.column(two)
        order[a], order[b] = b, a
        yield Table((table.rows[0], *[tuple(row[c] for c in order) for row in table.rows[1:]]))


def header_swapped(subject: TableSubject, _: np.random.Generator) -> Iterator[Table]:
    """The header names another order, or other axes."""
    header, *rows = subject.text.rows
    yield Table(((header[1], header[0], *header[2:]), *rows))
    yield Table((tuple("B" if name == "A" else name for name in header), *rows))


def no_number(name: str) -> Callable[..., Iterator[Table]]:
    """A word is no number."""
    return in_column(name, lambda _: "nan", lambda _: "", lambda _: "x", lambda _: "inf")


def sign(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
    """The sign of an axis."""
    for letter in subject.measure.meaning.machine.letters:
        yield from in_column(letter, times(-1.0))(subject, rng)


def moved(subject: TableSubject, rng: np.random.Generator) -> Iterator[Table]:
    """0.1 mm in a linear axis, half a degree in a rotary one."""
    for letter in subject.measure.meaning.machine.letters:
        by = 0.1 if letter in "XYZ" else 0.5
        yield from in_column(letter, lambda was, by=by: f"{float(was) + by:.9f}")(subject, rng)


TABLE_FAULTS = (
    # A duration or feed that doesn't fit the way always matters: one of both is what a program gets as its F.
    Fault("time", "motion.csv", in_column("time", times(10.0), times(0.1), lambda _: "0.0")),
    Fault("feed", "motion.csv", in_column("feed", times(10.0), lambda _: "0.0", times(-1.0))),
    Fault("negative time", "motion.csv", in_column("time", times(-1.0))),
    # What isn't a number always matters.
    Fault("no number in an axis", "motion.csv", no_number("X")),
    Fault("no number in time", "motion.csv", no_number("time")),
    Fault("no number in feed", "motion.csv", no_number("feed")),
    # Lines of the source are for messages only, so a warning is enough; another number matters to nobody.
    Fault(
        "source damaged",
        "motion.csv",
        in_column("source", lambda _: "x", lambda _: "-7", lambda _: ""),
        warned=True,
    ),
    Fault("other source", "motion.csv", in_column("source", lambda _: "1"), matters=never),
    # The kinds of moves, in the table of a motion with links: a word is none, or a cut is called rapid.
    Fault("kind damaged", "motion.csv", in_column("kind", lambda _: "x", lambda _: "9")),
    Fault("cut called rapid", "motion.csv", in_column("kind", lambda _: "2")),
    Fault("row lost", "motion.csv", row_lost, drawn=True),
    Fault("rows lost", "motion.csv", rows_lost),
    Fault("rows swapped", "motion.csv", rows_swapped, drawn=True),
    # A stop for the duration of one row: nothing but a mark.
    Fault("row doubled", "motion.csv", row_doubled, matters=never),
    Fault("header", "motion.csv", header_swapped),
    # By measure, as in a program.
    Fault("columns swapped", "motion.csv", columns_swapped, matters=leaves_path),
    Fault("sign of an axis", "motion.csv", sign, matters=leaves_path),
    Fault("axis moved", "motion.csv", moved, matters=leaves_path, drawn=True),
)
# What a table shows by itself: the way between two rows, their feed and their duration don't fit each other.
ALONE = tuple(
    fault
    for fault in TABLE_FAULTS
    if fault.matters is always and fault.name not in ("rows lost", "rows swapped", "cut called rapid")
)


@dataclass(frozen=True, eq=False)
class TableTrial:
    """The table of a motion in which faults are planted, and the control that it is posted to.

    Parameters
    ----------
    beside_path : whether the checks are given the path; else the tool, which leaves durations and feeds
    """

    solution: fx.Solution
    control: str
    mode: str
    beside_path: bool = True

    @cached_property
    def text(self) -> Table:
        with TemporaryDirectory() as folder:
            file = write_motion(self.solution.motion, Path(folder) / "motion.csv", self.solution.machine)
            return Table.read(file)

    @cached_property
    def subject(self) -> TableSubject:
        meaning = Meaning(self.solution.machine, "axes")
        return TableSubject(self.text, Measure(meaning, self.solution.toolpath, TILT))

    def by_program(self, text: Table, folder: Path) -> Verdict:
        """Check the table as `verify` does, with path, machine and what the job asks."""
        file = self._file(text, folder)
        machine, path = self.solution.machine, self.solution.toolpath
        if not self.beside_path:
            return verdict_of(lambda: verify_program(file, machine, tool=path.tool))
        return verdict_of(lambda: verify_program(file, machine, toolpath=path, tilt=TILT))

    def by_read_back(self, text: Table, folder: Path) -> Verdict:
        """Check the program that `post` makes of the table; one that is right is as good as none."""
        made: list[MadeProgram] = []

        def check() -> Report:
            made.append(self._post(text, folder))
            return made[0].report

        found = verdict_of(check)
        same = bool(made) and text != self.text and _blocks(made[0]) == self._clean_blocks
        return replace(found, harmless=same)

    @cached_property
    def _clean_blocks(self) -> list[str]:
        with TemporaryDirectory() as folder:
            return _blocks(self._post(self.text, Path(folder)))

    def _post(self, text: Table, folder: Path) -> MadeProgram:
        path = self.solution.toolpath
        against = Against(path, constraints=Constraints.of_degrees(tilt=TILT))
        return post_program(
            self._file(text, folder),
            self.solution.machine,
            control=self.control,
            coordinates=self.mode,
            against=against if self.beside_path else Against(tool=path.tool),
        ).made

    def _file(self, text: Table, folder: Path) -> Path:
        file = folder / "motion.csv"
        file.write_text("\n".join(text.lines) + "\n")
        return file

    def faults(self, count: int, rng: np.random.Generator) -> Iterator[tuple[Fault, Table]]:
        """Plant faults of each class: `count` of those that chance draws."""
        for fault in TABLE_FAULTS if self.beside_path else ALONE:
            for _ in range(count if fault.drawn else 1):
                for table in fault.plant(self.subject, rng):
                    yield fault, table

    def clean(self) -> Iterator[tuple[str, Table]]:
        """Write the same table in other ways."""
        rows = self.text.rows
        yield "as written", self.text
        yield "blanks", Table(tuple(tuple(f" {word}" for word in row) for row in rows))
        yield "line ends", Table(tuple((*row[:-1], f"{row[-1]}\r") for row in rows))


def _blocks(made: MadeProgram) -> list[str]:
    """Return the lines of a program that aren't comments."""
    return [line for line in made.text.lines if not COMMENT.match(line)]
