"""What the controls want to read, as data: one TOML file for each control."""

from __future__ import annotations

import re
from string import Formatter
from typing import Literal

from pydantic import Field, field_validator, model_validator

from fiveaxis.settings import StrictModel

# What the words of a program are: positions of axes, the tool's tip and the angles, the tip and a direction.
Coordinates = Literal["axes", "tip", "vector"]
FeedMode = Literal["inverse_time", "per_minute"]

Unit = Literal["mm", "inch"]

Lines = tuple[str, ...]

# Names that a template may have in curly brackets.
KNOWN_FIELDS = {
    "comment": {""},
    "head": {"name", "number", "unit"},
    "start": {"unit", "blend"},
    "end": {"name", "number", "unit"},
    "machine_move": {"words"},
    "tool_change": {"tool"},
    "work_offset": {"offset"},
    "spindle": {"rpm"},
    "spindle_left": {"rpm"},
    "rapid": {"words"},
    "linear": {"words", "feed"},
    "reset_block": {"words"},
    "line_number": {"n"},
    "modulo_word": {"letter", "value"},
    "on": {"offset"},
    "on_contained": {"offset"},
    "off": {"offset"},
}


def _require_fields(name: str, template: str) -> None:
    try:
        found = {field for _, field, _, _ in Formatter().parse(template) if field is not None}
    except ValueError as fault:
        raise ValueError(f"{name} = {template!r}: {fault}; write {{{{ for a bracket") from None
    known = KNOWN_FIELDS[name]
    for field in found - known:
        allowed = ", ".join(f"{{{f}}}" for f in sorted(known))
        raise ValueError(f"{name} = {template!r} has {{{field}}}; what it may have is {allowed}")


def _no_unit_words() -> dict[Unit, str]:
    return {"mm": ""}


class Comments(StrictModel):
    """How comments are written.

    Parameters
    ----------
    template : of one line
    width : longest text between the comment's brackets, characters
    capitals : whether the control knows capital letters only
    active : first words that, with a comma after them, make the control act on a comment
    forbidden : signs that end the program, or join lines, even in a comment
    """

    template: str = "({})"
    width: int = Field(60, ge=10)
    capitals: bool = False
    active: frozenset[str] = frozenset()
    forbidden: str = ""


class Numbers(StrictModel):
    """How numbers are written: always with a decimal point, never with an exponent or as -0.

    Parameters
    ----------
    linear, rotary, direction : decimals of mm, of deg and of the parts of a unit vector; inches have one more
    plus : whether a number that isn't negative has a + before it
    most : largest number of a word, mm or deg
    """

    linear: int = Field(4, ge=1, le=9)
    rotary: int = Field(4, ge=1, le=9)
    direction: int = Field(7, ge=4, le=12)
    plus: bool = False
    most: float = Field(99999.0, gt=0.0)


class Feed(StrictModel):
    """How F is written in one of its modes.

    Parameters
    ----------
    word : the mode's word; empty where the control has no other mode
    decimals : of F, fixed; None where `digits` says how it is written
    digits : significant digits of F, without zeros at the end
    least, most : range that the control reads, mm/min (deg/min) or 1/min; None where none is known
    least_speed : mm/min of the linear axes, below which the control runs a block at this speed
    """

    word: str = ""
    decimals: int | None = Field(None, ge=0, le=9)
    digits: int | None = Field(None, ge=4, le=12)
    least: float | None = Field(None, gt=0.0)
    most: float | None = Field(None, gt=0.0)
    least_speed: float | None = Field(None, gt=0.0)

    @model_validator(mode="after")
    def _has_one_form(self) -> Feed:
        if (self.decimals is None) == (self.digits is None):
            raise ValueError("a feed has either decimals or digits; give one of them")
        return self


class Mode(StrictModel):
    """How one kind of coordinates is switched on, and what F is in it.

    Parameters
    ----------
    on : blocks that switch it on
    on_contained : in place of `on` where words of axes contain the tool's length
    off : blocks that switch it off
    feed : how F counts: the inverse of a block's duration, or the speed along its way
    positions : whether the tip's words count in a frame that turns with the table, or in the machine's
    rapid, linear : templates in place of the control's
    directions : words of the tool's direction, in vector mode
    notes : what the person at the machine has to know
    """

    on: Lines = ()
    on_contained: Lines | None = None
    off: Lines = ()
    feed: FeedMode = "per_minute"
    positions: Literal["table", "machine"] = "table"
    rapid: str | None = None
    linear: str | None = None
    directions: tuple[str, str, str] | None = None
    notes: Lines = ()

    @model_validator(mode="after")
    def _has_known_fields(self) -> Mode:
        for name in ("on", "on_contained", "off"):
            for template in getattr(self, name) or ():
                _require_fields(name, template)
        for name in ("rapid", "linear"):
            if getattr(self, name) is not None:
                _require_fields(name, getattr(self, name))
        return self


class Modulo(StrictModel):
    """Rotary words from 0 to 360.

    Parameters
    ----------
    way : what such a word does: the axis goes there the ``shorter`` way, or the word's sign says which way
        (``signed``)
    word : template of one word; None for the plain one
    on, off : blocks that put it in force, and back
    low : deg, where the words begin: 0, or -180 for a control that shows -180 to 180
    """

    way: Literal["shorter", "signed"]
    word: str | None = None
    on: Lines = ()
    off: Lines = ()
    low: Literal[0, -180] = 0

    @field_validator("word")
    @classmethod
    def _has_known_fields(cls, word: str | None) -> str | None:
        if word is not None:
            _require_fields("modulo_word", word)
        return word

    @model_validator(mode="after")
    def _signs_are_free(self) -> Modulo:
        if self.way == "signed" and self.low < 0:
            raise ValueError("signed words say the way by their sign, so they begin at 0; leave low out")
        return self


