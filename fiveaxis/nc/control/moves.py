"""The moves of a program: straight, round, down a hole, and to places of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.nc.control.axis_track import NO_MOVE, Values
from fiveaxis.nc.control.drilling import DrillingCycle
from fiveaxis.nc.control.interpreter_state import CUT, InterpreterState
from fiveaxis.nc.control.modal import CYCLES
from fiveaxis.nc.control.round_moves import Local, between, round_points
from fiveaxis.nc.languages.block import Block, Triple
from fiveaxis.nc.rows import MILLIMETRES

# Counted under this name: moves to places of the machine, which a path on the workpiece can't hold.
MACHINE_MOVES = "moves in machine coordinates"

STRAIGHT = ("G0", "G1")


@dataclass
class Moves(InterpreterState):
    """Rows from blocks that move."""

    def _move(self, axes: list[str], block: Block) -> None:
        motion, line = self.modes.motion, block.line
        if motion is None and axes:
            raise self.source.error(
                "axis words, and none of G0, G1, G2, G3 is in force; give one of them", line
            )
        if "G53" in block.g:
            if motion not in STRAIGHT or self.modes.incremental:
                raise self.source.error("G53 needs G0 or G1, and G90; write them in its block", line)
            if self._leave_out("G53", {c: block.words[c] for c in axes}, line):
                return
            self._note_machine_zero("G53", line)
        before = self.track.vector
        vector = self._vector(axes, block)
        if vector is None:
            self.track.vector = None
        else:
            self.track.lead(vector, line)
        self.named.update(self.columns[c] for c in axes)
        # The control's own turn into a plane is no cut, whatever motion is in force.
        positions = "G53.1" in block.g or (block.frame is not None and motion not in block.g)
        if motion in CYCLES and not positions:
            self._go_deep(block)
            return
        target, local = self._target(block, of_machine="G53" in block.g)
        self._note_plane(target, line)
        if motion in ("G2", "G3") and not positions:
            self._go_round(target, local, block, before)
        elif motion == "G1" and not positions:
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
                "a tilted plane without tool centre point control, and rotary axes that aren't at 0: X, Y "
                "and Z are taken to lie on the workpiece, as after a swivel cycle; check it where the "
                "control lets the plane stand",
                line,
            )

    def _points(self, block: Block) -> bool:
        """Tell whether I, J and K are the tool's direction, and there is one of them."""
        return self._has_vectors and not block.words.keys().isdisjoint("IJK")

    @property
    def _has_vectors(self) -> bool:
        return self.modes.vectors and self.modes.motion in STRAIGHT

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

    def _go_straight(self, target: Values, block: Block, *, turns: bool) -> None:
        self._prepare_feed(target, block.line)
        if target == self.track.now and not turns and self.track.rows:
            self.ignored[NO_MOVE] += 1
            return
        time, feed = self._pace(block)
        self.track.add(target, block.line, CUT, time, feed, self._unturned(block.normal))

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
        scale = self.modes.feed_scale
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
        if self.cycle is None:
            self.cycle = DrillingCycle(self.source, word, self.local[2])
        self.cycle.word = word
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
        self._rise(self.cycle.level, block.line)
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

    def _rise(self, level: float | None, line: int) -> None:
        """Rise to the level R first where the tool is below it, as RS274/NGC says, and say so."""
        here = list(self.local)
        if level is None or here[2] is None or here[2] >= level:
            return
        self.note(
            Severity.WARNING,
            "cycle-from-below",
            f"{self.modes.motion} begins at Z {here[2]:g} mm, below its level R {level:g}; the tool is taken "
            "to rise first, as LinuxCNC lets it, where Fanuc goes to the place at once",
            line,
        )
        self.go_rapid(self._at(self.track.now, [*here[:2], level]), line)

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
            if column in self.track.rotary:
                # The rotary axes go where the block says, and leave the direction that was in force.
                self.track.vector = None
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
