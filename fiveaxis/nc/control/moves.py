"""Moves of a program: straight, circular, drilling cycles, and in machine coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, Severity
from fiveaxis.model import PATH_TOLERANCE
from fiveaxis.nc.control.arcs import USUAL, Arc, Pair, arc_about, arc_of_radius
from fiveaxis.nc.control.axis_track import NO_MOVE, Values
from fiveaxis.nc.control.coordinates import Point
from fiveaxis.nc.control.interpreter_state import CUT, InterpreterState
from fiveaxis.nc.control.modal import CYCLES, PLANES, DrillingCycle, Modes
from fiveaxis.nc.languages.block import Block, BlockError, Triple
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.writing.table_parts import Cycles

# Key of the counts: moves that a path on the workpiece can't contain.
MACHINE_MOVES = "moves in machine coordinates"

STRAIGHT = ("G0", "G1")

CENTRE = {"X": "I", "Y": "J", "Z": "K"}
# By which a number of turns may differ from a whole one (LinuxCNC 2.9, interp_check.cc).
WHOLE = 1e-3
# More full circles are likelier a wrong word than a helix.
MOST_TURNS = 1000


@dataclass
class Moves(InterpreterState):
    """Blocks that move, as rows."""

    def _move(self, axes: list[str], block: Block) -> None:
        motion, line = self.modes.motion, block.line
        if "G53" in block.g and self.modes.incremental:
            control = self.modes.control
            if control is not None and control.reading.machine_increments == "refused":
                raise BlockError(f"{control.short_title} refuses G53 under G91; write G90 before")
            # Fanuc doesn't move, Haas goes to the machine position: nothing is known after it.
            self._leave_at(dict.fromkeys(axes))
            return
        if motion is None and axes:
            self._require_begin()
        if "G53" in block.g and not self._takes_machine_move(axes, block):
            return
        if self.table_line and any(self.columns[c] in self.track.rotary for c in axes):
            raise BlockError(
                f"rotary axes turn under G254 (line {self.table_line}); write G255 before, G254 after"
            )
        before = self.track.vector
        vector = self._vector(axes, block)
        if vector is None:
            self.track.vector = None
        else:
            self.track.orient(vector, line)
        self.named.update(self.columns[c] for c in axes)
        # When the control turns into a plane by itself, it doesn't cut, whatever motion is in force.
        positions = "G53.1" in block.g or (block.frame is not None and motion not in block.g)
        if motion in CYCLES and not positions:
            self._drill(block, self._require_cycle(axes))
            return
        target, local = self._target(block, of_machine="G53" in block.g)
        self._note_plane(target)
        if motion in ("G2", "G3") and not positions:
            self._add_arc(target, local, block, before)
        elif motion == "G1" and not positions:
            self._add_cut(target, block, turns=self.track.vector != before)
        else:
            self.go_rapid(target, turns=self.track.vector != before)
        self.turned_local = local

    def _takes_machine_move(self, axes: list[str], block: Block) -> bool:
        """Check whether a move in machine coordinates (G53) is in the result."""
        if self.modes.motion not in STRAIGHT:
            raise BlockError("G53 needs G0 or G1; write one in its block")
        targets = {c: block.words[c] for c in axes}
        wrapped = (c for c in axes if self.columns[c] in self.wrapped)
        if self._omit_move("G53", targets | {c: self._position(c, block, None, 0.0) for c in wrapped}):
            return False
        self.modes.technology.placed.add(self.track.step)
        return True

    def _require_begin(self) -> None:
        """Accept a first position without G0 or G1, whose way isn't in the program; else raise."""
        if self.modes.knows_motion or self.track.rows or not self.track.unknown(self.track.now):
            raise BlockError("axis words, and none of G0, G1, G2, G3 is in force; write one of them")
        self.note(
            Severity.NOTE,
            "motion-assumed",
            "a first position without G0 or G1: whether the control goes there in rapid or at feed isn't in "
            "the program, only its end is used",
        )

    def _leave_at(self, targets: Mapping[str, float | None]) -> None:
        """Leave axes, by letter, at machine positions, None where unknown; the move isn't in the rows."""
        track, left = self.track, {self.columns[letter]: position for letter, position in targets.items()}
        self.named |= left.keys()
        if not left.keys().isdisjoint(track.rotary):
            # Rotary axes at machine positions end the tool direction in force.
            track.vector = None
        if self.coordinates.of_tip and not left.keys().isdisjoint(track.linear):
            # Where one linear axis goes decides all three words of the tip.
            left |= dict.fromkeys(track.linear)
        track.now = [left.get(i, v) for i, v in enumerate(track.now)]
        self.turned_local = self.coordinates.to_local(track.now)
        self.ignored[MACHINE_MOVES] += 1
        self.machine_moves.append((track.step, self.line))

    def _note_plane(self, target: Values) -> None:
        """Warn that a tilted plane is assumed to turn with the workpiece."""
        at, track = self.coordinates, self.track
        by_plane = at.turned and not at.tip_control and track.vector is None and not self.table_line
        if by_plane and any(target[i] for i in track.rotary):
            self.note(
                Severity.WARNING,
                "plane-on-workpiece",
                "a tilted plane without TCP, and rotary axes that aren't at 0: X, Y and Z are taken on the "
                "workpiece, as after a swivel cycle; check whether the control turns the plane with it",
            )

    def _points(self, block: Block) -> bool:
        """Check whether a block gives the tool direction by I, J, K."""
        return self._has_vectors and not block.words.keys().isdisjoint("IJK")

    @property
    def _has_vectors(self) -> bool:
        return self.modes.vectors and self.modes.motion in STRAIGHT

    def _vector(self, axes: list[str], block: Block) -> Triple | None:
        """Return the tool direction on the workpiece after a block; None if angles are in force."""
        given = block.vector
        if given is None and self._points(block):
            i, j, k = (block.words.get(c, 0.0) for c in "IJK")
            given = (i, j, k)
        by_angle = [c for c in axes if c in "ABC"]
        if given is None:
            return None if by_angle else self.track.vector
        if by_angle:
            raise BlockError(f"a tool direction and {', '.join(by_angle)} in one block; write one of them")
        if not self.coordinates.of_tip:
            raise BlockError("a tool direction, and TCP is off; switch it on before")
        self.named.update(self.track.rotary)
        return self._on_workpiece(given)

    def _add_cut(self, target: Values, block: Block, *, turns: bool) -> None:
        self._prepare_feed(target, turns=turns)
        if target == self.track.now and not turns and self.track.rows:
            self.ignored[NO_MOVE] += 1
            return
        time, feed = self._pace(block)
        self.track.add(target, block.line, CUT, time, feed, self._on_workpiece(block.normal))

    def _add_arc(self, target: Values, local: Point, block: Block, before: Triple | None) -> None:
        """Add the chords of an arc; other axes move in proportion to its angle."""
        self._prepare_feed(target)
        self.relies_on("plane")
        block = self._with_turns(block)
        track, begin = self.track, self.track.now
        missing = track.unknown(begin)
        if missing:
            raise BlockError(f"an arc from unknown {missing}; begin with a straight move")
        scale = MILLIMETRES[self.modes.units.now]
        points, length = round_points(self.modes, block, [float(c or 0.0) for c in self.local], local, scale)
        time, feed = self._pace(block)
        parts = len(points)
        scale = self.modes.feed_scale
        if time is not None and (least := self.modes.lowest_speed * scale):
            time = min(time, 60.0 * length / least)
        whole = length / (feed * scale) if feed is not None else time or 0.0
        feed = length / whole / scale if feed is None else feed
        normal, vector = self._on_workpiece(block.normal), track.vector
        for number, point in enumerate(self.coordinates.from_local(points[:-1]).tolist(), start=1):
            share = number / parts
            row = [
                None if a is None or b is None else a + (b - a) * share
                for a, b in zip(begin, target, strict=True)
            ]
            for column, value in zip(self.coordinates.xyz, point, strict=True):
                row[column] = value
            track.vector = between(before, vector, share)
            track.add(row, block.line, CUT, whole / parts, feed, normal)
        track.vector = vector
        track.add(target, block.line, CUT, whole / parts, feed, normal)

    def _with_turns(self, block: Block) -> Block:
        """Return an arc with the full circles that the control's letter for turns adds to it."""
        control = self.modes.control
        if control is None or not control.arc_turns or control.arc_turns not in block.words:
            return block
        turns = block.words[control.arc_turns]
        if turns < 1.0 - WHOLE or abs(turns - round(turns)) > WHOLE:
            raise BlockError(
                f"{control.arc_turns}{turns:g}: an arc has a whole number of turns from 1; write it"
            )
        return block._replace(turns=round(turns) - 1)

    def _require_cycle(self, axes: list[str]) -> Cycles:
        """Return the control's rules of cycles; raise if it runs none in this block."""
        control, word = self.modes.control, str(self.modes.motion)
        if control is None:
            return Cycles()
        rules, turned = control.cycles, [c for c in axes if self.columns[c] in self.track.rotary]
        if word in rules.others:
            raise BlockError(
                f"{word} {rules.others[word]} ({control.title}), which isn't read; post its moves"
            )
        if turned and not rules.rotary:
            named = ", ".join(turned)
            raise BlockError(f"{control.title} refuses a cycle with {named}; turn in a block before")
        if self.modes.feed_mode == "G93" and not rules.inverse_time:
            raise BlockError(f"{control.title} refuses cycles under G93; write G94 and F before")
        return rules

    def _drill(self, block: Block, rules: Cycles) -> None:
        """Add the moves of a drilling cycle: above the hole, to the level R, down at feed, and back."""
        if self.modes.plane != "G17":
            raise BlockError(f"a cycle in {self.modes.plane}; cycles are supported in G17; write G17")
        track, word = self.track, str(self.modes.motion)
        if self.cycle is None:
            self.cycle = DrillingCycle(word, self.local[2])
        self.cycle.word = word
        scale = MILLIMETRES[self.modes.units.now]
        self.cycle.take(block, scale, incremental=self.modes.incremental)
        rest = {c: v for c, v in block.words.items() if c != "Z"}
        over, point = self._target(block._replace(words=rest))
        self._assume_rotary(over)
        self.note(
            # What isn't in the rows takes time, too.
            Severity.WARNING,
            "cycle-simplified",
            f"{word} is read as one move down and one back; pecks, shifts and dwells are left out",
        )
        self.drilled.add(track.step)
        initial, level = self.cycle.initial, self.cycle.level
        if self.modes.to_initial is None and initial is not None and level is not None and initial > level:
            self.note(Severity.WARNING, "return-level", self.modes.rules.levels(initial, level))
        self._rise(self.cycle, rules)
        now, to_initial = self.local[2], bool(self.modes.to_initial)
        for height, at_feed in self.cycle.levels(now, to_initial=to_initial, rules=rules):
            point = [point[0], point[1], height]
            target = self._at(over, point)
            if at_feed:
                self._prepare_feed(target)
                time, feed = self._pace(block)
                track.add(target, block.line, CUT, time, feed)
            elif target != track.now:
                self.go_rapid(target)
        self.turned_local = point

    def _rise(self, cycle: DrillingCycle, rules: Cycles) -> None:
        """Raise a tool below the level R to it first, as RS274/NGC requires, with a warning."""
        here, level = list(self.local), cycle.level
        if level is None or here[2] is None:
            return
        if here[2] < level:
            self.note(
                Severity.WARNING,
                "cycle-from-below",
                f"{self.modes.motion} starts at Z {here[2]:g} mm, below its level R {level:g}; the tool is "
                "assumed to rise first, as on LinuxCNC; Fanuc goes straight to the hole",
            )
        elif not rules.level_first or cycle.initial is None or not cycle.initial < level < here[2]:
            return
        self.go_rapid(self._at(self.track.now, [*here[:2], level]))

    def _at(self, values: Values, local: Point) -> Values:
        """Return a row's values with X, Y, Z given in the frame in force, mm."""
        at, target = self.coordinates, values.copy()
        found = [None] * 3 if None in local else at.from_local(np.array([local], dtype=float))[0].tolist()
        for column, value in zip(at.xyz, found, strict=True):
            target[column] = value
        return target

    def _go_home(self, axes: list[str], block: Block) -> None:
        """Move the named axes to the reference, machine 0, via the position that the words give."""
        word = "G30" if "G30" in block.g else "G28"
        if not axes:
            self.note(
                Severity.WARNING,
                "reference-without-axes",
                f"{word} names no axis, so none moves, as on Fanuc; LinuxCNC would move all; name the axes",
            )
            self.ignored[word] += 1
            return
        columns = [self.columns[letter] for letter in axes]
        # An increment from an unknown position still ends at the reference: programs begin with G91 G28 Z0.
        if not (self.modes.incremental and any(self.track.now[c] is None for c in columns)):
            target, local = self._target(block)
            if target != self.track.now:
                self.go_rapid(target)
            self.turned_local = local
        if word == "G30":
            # The position of the second reference isn't in the program.
            self._leave_at(dict.fromkeys(axes))
            return
        # By signed words a wrapped axis goes on to the next whole turn.
        signed = self.wrapped if self.wrapping.rule == "signed" else ()
        zero = {c: self.wrapping.unwrap(0.0, self.track.now[c]) if c in signed else 0.0 for c in columns}
        if self._omit_move(word, {letter: zero[self.columns[letter]] for letter in axes}):
            return
        self.modes.technology.placed.add(self.track.step)
        self.go_rapid([zero.get(column, value) for column, value in enumerate(self.track.now)])
        self.turned_local = self.coordinates.to_local(self.track.now)

    def _omit_move(self, word: str, targets: Mapping[str, float]) -> bool:
        """Omit a move in machine coordinates unless its end is known; return whether it is omitted.

        It is known of axis positions, from a given zero. Rotary axes are taken to have the machine's zero.
        """
        if self.coordinates.zero is not None and not self.coordinates.of_tip:
            return False
        rotary = {c: target for c, target in targets.items() if self.columns[c] in self.track.rotary}
        if rotary:
            self.note(
                Severity.WARNING,
                "zero-assumed",
                f"{word} turns {', '.join(rotary)} in machine coordinates, whose zero is assumed to be the "
                "program's; set zero (--zero) if it isn't",
            )
        self._leave_at(dict.fromkeys(targets) | rotary)
        return True


