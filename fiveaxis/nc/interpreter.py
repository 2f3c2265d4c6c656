"""From blocks to moves: what RS274/NGC says of each word, for programs of machine-axis words."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.nc.arcs import Arc, arc_about, arc_of_radius
from fiveaxis.nc.axis_track import NO_MOVE, AxisTrack
from fiveaxis.nc.block import Block
from fiveaxis.nc.modal import END, HARMLESS, PARAMETERS, Modes
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.source import Source

PLANES = {"G17": "XY", "G18": "ZX", "G19": "YZ"}
CENTRE = {"X": "I", "Y": "J", "Z": "K"}

# Letters that may stand in any block: F acts, the others are counted.
COUNTED = "STDHO"

# s: a longer dwell is likelier one in ms, as Fanuc controls count P without a decimal point.
LONGEST_DWELL = 60.0


@dataclass
class Interpreter:
    """A control that writes down where its axes go.

    Parameters
    ----------
    source : the program
    modes : what is in force
    track : where the axes are
    zero : (k,), mm and deg, machine position of the program's zero, in the control's own sign; None where
        nobody has said, then 0
    ignored : counts of words without effect on the motion
    findings : what was assumed or left out
    """

    source: Source
    modes: Modes
    track: AxisTrack
    zero: list[float] | None
    ignored: Counter[str]
    findings: list[Finding] = field(default_factory=list)
    noted: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        axes = self.track.machine.axes
        self.columns = {a.letter: i for i, a in enumerate(axes)}
        self.offsets = [0.0] * len(axes) if self.zero is None else self.zero

    def take(self, block: Block) -> bool:
        """Act on a block; tell whether it ends the program.

        Raises
        ------
        ToolpathError
            With file and line: a word that isn't read or doesn't fit, a move that isn't determined.
        """
        if block.skipped:
            self.ignored["/"] += 1
            return False
        self.modes.take(block)
        axes = [letter for letter in block.words if self._knows(letter, block)]
        self._count(block)
        if axes:
            self.modes.units.use(block.line)
        if "G4" in block.g:
            self._wait(block)
        elif "G28" in block.g:
            self._go_home(axes, block)
        elif axes or (self._arcs and not block.words.keys().isdisjoint("IJKR")):
            self._move(block)
        elif "G53" in block.g:
            self.ignored["G53"] += 1
        return any(word in END for word in block.m)

    def note(self, severity: Severity, code: str, message: str, line: int) -> None:
        """Keep a finding, the first of its code."""
        if code not in self.noted:
            self.noted.add(code)
            place = Place(line=line, file=self.source.name)
            self.findings.append(Finding(severity, code, message, place))

    @property
    def _arcs(self) -> bool:
        return self.modes.motion in ("G2", "G3")

    def _knows(self, letter: str, block: Block) -> bool:
        """Tell whether a letter is an axis; refuse it if it's nothing that can stand in the block."""
        if letter in self.columns:
            return True
        if letter == "F" or letter in COUNTED:
            return False
        if letter in "IJKR" and self._arcs and "G28" not in block.g:
            return False
        if any(letter in PARAMETERS.get(word, "") for word in block.g):
            return False
        raise self._unknown(letter, block)

    def _unknown(self, letter: str, block: Block) -> ToolpathError:
        machine = self.track.machine
        shown = f"{letter}{block.words[letter]:g}"
        if letter in "ABCUVWXYZ":
            fact = (
                f"machine {machine.name!r} has the axes {', '.join(machine.letters)} and no {letter}; read "
                "the program with the machine that it was written for, or name its axis so in its file"
            )
        elif letter in "IJKR":
            fact = "belongs to an arc, and neither G2 nor G3 is in force; take it out or give the arc"
        elif letter == "E":
            fact = "isn't an axis, and numbers of G-code have no exponent; write it out"
        else:
            fact = "doesn't belong to anything in its block; take it out if it moves nothing"
        return self.source.error(f"{shown}: {fact}", block.line)

    def _count(self, block: Block) -> None:
        if "O" in block.words and self.ignored["O"]:
            raise self.source.error("a second program begins; write one file for each", block.line)
        self.ignored.update(word for word in block.g if word in HARMLESS)
        self.ignored.update(word for word in block.m if word not in END)
        self.ignored.update(letter for letter in block.words if letter in COUNTED)

    def _wait(self, block: Block) -> None:
        others = [c for c in block.words if c in self.columns or c in "IJKR"]
        time = block.words.get("P")
        if time is None or others:
            raise self.source.error(
                "G4 is read as a dwell of P seconds, in a block without moves; write it so", block.line
            )
        if time < 0.0:
            raise self.source.error(f"G4 P{time:g}; a dwell can't be negative", block.line)
        if time > LONGEST_DWELL:
            self.note(
                Severity.WARNING,
                "long-dwell",
                f"G4 P{time:g} is taken as seconds; if it is meant as ms, write s",
                block.line,
            )
        self.track.wait(block.line, time)

    def _target(self, block: Block, zero: list[float]) -> list[float | None]:
        """Give the place that a block's words name, (k,) mm and deg; axes without a word stay."""
        target = list(self.track.now)
        scale = MILLIMETRES[self.modes.units.now]
        for letter, word in block.words.items():
            column = self.columns.get(letter)
            if column is None:
                continue
            axis = self.track.machine.axes[column]
            value = word if axis.is_rotary else word * scale
            begin = target[column] if self.modes.incremental else zero[column]
            if begin is None:
                raise self.source.error(
                    f"{letter} by an increment (G91), and where it stands isn't in the program up to here; "
                    "give start, or an absolute position (G90) before",
                    block.line,
                )
            value += begin
            if abs(value) > LARGEST_POSITION:
                raise self.source.error(
                    f"{letter}{word:g} goes to {value:g} {axis.unit}, beyond {LARGEST_POSITION:g}; check the "
                    "unit and the decimal point",
                    block.line,
                )
            target[column] = value
        return target

    def _move(self, block: Block) -> None:
        motion, line = self.modes.motion, block.line
        if motion is None:
            raise self.source.error(
                "axis words, and none of G0, G1, G2, G3 is in force; give one of them", line
            )
        absolute = "G53" in block.g
        if absolute and (self._arcs or self.modes.incremental):
            raise self.source.error("G53 needs G0 or G1, and G90; write them in its block", line)
        if absolute:
            self._note_machine_zero("G53", line)
        target = self._target(block, [0.0] * len(self.offsets) if absolute else self.offsets)
        if motion == "G0":
            self.track.go_rapid(target, line)
            return
        begin = self.track.place(line)
        end = [v for v in target if v is not None]
        if self._arcs:
            self._go_round(begin, end, block)
            return
        way, turn = self.track.measure(end)
        if way == turn == 0.0:
            self.ignored[NO_MOVE] += 1
            return
        self.track.go(end, line, *self.modes.pace(block, way, turn))

    def _go_round(self, begin: list[float], end: list[float], block: Block) -> None:
        """Add the chords of an arc; axes out of its plane move in proportion to its angle."""
        first, second = (self.track.machine.column(c) for c in PLANES[self.modes.plane])
        arc = self._arc((begin[first], begin[second]), (end[first], end[second]), block)
        others = [i for i in self.track.linear if i not in (first, second)]
        way = math.hypot(arc.length, *(end[i] - begin[i] for i in others))
        time, feed = self.modes.pace(block, way, 0.0)
        parts = arc.parts(PATH_TOLERANCE)
        points = arc.points(parts).tolist()
        for number, (u, v) in enumerate(points[:-1], start=1):
            row = [a + (b - a) * number / parts for a, b in zip(begin, end, strict=True)]
            row[first], row[second] = u, v
            self.track.go(row, block.line, time / parts, feed)
        self.track.go(end, block.line, time / parts, feed)

    def _arc(self, begin: tuple[float, float], end: tuple[float, float], block: Block) -> Arc:
        scale, plane = MILLIMETRES[self.modes.units.now], PLANES[self.modes.plane]
        given = {c: block.words[c] * scale for c in "IJKR" if c in block.words}
        wanted = [CENTRE[c] for c in plane]
        clockwise = self.modes.motion == "G2"
        try:
            if max(map(abs, given.values()), default=0.0) > LARGEST_POSITION:
                raise ValueError(f"an arc of more than {LARGEST_POSITION:g} mm; check the decimal points")
            if set(given) == {"R"}:
                return arc_of_radius(begin, end, given["R"], clockwise=clockwise)
            if given and set(given) <= set(wanted):
                centre = (begin[0] + given.get(wanted[0], 0.0), begin[1] + given.get(wanted[1], 0.0))
                return arc_about(begin, end, centre, clockwise=clockwise)
            raise ValueError(
                f"an arc in {self.modes.plane} needs {' or '.join(wanted)}, or R alone, and has "
                f"{', '.join(given) or 'none'}; correct it"
            )
        except ValueError as fault:
            raise self.source.error(str(fault), block.line) from None

    def _go_home(self, axes: list[str], block: Block) -> None:
        """Go to the reference, 0 of the machine, through the place that the words name: named axes only."""
        if not axes:
            self.note(
                Severity.WARNING,
                "reference-without-axes",
                "G28 names no axis, so none moves, as on Fanuc controls; LinuxCNC would move all of them",
                block.line,
            )
            self.ignored["G28"] += 1
            return
        self._note_machine_zero("G28", block.line)
        columns = [self.columns[letter] for letter in axes]
        # An increment from nowhere still ends at the reference: programs begin with G91 G28 Z0.
        if not (self.modes.incremental and any(self.track.now[c] is None for c in columns)):
            self.track.go_rapid(self._target(block, self.offsets), block.line)
        home = list(self.track.now)
        for column in columns:
            home[column] = 0.0
        self.track.go_rapid(home, block.line)

    def _note_machine_zero(self, word: str, line: int) -> None:
        if self.zero is None:
            self.note(
                Severity.WARNING,
                "zero-assumed",
                f"{word} counts from the machine's zero, which is taken to be the program's; if it isn't, "
                "give program_zero (--program-zero)",
                line,
            )
