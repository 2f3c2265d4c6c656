"""What a program puts in force besides positions: spindle, tools, offsets, coolant, order of the approach."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.nc.control.words_in_force import group_of, in_force_after, words_beside
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.choice import ISO, SINUMERIK, Language, find_language
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.own_header import stated_control
from fiveaxis.nc.source import Source

# M word -> direction of the spindle; it stands once it is oriented, until it is switched on again.
SENSES = {
    **dict.fromkeys(("M3", "M13"), 1.0),
    **dict.fromkeys(("M4", "M14"), -1.0),
    **dict.fromkeys(("M5", "M19", "SPOS", "SPOSA"), 0.0),
}
# M word -> the word of the coolant that it switches on; M88 and M89 are Haas's through the spindle.
COOLANT = {"M7": "M7", "M8": "M8", "M13": "M8", "M14": "M8", "M88": "M88", "M9": "", "M89": ""}
CLAMPS = ("M13", "M14")
# They take effect after the block's move.
AFTER_MOVE = frozenset(("M5", "M9", "M89"))
# Words that load the selected tool, in any language.
CHANGES = ("M6", "TOOL CALL")
# Words that end the program: M99 and M17 end a subprogram; M99 restarts a main one, with the same moves.
END = ("M2", "M30", "M99", "M17")
# Switches the tool's length off: on some controls Z moves by it (`Mode.off_clear`).
LENGTH_OFF = "G49"
_JOINING = frozenset((*CHANGES, *END))
# Length offset of whatever tool is in the spindle: G43 without H, as LinuxCNC reads it.
OF_TOOL = "of the loaded tool"
LENGTH_ON = ("G43", "G43.4", "G43.5", "G234")
WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
# With the number in a word: G54.1 P3 or G54 P3 (Fanuc), G154 P3 (Haas), G15 H3 (Okuma).
NUMBERED_OFFSETS = {"G54.1": "P", "G54": "P", "G154": "P", "G15": "H"}
# In force where a program selects none.
DEFAULT_OFFSET = "G54"
_NOT_IN_PROGRAM = frozenset(("G53", "G28", "G30"))
# Words whose axis words aren't where the tool goes on the workpiece.
_ELSEWHERE = _NOT_IN_PROGRAM | {"G92", "G10"}
# Moves to points of the machine that the program doesn't give: their words are left out by the reader.
_FIXED_POINTS = frozenset(("G74", "G75", "M92", "M140", "MB"))
# mm: length of a word, by the words of the unit.
_UNITS = {"G20": 25.4, "G70": 25.4, "G21": 1.0, "G71": 1.0}
# Words whose effect is read here.
_FOLLOWED = frozenset((*SENSES, *COOLANT, *CHANGES))
_FEEDS = frozenset(("G1", "G2", "G3"))
FEED_MODES = ("G93", "G94", "G95")
_LETTERS = frozenset("STHD")
_AXES = frozenset("XYZABC")


class Technology(NamedTuple):
    """What is in force in a move.

    Parameters
    ----------
    speed : S, rev/min; None before the first
    sense : of the spindle: 1 for M3, -1 for M4, 0 if it stands
    tool : number or name of the tool, as after T or TOOL CALL; empty before the first
    loaded : tools loaded so far (M6, TOOL CALL)
    length : number of the length offset (H, or D on Sinumerik), `OF_TOOL`, or empty if none is in force
    work_offset : as written (``G54``, ``G54.1 P3``, ``G505``, ``3`` for preset 3); empty if none was selected
    coolant : M word that switched it on; empty if it is off
    feed_mode : G93, G94 or G95
    words : what else is in force, as written: smoothing, tolerances, overrides, data that was written
    """

    speed: float | None = None
    sense: float = 0.0
    tool: str = ""
    loaded: int = 0
    length: str = ""
    work_offset: str = ""
    coolant: str = ""
    feed_mode: str = "G94"
    words: tuple[str, ...] = ()

    @property
    def spindle(self) -> float:
        """Signed speed, rev/min; 0 if it stands, NaN if the program doesn't state the speed."""
        if not self.sense:
            return 0.0
        return float("nan") if self.speed is None else self.sense * self.speed


