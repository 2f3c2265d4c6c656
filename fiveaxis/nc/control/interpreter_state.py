"""Interpreter state: positions that words give, and whether a move is determined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Finding, Place, Severity, product
from fiveaxis.model import MoveKind, Operation
from fiveaxis.nc.control.axis_track import NO_MOVE, UNKNOWN_END, AxisTrack, Values
from fiveaxis.nc.control.coordinates import Coordinates, Point
from fiveaxis.nc.control.feed_meaning import FeedMeaning
from fiveaxis.nc.control.machine_functions import MachineFunctions
from fiveaxis.nc.control.modal import DrillingCycle, Modes
from fiveaxis.nc.control.technology import DEFAULT_OFFSET
from fiveaxis.nc.control.wrapping import Wrapping
from fiveaxis.nc.languages.block import Block, BlockError, Triple
from fiveaxis.nc.operations import Unread
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.source import Source

CUT, RAPID = int(MoveKind.CUT), int(MoveKind.RAPID)


@dataclass
class Switch:
    """The last switch between axis positions and the tip, and whether it was in a cut."""

    line: int
    in_cut: bool
    to_tip: bool


@dataclass
class InterpreterState:
    """State of the interpreter between blocks.

    Parameters
    ----------
    source : the program
    line : of the block being run; `within` names its file and line where that is called from there
    modes : modal words in force
    track : axis positions and rows
    coordinates : frames of the words
    ignored : counts of words without effect on the rows
    fixed_feed : whether the caller gives the feed, and the program needs none
    stand_in : whether the machine is a placeholder because none was given
    findings : assumptions and omissions
    noted : what has a finding: its code, and the tool, zero and frame in force
    found_at : index of a finding -> step in which it was found
    machine_moves : step and line of each move to a machine position that isn't in the rows
    wrapping : which rotary words are in 0 to 360, and the rule of their direction
    functions : M words
    tip_words : words that have switched TCP on
    frames : steps that change TCP or a tilted plane, with both from there on
    drilled : steps that drill a hole
    zero_word : work offset in force
    table_line : line of G254 in force; 0 for none
    unread : last lines of parts that aren't read, still to come
    left_out : these parts, and `original`, the program with their lines
    zero_unknown : whether words of axes count from a zero that nobody says, and no cut shows
    feed_meaning : what F and the numbers of dwells count
    end_word : that ended the program; empty without one
    """

    source: Source
    modes: Modes
    track: AxisTrack
    coordinates: Coordinates
    ignored: Counter[str]
    fixed_feed: bool = False
    stand_in: bool = False
    findings: list[Finding] = field(default_factory=list)
    noted: set[tuple[object, ...]] = field(default_factory=set)
    found_at: dict[int, int] = field(default_factory=dict)
    machine_moves: list[tuple[int, int]] = field(default_factory=list)
    switch: Switch | None = None
    cycle: DrillingCycle | None = None
    line: int = 0
    within: str = ""
    tip_words: set[str] = field(default_factory=set)
    turned_local: Point = field(default_factory=lambda: [None, None, None])
    wrapping: Wrapping = field(default_factory=Wrapping)
    functions: MachineFunctions = field(default_factory=MachineFunctions)
    frames: list[tuple[int, tuple[bool, tuple[float, ...] | None]]] = field(default_factory=list)
    drilled: set[int] = field(default_factory=set)
    zero_word: str = DEFAULT_OFFSET
    table_line: int = 0
    unread: tuple[int, ...] = ()
    left_out: tuple[Unread, ...] = ()
    original: Source | None = None
    zero_unknown: bool = False
    end_word: str = ""
    feed_meaning: FeedMeaning = field(init=False)

    def __post_init__(self) -> None:
        axes = self.track.machine.axes
        self.columns = {a.letter: i for i, a in enumerate(axes)}
        self.feed_meaning = FeedMeaning.of(self.source, self.track.machine, self.modes.control)
        self.track.counted = self.feed_meaning.counted(self.modes.units.now, of_tip=False)
        self.named = {i for i, v in enumerate(self.track.now) if v is not None}
        # If the program switches the rule on and off, it is off at the start.
        self.wrapped = () if self.wrapping.switched else self.wrapping.columns

    @property
    def local(self) -> Point:
        """X, Y and Z of the tool as words in the frame in force, mm."""
        return self.turned_local if self.coordinates.turned else self.coordinates.to_local(self.track.now)

    def note(self, severity: Severity, code: str, message: str, line: int | None = None) -> None:
        """Add a finding, at the present line by default, unless there is one of its code in the operation."""
        if line is None:
            self._keep(self.source.finding(severity, code, self.within + message, self.line))
        else:
            self.findings.append(self.source.finding(severity, code, message, line))

    def relies_on(self, key: str) -> None:
        """Warn where only settings of the control say what is in force: a key of `ReadingRules`."""
        if doubt := self.modes.rules.doubt(key):
            self.note(Severity.WARNING, "mode-assumed", doubt)

    def report(
        self,
        severity: Severity,
        code: str,
        message: str,
        line: int,
        location: int,
        value: float | None = None,
    ) -> None:
        """Add a finding at a location of the result, even if there are others of its code."""
        place = Place(location=location, line=line, file=self.source.name)
        self.findings.append(Finding(severity, code, message, place, value))

    def _keep(self, finding: Finding) -> None:
        now = self.modes.technology.now
        key = (finding.code, now.tool, now.loaded, now.work_offset, len(self.frames))
        if key not in self.noted:
            self.noted.add(key)
            self.found_at[len(self.findings)] = self.track.step
            self.findings.append(finding)

    def keep_own(self, steps: tuple[float, float], others: Sequence[Operation]) -> None:
        """Keep what was found in the steps of one operation, from the first up to the last, and only there.

        Findings of no step on the lines of other operations are theirs.
        """
        low, high = steps
        found, self.findings = self.findings, []
        codes: set[str] = set()
        for index, finding in enumerate(found):
            step, line = self.found_at.get(index), finding.place.line
            if step is None and not any(line and o.first_line <= line <= o.last_line for o in others):
                self.findings.append(finding)
            elif step is not None and low < step <= high and finding.code not in codes:
                codes.add(finding.code)
                self.findings.append(finding)
        self.machine_moves = [(step, line) for step, line in self.machine_moves if low < step <= high]

    def _target(self, block: Block, *, of_machine: bool = False) -> tuple[Values, Point]:
        """Return the target of a block: the row's values, and X, Y, Z as words; axes without a word stay."""
        at, track = self.coordinates, self.track
        # In an unturned frame X, Y and Z as words follow from the target.
        target, local = track.now.copy(), self.turned_local.copy()
        for letter in block.words:
            column = self.columns.get(letter)
            if column is None:
                continue
            if at.turned and column not in track.rotary and not of_machine:
                place = "XYZ".index(letter)
                local[place] = self._position(letter, block, local[place], None)
            else:
                offset = 0.0 if of_machine else at.offsets[column]
                target[column] = self._position(letter, block, target[column], offset)
        if not at.turned:
            return target, at.to_local(target)
        for column, coordinate in zip(at.xyz, at.to_tip(local), strict=True):
            target[column] = coordinate
        return target, local

    def _position(self, letter: str, block: Block, begin: float | None, offset: float | None) -> float:
        """Return the position, mm or deg, to which a word of an axis leads from `begin`, None if unknown.

        The offset is added to absolute words; None in a turned frame, whose words are positions.
        """
        self.relies_on("positions")
        column, word = self.columns[letter], block.words[letter]
        axis = self.track.machine.axes[column]
        value = word if axis.is_rotary else word * MILLIMETRES[self.modes.units.now]
        incremental = self.modes.incremental and letter not in block.absolutes
        if incremental or letter in block.increments:
            if begin is None:
                raise BlockError(
                    f"{letter} by an increment (G91) from a position that isn't in the program yet; set "
                    "start, or write an absolute position (G90) before"
                )
            value += begin
        elif offset is not None:
            value = (self._unwrapped(column, value, offset) if column in self.wrapped else value) + offset
        if not abs(value) <= LARGEST_POSITION:
            raise BlockError(
                f"{letter}{word:g} goes to {value:g} {axis.unit}, beyond {LARGEST_POSITION:g}; check the "
                "unit and the decimal point"
            )
        return value

    def _unwrapped(self, column: int, word: float, offset: float) -> float:
        """Return a rotary word from 0 to 360 as the unwrapped angle to which the axis turns."""
        now, letter = self.track.now[column], self.track.machine.letters[column]
        fault = self.wrapping.fault(letter, word)
        if fault is not None:
            raise BlockError(fault)
        if now is None:
            self.note(
                Severity.NOTE,
                "turn-assumed",
                f"rotary words of {letter} are in 0 to 360, so the program doesn't give the turn on which "
                "the axis starts; the first turn is assumed, set start if it isn't",
            )
        return self.wrapping.unwrap(word, None if now is None else now - offset)

    def _on_workpiece(self, direction: Triple | None) -> Triple | None:
        """Convert a direction in the frame in force to the workpiece frame."""
        if direction is None or not self.coordinates.turned:
            return direction
        x, y, z = (float(c) for c in product(self.coordinates.total.rotation, np.array(direction)))
        return x, y, z

    def _pace(self, block: Block) -> tuple[float | None, float | None]:
        self.relies_on("feed_mode")
        return (None, 1.0) if self.fixed_feed else self.modes.pace(block)

    def _prepare_feed(self, target: Values, *, turns: bool = False) -> None:
        """Raise if the end of a feed move isn't known."""
        track, switch = self.track, self.switch
        self.switch = None
        self._assume_rotary(target)
        self._begin(turns=turns)
        missing = track.unknown(target)
        if missing:
            raise self._undetermined(missing, target, switch)
        turned = track.vector is None and any(target[i] != track.now[i] for i in track.rotary)
        if switch is not None and switch.in_cut and not switch.to_tip and turned:
            raise BlockError(
                f"rotary axes turn in a cut in which {_describe(switch)} on line {switch.line}: the tip "
                "leaves its path on the workpiece; retract before, or leave TCP on"
            )

    def _undetermined(self, missing: str, target: Values, switch: Switch | None) -> BlockError:
        """Return the error for a feed move to an unknown position."""
        track = self.track
        silent = [track.machine.letters[i] for i in track.rotary if target[i] is None]
        if track.control_turned and track.vector is None and (silent or not track.rotary):
            turned = ", ".join(silent) or "the rotary axes"
            cure = f"write {turned}" if silent else "give the machine, and write its rotary axes"
            return BlockError(
                f"a feed move without {turned}: since line {track.control_turned} the control turns them "
                f"itself, to directions or a plane, and their angles aren't in the program; {cure}"
            )
        if switch is not None:
            return BlockError(
                f"a feed move without {missing}: {_describe(switch)} on line {switch.line}, and {missing} "
                "isn't in the program since; write X, Y and Z, or begin with a rapid move"
            )
        return BlockError(
            f"a feed move, and the position of {missing} isn't in the program yet; set start, or write a "
            "rapid move before"
        )

    def _assume_rotary(self, target: Values) -> None:
        """Assume 0 for rotary axes that the program hasn't written yet, with a warning."""
        track = self.track
        if track.vector is not None:
            return
        silent = [i for i in track.rotary if target[i] is None and i not in self.named]
        for column in silent:
            target[column] = track.now[column] = self.coordinates.offsets[column]
        if silent:
            letters = ", ".join(track.machine.letters[i] for i in silent)
            self.note(
                Severity.WARNING,
                "rotary-assumed",
                f"the program cuts before it gives {letters}; 0 deg is assumed, set start if it isn't",
            )

    def _begin(self, *, turns: bool = False) -> None:
        """Add the start of the first move as the first row, if it is known.

        If the move `turns` the tool to a direction, the one before is unknown.
        """
        track = self.track
        if not track.rows and not turns and not track.unknown(track.now):
            track.add(track.now, self.line, RAPID, 0.0)

    def go_rapid(self, target: Values, *, turns: bool = False) -> None:
        """Add a rapid move; where an axis isn't known it only updates their positions."""
        track = self.track
        self._begin(turns=turns)
        begins = not track.rows
        track.approach += begins
        if track.unknown(target):
            self.ignored[UNKNOWN_END] += not begins
            track.now = target
            return
        self.switch = None
        if target == track.now and not turns and track.rows:
            self.ignored[NO_MOVE] += 1
            return
        track.add(target, self.line, RAPID)


def _describe(switch: Switch) -> str:
    return f"TCP was switched {'on' if switch.to_tip else 'off'}"