class Reset(StrictModel):
    """Naming the place anew where axes stand, without a move.

    Parameters
    ----------
    block : template of the block that does it
    clear : block that takes such names back
    """

    block: str
    clear: str

    @field_validator("block")
    @classmethod
    def _has_known_fields(cls, block: str) -> str:
        _require_fields("reset_block", block)
        return block


class Dialect(StrictModel):
    """How one control writes a program.

    Parameters
    ----------
    name : what ``control=`` takes
    title : what it is, for people
    language : ``blocks`` of a control; ``apt`` and ``points`` are lists of cutter locations
    suffix : of program files
    axes : letters of axes that it knows
    comment : how comments are written
    longest : characters of a line that it reads
    line_number, most_number, numbered : template of a block number, the highest, and whether all lines have
        one, from 0
    number, feed : how words and F are written
    unit : the words of ``mm`` and ``inch``; what is missing the control can't be told
    inch_feed : inch/min that F counts in programs in inch
    head : lines before the comments
    start : blocks that fix every mode the program relies on
    blend : mm, how far corners may be cut, for controls whose `start` says it
    machine_move : template of a rapid move to a place in machine coordinates
    tool_change, work_offset, spindle, spindle_left, coolant : templates, and blocks of coolants by name
    work_offsets, default_offset : pattern of the names that the control knows, and the name that is written
        where nobody says another
    spindle_off, coolant_off : blocks
    rapid, linear : templates of moves
    end : last blocks
    modes : the coordinates that can be written
    refused : why others can't
    notes : what the person at the machine has to know
    modulo, reset : further ways to count turns; None where the control has them not
    winding_notes : what the person at the machine has to know, by the way in which turns are counted
    """

    name: str
    title: str = ""
    language: Literal["blocks", "apt", "points"] = "blocks"
    suffix: str = Field(pattern=r"^\.[A-Za-z0-9]+$")
    axes: str = "XYZABC"
    comment: Comments = Comments()
    longest: int = Field(255, ge=40)
    line_number: str = ""
    most_number: int = Field(99999, ge=1)
    numbered: bool = False
    number: Numbers = Numbers()
    feed: dict[FeedMode, Feed] = Field(default_factory=dict)
    unit: dict[Unit, str] = Field(default_factory=_no_unit_words)
    inch_feed: float = Field(1.0, gt=0.0)
    head: Lines = ()
    start: Lines = ()
    blend: float = Field(0.01, gt=0.0)
    machine_move: str = ""
    tool_change: str = ""
    work_offset: str = ""
    work_offsets: str = ""
    default_offset: str = ""
    spindle: str = ""
    spindle_left: str = ""
    coolant: dict[str, str] = Field(default_factory=dict)
    spindle_off: str = ""
    coolant_off: str = ""
    rapid: str = ""
    linear: str = ""
    end: Lines = ()
    modes: dict[Coordinates, Mode] = Field(min_length=1)
    refused: dict[Coordinates, str] = Field(default_factory=dict)
    notes: Lines = ()
    modulo: Modulo | None = None
    reset: Reset | None = None
    winding_notes: dict[str, str] = Field(default_factory=dict)

    @property
    def windings(self) -> tuple[str, ...]:
        """Ways to count turns that the control has."""
        ways = ("unwound", True), ("modulo", self.modulo is not None), ("rezero", self.reset is not None)
        return tuple(name for name, known in ways if known)

    @model_validator(mode="after")
    def _is_complete(self) -> Dialect:
        for name in KNOWN_FIELDS.keys() & type(self).model_fields.keys() - {"comment"}:
            value = getattr(self, name)
            for template in (value,) if isinstance(value, str) else value:
                _require_fields(name, template)
        _require_fields("comment", self.comment.template)
        if self.language == "blocks":
            self._require_moves()
        try:
            re.compile(self.work_offsets)
        except re.error as fault:
            raise ValueError(f"work_offsets = {self.work_offsets!r}: {fault}") from None
        return self

    def asks(self, field: str) -> bool:
        """Tell whether a block that stands around the moves needs a number or a name that people give."""
        modes = self.modes.values()
        around = (
            *self.head,
            *self.end,
            *(b for m in modes for b in (*m.on, *(m.on_contained or ()), *m.off)),
        )
        return any(f"{{{field}}}" in block for block in around)

    def _require_moves(self) -> None:
        for name, mode in self.modes.items():
            rapid, linear = mode.rapid or self.rapid, mode.linear or self.linear
            if "{words}" not in rapid:
                raise ValueError(f"rapid = {rapid!r} needs {{words}}, the words of the axes")
            if "{words}" not in linear or "{feed}" not in linear:
                raise ValueError(f"linear = {linear!r} needs {{words}} and {{feed}}")
            if mode.feed not in self.feed:
                raise ValueError(f"modes.{name} counts F {mode.feed}, and there is no feed.{mode.feed}")
            if name == "vector" and mode.directions is None:
                raise ValueError("modes.vector needs directions, the words of the tool's direction")
