"""Programs of every control and mode on three parts; the checks of a text: as a file, and read back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

import fiveaxis as fx
from fiveaxis.base.errors import FiveAxisError
from fiveaxis.base.findings import Severity
from fiveaxis.check import (
    DEFAULT_TOLERANCES,
    ReadBack,
    Report,
    Surroundings,
    WrittenText,
    unsaid,
    verify_program,
    verify_text,
)
from fiveaxis.job.program import MadeProgram
from fiveaxis.model import Phase, Tool, Toolpath
from fiveaxis.nc import DIALECTS, ProgramSettings
from fiveaxis.nc.program_options import ProgramOptions
from planted.clean import clean
from planted.fault import Fault, Subject
from planted.measure import Meaning, Measure
from planted.registry import FAULTS
from planted.words import Text

MODES = [(name, mode) for name, dialect in DIALECTS.items() for mode in dialect.modes]
TILT = (15.0, 75.0)
FEED = 1000.0
# mm off the part: where links go over it, and where they turn from rapid to feed.
CLEAR, NEAR = 12.0, 3.0
CLEAN = "clean"
# mm, in the travel of the trunnion's Z and above its parts.
RETRACT = 110.0
# What the job asks of every program, in words that the control has: these are no control's defaults.
ASKED: dict[str, Any] = {"tool_number": 5, "spindle_rpm": 8000.0, "coolant": "flood"}
OFFSETS: dict[str, dict[str, Any]] = {
    "fanuc": {"work_offset": "G55", "length_offset": 7},
    "haas": {"work_offset": "G55", "length_offset": 7},
    "linuxcnc": {"work_offset": "G55"},
    "linuxcnc-switchkins": {"work_offset": "G55"},
    "sinumerik": {"work_offset": "G505"},
    "heidenhain": {"work_offset": "3"},
    "heidenhain-m128": {"work_offset": "3"},
}


# mm: how far the wall waves out and in, and how often per turn, so that its program needs many blocks.
WAVE, WAVES = 1.5, 6.0


def cone_wall(rise: float, height: float = 20.0) -> Toolpath:
    """A pass around a quarter of a fluted wall, whose normals rise by so much per length of 1."""
    turn = np.radians(np.linspace(0.0, 90.0, 30))
    out = np.column_stack([np.cos(turn), np.sin(turn)])
    radius = (25.0 + WAVE * np.sin(WAVES * turn))[:, None]
    slope = (WAVE * WAVES * np.cos(WAVES * turn))[:, None]
    normal = radius * out - slope * np.column_stack([-out[:, 1], out[:, 0]])
    normal = np.column_stack(
        [normal / np.linalg.norm(normal, axis=1, keepdims=True), np.full_like(turn, rise)]
    )
    contact = np.column_stack([radius * out, np.full_like(turn, height)])
    return Toolpath.from_contacts(contact, normal, Tool.ball(8), feed_mm_min=FEED, name="wall")


def two_passes(tool: Tool | None = None, rise: float = -0.5, rapid: bool = True) -> Toolpath:
    """Two passes around the same wall, joined by moves in the air and a link down to the second one."""
    upper, lower = cone_wall(rise), cone_wall(rise, height=17.0)
    links = [
        upper.contact[-1] + CLEAR * upper.normal[-1],
        lower.contact[0] + CLEAR * lower.normal[0],
        lower.contact[0] + NEAR * lower.normal[0],
    ]
    contact = np.concatenate([upper.contact, links, lower.contact])
    normal = np.concatenate([upper.normal, upper.normal[-1:], *[lower.normal[:1]] * 2, lower.normal])
    path = Toolpath.from_contacts(contact, normal, tool or Tool.ball(8), feed_mm_min=FEED, name="passes")
    row, n = np.arange(len(path)), len(upper)
    if not rapid:
        return path.with_links((row >= n) & (row <= n + 3))
    return path.with_links((row >= n + 2) & (row <= n + 3)).with_rapids((row == n) | (row == n + 1))


@dataclass(frozen=True)
class Part:
    """A part on a machine, and what its job asks of programs beside what every job does.

    Parameters
    ----------
    solve : its postures
    asked : settings, of controls that have words for a tool
    """

    name: str
    solve: Callable[[], fx.Solution]
    asked: dict[str, Any] = field(default_factory=dict)


@cache
def on_hayashi() -> fx.Solution:
    """An overhanging wall on a table-table machine without offsets."""
    return fx.optimise(cone_wall(-0.5), fx.load_machine("hayashi-640123"), tilt=TILT, effort="quick")


@cache
def on_trunnion(locations: int = 30) -> fx.Solution:
    """An upright wall or its begin, on a machine of reversed and offset rotary axes, with known travels."""
    machine = fx.load_machine("linuxcnc-xyzac-trt").with_drives_of(fx.load_machine("hayashi-640123"))
    path = cone_wall(0.0).at(np.arange(locations))
    return fx.optimise(path, machine, tilt=TILT, effort="quick")


@cache
def with_links() -> fx.Solution:
    """Two passes with rapid moves between them."""
    return fx.optimise(two_passes(), fx.load_machine("hayashi-640123"), tilt=TILT, effort="quick")


PARTS = {
    part.name: part
    for part in (
        Part("hayashi", on_hayashi),
        Part("trunnion", on_trunnion, {"retract": RETRACT}),
        Part("passes", with_links, {"spindle_direction": "left"}),
    )
}


@dataclass(frozen=True)
class Verdict:
    """How often a check tells each code of an error, and of a warning.

    Parameters
    ----------
    harmless : whether what comes of a fault is right all the same, so that there is nothing to tell
    """

    errors: Counter[str]
    warnings: Counter[str] = field(default_factory=Counter)
    harmless: bool = False

    @classmethod
    def of(cls, report: Report) -> Verdict:
        def told(severity: Severity) -> Counter[str]:
            codes = {f.code for f in report.findings if f.severity is severity}
            return Counter({code: n for code, n in report.counts.items() if code in codes})

        return cls(told(Severity.ERROR), told(Severity.WARNING))

    def news(self, before: Verdict) -> Counter[str]:
        """Count the errors, or else the warnings, that weren't told before."""
        return (self.errors - before.errors) or (self.warnings - before.warnings)

    def finds(self, fault: Fault, before: Verdict) -> bool:
        """Whether it tells a fault in a text that had another verdict before."""
        new = bool(self.errors - before.errors)
        return new or self.harmless or (fault.warned and bool(self.warnings - before.warnings))