class MachineMove(NamedTuple):
    """A move in machine coordinates, or to a reference or fixed point of the machine.

    Parameters
    ----------
    line, step : of the program, and its place in the order in which lines run
    word : G53 (also of SUPA and M91), G28 and so on
    axes : letters that it names; empty where the machine alone knows what moves
    height : mm, of Z in machine coordinates; None where Z doesn't move there, or nobody knows how far
    """

    line: int
    step: int
    word: str
    axes: str
    height: float | None = None


class Join(NamedTuple):
    """A line at which more happens than the rows show: a tool change, a machine move, the program's end.

    Parameters
    ----------
    line, step : as of `MachineMove`
    word : M6, TOOL CALL, M30, G49 and so on, or that of a machine move
    axes : letters that a machine move names
    moves : whether it is a machine move
    tcp : whether TCP is on
    of_tip : whether machine coordinates are the tip's there, as on LinuxCNC under M428
    """

    line: int
    step: int
    word: str
    axes: str
    moves: bool
    tcp: bool
    of_tip: bool = False


@dataclass(frozen=True, eq=False)
class TechnologyTrack:
    """What is in force, move by move.

    Parameters
    ----------
    language : of the program; empty for a table
    states : the different states
    state : (n,), which one is in force in the move to a row
    steps : (n,), of the program's lines, in the order in which they run
    machine_moves : moves in machine coordinates, in order
    joins : tool changes, moves in machine coordinates, G49 and the end, in order
    placed : steps of those moves whose ends are among the rows, because the zero is known
    once : steps, lines and words that act once, where they stand: stops, unknown M words
    unapproached : steps of machine moves after which the program feeds before it has positioned their axes
    late_axes : letters that the approach positions only once Z is down, with the line of the first; empty if
        Z comes down last
    late_line : that line; 0 for none
    diagonals : lines on which the approach moves Z together with X or Y
    cancelled : modes that are switched off before the first move, with the line
    ended : modes that are switched off after it, with the last step that does
    control : that the header of a program by this package names; empty in others
    """

    language: str
    states: tuple[Technology, ...]
    state: IntArray
    steps: IntArray
    machine_moves: tuple[MachineMove, ...] = ()
    joins: tuple[Join, ...] = ()
    placed: frozenset[int] = frozenset()
    once: tuple[tuple[int, int, str], ...] = ()
    unapproached: frozenset[int] = frozenset()
    late_axes: str = ""
    late_line: int = 0
    diagonals: tuple[int, ...] = ()
    cancelled: Mapping[str, int] = field(default_factory=dict)
    ended: Mapping[str, int] = field(default_factory=dict)
    control: str = ""

    @property
    def spindle(self) -> Array:
        """Signed speed, (n,) rev/min, as `Technology.spindle`."""
        return np.array([state.spindle for state in self.states])[self.state]

    def at(self, rows: IntArray) -> TechnologyTrack:
        """Return the track of some rows."""
        return replace(self, state=self.state[rows], steps=self.steps[rows])


