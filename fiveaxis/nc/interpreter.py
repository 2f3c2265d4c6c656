"""From blocks to rows: what RS274/NGC says of each word, whatever the control's language.

A row's X, Y and Z are positions of the machine's axes or, under tool centre point control and in a tilted
plane, the place of the tool's tip on the workpiece (`fiveaxis.nc.coordinates`). Where one becomes the other,
the program doesn't say where the axes are until it names them again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.axis_track import NO_MOVE, AxisTrack, Counting, Values
from fiveaxis.nc.block import Block, Triple
from fiveaxis.nc.coordinates import Coordinates
from fiveaxis.nc.drilling import DrillingCycle
from fiveaxis.nc.modal import CYCLES, END, HARMLESS, PARAMETERS, Modes
from fiveaxis.nc.planes import Plane
from fiveaxis.nc.round_moves import Local, between, round_points
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.nc.unknown_words import unknown_word
from fiveaxis.toolpath import MoveKind

# Letters that may stand in any block: F acts, the others are counted.
COUNTED = "STDHO"

# s: a longer dwell is likelier one in ms, as Fanuc controls count P without a decimal point.
LONGEST_DWELL = 60.0

# Counted under this name: moves to places of the machine, which a path on the workpiece can't hold.
MACHINE_MOVES = "moves in machine coordinates"

CUT, RAPID = int(MoveKind.CUT), int(MoveKind.RAPID)
_STRAIGHT = ("G0", "G1")
_PLAIN_MOTION = {(): None, ("G0",): "G0", ("G1",): "G1"}
# What the rest of a block is where it has nothing but motion and words.
_NOTHING_ELSE = tuple(Block(0))[4:]


@dataclass
class Switch:
    """The last change between positions of axes and the tip's place: line, and what was before it."""

    line: int
    in_cut: bool
    to_tip: bool