def round_points(
    modes: Modes, block: Block, begin: list[float], end: Point, scale: float
) -> tuple[Array, float]:
    """Compute the ends of chords within `PATH_TOLERANCE` of an arc, (n, 3) mm, and its length, mm.

    The last point is the end; the length is along the arc or helix. Begin and end are X, Y, Z in program
    coordinates, mm, the scale mm per program unit. `BlockError` if the arc is undetermined or ambiguous.
    """
    letters = PLANES[modes.plane]
    columns = ["XYZ".index(c) for c in letters]
    finish = [float(c or 0.0) for c in end]
    first, last = ((p[columns[0]], p[columns[1]]) for p in (begin, finish))
    try:
        arc = _arc(modes, block, first, last, scale)
        if not 0 <= block.turns <= MOST_TURNS:
            raise ValueError(f"{block.turns} full turns; at most {MOST_TURNS} are supported")
    except ValueError as fault:
        raise BlockError(str(fault)) from None
    arc = replace(arc, sweep=arc.sweep + math.copysign(2.0 * math.pi * block.turns, arc.sweep))
    [third] = {0, 1, 2} - set(columns)
    parts = arc.parts(PATH_TOLERANCE)
    points = np.empty((parts, 3))
    points[:, columns] = arc.points(parts)
    points[:, third] = begin[third] + (finish[third] - begin[third]) * np.arange(1, parts + 1) / parts
    points[-1] = finish
    return points, math.hypot(arc.length, finish[third] - begin[third])


