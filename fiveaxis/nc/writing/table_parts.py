"""The parts of a control's table: comments, numbers, feeds, coordinates, windings."""

from __future__ import annotations

from string import Formatter
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from fiveaxis.base import StrictModel

FeedMode = Literal["inverse_time", "per_minute"]

Unit = Literal["mm", "inch"]

# Settings of a program whose numbers the control limits.
Counted = Literal["number", "tool_number", "length_offset", "spindle_rpm"]

Lines = tuple[str, ...]

# Placeholders that a template must have, each once, and others that it may have.
TEMPLATES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "comment": (("",), ()),
    "head": ((), ("name", "number", "unit")),
    **dict.fromkeys(("safe_start", "smoothing", "unclamp", "after_tcp"), ((), ("unit",))),
    "end": ((), ("name", "number", "unit")),
    "machine_move": (("words",), ()),
    "tool_change": (("tool",), ()),
    "work_offset": (("offset",), ()),
    **dict.fromkeys(("spindle", "spindle_left"), (("rpm",), ())),
    "rapid": (("words",), ()),
    "linear": (("words", "feed"), ()),
    "reset_block": (("words",), ()),
    "line_number": (("n",), ()),
    "modulo_word": (("value", "letter"), ()),
    **dict.fromkeys(("on", "on_contained", "off", "off_clear"), ((), ("offset",))),
    "first": (("words",), ("offset",)),
}


def require_fields(name: str, template: str) -> None:
    """Raise `ValueError` if a template has an unknown placeholder or lacks a required one."""
    require_ascii(name, template)
    try:
        parts = [part for part in Formatter().parse(template) if part[1] is not None]
    except ValueError as fault:
        raise ValueError(f"{name} = {template!r}: {fault}; write {{{{ for a bracket") from None
    wanted, optional = TEMPLATES[name]
    known, found = {*wanted, *optional}, [field for _, field, _, _ in parts]
    for field in sorted({str(field) for field in found} - known):
        allowed = ", ".join(f"{{{f}}}" for f in sorted(known))
        raise ValueError(f"{name} = {template!r} has {{{field}}}; what it may have is {allowed}")
    if any(form or conversion for _, _, form, conversion in parts):
        raise ValueError(f"{name} = {template!r} formats what fills a bracket; write {{name}} alone")
    if (template or name == "comment") and any(found.count(field) != 1 for field in wanted):
        needed = " and ".join(f"{{{f}}}" for f in wanted)
        raise ValueError(f"{name} = {template!r} needs {needed}, {'each ' if len(wanted) > 1 else ''}once")


def require_ascii(name: str, text: str) -> None:
    """Raise `ValueError` if a text isn't printable ASCII."""
    strange = [sign for sign in text if not (" " <= sign <= "~" or sign == "\n")]
    if strange:
        raise ValueError(f"{name} = {text!r} has {strange[0]!r}; write plain ASCII")


def written(name: str = "") -> AfterValidator:
    """Return the check of texts that are written: a template has its placeholders, and all are plain ASCII.

    By default the template has the field's name.
    """

    def check(texts: Any, info: ValidationInfo) -> Any:
        known = name or str(info.field_name)
        for text in (texts,) if isinstance(texts, str) else texts or ():
            (require_fields if known in TEMPLATES else require_ascii)(known, text)
        return texts

    return AfterValidator(check)


Text = Annotated[str, written()]
Blocks = Annotated[Lines, written()]


class Comments(StrictModel):
    """How comments are written.

    Parameters
    ----------
    template : of one line
    width : characters of the longest text in a comment
    capitals : whether the control knows capital letters only
    active : first word of comments that the control acts on, if a comma follows -> whether it ``shows`` or
        keeps something, ``stops`` the program, or ``runs`` what the comment names
    forbidden : characters that end the program or continue a line, even in a comment
    """

    template: Annotated[str, written("comment")] = "({})"
    width: int = Field(60, ge=10)
    capitals: bool = False
    active: dict[str, Literal["shows", "stops", "runs"]] = Field(default_factory=dict)
    forbidden: str = ""