def verdict_of(check: Callable[[], Report]) -> Verdict:
    """Run a check; an error of our own refuses the text, any other exception finds nothing."""
    try:
        report = check()
    except FiveAxisError as fault:
        return Verdict(Counter({type(fault).__name__: 1}))
    except Exception as fault:
        return Verdict(Counter(), Counter({type(fault).__name__: 1}))
    return Verdict.of(report)


@dataclass(frozen=True, eq=False)
class Trial:
    """A program in which faults are planted."""

    solution: fx.Solution
    control: str
    mode: str
    settings: ProgramSettings

    @classmethod
    def of(cls, part: Part, solution: fx.Solution, control: str, mode: str) -> Trial:
        """Make the trial of a part; a list of locations has no words for what a job asks."""
        offsets = OFFSETS.get(control)
        asked = {} if offsets is None else ASKED | offsets | part.asked
        return cls(solution, control, mode, ProgramSettings(**asked))

    @cached_property
    def made(self) -> MadeProgram:
        return self.solution.program(control=self.control, coordinates=self.mode, settings=self.settings)

    @cached_property
    def text(self) -> Text:
        motion = self.made.motion
        on_path = range(motion.first, motion.first + 1 + int((motion.phase == Phase.PATH).sum()))
        is_list = DIALECTS[self.control].language != "blocks"
        return Text(self.made.text.lines, self.made.text.rows, range(0) if is_list else on_path)

    @cached_property
    def subject(self) -> Subject:
        meaning = Meaning(self.solution.machine, self.mode)
        measure = Measure(meaning, self.solution.toolpath, TILT)
        return Subject(self.text, self.control, self.mode, measure)

    def by_program(self, text: Text, folder: Path) -> Verdict:
        """Check the text as a foreign program, with path, machine and what the job asks."""
        file = folder / f"program{self.made.text.suffix}"
        file.write_text("\n".join(text.lines) + "\n")
        machine, path = self.solution.machine, self.solution.toolpath
        return verdict_of(
            lambda: verify_program(
                file, machine, toolpath=path, tilt=TILT, settings=self.settings, control=self.control
            )
        )

    def by_read_back(self, text: Text, _: Path) -> Verdict:
        """Check the text as that of the planned motion."""
        options = ProgramOptions.of(control=self.control, coordinates=self.mode, settings=self.settings)
        wording = options.wording(self.solution.machine)
        draft = replace(self.made.text, lines=text.lines, rows=text.rows)

        def check() -> Report:
            back = ReadBack.of(draft, self.made.motion, wording, self.settings)
            report = verify_text(
                WrittenText(back, self.made.fill),
                self.solution.constraints,
                surroundings=Surroundings(),
                tolerances=DEFAULT_TOLERANCES,
            )
            return report.merge(unsaid(back.read.motion.findings))

        return verdict_of(check)

    def faults(self, count: int, rng: np.random.Generator) -> Iterator[tuple[Fault, Text]]:
        """Plant faults of each class that applies to the program: `count` of those that chance draws."""
        for fault in FAULTS:
            for _ in range(count if fault.drawn else 1):
                for text in fault.plant(self.subject, rng):
                    yield fault, text

    def clean(self) -> Iterator[tuple[str, Text]]:
        """Rewrite the program in ways that change nothing."""
        return clean(self.subject)