@dataclass
class TechnologyReader:
    """Follows blocks, and records each change.

    T selects a tool and M6 loads it. In a program without M6, as for turrets and some Sinumerik machines, T
    changes the tool. TOOL CALL does both.

    Parameters
    ----------
    language : whose D (Sinumerik), or else H, is the tool's length offset
    accepted : M words that the caller takes for harmless
    placed : steps of moves in machine coordinates whose ends are among the rows, as their interpreter knows
    steps : of the changes
    selections : names of selected tools
    cancelled, ended, control : as of `TechnologyTrack`
    """

    language: Language = ISO
    accepted: Collection[str] = ()
    control: str = ""
    now: Technology = field(default_factory=Technology)
    steps: list[int] = field(default_factory=list)
    states: list[Technology] = field(default_factory=list)
    machine_moves: list[MachineMove] = field(default_factory=list)
    joins: list[Join] = field(default_factory=list)
    placed: set[int] = field(default_factory=set)
    once: list[tuple[int, int, str]] = field(default_factory=list)
    selections: list[str] = field(default_factory=list)
    cancelled: dict[str, int] = field(default_factory=dict)
    ended: dict[str, int] = field(default_factory=dict)
    cuts: bool = False
    tcp: bool = False
    _scale: float = 1.0
    _incremental: bool = False
    _moved: bool = False
    _rapid: bool = False
    _kinematics: bool = False
    _down: int = 0
    _diagonals: list[int] = field(default_factory=list)
    _others: dict[str, tuple[int, int]] = field(default_factory=dict)
    _at_machine: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, source: Source, accepted: Collection[str] = ()) -> TechnologyReader:
        """Make the reader for a program."""
        return cls(find_language(source), accepted, stated_control(source)[0])

    def take(self, block: Block) -> None:
        """Read a block."""
        if not self.cuts:
            self._follow_approach(block)
        if block.tip_control is not None:
            self.tcp = block.tip_control
            self._kinematics = "M428" in block.m
        off, at = (self.ended, block.step or block.line) if self._moved else (self.cancelled, block.line)
        off.update(dict.fromkeys(block.cancels, at))
        if not self._moved:
            on_work = _ELSEWHERE.isdisjoint(block.g) and block.frame is None
            self._moved = on_work and not _AXES.isdisjoint(block.words)
        if not (block.m or block.ignored or block.stated or block.g or block.tool) and _LETTERS.isdisjoint(
            block.words
        ):
            return
        self._take_machine_moves(block)
        words = (*block.m, *block.ignored)
        change = self._of_tool(block, words) | self._of_offsets(block) | self._of_words(block)
        if modes := [word for word in block.g if word in FEED_MODES]:
            change["feed_mode"] = modes[-1]
        if "S" in block.words:
            change["speed"] = block.words["S"]
        later: dict[str, Any] = {}
        # Without a speed to turn at, M13 and M14 are those of a clamp, as on Haas.
        stands = self.now.speed is None and "S" not in block.words
        for word in words:
            if stands and word in CLAMPS:
                continue
            target = later if word in AFTER_MOVE else change
            if word in SENSES:
                target["sense"] = SENSES[word]
            if word in COOLANT:
                target["coolant"] = COOLANT[word]
        step = block.step or block.line
        joining = [word for word in words if word in _JOINING]
        joining += [LENGTH_OFF] if LENGTH_OFF in block.g and "Z" not in block.words else []
        self.joins += [Join(block.line, step, word, "", False, self.tcp) for word in joining]
        self._record(step, change)
        self._record(step + 1, later)

    def take_run(self, run: Run) -> None:
        """Read a run of plain blocks, which only show the order of the approach."""
        for block in run.blocks():
            if self.cuts:
                return
            self.take(block)

    def _take_machine_moves(self, block: Block) -> None:
        for word in block.g:
            self._scale = _UNITS.get(word, self._scale)
            self._incremental = word == "G91" or (self._incremental and word != "G90")
        axes, step = "".join(c for c in "XYZABC" if c in block.words), block.step or block.line
        for word in block.g:
            # G53 alone doesn't move; G28 alone moves all axes on LinuxCNC.
            if word in _NOT_IN_PROGRAM and (axes or word != "G53"):
                known = word == "G53" and "Z" in axes and not (self._incremental or block.increments)
                height = block.words["Z"] * self._scale if known else None
                self._move_by_machine(MachineMove(block.line, step, word, axes, height))
        for word in (w for w in block.ignored if w in _FIXED_POINTS):
            self._move_by_machine(MachineMove(block.line, step, word, ""))

    def _move_by_machine(self, move: MachineMove) -> None:
        self.machine_moves.append(move)
        of_tip = self.tcp and self._kinematics
        self.joins.append(Join(move.line, move.step, move.word, move.axes, True, self.tcp, of_tip))
        if not self.cuts:
            # Z may come down at feed from a retract, but not go back to one once it is down.
            axes = (c for c in move.axes or "XY" if c != "Z" or self._down)
            self._at_machine |= dict.fromkeys(axes, move.step)

    def _of_words(self, block: Block) -> dict[str, Any]:
        words = self.now.words
        for word in words_beside(block, _FOLLOWED):
            group = group_of(word)
            if group is not None:
                words = in_force_after(words, word, group)
            elif word not in self.accepted:
                self.once.append((block.step or block.line, block.line, word))
        return {} if words == self.now.words else {"words": words}

    def _of_tool(self, block: Block, words: Collection[str]) -> dict[str, Any]:
        name = block.tool or (f"T{block.words['T']:g}" if "T" in block.words else None)
        if name is not None:
            self.selections.append(name)
        latest = self.selections[-1] if self.selections else None
        loads = any(word in words for word in CHANGES)
        if block.tool and "T" in block.words:
            # T1 T2 M6 loads the first, and the second waits for the next change.
            self.selections.append(f"T{block.words['T']:g}")
        if loads:
            return {"tool": _tool_number(latest), "loaded": self.now.loaded + 1}
        # Without a change the next tool is only made ready; where no change is ever written, T loads it.
        return {} if name is None or self.now.loaded else {"tool": _tool_number(name)}

    def _of_offsets(self, block: Block) -> dict[str, Any]:
        change: dict[str, Any] = {}
        letter = "D" if self.language is SINUMERIK else "H"
        if letter in block.words and "G15" not in block.g:
            number = f"{block.words[letter]:g}"
            change["length"] = "" if number == "0" else number
        elif any(word in LENGTH_ON for word in block.g):
            change["length"] = OF_TOOL
        if "G49" in block.g:
            change["length"] = ""
        for word in block.g:
            if (offset := selected_offset(word, block)) is not None:
                change["work_offset"] = offset
        if block.work_offset:
            change["work_offset"] = block.work_offset
        return change

    def _record(self, step: int, change: dict[str, Any]) -> None:
        new = self.now._replace(**change) if change else self.now
        if new != self.now:
            self.now = new
            self.steps.append(step)
            self.states.append(new)

    def _follow_approach(self, block: Block) -> None:
        """Record in which order the approach positions the axes, up to the first feed move."""
        for word in block.g:
            self._rapid = word == "G0" or (self._rapid and word not in _FEEDS)
            self.cuts = self.cuts or word in _FEEDS
        if self.cuts or not self._rapid or not _ELSEWHERE.isdisjoint(block.g):
            return
        if "Z" in block.words and not {"X", "Y"}.isdisjoint(block.words):
            self._diagonals.append(block.line)
        for letter in (c for c in "XYZABC" if c in block.words):
            self._at_machine.pop(letter, None)
            if letter == "Z":
                self._down = block.step or block.line
            else:
                self._others.setdefault(letter, (block.step or block.line, block.line))

    def track(self, steps: IntArray) -> TechnologyTrack:
        """Return what is in force at steps, (n,), of the moves."""
        state = np.searchsorted(self.steps, steps, side="right")
        late = {c: at for c, at in self._others.items() if 0 < self._down < at[0]}
        _, first = min(late.values(), default=(0, 0))
        states = Technology(), *self.states
        return TechnologyTrack(
            language=self.language.name,
            states=states,
            state=state,
            steps=steps,
            machine_moves=tuple(self.machine_moves),
            joins=tuple(self.joins),
            placed=frozenset(self.placed),
            once=tuple(self.once),
            unapproached=frozenset(self._at_machine.values()) if self.cuts else frozenset(),
            late_axes="".join(sorted(late)),
            late_line=first,
            diagonals=tuple(self._diagonals),
            cancelled=self.cancelled,
            ended=self.ended,
            control=self.control,
        )


def selected_offset(word: str, block: Block) -> str | None:
    """Return the work offset that a G word selects in its block, ``G54.1 P3``; None if it selects none."""
    letter = NUMBERED_OFFSETS.get(word, "")
    # P of G64 is its tolerance.
    if letter in block.words and not (letter == "P" and "G64" in block.g):
        word = "G54.1" if word == "G54" else word
        return f"{word} {letter}{block.words[letter]:g}"
    if word in ("G54.1", "G154"):
        return f"{word} P1"
    return word if word in WORK_OFFSETS else None


def _tool_number(written: str | None) -> str:
    """Return the number or name of a tool; empty if none is known."""
    return (written or "").removeprefix("TOOL CALL").removeprefix("T").strip(' ="')


def read_technology(source: Source) -> TechnologyReader:
    """Read what a whole program puts in force."""
    reader = TechnologyReader.of(source)
    for block in reader.language.split(source):
        reader.take(block) if isinstance(block, Block) else reader.take_run(block)
    return reader
