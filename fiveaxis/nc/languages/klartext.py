"""Heidenhain Klartext programs as blocks of ISO words: L, LN, circles, M128, PLANE, datum shifts.

Supported: straight lines ``L`` with axes and ``LN`` with vectors, poles and circles ``CC C CR``, polar ``LP``
and ``CP``, increments, Q parameters with simple arithmetic, M128 and FUNCTION TCPM, datum shifts (cycle 7,
TRANS DATUM), presets, cycle 10, PLANE with spatial angles, Euler angles or vectors, drilling cycles, CALL LBL
with and without REP, CALL PGM of a file beside the program. Lines without effect on the path
are listed in `Block.ignored`; anything else is refused with its line. After the *User's Manual Klartext
Programming* of the TNC 640 (Heidenhain 892903-29).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, product
from fiveaxis.nc.languages.block import NUMBER, Block, BlockError, require_short, strip_comment
from fiveaxis.nc.languages.klartext_cycles import Cycle, require_drill
from fiveaxis.nc.languages.klartext_move import MOVES, Move
from fiveaxis.nc.languages.klartext_state import (
    END_M,
    IGNORED_CYCLES,
    IGNORED_LINES,
    INCH_FEED,
    VALUE,
    Line,
    State,
    refusal,
)
from fiveaxis.nc.languages.planes import turns
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Reader, Run
from fiveaxis.nc.source import Source

_PARAMETER = re.compile(r"(?:FN ?([0-7]) ?: ?)?(Q[LR]?[0-9]+) ?= ?(.+)")
_ANGLE = re.compile(rf"(SP[ABC]|EUL(?:PR|NU|ROT)|[BN][XYZ]) ?({VALUE})")
_CYCLE = re.compile(r"CYCL DEF ([0-9]{1,4})(?:\.([0-9]+))?(?![0-9])\s*(.*)")
_TOOL = re.compile(r"TOOL CALL(?: (TEXT|Q[LRS]?[0-9]+|[0-9]+(?:\.[0-9]+)?))?(?: ([UVWXYZ])(?![0-9+.-]))?")
_DELTA = re.compile(rf"(?<![A-Z])(DL|DR2?) ?[=:]? ?({VALUE})")
_TOOL_FEED = re.compile(rf"\bF ?({VALUE})")
_TOOL_SPEED = re.compile(rf"\bS ?({VALUE})")
_TEXT = re.compile(r'"[^"]*"')
_ENDS = frozenset(f"M{number}" for number in END_M)
_NAME = r'0*([1-9][0-9]*|"[^"]+")'
_LABEL = re.compile(rf"\s*(?:[0-9]+\s+)?LBL {_NAME}")
_CALL_LABEL = re.compile(rf"CALL LBL {_NAME}(?: REP ?([0-9]{{1,5}})(?:/[0-9]+)?)?")
# Folders of the control are beside the point: the file is looked for beside the program.
_CALL_PROGRAM = re.compile(r'CALL PGM "?(?:[^"]*[\\/:])?([^"\\/:]+)"?')
_CYCLE_CALL = re.compile(r"CYCL CALL(?! PAT)(?: (POS)(?= ))? ?")
_AT_ZERO = re.compile(r"(X ?[^IZ]+Y ?[^IZ]+)Z ?[+-]?0+(?:\.0*)?(?![0-9.])(.*)")
_SIMPLIFIED = (
    "drilling cycles are read as one move down and one back; pecks, dwells at the top and the disengagement "
    "in boring are left out"
)
_LAST_NUMBER = re.compile(rf"({VALUE})\s*$")


class SetUp(Line):
    """A block without moves."""

    def read(self) -> bool:
        """Read the block; return whether it is a set-up block."""
        for begin, reader in (
            ("BEGIN PGM", self._begin),
            ("END PGM", lambda: self.draft.m.append("M30")),
            ("TOOL CALL", self._call_tool),
            ("FUNCTION TCPM", self._switch_tcp_on),
            ("FUNCTION RESET TCPM", self._switch_tcp_off),
            ("PLANE", self._tilt),
            ("TRANS DATUM", self._trans_datum),
            ("CYCL DEF", self._cycle),
        ):
            if self.code.startswith(begin):
                reader()
                return True
        parameter = _PARAMETER.fullmatch(self.code)
        if parameter is not None:
            self._set_parameter(parameter[1], parameter[2], parameter[3])
        return parameter is not None

    def _set_parameter(self, function: str | None, name: str, text: str) -> None:
        """Read ``Q1 = …`` and the functions 0 to 7, in which DIV means /."""
        if self.state.cycle is not None and name in self.state.cycle.values:
            raise BlockError(f"{name} belongs to the cycle in force; write its value in CYCL DEF")
        self.state.parameters[name] = value = self.value(text.replace("DIV", "/"))
        self.draft.stated.append(f"variable {name}={value:g}")
        self.draft.ignored.append("=" if function is None else f"FN {function}")

    def _begin(self) -> None:
        unit = self.code.split()[-1]
        if unit not in ("MM", "INCH"):
            raise BlockError("BEGIN PGM must end with the unit, MM or INCH; write it")
        if self.state.unit:
            raise BlockError("a second program begins; split the file")
        self.state.unit = unit
        self.draft.g.append("G21" if unit == "MM" else "G20")
        if unit == "INCH":
            self.draft.feed_step = INCH_FEED
            self.draft.note(
                Severity.NOTE,
                "feed-unit-assumed",
                f"F is in units of {INCH_FEED:g} inch/min, as in all inch programs of these controls: F100 "
                "is 10 inch/min; check it if the post-processor wrote inch/min",
            )

    def _call_tool(self) -> None:
        code = _TEXT.sub("TEXT", self.code)
        found = _TOOL.match(code)
        if found is not None and found[2] not in (None, "Z"):
            raise BlockError(f"a tool along {found[2]} isn't supported; post for a tool along Z")
        for key, value in _DELTA.findall(code):
            if self.value(value) != 0.0:
                raise BlockError(
                    f"{key}{value} changes the tool that the program was posted for, which isn't supported; "
                    "post without it, for the actual tool"
                )
        feed = _TOOL_FEED.search(code)
        if feed is not None:
            self.state.tool_feed = self.value(feed[1])
        speed = _TOOL_SPEED.search(code)
        if speed is not None:
            self.draft.words["S"] = self.state.speed = self.value(speed[1])
        if found is None or found[1] is None:
            self.draft.ignored.append("TOOL CALL without a tool")  # another speed or feed
            return
        text = _TEXT.search(self.code)
        self.draft.tool = f"TOOL CALL {text[0] if text is not None and found[1] == 'TEXT' else found[1]}"
        self.draft.ignored.append("TOOL CALL")

    def _switch_tcp_on(self) -> None:
        words = self.code.split()
        if "REFPNT" in words and words[words.index("REFPNT") + 1 :][:1] != ["TIP-TIP"]:
            raise BlockError("only REFPNT TIP-TIP is supported, positions of the tool tip; post with it")
        self.switch_tcp(on=True)
        self.draft.stated.append(self.code)
        if "SPAT" in words or "SPATIAL" in words:
            self.state.spatial = {}

    def _switch_tcp_off(self) -> None:
        self.switch_tcp(on=False)
        self.draft.stated.append(self.code)

    # Planes and shifts

    def _tilt(self) -> None:
        """Read PLANE; with MOVE and TURN the control turns its axes into the plane, with STAY it doesn't."""
        state, draft, words = self.state, self.draft, self.code.split()
        kind = words[1] if len(words) > 1 else ""
        draft.ignored.append(f"PLANE {kind}")
        if kind == "RESET":
            draft.cancels.append("tilted plane (PLANE, cycle 19)")
            state.tilt_plane(np.eye(3))
            draft.tip_control = state.tip_control
        else:
            angles = {key: self.value(value) for key, value in _ANGLE.findall(self.code)}
            state.tilt_plane(self._rotation(kind, angles))
        draft.frame = state.frame(f"PLANE {kind}")
        if ("MOVE" in words or "TURN" in words) and (kind != "RESET" or state.positioned):
            self.turn_into_plane(f"PLANE {kind}", follows="MOVE" in words)

    def _rotation(self, kind: str, angles: dict[str, float]) -> Array:
        def need(*keys: str) -> list[float]:
            missing = [key for key in keys if key not in angles]
            if missing:
                raise BlockError(f"PLANE {kind} needs {', '.join(missing)}; write it")
            return [angles[key] for key in keys]

        if kind == "SPATIAL":
            # About fixed X, Y, Z, which equals about Z, Y', X''.
            return turns("ZYX", need("SPA", "SPB", "SPC")[::-1])
        if kind == "EULER":
            return turns("ZXZ", need("EULPR", "EULNU", "EULROT"))
        if kind == "RELATIV" and len(angles) == 1:
            [(key, angle)] = angles.items()
            return product(self.state.tilt, turns("XYZ"["ABC".index(key[-1])], [angle]))
        if kind == "VECTOR":
            return self._rotation_of(need("BX", "BY", "BZ"), need("NX", "NY", "NZ"))
        raise BlockError(refusal("PLANE"))

    def _rotation_of(self, base: list[float], normal: list[float]) -> Array:
        """Return the rotation of Z into the normal, and of X into the base vector's part across it."""
        z = np.array(normal)
        x = np.array(base)
        z = z / (np.linalg.norm(z, axis=-1) or 1.0)
        x = x - product(x, z) * z
        if not z.any() or np.linalg.norm(x, axis=-1) < 1e-9:
            raise BlockError("PLANE VECTOR needs a base vector across its normal; correct them")
        x = x / np.linalg.norm(x, axis=-1)
        return np.column_stack([x, np.cross(z, x), z])

    def _trans_datum(self) -> None:
        words = self.code.split()
        if words[2:3] == ["RESET"]:
            self._shift({"X": 0.0, "Y": 0.0, "Z": 0.0}, "")
        elif words[2:3] == ["AXIS"]:
            self._read_shift(self.code.partition("AXIS")[2])
        else:
            raise BlockError(refusal("TRANS DATUM"))
        self.draft.ignored.append("TRANS DATUM")

    def _read_shift(self, text: str) -> None:
        words, increments = self.axes_of(text)
        if not set(words) <= set("XYZ"):
            raise BlockError("a datum shift is supported for X, Y and Z; post without other axes")
        self._shift(words, increments)

    def _shift(self, words: dict[str, float], increments: str) -> None:
        if self.state.from_table:
            if set(words) != set("XYZ") or increments:
                raise BlockError(
                    "a datum shift from a table is replaced in some axes, and the values of the others are "
                    "only in the table; write all of X, Y and Z"
                )
            self.state.from_table, self.draft.work_offset = False, self.state.preset
        self.state.shift_datum(words, increments)
        if self.state.at_datum == set("XYZ"):
            self.draft.cancels.append("datum shift (cycle 7, TRANS DATUM)")
        self.draft.frame = self.state.frame("datum shift")

    def _cycle(self) -> None:
        """Read a line of a cycle definition: a shift, a rotation, a dwell, or nothing that moves."""
        found = _CYCLE.match(self.code)
        if found is None:
            raise BlockError("CYCL DEF must be followed by a number; write it")
        number, part, rest = int(found[1]), int(found[2] or 0), found[3]
        self.draft.ignored.append(f"CYCL DEF {number}")
        if number == 247:
            self._select_preset(rest.partition("Q339")[2].strip(" =~+") or rest)
        elif number in IGNORED_CYCLES:
            self.draft.stated.append(self.code)
            self.draft.cancels += ["tolerance (cycle 32)"] if (number, part) == (32, 1) else []
        elif number not in (7, 8, 9, 10, 11, 19):
            require_drill(number)
            self.state.drilling = False
            self.state.cycle = Cycle.read(number, rest, self.value, self.state.tool_feed)
        elif part > 0:
            self._cycle_part(number, rest)

    def _select_preset(self, name: str) -> None:
        """Read cycle 247, which resets shift and rotation; only the control knows where presets are."""
        state = self.state
        if state.is_tilted:
            raise BlockError("a preset while the plane is tilted; write PLANE RESET before")
        state.datum, state.shift, state.spin, state.from_table = np.zeros(3), np.zeros(3), 0.0, False
        state.preset = self.draft.work_offset = name
        self.draft.frame = state.frame("CYCL DEF 247")

    def _cycle_part(self, number: int, rest: str) -> None:
        state = self.state
        if number == 7 and rest.startswith("#"):
            if state.is_tilted:
                raise BlockError("a datum from a table in a tilted plane isn't supported; write PLANE RESET")
            state.datum, state.from_table, state.at_datum = np.zeros(3), True, set()
            self.draft.work_offset = f"{state.preset} {rest}".strip()
            self.draft.frame = state.frame("datum shift")
        elif number == 7:
            self._read_shift(rest)
        elif number == 9:
            self.draft.g.append("G4")
            self.draft.words["P"] = self._last_number(rest)
        elif number == 10:
            angle = self._last_number(rest.replace("ROT", " "))
            state.spin = angle + (state.spin if rest.startswith("IROT") else 0.0)
            self.draft.frame = state.frame("cycle 10")
            self.draft.cancels += [] if state.spin else ["rotation (cycle 10)"]
        elif number == 19:
            if any(self.axes_of(rest)[0].values()):
                raise BlockError("cycle 19 angles depend on the machine; write PLANE SPATIAL")
            state.tilt_plane(np.eye(3))
            self.draft.frame = state.frame("cycle 19")
        elif rest and not (number == 11 and self._last_number(rest.replace("SCL", " ")) == 1.0):
            raise BlockError(f"cycle {number} mirrors or scales, which isn't supported; post without it")
        else:
            self.draft.cancels.append(f"{'scaling' if number == 11 else 'mirror'} (cycle {number})")

    def _last_number(self, text: str) -> float:
        found = _LAST_NUMBER.search(text)
        if found is None:
            raise BlockError("a number is missing at the end; write it")
        return self.value(found[1])