class Numbers(StrictModel):
    """How numbers are written: always with a decimal point, never with an exponent or as -0.

    Parameters
    ----------
    linear, rotary, direction : decimals of mm, deg and components of a unit vector; inches have one more
    plus : whether a number that isn't negative has a + sign
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
    word : of the mode; empty where the control has no other mode
    decimals : of F, fixed; either these or `digits`
    digits : significant digits of F, without trailing zeros
    least, most : the control's range, mm/min (deg/min) or 1/min; None if unknown
    least_speed : units of length per minute, lowest speed of the linear axes: the control runs slower blocks
        at this speed
    clears : whether the mode's word clears F where the mode is in force already
    """

    word: Text = ""
    decimals: int | None = Field(None, ge=0, le=9)
    digits: int | None = Field(None, ge=4, le=12)
    least: float | None = Field(None, gt=0.0)
    most: float | None = Field(None, gt=0.0)
    least_speed: float | None = Field(None, gt=0.0)
    clears: bool = False

    @model_validator(mode="after")
    def _has_one_form(self) -> Feed:
        if (self.decimals is None) == (self.digits is None):
            raise ValueError("a feed has either decimals or digits; set one of them")
        if self.least is not None and self.most is not None and self.least > self.most:
            raise ValueError(f"least = {self.least:g} is above most = {self.most:g}; no feed is between them")
        return self


class MixedFeed(StrictModel):
    """What F per minute counts where linear and rotary axes move together by axis words.

    Parameters
    ----------
    degree : units of length that a degree counts, `L = √(Σ mm² + (degree · deg)²)`: 0 where F is along the
        linear axes alone, 1 where mm and degrees are one length; None where no manual says it
    unknown : why it is None
    source : what says so
    """

    degree: float | None = Field(None, ge=0.0)
    unknown: str = "the control's table doesn't say it (mixed_feed)"
    source: str = ""

    @model_validator(mode="after")
    def _has_source(self) -> MixedFeed:
        if self.degree is not None and not self.source:
            raise ValueError(f"mixed_feed.degree = {self.degree:g} needs a source, the manual that says so")
        return self


class ReadingRules(StrictModel):
    """What the control does with what a program doesn't state, and with text that controls read differently.

    Parameters
    ----------
    plane : of arcs that a program begins in; ``unknown`` where settings decide
    positions : whether words that it begins with are absolute (``G90``) or increments
    feed_mode : what F means at its begin
    return_level : where a cycle with neither word goes on: at the initial level (``G98``) or at R
    nested_comments : whether ``(`` within a comment is ``accepted``, the comment going on to the last ``)``,
        or stops the program
    numbered_skip : the same for block delete elsewhere than in the first character, or with a number:
        ``N5 /`` and ``/2``
    late_percent : the same for a ``%`` that isn't on the first filled line; on that line it is accepted
        everywhere, and the next one ends the text
    whole_words : what axis words without a decimal point count: ``units``, mm and deg, or ``unknown`` where a
        setting may make them multiples of the increment
    whole_feed : the same for F
    machine_increments : what it does with G53 under G91: ``accepted``, ``refused`` or ``unknown``
    change_moves : whether the control itself moves axes at a tool change
    ends : words that end a program
    repeats : words that begin a main program again instead
    unknown : why keys are unknown
    source : what says so, with its version
    """

    plane: Literal["G17", "G18", "G19", "unknown"] = "unknown"
    positions: Literal["G90", "G91", "unknown"] = "unknown"
    feed_mode: Literal["G93", "G94", "G95", "unknown"] = "unknown"
    return_level: Literal["G98", "G99", "unknown"] = "unknown"
    nested_comments: Literal["accepted", "refused", "unknown"] = "unknown"
    numbered_skip: Literal["accepted", "refused", "unknown"] = "unknown"
    late_percent: Literal["accepted", "refused", "unknown"] = "unknown"
    whole_words: Literal["units", "unknown"] = "unknown"
    whole_feed: Literal["units", "unknown"] = "units"
    machine_increments: Literal["accepted", "refused", "unknown"] = "unknown"
    change_moves: bool = True
    ends: Lines = ("M2", "M30")
    repeats: Lines = ()
    unknown: str = "the control's table doesn't say it (reading)"
    source: str = ""

    @model_validator(mode="after")
    def _has_source(self) -> ReadingRules:
        if self.model_fields_set - {"unknown", "source"} and not self.source:
            raise ValueError("reading needs a source, the manual that says so")
        return self


