"""Interpreter: blocks to rows, by RS274/NGC's meaning of the words, for all languages.

X, Y and Z of a row are positions of the machine's axes or, under TCP and in a tilted plane, the tip on the
workpiece (`fiveaxis.nc.control.coordinates`). After a switch between the two, the axis positions are unknown
until the program gives them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Severity
from fiveaxis.model import BED, link_poses
from fiveaxis.nc.control.axis_track import Counting, axis_values
from fiveaxis.nc.control.interpreter_state import CUT, Switch
from fiveaxis.nc.control.modal import (
    CYCLES,
    G92_WORDS,
    HARMLESS,
    MOTION,
    PARAMETERS,
    TABLE_ZERO_WORDS,
    unknown_word,
)
from fiveaxis.nc.control.run_moves import RunMoves
from fiveaxis.nc.control.technology import DEFAULT_OFFSET, END, WORK_OFFSETS
from fiveaxis.nc.languages.block import Block, BlockError, Plane
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.rows import MILLIMETRES

# Letters allowed in any block besides F; they are only counted.
COUNTED = "STDHO"

# P without a decimal point.
_WHOLE_DWELL = re.compile(r"P *[-+]?[0-9]+(?![0-9.])")
# s: a longer dwell is probably in ms, as P without a decimal point on Fanuc.
LONGEST_DWELL = 60.0
# s: as long as any hole's bottom or corner is dwelled on.
LONGEST_IN_CUT = 5.0

# L of G10: tables of tool lengths and radii. P of G10 L2: the work offset.
TOOL_TABLES = (1.0, 10.0, 11.0, 12.0, 13.0)
G10_OFFSETS = {float(number): word for number, word in enumerate(WORK_OFFSETS[:6], start=1)}
# mm and deg: a zero this near to the caller's is the same.
SAME_ZERO = 1e-4


def _shown(words: Mapping[str, float], letters: str) -> str:
    return "".join(f" {c}{words[c]:g}" for c in letters if c in words)


@dataclass
class Interpreter(RunMoves):
    """A control that records the positions of its axes."""

    def run(self, blocks: Iterable[Block | Run]) -> int | None:
        """Run blocks up to the end of the program; return the line of the block that ends it.

        `ToolpathError`, with file and line, for an unsupported or misplaced word, or an undetermined move.
        """
        try:
            for block in self._outside_runs(blocks):
                self.line, self.track.step = block.line, block.step or block.line
                self.within = block.within
                if self.take(block):
                    return block.line
        except BlockError as fault:
            raise self.source.error(f"{self.within}{fault}", self.line) from None
        return None

    def _outside_runs(self, blocks: Iterable[Block | Run]) -> Iterator[Block]:
        """Take runs of plain straight moves together, and yield all other blocks."""
        for block in blocks:
            if isinstance(block, Block):
                yield block
                continue
            row = 0
            while row < len(block) and not self.is_plain(block):
                yield block.block(row)
                row += 1
            if row < len(block) and not self.take_run(rest := block.since(row)):
                yield from rest.blocks()

    def take(self, block: Block) -> bool:
        """Run a block; return whether it ends the program."""
        if self.unread and block.line > self.unread[0]:
            self._forget(block.line)
        if block.skipped:
            self.ignored["/"] += 1
            return False
        for finding in block.findings:
            self._keep(finding)
        if block.drills:
            self.drilled.add(self.track.step)
        self.modes.take(block)
        if self.modes.motion not in CYCLES:
            self.cycle = None
        if block.shorter is not None:
            self._switch_wrapping(block)
        self._reduce(block.reduced)
        block = self._with_table(block)
        self._note_feed_words(block)
        self._change_coordinates(block)
        axes = [letter for letter in block.words if self._is_axis(letter, block)]
        self._count(block)
        if axes:
            self.modes.units.use(block.line)
        if "G4" in block.g:
            self._dwell(block)
        elif "G10" in block.g:
            self._enter_data(axes, block)
        elif "G28" in block.g or "G30" in block.g:
            self._go_home(axes, block)
        elif not G92_WORDS.isdisjoint(block.g):
            self._shift(axes, block)
        elif axes or block.vector or self._is_arc(block) or self._points(block):
            self._move(axes, block)
        elif "G53" in block.g:
            self.ignored["G53"] += 1
        self.end_word = next((word for word in block.m if word in END), "")
        return bool(self.end_word)

    def _forget(self, line: int) -> None:
        """Forget where the axes are, behind a part of the program that isn't read."""
        self.unread = tuple(last for last in self.unread if last >= line)
        self.track.now, self.track.vector = [None] * len(self.track.now), None
        self.turned_local, self.cycle, self.switch = [None, None, None], None, None

    def _change_coordinates(self, block: Block) -> None:
        """Apply a block's changes of work offset, plane and TCP.

        Known positions are converted; those that can't be become unknown.
        """
        at, track = self.coordinates, self.track
        if "G52" in block.ignored and any(at.shifts):
            raise BlockError("G52 X0 Y0 Z0 cancels G92 on LinuxCNC alone; write G92.1")
        new_zero = self._changes_zero()
        changes = block.frame is not None or new_zero or self.modes.work_offset != at.work_offset
        if self.modes.compensated != at.compensated:
            # The axes stay where they are; the words from here on count otherwise.
            at.compensated = self.modes.compensated
            at.update()
            self.turned_local = at.to_local(track.now)
        if block.tip_control is None and not changes:
            self._count_length()
            return
        was_of_tip = at.of_tip
        if new_zero:
            track.now = [None if i in at.xyz else value for i, value in enumerate(track.now)]
        at.work_offset = self.modes.work_offset
        if block.tip_control is not None:
            at.tip_control = block.tip_control
            self.tip_words.update((*block.g, *block.m) if block.tip_control else ())
        if block.frame is not None:
            if block.frame.word == "G52" and (self.modes.incremental or any(at.shifts)):
                raise BlockError("G52 under G91 or after G92 depends on the control; write G90, or G92.1")
            scale = MILLIMETRES[self.modes.units.now]
            if any(block.frame.origin):
                self.modes.units.use(block.line)
            at.plane = Plane(block.frame.origin * scale, block.frame.rotation)
        at.update()
        turned = None if at.plane.is_unturned else tuple((at.plane.rotation.round(9) + 0.0).ravel().tolist())
        self.frames.append((self.track.step, (at.tip_control, turned)))
        if at.of_tip != was_of_tip:
            in_cut = bool(track.rows) and track.rows.last_kind == CUT
            self.switch = Switch(block.line, in_cut, at.of_tip)
            track.now = at.exchange(track.now, to_tip=at.of_tip)
            track.vector = track.vector if at.of_tip else None
        self.turned_local = at.to_local(track.now)
        self._count_length()

    def _reduce(self, letters: str) -> None:
        """Count axes from below a turn on (M94); nothing moves (TNC 640, 34059x-01, 11.4)."""
        for column in (self.columns[letter] for letter in letters if letter in self.columns):
            if (now := self.track.now[column]) is not None and column in self.track.rotary:
                at = self.coordinates
                at.shift(column, now, math.fmod(now - at.offsets[column], 360.0))

    def _with_table(self, block: Block) -> Block:
        """Return a block of G254 with its frame: X, Y, Z along the machine's axes, the zero on the table.

        The zero stays on the workpiece while the table is turned; rotary axes must not turn meanwhile (Haas,
        Mill Operator's Manual, G254 Dynamic Work Offset, DWO).
        """
        at, track, [word] = self.coordinates, self.track, [*TABLE_ZERO_WORDS.intersection(block.g), ""][:1]
        if not word:
            return block
        self.table_line, rotation = 0, np.eye(3)
        if word == "G254":
            heads = [i for i in track.rotary if track.machine.letters[i] not in track.machine.code.table]
            if self.stand_in or at.of_tip or any(at.plane.origin) or any(track.now[i] for i in heads):
                raise BlockError(
                    "G254 without the machine, with its head tilted, under G52 or TCP isn't supported"
                )
            if any(track.now[i] is None for i in track.rotary):
                raise BlockError("G254 before the rotary axes are known; write them before")
            values = [v if i in track.rotary else 0.0 for i, v in enumerate(track.now)]
            poses = link_poses(track.machine, axis_values(track.machine, values, Counting.AXES))
            rotation = poses[BED][0, :3, :3]
            self.table_line = block.line
        return block._replace(frame=Plane(rotation=rotation).by(word))

    def _changes_zero(self) -> bool:
        """Check whether another zero comes into force whose distance from the one before isn't known."""
        before, self.zero_word = self.zero_word, self.modes.technology.now.work_offset or DEFAULT_OFFSET
        knows = self.coordinates.work_offsets.knows
        if self.zero_word == before or (knows(before) and knows(self.zero_word)):
            return False
        if self.modes.units.used_line is None:
            return False
        if any(self.track.now[i] is not None for i in self.track.rotary):
            self.note(
                Severity.WARNING,
                "zero-assumed",
                f"{self.zero_word} after {before}: their distance isn't in the program; angles are taken to "
                "have the same zero in both, write them again if not",
            )
        return True

    def _switch_wrapping(self, block: Block) -> None:
        """Apply M126 and M127; which axes wrap at 360 deg is set at the control, not in the program."""
        self.wrapped = self.wrapping.columns if block.shorter else ()
        if block.shorter and not self.wrapped:
            self.note(
                Severity.NOTE,
                "angles-as-written",
                "M126 makes rotary axes that wrap at 360 deg take the shorter direction; angles are read as "
                "written, set wrap=shorter if the axes wrap",
            )

    def _count_length(self) -> None:
        modes = self.modes
        if self.coordinates.of_tip:
            self.track.counting = int(Counting.TIP)
        else:
            self.track.counting = int(Counting.COMPENSATED if modes.compensated else Counting.AXES)
        self.track.counted = self.feed_meaning.counted(modes.units.now, of_tip=self.coordinates.of_tip)

    def _note_feed_words(self, block: Block) -> None:
        """Apply words that set what F counts; what one of them makes unknown is reported."""
        for word in (*block.stated, *block.ignored):
            if self.feed_meaning.take(word, MILLIMETRES[self.modes.units.now]):
                why = f"F isn't known from here on: {self.feed_meaning.unknown}; post it as the tip's"
                self.note(Severity.WARNING, "feed-meaning", why)

    def _is_arc(self, block: Block) -> bool:
        """Check whether a block without axis words is an arc: a full circle."""
        arcs = self.modes.motion in ("G2", "G3")
        return arcs and (block.centre is not None or not block.words.keys().isdisjoint("IJKR"))

    def _is_axis(self, letter: str, block: Block) -> bool:
        """Check whether a letter is an axis; raise if it doesn't belong to anything in its block."""
        if letter in self.columns:
            return True
        if letter == "F" or letter in COUNTED:
            return False
        home = "G28" in block.g or "G30" in block.g
        turns = "" if self.modes.control is None else self.modes.control.arc_turns
        if letter in f"IJKR{turns}" and self.modes.motion in ("G2", "G3") and not home:
            return False
        if letter in "IJK" and self._has_vectors and not home:
            return False
        acting = (*block.g, *block.m, self.modes.motion if self.modes.motion in CYCLES else "")
        if any(letter in PARAMETERS.get(word, "") for word in acting):
            return False
        raise unknown_word(self.track.machine, letter, block, stand_in=self.stand_in)

    def _count(self, block: Block) -> None:
        if "O" in block.words and self.ignored["O"]:
            raise BlockError("a second program begins; split the file")
        if block.m or block.ignored:
            self.functions.take(block)
        switches = block.tip_control is not None
        counted = [word for word in block.g if word in HARMLESS]
        counted += [word for word in block.m if word not in END and not switches]
        counted += [letter for letter in block.words if letter in COUNTED]
        self.ignored.update((*counted, *block.ignored))

    def _shift(self, axes: list[str], block: Block) -> None:
        """Shift axes (G92), or cancel the shifts; nothing moves."""
        at, track = self.coordinates, self.track
        if any(word in MOTION for word in block.g):
            raise BlockError("G92 together with a move isn't supported; write it in its own block")
        if "G92" not in block.g:
            if any(at.plane.origin):
                raise BlockError("G92.1 cancels G52 on LinuxCNC alone; write G52 X0 Y0 Z0 before")
            at.shifts = [0.0] * len(at.machine.axes)
            at.update()
            self.turned_local = at.to_local(track.now)
            return
        if not axes or (at.of_tip and any(self.columns[letter] not in track.rotary for letter in axes)):
            raise BlockError(
                "G92 shifts named axes, X, Y, Z outside of TCP and tilted planes; post without it"
            )
        for letter in axes:
            column = self.columns[letter]
            now = track.now[column]
            if now is None:
                raise BlockError(f"G92 shifts {letter}, whose position isn't in the program yet; set start")
            scale = 1.0 if column in track.rotary else MILLIMETRES[self.modes.units.now]
            at.shift(column, now, block.words[letter] * scale)
        self.turned_local = at.to_local(track.now)

    def _enter_data(self, axes: list[str], block: Block) -> None:
        """Check data for the control's tables (G10): lengths of tools don't matter here, work offsets do.

        `BlockError` for a work offset other than the caller's, and for any other table.
        """
        table, number = block.words.get("L"), block.words.get("P")
        if table in TOOL_TABLES:
            self.ignored["G10"] += 1
            return
        offset = G10_OFFSETS.get(number) if table == 2.0 and number is not None else None
        if offset is None or self.modes.incremental or "R" in block.words:
            raise BlockError(
                f"G10{_shown(block.words, 'LP')} changes the control's data in a way that isn't supported; "
                "write G90 G10 L2 P1 to P6 with X, Y, Z and angles, or set the data at the control"
            )
        scale = MILLIMETRES[self.modes.units.now]
        zero = self.coordinates.work_offsets.of(offset) or [0.0] * len(self.columns)
        for letter in axes:
            column = self.columns[letter]
            value = block.words[letter] * (1.0 if column in self.track.rotary else scale)
            if abs(value - zero[column]) > SAME_ZERO:
                given = ",".join(f"{offset}{c}{block.words[c]:g}" for c in axes)
                raise BlockError(
                    f"G10 puts the zero of {offset} at {letter}{block.words[letter]:g} of the machine, and "
                    f"it is taken to be at {zero[column]:g}; set zero (--zero {given}, in mm "
                    "and deg)"
                )
        self.ignored["G10"] += 1

    def _dwell(self, block: Block) -> None:
        others = [c for c in block.words if c in self.columns or c in "IJKR"]
        time = block.words.get("P")
        if time is None or others:
            raise BlockError("G4 takes P in seconds, in a block without moves; write it like that")
        if time < 0.0:
            raise BlockError(f"G4 P{time:g}: a dwell can't be negative; correct it")
        if self.feed_meaning.dwell != 1.0 and _WHOLE_DWELL.search(self.source.lines[block.line - 1].upper()):
            time *= self.feed_meaning.dwell
        if time > LONGEST_DWELL:
            self.note(
                Severity.WARNING,
                "long-dwell",
                f"G4 P{time:g} is taken as seconds; if it is in ms, write seconds",
            )
        in_cut = bool(self.track.rows) and self.track.rows.last_kind == CUT
        if in_cut and LONGEST_IN_CUT < time <= LONGEST_DWELL:
            self.note(
                Severity.WARNING,
                "dwell-in-cut",
                f"G4 of {time:g} s where a feed move has ended, above {LONGEST_IN_CUT:g} s: the tool may rub "
                "in the material; retract before, or write a shorter one (P without a decimal point is in "
                "ms on Fanuc and Haas, in s on LinuxCNC)",
            )
        if None in self.track.now:
            self.ignored["G4 at an unknown position"] += 1
        else:
            self._begin()
            kind = self.track.rows.last_kind
            self.track.add(self.track.now, self.line, kind, time)