def between(begin: Triple | None, end: Triple | None, share: float) -> Triple | None:
    """Interpolate between two unit vectors at a share from 0 to 1; the end if there is no begin."""
    if begin is None or end is None or begin == end:
        return end
    x, y, z = (a + (b - a) * share for a, b in zip(begin, end, strict=True))
    length = math.hypot(x, y, z)
    return end if length == 0.0 else (x / length, y / length, z / length)


def _arc(modes: Modes, block: Block, begin: Pair, end: Pair, scale: float) -> Arc:
    letters, arcs = PLANES[modes.plane], {} if modes.control is None else modes.control.arcs
    clockwise, bounds = modes.motion == "G2", arcs.get(modes.units.now, USUAL)
    given = {c: block.words[c] * scale for c in "IJKR" if c in block.words}
    centre = block.centre
    wanted = [CENTRE[c] for c in letters]
    if modes.absolute_centres and centre is None and set(wanted) <= given.keys():
        centre = {c: block.words[i] for c, i in zip(letters, wanted, strict=True)}
    if max(map(abs, given.values()), default=0.0) > LARGEST_POSITION:
        raise ValueError(f"an arc of more than {LARGEST_POSITION:g} mm; check the decimal points")
    if centre is not None:
        x, y = (centre[c] * scale if c in centre else p for c, p in zip(letters, begin, strict=True))
        return arc_about(begin, end, (x, y), clockwise=clockwise, bounds=bounds)
    if set(given) == {"R"}:
        return arc_of_radius(begin, end, given["R"], clockwise=clockwise, bounds=bounds)
    if given and set(given) <= set(wanted):
        x, y = (p + given.get(c, 0.0) for c, p in zip(wanted, begin, strict=True))
        return arc_about(begin, end, (x, y), clockwise=clockwise, bounds=bounds)
    raise ValueError(
        f"an arc in {modes.plane} needs {' or '.join(wanted)}, or R alone, and has "
        f"{', '.join(given) or 'none'}; correct it"
    )
