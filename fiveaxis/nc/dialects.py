"""What the controls want to read, as data: a new control is one entry here and one golden file."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from fiveaxis.errors import SettingError


@dataclass(frozen=True)
class Dialect:
    """How one control writes a program.

    Parameters
    ----------
    name : what ``control=`` takes
    suffix : of program files
    comment : template of a comment
    comment_width : longest text between the comment's brackets, characters
    active_comments : first words that, with a comma after them, make the control act on a comment
    start : blocks that fix every mode the program relies on
    tool_length : blocks that make Z the tool tip's: where the tool keeps its direction, and where it turns
    rapid : template of the approach moves
    timed : block that makes F the inverse of the block's duration, 1/min
    linear : template of a timed move
    end : last blocks
    notes : what the person at the machine has to know
    modulo : what a rotary word from 0 to 360 does: the axis goes there the ``shorter`` way, or the word's
        sign says which way (``signed``); empty where the control has no such words
    reset : template of a block that names the place where axes stand, without a move; empty where there is
        none
    clear : block that takes such names back
    winding_notes : what the person at the machine has to know, by the way in which turns are counted
    decimals : of mm and deg; 6 keeps the tip within 1e-5 mm at a metre from the rotary axes
    feed_digits : significant digits of F
    """

    name: str
    suffix: str
    comment: str
    comment_width: int
    active_comments: frozenset[str]
    start: tuple[str, ...]
    tool_length: tuple[str, str]
    rapid: str
    timed: str
    linear: str
    end: tuple[str, ...]
    notes: tuple[str, ...]
    modulo: Literal["", "shorter", "signed"] = ""
    reset: str = ""
    clear: str = ""
    winding_notes: Mapping[str, str] = field(default_factory=dict)
    decimals: int = 6
    feed_digits: int = 7

    @property
    def windings(self) -> tuple[str, ...]:
        """Ways to count turns that the control has."""
        ways = ("unwound", True), ("modulo", bool(self.modulo)), ("rezero", bool(self.reset))
        return tuple(name for name, known in ways if known)


LINUXCNC = Dialect(
    name="linuxcnc",
    suffix=".ngc",
    comment="({})",
    comment_width=100,
    active_comments=frozenset(
        ("msg", "debug", "print", "log", "logopen", "logappend", "probeopen", "probeappend", "abort", "py")
    ),
    # G64 P: blends at corners stay within 0.01 mm; without a P the control cuts them as far as speed wants.
    start=("G21 G90 G94 G17 G40 G80", "G54", "G64 P0.01"),
    tool_length=("G43", "G49"),
    rapid="G0 {words}",
    timed="G93",
    linear="G1 {words} F{feed}",
    end=("G94", "M5", "M9", "M2"),
    notes=(
        "words are positions of the machine's axes, not of the workpiece: tool centre point control must be "
        "off, which on a machine with switchable kinematics means identity, M429",
        "no spindle speed, coolant or tool change is written: load the tool and start the spindle before",
    ),
    # LinuxCNC manual, [AXIS_<letter>] WRAPPED_ROTARY: the sign of a word is the direction to turn in.
    modulo="signed",
    reset="G92 {words}",
    clear="G92.1",
    winding_notes={
        "modulo": "rotary words go from 0 to 360 and their sign is the way to turn: the axis needs "
        "WRAPPED_ROTARY = 1 in the machine's INI file, without it these words mean other angles",
        "rezero": "where a link begins, G92 names a rotary axis anew by whole turns; its joint counts on "
        "and keeps its limits. After an abort run G92.1 before anything else",
    },
)

# M429 means identity where a configuration like 5axis/table-rotary-tilting remaps it so. Elsewhere it is an
# error or, on a mill-turn machine, something else: hence a control of its own, to be asked for by name.
LINUXCNC_SWITCHKINS = replace(LINUXCNC, name="linuxcnc-switchkins", start=("M429", *LINUXCNC.start))

DIALECTS = {d.name: d for d in (LINUXCNC, LINUXCNC_SWITCHKINS)}


def find_dialect(control: str) -> Dialect:
    """Find the dialect of a control.

    Raises
    ------
    SettingError
        No control of that name; the nearest is named, and all known ones.
    """
    if control not in DIALECTS:
        near = difflib.get_close_matches(control, DIALECTS, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise SettingError(f"unknown control {control!r}; {hint}known: {', '.join(DIALECTS)}")
    return DIALECTS[control]
