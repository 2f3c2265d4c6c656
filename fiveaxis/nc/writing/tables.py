"""Tables of controls: how a program is written, one TOML file for each, of the package or custom."""

from __future__ import annotations

import difflib
import re
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from fiveaxis.base import Coordinates, SettingError, StrictModel, read_document, validate_settings
from fiveaxis.nc.writing.table_parts import (
    ArcBounds,
    Arithmetic,
    Blocks,
    Comments,
    Counted,
    Cycles,
    Feed,
    FeedMode,
    Lines,
    MixedFeed,
    Mode,
    Modulo,
    Numbers,
    Planner,
    ReadingRules,
    Reset,
    Text,
    Unit,
)

FOLDER = Path(__file__).parents[1] / "controls"


class Dialect(StrictModel):
    """How one control writes a program.

    Parameters
    ----------
    name : of the control, for ``control=``
    title : full name
    language : ``blocks`` of a control; ``apt`` and ``points`` are lists of cutter locations
    suffix : of program files
    axes : letters of axes that it knows
    comment : how comments are written
    longest : characters of the longest line that it reads
    line_number, most_number, numbered : template of a block number, the highest, and whether all lines have
        one, from 0
    continuation : character at the end of a line that continues in the next; empty if there is none
    number, feed : how words and F are written
    unit : the words of ``mm`` and ``inch``; a unit without a word isn't supported
    inch_feed : unit of F in programs in inch, inch/min
    reading : what it does with what a program doesn't state, and with text that controls read differently
    mixed_feed : what F counts where linear and rotary axes move together
    dwell : s, of a P of 1 in G4 without a decimal point; with one it counts seconds
    arcs : how far their words may contradict each other, by the unit of length
    arc_turns : letter of an arc's turns, of which the first is the arc itself; empty if there is none
    arithmetic, cycles : what expressions are, and where there are no cycles, on this control
    head : lines before the comments
    safe_start : blocks that set every mode the program relies on, and switch off what an earlier program, or
        one that was aborted, may have left on
    smoothing : blocks that set how the control rounds corners, in place of what was set before
    unclamp : blocks that release the clamps of the rotary axes, before they turn
    corners : how moves join with `smoothing`: ``exact-path`` as LinuxCNC's G61, ``blended`` as its
        G64 (`predicted_time`), or the tolerance in mm; None where it depends on the machine's settings
    blend : mm, by which blended moves may pass a corner, as in G64 P; 0 where nothing but speed counts
    cycle : s, of the control's clock; a move from rest to rest takes whole cycles
    planner : the version whose times these are
    jerk : what limits the axes' jerk; empty where nothing does
    limited : what the axes' highest speeds and accelerations apply to under TCP control: ``axes``, or the
        program's ``words``
    after_tcp : blocks after TCP has been switched off, which reset what it may leave on
    machine_move : template of a rapid move to a position in machine coordinates
    tool_change, work_offset, spindle, spindle_left, coolant : templates, and blocks of coolants by name
    work_offsets, default_offset : pattern of the names that the control knows, and the default
    spindle_decimals : of S
    most : the largest number that the control accepts, by name of the setting
    spindle_off, coolant_off : blocks
    rapid, linear : templates of moves
    straight : what makes a rapid move of several axes straight
    end : last blocks
    modes : the coordinates that can be written
    refused : why others can't; those of the table that this one is based on are then left out
    harmless : patterns of whole words that this table doesn't write, and that do nothing to a cut
    notes : for the operator
    modulo, reset : how turns are written with further windings; None if not supported
    winding_notes : for the operator, by winding
    """

    name: str
    title: str = ""
    language: Literal["blocks", "apt", "points"] = "blocks"
    suffix: str = Field(pattern=r"^\.[A-Za-z0-9]+$")
    axes: Text = "XYZABC"
    comment: Comments = Comments()
    longest: int = Field(255, ge=40)
    line_number: Text = ""
    most_number: int = Field(99999, ge=1)
    numbered: bool = False
    continuation: Text = ""
    number: Numbers = Numbers()
    feed: dict[FeedMode, Feed] = Field(default_factory=dict)
    unit: dict[Unit, Text] = Field({"mm": ""})
    inch_feed: float = Field(1.0, gt=0.0)
    reading: ReadingRules = ReadingRules()
    mixed_feed: MixedFeed = MixedFeed()
    dwell: float = Field(1.0, gt=0.0)
    arcs: dict[Unit, ArcBounds] = Field(default_factory=dict)
    arc_turns: Literal["", "P"] = ""
    arithmetic: Arithmetic = Arithmetic()
    cycles: Cycles = Cycles()
    head: Blocks = ()
    safe_start: Blocks = ()
    smoothing: Blocks = ()
    unclamp: Blocks = ()
    corners: Annotated[float, Field(ge=0.0)] | Literal["exact-path", "blended"] | None = None
    blend: float = Field(0.0, ge=0.0)
    cycle: float = Field(0.0, ge=0.0)
    planner: Planner = Planner()
    jerk: str = ""
    limited: Literal["axes", "words"] = "axes"
    after_tcp: Blocks = ()
    machine_move: Text = ""
    tool_change: Text = ""
    work_offset: Text = ""
    work_offsets: str = ""
    default_offset: Text = ""
    spindle: Text = ""
    spindle_left: Text = ""
    spindle_decimals: int = Field(0, ge=0, le=6)
    most: dict[Counted, float] = Field(default_factory=dict)
    coolant: dict[str, Text] = Field(default_factory=dict)
    spindle_off: Text = ""
    coolant_off: Text = ""
    rapid: Text = ""
    linear: Text = ""
    straight: Text = "see that the control does so, as some let every axis run at its own speed"
    end: Blocks = ()
    modes: dict[Coordinates, Mode] = Field(min_length=1)
    refused: dict[Coordinates, str] = Field(default_factory=dict)
    harmless: Lines = ()
    notes: Lines = ()
    modulo: Modulo | None = None
    reset: Reset | None = None
    winding_notes: dict[str, str] = Field(default_factory=dict)

    @property
    def short_title(self) -> str:
        """The title without the control's options."""
        return re.split(r" \(|,| with ", self.title or self.name)[0]

    @property
    def moving_words(self) -> frozenset[str]:
        """Words that may move an axis by the tool's length."""
        blocks = (block for mode in self.modes.values() for block in mode.off_clear)
        return frozenset(word for block in blocks for word in block.split())

    @property
    def windings(self) -> tuple[str, ...]:
        """Windings that the control supports."""
        known = ("unwound", True), ("modulo", self.modulo is not None), ("rezero", self.reset is not None)
        return tuple(name for name, supported in known if supported)

    @model_validator(mode="after")
    def _is_complete(self) -> Dialect:
        if isinstance(self.corners, str) and not self.cycle:
            raise ValueError(f"corners = {self.corners!r} needs cycle, the time of the control's clock in s")
        if self.blend and self.corners != "blended":
            raise ValueError(f"blend = {self.blend:g} is for corners = 'blended'")
        if self.language == "blocks":
            self._require_moves()
            self._require_units()
        for name, patterns in (("work_offsets", (self.work_offsets,)), ("harmless", self.harmless)):
            for pattern in patterns:
                try:
                    with warnings.catch_warnings():
                        warnings.simplefilter("error")  # of what a later Python reads differently
                        re.compile(pattern)
                except (re.error, Warning, RecursionError, OverflowError) as fault:
                    raise ValueError(f"{name} = {pattern!r}: {fault}") from None
        return self

    def uses(self, field: str) -> bool:
        """Check whether a block around the moves has a placeholder for a setting."""
        blocks = [*self.head, *self.end]
        for mode in self.modes.values():
            blocks += [*mode.on, *(mode.on_contained or ()), mode.first or "", *mode.off, *mode.off_clear]
        return any(f"{{{field}}}" in block for block in blocks)

    def _require_units(self) -> None:
        """Raise `ValueError` if a unit has no word and blocks have a placeholder for it."""
        written = any("{unit}" in block for block in (*self.head, *self.safe_start, *self.end))
        for unit, word in self.unit.items():
            if written and not word.strip():
                raise ValueError(f"unit.{unit} = {word!r} needs the word for it, as {{unit}} is written")

    def _require_moves(self) -> None:
        for name, mode in self.modes.items():
            rapid, linear = mode.rapid or self.rapid, mode.linear or self.linear
            if not rapid or not linear:
                missing = "linear" if rapid else "rapid"
                raise ValueError(f"modes.{name} needs {missing}, the template of a move")
            if mode.feed not in self.feed:
                raise ValueError(f"modes.{name} counts F {mode.feed}, and there is no feed.{mode.feed}")
            if name == "axes" and mode.feed == "per_minute" and self.mixed_feed.degree is None:
                raise ValueError(
                    "modes.axes counts F per_minute, and mixed_feed.degree doesn't say what F counts where "
                    "rotary axes turn, too; set it with its source, or feed = 'inverse_time'"
                )
            if name == "vector" and mode.directions is None:
                raise ValueError("modes.vector needs directions, the words of the tool's direction")


