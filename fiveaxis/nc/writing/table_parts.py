"""The parts of a control's table: comments, numbers, feeds, coordinates, ways to count turns."""

from __future__ import annotations

from string import Formatter
from typing import Literal

from pydantic import Field, field_validator, model_validator

from fiveaxis.settings import StrictModel

# What the words of a program are: positions of axes, the tool's tip and the angles, the tip and a direction.
Coordinates = Literal["axes", "tip", "vector"]
FeedMode = Literal["inverse_time", "per_minute"]

Unit = Literal["mm", "inch"]

# Settings of a program that are numbers of a word that has only so much room.
Counted = Literal["number", "tool_number", "length_offset", "spindle_rpm"]

Lines = tuple[str, ...]

# Names that a template may have in curly brackets.
KNOWN_FIELDS = {
    "comment": {""},
    "head": {"name", "number", "unit"},
    "start": {"unit"},
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
    "off_clear": {"offset"},
    "first": {"words", "offset"},
}

# What a template says nothing without; each stands once.
NEEDED_FIELDS = {
    **{
        name: KNOWN_FIELDS[name]
        for name in ("comment", "machine_move", "tool_change", "work_offset", "spindle", "spindle_left")
    },
    **{name: KNOWN_FIELDS[name] for name in ("rapid", "linear", "reset_block", "line_number", "modulo_word")},
    "first": {"words"},
}


def require_fields(name: str, template: str) -> None:
    """Refuse a template with a bracket that nothing fills, or without one that must be filled.

    Raises
    ------
    ValueError
        With the key, the template, and what it needs.
    """
    require_ascii(name, template)
    try:
        parts = [part for part in Formatter().parse(template) if part[1] is not None]
    except ValueError as fault:
        raise ValueError(f"{name} = {template!r}: {fault}; write {{{{ for a bracket") from None
    known, found = KNOWN_FIELDS[name], [field for _, field, _, _ in parts]
    for field in sorted({str(field) for field in found} - known):
        allowed = ", ".join(f"{{{f}}}" for f in sorted(known))
        raise ValueError(f"{name} = {template!r} has {{{field}}}; what it may have is {allowed}")
    if any(form or conversion for _, _, form, conversion in parts):
        raise ValueError(f"{name} = {template!r} formats what fills a bracket; write {{name}} alone")
    wanted = NEEDED_FIELDS.get(name, set())
    if template and any(found.count(field) != 1 for field in wanted):
        needed = " and ".join(f"{{{f}}}" for f in sorted(wanted, reverse=True))
        raise ValueError(f"{name} = {template!r} needs {needed}, {'each ' if len(wanted) > 1 else ''}once")


def require_ascii(name: str, text: str) -> None:
    """Refuse, with a `ValueError`, what a control has no signs for."""
    strange = [sign for sign in text if not (" " <= sign <= "~" or sign == "\n")]
    if strange:
        raise ValueError(f"{name} = {text!r} has {strange[0]!r}; write plain ASCII")


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
        if self.least is not None and self.most is not None and self.least > self.most:
            raise ValueError(f"least = {self.least:g} is above most = {self.most:g}; no feed is between them")
        return self


class Mode(StrictModel):
    """How one kind of coordinates is switched on, and what F is in it.

    Parameters
    ----------
    on : blocks that switch it on
    on_contained : in place of `on` where words of axes contain the tool's length
    off : blocks that switch it off
    off_clear : more of them, which may move an axis by the tool's length: they stand after the retract, and
        nowhere where the program doesn't end clear
    feed : how F counts: the inverse of a block's duration, or the speed along its way
    positions : whether the tip's words count in a frame that turns with the table, or in the machine's
    rapid, linear : templates of moves, in place of the control's; the approach has the control's
    first : template of the first rapid move that the tool's length counts in, where the control wants it
        switched on in a move; unused where words of axes contain the length
    directions : words of the tool's direction, in vector mode
    notes : what the person at the machine has to know
    """

    on: Lines = ()
    on_contained: Lines | None = None
    off: Lines = ()
    off_clear: Lines = ()
    feed: FeedMode = "per_minute"
    positions: Literal["table", "machine"] = "table"
    rapid: str | None = None
    linear: str | None = None
    first: str | None = None
    directions: tuple[str, str, str] | None = None
    notes: Lines = ()

    @model_validator(mode="after")
    def _has_known_fields(self) -> Mode:
        for name in ("on", "on_contained", "off", "off_clear"):
            for template in getattr(self, name) or ():
                require_fields(name, template)
        for name in ("rapid", "linear", "first"):
            if getattr(self, name) is not None:
                require_fields(name, getattr(self, name))
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
            require_fields("modulo_word", word)
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
        require_fields("reset_block", block)
        return block