@dataclass
class Interpreter:
    """A control that writes down where its axes go.

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
    turned_local: Local = field(default_factory=lambda: [None, None, None])

    def __post_init__(self) -> None:
        axes = self.track.machine.axes
        self.columns = {a.letter: i for i, a in enumerate(axes)}
        self.named = {i for i, v in enumerate(self.track.now) if v is not None}
        self.plain = False

    def run(self, blocks: Iterable[Block]) -> int | None:
        """Act on blocks up to the one that ends the program; give its line.

        Raises
        ------
        ToolpathError
            With file and line: a word that isn't read or doesn't fit, a move that isn't determined.
        """
        for block in blocks:
            if not (self.plain and self._take_plainly(block)) and self.take(block):
                return block.line
        return None

    def take(self, block: Block) -> bool:
        """Act on a block; tell whether it ends the program.

        Raises
        ------
        ToolpathError
            As `run`.
        """
        if block.skipped:
            self.ignored["/"] += 1
            return False
        for finding in block.findings:
            self._keep(finding)
        self.modes.take(block)
        self._change_coordinates(block)
        axes = [letter for letter in block.words if self._knows(letter, block)]
        self._count(block)
        if axes:
            self.modes.units.use(block.line)
        if "G4" in block.g:
            self._wait(block)
        elif "G28" in block.g or "G30" in block.g:
            self._go_home(axes, block)
        elif axes or block.vector or self._is_arc(block) or self._points(block):
            self._move(axes, block)
        elif "G53" in block.g:
            self.ignored["G53"] += 1
        self._look_for_plain_blocks()
        return any(word in END for word in block.m)

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

    # The short way

    def _look_for_plain_blocks(self) -> None:
        """See whether the next block may take the short way: everything known, nothing special in force."""
        modes, track = self.modes, self.track
        self.plain = (
            self.quickly
            and not modes.incremental
            and not self.coordinates.turned
            and not modes.vectors
            and modes.feed_mode != "G95"
            and not self.fixed_feed
            and track.vector is None
            and bool(track.rows)
            and None not in track.now
            and self.switch is None
        )
        scale = MILLIMETRES[modes.units.now]
        self.scales = [1.0 if a.is_rotary else scale for a in track.machine.axes]

    def _take_plainly(self, block: Block) -> bool:
        """Act on a block of axis words and F, with G0, G1 or neither; tell whether it was one."""
        line, g, m, words = block[:4]
        modes, track = self.modes, self.track
        if m or block[4:] != _NOTHING_ELSE or g not in _PLAIN_MOTION:
            return False
        motion = _PLAIN_MOTION[g] or modes.motion
        feed = words.get("F")
        if motion not in _STRAIGHT or (feed is not None and feed <= 0.0):
            return False
        columns, scales, offsets = self.columns, self.scales, self.coordinates.offsets
        target, named = track.now.copy(), 0
        for letter, word in words.items():
            column = columns.get(letter)
            if column is None:
                if letter != "F":
                    return False
                continue
            value = word * scales[column] + offsets[column]
            if not -LARGEST_POSITION <= value <= LARGEST_POSITION:
                return False
            target[column] = value
            named += 1
        stays = target == track.now
        time = None
        if motion == "G1" and not stays:
            if modes.feed_mode == "G93":
                if feed is None:
                    return False
                time, speed = 60.0 / feed, None
            else:
                if (feed or modes.feed) is None:
                    return False
                speed = (feed or modes.feed) / 60.0  # type: ignore[operator]
        modes.motion = motion
        modes.feed = feed or modes.feed
        if named == 0:
            return True
        if stays:
            self.ignored[NO_MOVE] += 1
        elif motion == "G0":
            track.rows.append((target, line, RAPID, None, None, track.counting, None, None))
            track.now = target
        else:
            track.rows.append((target, line, CUT, time, speed, track.counting, None, None))
            track.now = target
        return True

    # What a block does before it moves

    def _change_coordinates(self, block: Block) -> None:
        """Take what a block does to the coordinates: work offset, plane, tip control.

        Places known so far are carried over, or forgotten where the program doesn't tell them.
        """
        at, track = self.coordinates, self.track
        changes = block.frame is not None or self.modes.frame != at.frame
        if block.tip_control is None and not changes:
            self._count_length()
            return
        was_of_tip = at.of_tip
        at.frame = self.modes.frame
        if block.tip_control is not None:
            at.tip_control = block.tip_control
        if block.frame is not None:
            scale = MILLIMETRES[self.modes.units.now]
            self.modes.units.use(block.line)
            new = Plane(np.array(block.frame.origin) * scale, block.frame.rotation)
            at.plane = new if block.frame.kind == "set" else at.plane.then(new)
        at.settle()
        if at.of_tip != was_of_tip:
            in_cut = bool(track.rows) and track.rows[-1][2] == CUT
            self.switch = Switch(block.line, in_cut, at.of_tip)
            track.now = at.exchange(track.now, to_tip=at.of_tip)
            track.vector = track.vector if at.of_tip else None
        self.turned_local = at.to_local(track.now)
        self._count_length()

    def _count_length(self) -> None:
        modes = self.modes
        if self.coordinates.of_tip:
            self.track.counting = Counting.TIP
        else:
            self.track.counting = Counting.COMPENSATED if modes.compensated else Counting.AXES

    def _is_arc(self, block: Block) -> bool:
        """Tell whether a block without axis words is an arc: a full circle."""
        arcs = self.modes.motion in ("G2", "G3")
        return arcs and (block.centre is not None or not block.words.keys().isdisjoint("IJKR"))

    def _points(self, block: Block) -> bool:
        """Tell whether I, J and K are the tool's direction, and there is one of them."""
        return self._has_vectors and not block.words.keys().isdisjoint("IJK")

    @property
    def _has_vectors(self) -> bool:
        return self.modes.vectors and self.modes.motion in _STRAIGHT

    def _knows(self, letter: str, block: Block) -> bool:
        """Tell whether a letter is an axis; refuse it if it's nothing that can stand in the block."""
        if letter in self.columns:
            return True
        if letter == "F" or letter in COUNTED:
            return False
        home = "G28" in block.g or "G30" in block.g
        if letter in "IJKR" and self.modes.motion in ("G2", "G3") and not home:
            return False
        if letter in "IJK" and self._has_vectors and not home:
            return False
        acting = (*block.g, *block.m, self.modes.motion if self.modes.motion in CYCLES else "")
        if any(letter in PARAMETERS.get(word, "") for word in acting):
            return False
        raise unknown_word(self.source, self.track.machine, letter, block, stand_in=self.stand_in)

    def _count(self, block: Block) -> None:
        if "O" in block.words and self.ignored["O"]:
            raise self.source.error("a second program begins; write one file for each", block.line)
        switches = block.tip_control is not None
        self.ignored.update(word for word in block.g if word in HARMLESS)
        self.ignored.update(word for word in block.m if word not in END and not switches)
        self.ignored.update(letter for letter in block.words if letter in COUNTED)
        self.ignored.update(block.ignored)

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
        if not self.modes.for_motion:
            self.ignored["G4"] += 1
        elif None in self.track.now:
            self.ignored["G4 before the motion begins"] += 1
        else:
            self._begin(block.line)
            kind = self.track.rows[-1][2]
            self.track.add(self.track.now, block.line, kind, time)

    # Moves

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
            elif not turned and not of_machine:
                value += at.offsets[column]
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

    def _is_increment(self, letter: str, block: Block) -> bool:
        return letter in block.increments or (self.modes.incremental and letter not in block.absolutes)

    def _move(self, axes: list[str], block: Block) -> None:
        motion, line = self.modes.motion, block.line
        if motion is None and axes:
            raise self.source.error(
                "axis words, and none of G0, G1, G2, G3 is in force; give one of them", line
            )
        if "G53" in block.g:
            if motion not in _STRAIGHT or self.modes.incremental:
                raise self.source.error("G53 needs G0 or G1, and G90; write them in its block", line)
            if self._leave_out("G53", {c: block.words[c] for c in axes}, line):
                return
            self._note_machine_zero("G53", line)
        before = self.track.vector
        self.track.vector = self._vector(axes, block)
        self.named.update(self.columns[c] for c in axes)
        if motion in CYCLES:
            self._go_deep(block)
            return
        target, local = self._target(block, of_machine="G53" in block.g)
        self._note_plane(target, line)
        if motion in ("G2", "G3"):
            self._go_round(target, local, block, before)
        elif motion == "G1" and "G53.1" not in block.g:
            self._go_straight(target, block, turns=self.track.vector != before)
        else:
            self.go_rapid(target, line, turns=self.track.vector != before)
        self.turned_local = local

    def _note_plane(self, target: Values, line: int) -> None:
        """Say that a plane is taken to lie on a workpiece that rotary words have turned."""
        at, track = self.coordinates, self.track
        by_plane = at.turned and not at.tip_control and track.vector is None
        if by_plane and any(target[i] for i in track.rotary):
            self.note(
                Severity.WARNING,
                "plane-on-workpiece",
                "a tilted plane without tool centre point control, and rotary axes that aren't at 0: X, Y and "
                "Z are taken to lie on the workpiece, as after a swivel cycle; check it where the control "
                "lets the plane stand",
                line,
            )

    def _vector(self, axes: list[str], block: Block) -> Triple | None:
        """Give the tool's direction on the workpiece that is in force from a block on; None by angles."""
        given = block.vector
        if given is None and self._points(block):
            i, j, k = (block.words.get(c, 0.0) for c in "IJK")
            given = (i, j, k)
        by_angle = [c for c in axes if c in "ABC"]
        if given is None:
            return None if by_angle else self.track.vector
        if by_angle:
            raise self.source.error(
                f"a tool direction and {', '.join(by_angle)} in one block; write one of them", block.line
            )
        if not self.coordinates.of_tip:
            raise self.source.error(
                "a tool direction, and tool centre point control is off; switch it on before", block.line
            )
        self.named.update(self.track.rotary)
        return self._unturned(given)

    def _unturned(self, direction: Triple | None) -> Triple | None:
        """Turn a direction of the plane in force into one on the workpiece."""
        if direction is None or not self.coordinates.turned:
            return direction
        x, y, z = (float(c) for c in self.coordinates.total.rotation @ np.array(direction))
        return x, y, z

    def _go_straight(self, target: Values, block: Block, *, turns: bool) -> None:
        self._prepare_feed(target, block.line)
        if target == self.track.now and not turns and self.track.rows:
            self.ignored[NO_MOVE] += 1
            return
        time, feed = self._pace(block)
        self.track.add(target, block.line, CUT, time, feed, self._unturned(block.normal))

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
        if missing and switch is not None:
            raise self.source.error(
                f"a feed move, and it doesn't name {missing}: since {_named(switch)} on line {switch.line} "
                f"the program hasn't said where {missing} stands; name X, Y and Z, or begin with a rapid",
                line,
            )
        if missing:
            raise self.source.error(
                f"a feed move, and the place of {missing} isn't in the program up to here; give start, or a "
                "rapid move before",
                line,
            )
        turned = track.vector is None and any(target[i] != track.now[i] for i in track.rotary)
        if switch is not None and switch.in_cut and not switch.to_tip and turned:
            raise self.source.error(
                f"rotary axes turn in a cut in which {_named(switch)} on line {switch.line}: the tip leaves "
                "its way on the workpiece there; retract before, or leave tip control on",
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

    def _go_round(self, target: Values, local: Local, block: Block, before: Triple | None) -> None:
        """Add the chords of an arc; axes out of its plane move in proportion to its angle."""
        self._prepare_feed(target, block.line)
        track, begin = self.track, self.track.now
        missing = track.unknown(begin)
        if missing:
            raise self.source.error(
                f"an arc, and the place of {missing} where it begins isn't in the program; begin with a "
                "straight move",
                block.line,
            )
        scale = MILLIMETRES[self.modes.units.now]
        points, length = round_points(
            self.source, self.modes, block, [float(c or 0.0) for c in self.local], local, scale
        )
        time, feed = self._pace(block)
        parts = len(points)
        whole = length / (feed * scale) if feed is not None else time or 0.0
        feed = length / whole / scale if feed is None else feed
        normal, vector = self._unturned(block.normal), track.vector
        for number, place in enumerate(self.coordinates.from_local(points[:-1]).tolist(), start=1):
            share = number / parts
            row = [
                None if a is None or b is None else a + (b - a) * share
                for a, b in zip(begin, target, strict=True)
            ]
            for column, value in zip(self.coordinates.xyz, place, strict=True):
                row[column] = value
            track.vector = between(before, vector, share)
            track.add(row, block.line, CUT, whole / parts, feed, normal)
        track.vector = vector
        track.add(target, block.line, CUT, whole / parts, feed, normal)

    def _go_deep(self, block: Block) -> None:
        """Add the moves of a drilling cycle at one place: over it, to the level R, down at feed, and back."""
        if self.modes.plane != "G17":
            raise self.source.error(
                f"a cycle in {self.modes.plane}; cycles are read in G17, along Z", block.line
            )
        track, word = self.track, str(self.modes.motion)
        if self.cycle is None or word in block.g:
            self.cycle = DrillingCycle(self.source, word, self.local[2])
        scale = MILLIMETRES[self.modes.units.now]
        self.cycle.take(block, scale, incremental=self.modes.incremental)
        rest = {c: v for c, v in block.words.items() if c != "Z"}
        over, place = self._target(block._replace(words=rest))
        self._assume_rotary(over, block.line)
        self.note(
            Severity.NOTE,
            "cycle-simplified",
            f"{word} is read as one way down and one back; stops in between, shifts and dwells aren't in the "
            "path",
            block.line,
        )
        for height, at_feed in self.cycle.levels(place[2], to_initial=self.modes.to_initial, line=block.line):
            place = [place[0], place[1], height]
            target = self._at(over, place)
            if at_feed:
                self._prepare_feed(target, block.line)
                time, feed = self._pace(block)
                track.add(target, block.line, CUT, time, feed)
            elif target != track.now:
                self.go_rapid(target, block.line)
        self.turned_local = place

    def _at(self, values: Values, place: Local) -> Values:
        """Give the row of a place in the plane in force, mm."""
        target = values.copy()
        if None in place:
            found: Local = [None] * 3
        else:
            found = self.coordinates.from_local(np.array([place], dtype=float))[0].tolist()
        for column, value in zip(self.coordinates.xyz, found, strict=True):
            target[column] = value
        return target

    # Places of the machine

    def _go_home(self, axes: list[str], block: Block) -> None:
        """Go to the reference, 0 of the machine, through the place that the words name: named axes only."""
        word = "G30" if "G30" in block.g else "G28"
        if not axes:
            self.note(
                Severity.WARNING,
                "reference-without-axes",
                f"{word} names no axis, so none moves, as on Fanuc controls; LinuxCNC would move all of them",
                block.line,
            )
            self.ignored[word] += 1
            return
        columns = [self.columns[letter] for letter in axes]
        # An increment from nowhere still ends at the reference: programs begin with G91 G28 Z0.
        if not (self.modes.incremental and any(self.track.now[c] is None for c in columns)):
            target, local = self._target(block)
            if target != self.track.now:
                self.go_rapid(target, block.line)
            self.turned_local = local
        # The second reference is where the machine's builder put it.
        if self._leave_out(word, dict.fromkeys(axes, None if word == "G30" else 0.0), block.line):
            return
        self._note_machine_zero(word, block.line)
        home = self.track.now.copy()
        for column in columns:
            home[column] = 0.0
        self.go_rapid(home, block.line)
        self.turned_local = self.coordinates.to_local(self.track.now)

    def _leave_out(self, word: str, places: Mapping[str, float | None], line: int) -> bool:
        """Leave a move to a place of the machine out of a path that can't hold it; tell whether it did.

        A motion holds it, and so does a path of positions of the axes whose zero is known.
        """
        if self.modes.for_motion and self.coordinates.of_tip:
            raise self.source.error(
                f"{word} under tool centre point control: where the tip is then isn't in the program; switch "
                "it off before",
                line,
            )
        known = self.coordinates.zero is not None and not self.coordinates.of_tip and word != "G30"
        if self.modes.for_motion or known:
            return False
        now = self.track.now.copy()
        for letter, place in places.items():
            column = self.columns[letter]
            self.named.add(column)
            now[column] = place if column in self.track.rotary else None
            if column in self.track.rotary and place is not None:
                self._note_machine_zero(word, line)
        self.track.now = now
        self.turned_local = self.coordinates.to_local(now)
        self.ignored[MACHINE_MOVES] += 1
        self.machine_move_line = self.machine_move_line or line
        return True

    def _note_machine_zero(self, word: str, line: int) -> None:
        if self.coordinates.zero is None:
            self.note(
                Severity.WARNING,
                "zero-assumed",
                f"{word} counts from the machine's zero, which is taken to be the program's; if it isn't, "
                "give program_zero (--program-zero)",
                line,
            )


def _named(switch: Switch) -> str:
    return f"tool centre point control was switched {'on' if switch.to_tip else 'off'}"