class ArcBounds(StrictModel):
    """How far an arc's words may contradict each other, in mm; its radius then changes along it.

    Parameters
    ----------
    rounding : allowed difference of the radii about a centre, at start and end
    share : of the larger radius, that is allowed too
    largest : difference that is allowed by no share
    reach : by which R may be too short for its ends, and least radius about a centre; None for those of the
        radii, and any
    source : what says so
    """

    rounding: float = Field(0.005, ge=0.0)
    share: float = Field(0.001, ge=0.0)
    largest: float = Field(0.5, ge=0.0)
    reach: float | None = Field(None, ge=0.0)
    source: str = ""


class Planner(StrictModel):
    """Whose planner the times of a control's clock are those of: other versions take other times.

    Parameters
    ----------
    version : of the control; empty where times don't hang on it
    later : what later versions do otherwise
    source : what says so
    """

    version: str = ""
    later: Lines = ()
    source: str = ""


class Arithmetic(StrictModel):
    """What expressions are where controls differ; what nobody says has no value.

    Parameters
    ----------
    same : numbers that differ by less are equal in EQ and NE, and in LE and GE of some versions; None where
        no manual says it
    doubtful : largest difference at which that decides, where the control isn't known
    standard : ``RS274/NGC`` where MOD is positive, FIX and FUP go to the next whole number below and above,
        ATAN[y]/[x] is from -180 to 180 deg, and any number but 0 is true
    source : what says so
    """

    same: float | None = Field(None, ge=0.0)
    doubtful: float = Field(0.0, ge=0.0)
    standard: Literal["RS274/NGC"] | None = None
    source: str = ""


class Cycles(StrictModel):
    """What drilling cycles are where controls differ.

    Parameters
    ----------
    rotary : whether a block of a cycle may turn rotary axes
    inverse_time : whether there are cycles under G93
    fed_to_initial : words of cycles that return at feed up to the initial level (G98), others to R alone
    level_first : whether a cycle whose initial level is below R goes to R before X and Y from above, too
    others : words that are no cycles of one hole here, and what they do
    source : what says so
    """

    rotary: bool = True
    inverse_time: bool = True
    fed_to_initial: tuple[str, ...] = ()
    level_first: bool = False
    others: dict[str, str] = Field(default_factory=dict)
    source: str = ""


class Mode(StrictModel):
    """How one kind of coordinates is switched on, and the meaning of F in it.

    Parameters
    ----------
    on : blocks that switch it on
    on_contained : in place of `on` where axis words contain the tool's length
    off : blocks that switch it off
    off_clear : further ones, which may move an axis by the tool's length: they are written after the retract,
        and omitted where the program doesn't end clear
    feed : meaning of F: the inverse of a block's duration, or the speed along its path
    positions : frame of the tip's words: it turns with the table, or is fixed to the machine
    rapid, linear : templates of moves, in place of the control's, except in the approach
    first : template of the first rapid move with the tool's length, for controls that switch it on in a move;
        unused where axis words contain the length
    directions : words of the tool direction, in vector mode
    notes : for the operator
    """

    on: Blocks = ()
    on_contained: Annotated[Lines | None, written()] = None
    off: Blocks = ()
    off_clear: Blocks = ()
    feed: FeedMode = "per_minute"
    positions: Literal["table", "machine"] = "table"
    rapid: Annotated[str | None, written()] = None
    linear: Annotated[str | None, written()] = None
    first: Annotated[str | None, written()] = None
    directions: tuple[Text, Text, Text] | None = None
    notes: Lines = ()


class Modulo(StrictModel):
    """Rotary words from 0 to 360.

    Parameters
    ----------
    way : direction of the turn to such a word: the ``shorter`` one, or that of the word's sign (``signed``)
    word : template of one word; None for the plain one
    on, off : blocks that switch it on and off
    low : deg, lowest word: 0, or -180 for a control that counts from -180 to 180
    """

    way: Literal["shorter", "signed"]
    word: Annotated[str | None, written("modulo_word")] = None
    on: Annotated[Lines, written("modulo")] = ()
    off: Annotated[Lines, written("modulo")] = ()
    low: Literal[0, -180] = 0

    @model_validator(mode="after")
    def _signs_are_free(self) -> Modulo:
        if self.way == "signed" and self.low < 0:
            raise ValueError("the sign of signed words is the direction, so they begin at 0; omit low")
        return self


class Reset(StrictModel):
    """Setting the values of axes without a move.

    Parameters
    ----------
    block : template of the block that sets them
    clear : block that cancels it
    """

    block: Annotated[str, written("reset_block")]
    clear: Text