def find_dialect(control: str | Path) -> Dialect:
    """Find the dialect of a control: one of `DIALECTS` by its name, or a custom table by its path.

    Parameters
    ----------
    control : a name, or the path of a ``.toml`` file

    Raises
    ------
    SettingError
        An unknown name, with the nearest and all known ones; a table that can't be read, with file and line.
    """
    name = str(control)
    if name.lower().endswith(".toml"):
        return read_dialect(Path(name))
    if name not in DIALECTS:
        near = difflib.get_close_matches(name, DIALECTS, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]!r}? " if near else ""
        known = ", ".join(DIALECTS)
        raise SettingError(f"unknown control {name!r}; {hint}known: {known} (or the path of a .toml file)")
    return DIALECTS[name]


def read_dialect(path: Path) -> Dialect:
    """Read a control's table; keys that it lacks come from the table named by ``based_on``."""
    text, data = _merged(path, ())
    return validate_settings({"name": path.stem, **data}, text, path, Dialect, SettingError)


def _merged(path: Path, above: tuple[Path, ...]) -> tuple[str, dict[str, Any]]:
    text, data = read_document(path, SettingError)
    base = data.pop("based_on", None)
    if base is None:
        return text, data
    below = _base_of(path, base)
    if below in (*above, path):
        raise SettingError(f"based_on = {base!r} leads back to this table; remove one of them", file=path)
    _, whole = _merged(below, (*above, path))
    whole.pop("name", None)
    lacks, own = data.get("refused"), data.get("modes")
    if isinstance(lacks, dict) and isinstance(whole.get("modes"), dict):
        left_out = lacks.keys() - (own.keys() if isinstance(own, dict) else ())
        whole["modes"] = {name: mode for name, mode in whole["modes"].items() if name not in left_out}
    return text, _overlay(whole, data)


def _base_of(path: Path, base: object) -> Path:
    """Find the file that a table is based on: in the package by its name, or relative to the table."""
    if not isinstance(base, str):
        raise SettingError(f"based_on = {base!r} must be text in quotes", file=path)
    if base.lower().endswith(".toml"):
        return path.parent / base
    if not (FOLDER / f"{base}.toml").is_file():
        known = ", ".join(sorted(p.stem for p in FOLDER.glob("*.toml")))
        raise SettingError(f"based_on = {base!r} isn't a known control; known: {known}", file=path)
    return FOLDER / f"{base}.toml"


def _overlay(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Override the values of one document by another's, table by table."""
    merged = dict(below)
    for key, value in above.items():
        are_tables = isinstance(below.get(key), dict) and isinstance(value, dict)
        merged[key] = _overlay(below[key], value) if are_tables else value
    return merged


DIALECTS: dict[str, Dialect] = {
    path.stem: read_dialect(path) for path in sorted(FOLDER.glob("*.toml"), key=lambda p: p.stem)
}
