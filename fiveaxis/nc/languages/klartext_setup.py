"""Klartext blocks without moves: tools, parameters, TCP, planes, shifts, and definitions of cycles."""

from __future__ import annotations

import re

import numpy as np

from fiveaxis.base import Array, Severity, product
from fiveaxis.nc.languages.block import IS_CYCLE, BlockError
from fiveaxis.nc.languages.klartext_cycles import DRILLS, Cycle
from fiveaxis.nc.languages.klartext_state import IGNORED_CYCLES, INCH_FEED, VALUE, Line, refusal
from fiveaxis.nc.languages.planes import rotation_onto, turns

_PARAMETER = re.compile(r"(?:FN ?([0-7]) ?: ?)?(Q[LR]?[0-9]+) ?= ?(.+)")
_ANGLE = re.compile(rf"(SP[ABC]|EUL(?:PR|NU|ROT)|[BN][XYZ]) ?({VALUE})")
_CYCLE = re.compile(r"CYCL DEF ([0-9]{1,4})(?:\.([0-9]+))?(?![0-9])\s*(.*)")
_TOOL = re.compile(r"TOOL CALL(?: (TEXT|Q[LRS]?[0-9]+|[0-9]+(?:\.[0-9]+)?))?(?: ([UVWXYZ])(?![0-9+.-]))?")
_DELTA = re.compile(rf"(?<![A-Z])(DL|DR2?) ?[=:]? ?({VALUE})")
_TOOL_FEED = re.compile(rf"\bF ?({VALUE})")
_TOOL_SPEED = re.compile(rf"\bS ?({VALUE})")
_TEXT = re.compile(r'"[^"]*"')
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
            base, normal = need("BX", "BY", "BZ"), need("NX", "NY", "NZ")
            return rotation_onto(np.array(base), np.array(normal), "PLANE VECTOR")
        raise BlockError(refusal("PLANE"))

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
        elif number in DRILLS:
            self.state.drilling = False
            self.state.cycle = Cycle.read(number, rest, self.value, self.state.tool_feed)
        elif number not in (7, 8, 9, 10, 11, 19):
            raise BlockError(f"CYCL DEF {number} {IS_CYCLE}")
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
