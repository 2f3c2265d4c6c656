"""Where the tool is while a program is read: places that words name, and when a move is determined."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.control.axis_track import NO_MOVE, AxisTrack, Values
from fiveaxis.nc.control.coordinates import Coordinates
from fiveaxis.nc.control.drilling import DrillingCycle
from fiveaxis.nc.control.modal import Modes
from fiveaxis.nc.control.round_moves import Local
from fiveaxis.nc.control.tools import Tools
from fiveaxis.nc.control.wrapping import Wrapping
from fiveaxis.nc.languages.block import Block, Triple
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import MoveKind

CUT, RAPID = int(MoveKind.CUT), int(MoveKind.RAPID)


@dataclass
class Switch:
    """The last change between positions of axes and the tip's place: line, and what was before it."""

    line: int
    in_cut: bool
    to_tip: bool


@dataclass
class InterpreterState:
    """Where the tool is while a program is read, and what makes a move determined.

    Parameters
    ----------
    source : the program
    modes : what is in force
    track : where the axes are
    coordinates : what words count from
    ignored : counts of words without effect on the rows
    fixed_feed : whether the caller gives the feed, and the program needs none
    stand_in : whether the machine only stands in for one that nobody has given
    quickly : whether plain blocks take the short way; the rows are the same either way
    findings : what was assumed or left out
    tools : those that the program names
    wrapping : which rotary words count from 0 to 360, and by which rule the axes turn
    """

    source: Source
    modes: Modes
    track: AxisTrack
    coordinates: Coordinates
    ignored: Counter[str]
    fixed_feed: bool = False
    stand_in: bool = False
    quickly: bool = True
    findings: list[Finding] = field(default_factory=list)
    noted: set[str] = field(default_factory=set)
    switch: Switch | None = None
    cycle: DrillingCycle | None = None
    machine_move_line: int = 0
    tools: Tools = field(default_factory=Tools)
    turned_local: Local = field(default_factory=lambda: [None, None, None])
    wrapping: Wrapping = field(default_factory=Wrapping)

    def __post_init__(self) -> None:
        axes = self.track.machine.axes
        self.columns = {a.letter: i for i, a in enumerate(axes)}
        self.named = {i for i, v in enumerate(self.track.now) if v is not None}
        # Where the program switches the rule on and off, it is off before.
        self.wrapped = () if self.wrapping.switched else self.wrapping.columns

    @property
    def local(self) -> Local:
        """X, Y and Z as words would name them, mm, of where the tool is."""
        return self.turned_local if self.coordinates.turned else self.coordinates.to_local(self.track.now)

    def note(self, severity: Severity, code: str, message: str, line: int) -> None:
        """Keep a finding, the first of its code."""
        self._keep(Finding(severity, code, message, Place(line=line, file=self.source.name)))

    def _keep(self, finding: Finding) -> None:
        if finding.code not in self.noted:
            self.noted.add(finding.code)
            self.findings.append(finding)

    def _target(self, block: Block, *, of_machine: bool = False) -> tuple[Values, Local]:
        """Give the place that a block's words name: the row's values, and X, Y, Z as words would name them.

        Axes without a word stay where they are.
        """
        at, track = self.coordinates, self.track
        target, local = track.now.copy(), self.local.copy()
        scale = MILLIMETRES[self.modes.units.now]
        for letter, word in block.words.items():
            column = self.columns.get(letter)
            if column is None:
                continue
            axis = track.machine.axes[column]
            value = word if axis.is_rotary else word * scale
            turned = at.turned and not axis.is_rotary and not of_machine
            if self._is_increment(letter, block):
                begin = local["XYZ".index(letter)] if turned else target[column]
                if begin is None:
                    raise self.source.error(
                        f"{letter} by an increment (G91), and where it stands isn't in the program up to "
                        "here; give start, or an absolute position (G90) before",
                        block.line,
                    )
                value += begin
            elif not turned:
                offset = 0.0 if of_machine else at.offsets[column]
                if column in self.wrapped:
                    value = self._unwrapped(column, value, offset, block.line)
                value += offset
            if not abs(value) <= LARGEST_POSITION:
                raise self.source.error(
                    f"{letter}{word:g} goes to {value:g} {axis.unit}, beyond {LARGEST_POSITION:g}; check the "
                    "unit and the decimal point",
                    block.line,
                )
            if turned:
                local["XYZ".index(letter)] = value
            else:
                target[column] = value
        if not at.turned:
            return target, at.to_local(target)
        for column, place in zip(at.xyz, at.to_place(local), strict=True):
            target[column] = place
        return target, local

    def _unwrapped(self, column: int, word: float, offset: float, line: int) -> float:
        """Give a rotary word from 0 to 360 on the turn to which it leads the axis."""
        now, letter = self.track.now[column], self.track.machine.letters[column]
        fault = self.wrapping.fault(letter, word)
        if fault is not None:
            raise self.source.error(fault, line)
        if now is None:
            self.note(
                Severity.NOTE,
                "turn-assumed",
                f"rotary words of {letter} count from 0 to 360, so on which of its turns the axis begins "
                "isn't in the program; the first one is taken, say otherwise with start",
                line,
            )
        return self.wrapping.place(word, None if now is None else now - offset)

    def _is_increment(self, letter: str, block: Block) -> bool:
        return letter in block.increments or (self.modes.incremental and letter not in block.absolutes)

    def _unturned(self, direction: Triple | None) -> Triple | None:
        """Turn a direction of the plane in force into one on the workpiece."""
        if direction is None or not self.coordinates.turned:
            return direction
        x, y, z = (float(c) for c in self.coordinates.total.rotation @ np.array(direction))
        return x, y, z

    def _pace(self, block: Block) -> tuple[float | None, float | None]:
        return (None, 1.0) if self.fixed_feed else self.modes.pace(block)

    def _prepare_feed(self, target: Values, line: int) -> None:
        """Make sure that a feed move is determined: by its begin in a motion, by its end in a path."""
        track, switch = self.track, self.switch
        self.switch = None
        if self.modes.for_motion and not track.rows:
            self._begin(line)
            return
        if not self.modes.for_motion:
            self._assume_rotary(target, line)
        missing = track.unknown(target)
        if missing:
            raise self._undetermined(missing, target, switch, line)
        turned = track.vector is None and any(target[i] != track.now[i] for i in track.rotary)
        if switch is not None and switch.in_cut and not switch.to_tip and turned:
            raise self.source.error(
                f"rotary axes turn in a cut in which {_named(switch)} on line {switch.line}: the tip leaves "
                "its way on the workpiece there; retract before, or leave tip control on",
                line,
            )

    def _undetermined(self, missing: str, target: Values, switch: Switch | None, line: int) -> ToolpathError:
        """Say which axes a feed move lacks, and since when."""
        track = self.track
        silent = [track.machine.letters[i] for i in track.rotary if target[i] is None]
        if track.led_line and track.vector is None and (silent or not track.rotary):
            turned = ", ".join(silent) or "the rotary axes"
            cure = f"name {turned}" if silent else "give the machine, and name its rotary axes"
            return self.source.error(
                f"a feed move, and it doesn't name {turned}: on line {track.led_line} the control began to "
                "turn them itself, into directions or a plane, and their angles aren't in the program; "
                f"{cure}",
                line,
            )
        if switch is not None:
            return self.source.error(
                f"a feed move, and it doesn't name {missing}: since {_named(switch)} on line {switch.line} "
                f"the program hasn't said where {missing} stands; name X, Y and Z, or begin with a rapid",
                line,
            )
        return self.source.error(
            f"a feed move, and the place of {missing} isn't in the program up to here; give start, or a "
            "rapid move before",
            line,
        )

    def _assume_rotary(self, target: Values, line: int) -> None:
        """Take rotary axes that the program hasn't named at all to stand at 0, and say so."""
        track = self.track
        if track.vector is not None:
            return
        silent = [i for i in track.rotary if target[i] is None and i not in self.named]
        for column in silent:
            target[column] = self.coordinates.offsets[column]
        if silent:
            letters = ", ".join(track.machine.letters[i] for i in silent)
            self.note(
                Severity.WARNING,
                "rotary-assumed",
                f"the program cuts before it names {letters}; 0 deg is taken, say otherwise with start",
                line,
            )

    def _begin(self, line: int) -> None:
        """Make sure that a motion begins where the axes are: its first row is its first move's begin."""
        track = self.track
        missing = track.unknown(track.now)
        if missing:
            raise self.source.error(
                f"a feed move, and the place of {missing} isn't in the program up to here; give start, or a "
                "rapid move before",
                line,
            )
        if not track.rows:
            track.add(track.now, line, RAPID, 0.0)

    def go_rapid(self, target: Values, line: int, *, turns: bool = False) -> None:
        """Add a rapid move; while an axis isn't known it only tells where the others are."""
        track = self.track
        if self.modes.for_motion and not track.rows:
            if track.unknown(track.now):
                track.now = target
                track.approach += 1
                if not track.unknown(target):
                    self._begin(line)
                return
            self._begin(line)
        if track.unknown(target):
            track.now = target
            track.approach += 1
            return
        self.switch = None
        if target == track.now and not turns and track.rows:
            self.ignored[NO_MOVE] += 1
            return
        track.add(target, line, RAPID)


def _named(switch: Switch) -> str:
    return f"tool centre point control was switched {'on' if switch.to_tip else 'off'}"