_BEGIN, _WORDS = r"[ \t]*+(?:[0-9]++[ \t]++)?+LN?+[ \t]++", rf"[XYZABC]{NUMBER}(?:[ \t]++[XYZABCF]{NUMBER})*+"
# A normal alone may be the tool direction, too: such lines aren't plain.
_POINTING = rf"(?:[ \t]++N[XYZ]{NUMBER})*+(?:[ \t]++T[XYZ]{NUMBER})++(?:[ \t]++F{NUMBER})?+"
_G1 = re.compile(r"^[ \t]*(?:[0-9]+[ \t]+)?LN?", re.MULTILINE)
_NUMBERED = re.compile(r"\s*(?:[0-9]+\s+|[0-9]+$)?")
_SKIPPED = re.compile(r"\s*(?:[0-9]+\s*)?/\s*(?:[0-9]+\s+)?")
_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")


class Klartext(Reader):
    """Klartext, up to END PGM."""

    forms = (
        PlainLines(re.compile(rf"(?:(?:{_BEGIN}{_WORDS})?+[ \t]*+\n)*+"), _G1),
        PlainLines(
            re.compile(rf"(?:(?:{_BEGIN}{_WORDS}{_POINTING})?+[ \t]*+\n)*+"),
            _G1,
            dict(zip(("TX", "TY", "TZ", "NX", "NY", "NZ"), DIRECTION + NORMAL, strict=True)),
        ),
    )
    # A comment alone, with its block number; but not one that ends with ~, after which the block goes on.
    comments = re.compile(r"(?:^[ \t]*+[0-9]++[ \t]*+)?;(?![^\n]*~\s*$)[^\n]*+", re.MULTILINE)

    def __init__(self, source: Source, *, block_delete: bool = False) -> None:
        super().__init__(source, block_delete=block_delete)
        self.state = State()

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say."""
        return self.state.spatial is None and not self.state.positioned and not self.state.drilling

    def follow(self, run: Run) -> None:
        """Remember the last words of a run."""
        words = run.last_words()
        self.state.now.update((c, value) for c, value in words.items() if c in "XYZABC")
        self.state.feed = words.get("F", self.state.feed)

    def continues(self, text: str) -> bool:
        """Whether the line ends with ``~``, which may follow a comment."""
        return text.rstrip().endswith("~")

    def read(self, line: int, text: str) -> Iterator[Block]:
        """Read a line with its continuations."""
        code = " ".join(_code_of(part).rstrip("~") for part in text.split("\n"))
        skipped = _SKIPPED.match(code)
        if skipped is not None and self.block_delete:
            yield Block(line, skipped=True)
            return
        require_short(code)
        numbered = _NUMBERED.match(code) if skipped is None else skipped
        code = " ".join(code[0 if numbered is None else numbered.end() :].split())
        if code:
            yield from self._read(line, code)

    def _read(self, line: int, code: str) -> Iterator[Block]:
        """Read one block of any kind."""
        if (word := self._follow_order(code)) is not None:
            yield Block(line, ignored=(word,))
            return
        read = self._line(line, code)
        if self._in_file and not _ENDS.isdisjoint(read.draft.m):
            raise BlockError("ends the program within one that is called, which the control doesn't allow")
        if read.calls:
            read.draft.note(Severity.NOTE, "cycle-simplified", _SIMPLIFIED)
        yield from (block for block in (read.before, read.draft.block()) if block is not None)
        if read.calls:
            yield from self.state.drill(line)
        if read.after is not None:
            yield read.after
        self.ended = code.startswith("END PGM")

    def _line(self, line: int, code: str) -> Line:
        called = _CYCLE_CALL.match(code)
        if called is not None or MOVES.match(code) is not None:
            words = code if called is None else code[called.end() :]
            move = Move(self.source, line, words, self.state)
            if called is not None and self.state.drilling:
                raise BlockError("calls a cycle that M89 calls at every position; write M99 before")
            if called is not None:
                move.code = self._position_of(words) if called[1] else words
                move.draft.ignored.append("CYCL CALL")
                move.calls = True
            move.read()
            return move
        setup = SetUp(self.source, line, code, self.state)
        if setup.read():
            return setup
        ignored = IGNORED_LINES.match(code)
        if ignored is None:
            raise BlockError(refusal(code))
        setup.draft.ignored.append(ignored[0])
        setup.draft.stated.append(code)
        return setup

    def _position_of(self, words: str) -> str:
        """Return the words of CYCL CALL POS without its Z, which shifts the hole unless it is 0."""
        found = _AT_ZERO.fullmatch(words)
        if found is None:
            raise BlockError("CYCL CALL POS needs X, Y and Z+0, with the surface in Q203; write that")
        near, height = self.state.clearance, self.state.now.get("Z")
        if near is not None and height is not None and height < near:
            raise BlockError(
                f"CYCL CALL POS from Z {height:g}, below the set-up clearance at {near:g}, goes up first, "
                "which isn't supported; go up before"
            )
        return f"{found[1]}{found[2]}"

    # The order of lines

    @property
    def _in_file(self) -> bool:
        """Whether a called program is run."""
        called = self.tape.called
        return called is not None and called.is_file

    def _follow_order(self, code: str) -> str | None:
        """Call and end subprograms and repeat parts; return the word that does, None if there is none."""
        tape = self.tape
        if (call := _CALL_LABEL.fullmatch(code)) is not None:
            rows = tape.now.text.labels(_LABEL).get(call[1], [])
            if len(rows) != 1:
                raise BlockError(f"calls LBL {call[1]}, which stands in the program {len(rows)} times")
            if call[2] is None:
                tape.call(rows[0] + 1)
            elif not tape.now.begin <= rows[0] < tape.row:
                raise BlockError(f"repeats from LBL {call[1]}, which isn't before it in the part that runs")
            else:
                tape.repeat(rows[0], tape.row, int(call[2]))
            return "CALL LBL"
        if (call := _CALL_PROGRAM.fullmatch(code)) is not None:
            local = {name: value for name, value in self.state.parameters.items() if name[:2] == "QL"}
            tape.call_file(tape.open_file(call[1], (".h",)), lambda: self._leave(local))
            self._leave({})
            return "CALL PGM"
        if code.startswith("LBL"):
            if code[3:].strip() == "0" and tape.called is not None and not self._in_file:
                tape.leave()
            return "LBL"
        if self._in_file and code.startswith("BEGIN PGM"):
            if code.split()[-1] != self.state.unit:
                raise BlockError(f"the program that calls is in {self.state.unit}; post both in one unit")
            return "BEGIN PGM"
        if code.startswith("END PGM") and tape.called is not None:
            if not self._in_file:
                raise BlockError("the subprogram that is called isn't ended; write LBL 0")
            tape.leave()
            return "END PGM"
        return None

    def _leave(self, local: dict[str, float]) -> None:
        """Set the QL parameters, which are local to a program."""
        others = {name: value for name, value in self.state.parameters.items() if name[:2] != "QL"}
        self.state.parameters = others | local


def _code_of(text: str) -> str:
    """Return a line without its comment, in upper case, with decimal points instead of commas."""
    code = strip_comment(text)
    return _COMMA.sub(".", code) if "," in code else code