@dataclass
class Count:
    """Numbers of faults of one class: made, mattered, found by each check, false alarms; and those missed."""

    made: int = 0
    mattered: int = 0
    by_program: int = 0
    by_read_back: int = 0
    false_alarms: int = 0
    missed: list[str] = field(default_factory=list)

    def add(self, other: Count) -> None:
        """Add the numbers of another program."""
        for name in ("made", "mattered", "by_program", "by_read_back", "false_alarms"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.missed += other.missed


def first_difference(clean: Text, faulty: Text) -> str:
    """Return the first different line, for messages."""
    for number, (a, b) in enumerate(zip(clean.lines, faulty.lines, strict=False), start=1):
        if a != b:
            return f"line {number}: {a!r} became {b!r}"
    return "no line"


def try_program(
    trial: Trial, folder: Path, count: int, seed: int, only: Callable[[Fault], bool] = lambda _: True
) -> dict[str, Count]:
    """Plant faults in a program and count what is found, by class; the class `CLEAN` has none."""
    rng = np.random.default_rng(seed)
    before = trial.by_program(trial.text, folder), trial.by_read_back(trial.text, folder)
    counts = {CLEAN: Count()}
    for fault, text in trial.faults(count, rng):
        if not only(fault):
            continue
        tally = counts.setdefault(fault.name, Count())
        tally.made += 1
        if not fault.matters(trial.subject, text):
            continue
        tally.mattered += 1
        after = trial.by_program(text, folder), trial.by_read_back(text, folder)
        found = [now.finds(fault, was) for now, was in zip(after, before, strict=True)]
        tally.by_program += found[0]
        tally.by_read_back += found[1]
        if not all(found):
            checks = " and ".join(w for w, ok in zip(("program", "read-back"), found, strict=True) if not ok)
            tally.missed.append(f"{fault.name} by {checks}: {first_difference(trial.text, text)}")
    tally = counts[CLEAN]
    for name, text in trial.clean():
        tally.made += 1
        same = text is trial.text
        after = before if same else (trial.by_program(text, folder), trial.by_read_back(text, folder))
        news = {
            check: now.errors or now.news(was)
            for check, now, was in zip(("program", "read-back"), after, before, strict=True)
        }
        tally.false_alarms += any(news.values())
        tally.missed += [f"{name} by {check}: {dict(codes)}" for check, codes in news.items() if codes]
    return counts
