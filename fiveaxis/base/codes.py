"""All codes of findings about a path, a motion or a program, with their meanings.

Codes are stable: scripts depend on them, and ``override`` names them. `OVERRIDABLE` lists the codes that keep
a program back unless someone accepts them by name.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Severity

ERROR, WARNING, NOTE = Severity


@dataclass(frozen=True)
class Code:
    """One code: its severity at worst, and what was found.

    An error that is overridable may be accepted by name: a program may then be written despite it.
    """

    severity: Severity
    meaning: str
    overridable: bool = True


# Found by the checks on a motion.
CHECKS = {
    "figure-unknown": Code(
        ERROR,
        "the machine doesn't state a figure on which the tool's motion depends: a pivot, a sense, the tool's "
        "length; a warning where only the computed travel and energy depend on it",
        overridable=False,
    ),
    "figure-assumed": Code(WARNING, "a figure of the machine is assumed for this run (--assume)"),
    "not-finite": Code(ERROR, "an axis value or duration isn't a number, or a duration is negative"),
    "axis-limit": Code(ERROR, "an axis is beyond its travel"),
    "contact-error": Code(ERROR, "the axis values don't put the tool on the path"),
    "tilt": Code(ERROR, "the tool axis is outside the given bounds"),
    "held-axis": Code(ERROR, "a rotary axis that should be held has moved"),
    "jump": Code(
        ERROR, "a rotary axis turns far within one cutting block; a warning where gouges are checked"
    ),
    "turn-rate": Code(ERROR, "a rotary axis turns more along the cut, in deg/mm, than allowed"),
    "singular-turn": Code(WARNING, "the first rotary axis turns while the tool points nearly along it"),
    "singular-crossing": Code(WARNING, "the path passes the singular direction"),
    "speed": Code(ERROR, "a block is shorter than an axis needs at its highest speed"),
    "feed-over": Code(WARNING, "the programmed feed exceeds the highest speed of an axis: it runs slower"),
    "rotary-slows": Code(WARNING, "a rotary axis can't keep up with the feed"),
    "rotary-acceleration": Code(WARNING, "the speed of a rotary axis changes faster than it can"),
    "linear-acceleration": Code(WARNING, "the speed of a linear axis changes faster than it can"),
    "tip-deviation": Code(
        ERROR,
        "between blocks of axis words the tool leaves its straight path; a note between bare locations, a "
        "warning in a program without its path",
    ),
    "axis-off-plane": Code(
        WARNING, "between two locations of a program the tool axis leaves the plane of its directions there"
    ),
    "gouge": Code(
        ERROR,
        "the cutter reaches into the part, at a location or on the move to it; or the stock that the program "
        "has cut lacks material of the part",
    ),
    "left-over": Code(WARNING, "the program leaves ridges of the stock between places that it finishes"),
    "shank-collision": Code(ERROR, "the shank reaches into part, stock, fixture or table"),
    "holder-collision": Code(ERROR, "the holder reaches into part, stock, fixture or table"),
    "fixture-collision": Code(ERROR, "the cutter reaches into a fixture or the table"),
    "machine-collision": Code(ERROR, "bodies of the machine reach into each other, part, stock or fixture"),
    "shank-clearance": Code(WARNING, "the shank is nearer than its clearance"),
    "holder-clearance": Code(WARNING, "the holder is nearer than its clearance"),
    "fixture-clearance": Code(WARNING, "the cutter is nearer to a fixture or the table than its clearance"),
    "machine-clearance": Code(WARNING, "bodies of the machine are nearer than their clearance"),
    "approach-blocked": Code(
        ERROR, "no approach to the first location is clear of part, stock, fixtures and machine"
    ),
    "retreat-blocked": Code(
        ERROR, "no retract from the last location is clear of part, stock, fixtures and machine"
    ),
    "text-differs": Code(ERROR, "a program's text, read back, ends a block elsewhere than planned"),
    "duration-differs": Code(
        ERROR, "by its F a block takes a different time than planned; a warning where F has too few digits"
    ),
    "rapid-in-cut": Code(
        ERROR,
        "a program has a rapid move where the path cuts or down to it, for a planned feed move, or in "
        "machine coordinates between the cuts; a warning without a path",
    ),
    "tcp-state": Code(ERROR, "TCP is on where a program's words need it off, or off where they need it on"),
    "spindle-off": Code(ERROR, "the spindle is off in a cut, or its speed or sense isn't what was asked for"),
    "wrong-tool": Code(ERROR, "another tool cuts than was asked for, or the tool is never loaded"),
    "change-in-cut": Code(ERROR, "a tool is loaded between the cuts of a path"),
    "length-offset": Code(ERROR, "a cut has another tool length offset than was asked for, or none"),
    "work-offset": Code(ERROR, "a cut has another work offset than was asked for"),
    "coolant-off": Code(WARNING, "a cut has other coolant than was asked for"),
    "start-unknown": Code(WARNING, "moves start where the program doesn't say, so their ways aren't known"),
    "start-state": Code(
        ERROR,
        "nothing switches off what an earlier program may have left on; a warning in other sources' text",
    ),
    "end-state": Code(ERROR, "nothing switches off after the last cut what the control's table switches off"),
    "approach-order": Code(ERROR, "the approach brings Z down before the other axes have moved"),
    "approach-deep": Code(ERROR, "before or after its path the cutter goes below the surface that it cuts"),
    "length-off": Code(
        WARNING, "G49 alone, before a retract, where a setting of the control moves Z by the tool's length"
    ),
    "no-retract": Code(
        ERROR,
        "the tool doesn't retract before or after the cuts, or not to where was asked for; a warning where a "
        "control's own move may do it",
    ),
    "word-in-cut": Code(
        ERROR,
        "a word acts in a cut or between cuts that the control's table doesn't have; a warning without a job",
    ),
    "cutter-speed": Code(NOTE, "centre or contact of the tool go faster along the part than F says"),
    "feed-differs": Code(ERROR, "a cut takes another time than the path's feed asks for"),
    "off-path": Code(ERROR, "a program moves the tool off the path that it should follow"),
    "path-missed": Code(ERROR, "a program misses a location of the path that it should follow"),
}
# Found by planning and optimising.
PLANNING = {
    "no-posture": Code(ERROR, "no posture is within the bounds and reachable from its neighbours"),
    "no-rewind": Code(ERROR, "nowhere can an axis at its limit be rewound"),
    "rewind": Code(WARNING, "an axis at its limit is rewound by whole turns"),
    "rewind-phase": Code(NOTE, "with the part turned on the table fewer rewinds would fall within cuts"),
    "cone-assumed": Code(NOTE, "nothing bounds the tool's lean: a cone about the programmed axes is taken"),
    "no-bound": Code(NOTE, "nothing bounds the energy of the machine's drives from below"),
    "setup-kept": Code(NOTE, "another setup looked cheaper, but by no more than chance"),
    "between-locations": Code(
        WARNING, "between two locations the tool or an axis is out of bounds; no path avoids that"
    ),
    "rapid-speed-unknown": Code(WARNING, "rapid moves of axes whose highest speed isn't known"),
    "part-placed": Code(WARNING, "no work offset was given, and the part was placed where it can be cut"),
    "powers-estimated": Code(WARNING, "the powers of drives aren't known and were estimated, within bands"),
    "powers-borrowed": Code(NOTE, "the powers of drives are those of another machine"),
    "slow-speed-assumed": Code(NOTE, "the slowest speeds at which powers were measured aren't stated"),
    "acceleration-unknown": Code(WARNING, "time is to be minimised, and an axis states no acceleration"),
    "off-surface": Code(WARNING, "a location doesn't touch the part"),
    "sunk": Code(WARNING, "a cut reaches deeper into the part than counts as touching"),
    "no-single-contact": Code(WARNING, "the cutter touches the part at more than one point"),
    "contacts-left-out": Code(
        ERROR, "no pass reaches some contacts on the walls; a warning if they are at most half of all"
    ),
    "faces-left-out": Code(
        ERROR, "no pass touches some of the chosen faces; a warning if they are at most half of their area"
    ),
    "several-bodies": Code(NOTE, "a CAD file's bodies are taken together as the part"),
    "scallop-over": Code(
        WARNING, "as the cutter leans, ridges between passes are more than 5 % above the scallop asked for"
    ),
    "part-size": Code(WARNING, "the part is so small or large that its unit is doubtful"),
    "override-unused": Code(WARNING, "an accepted code didn't occur"),
    "no-acceleration": Code(WARNING, "the machine states no acceleration of some axes"),
}
# Found by readers of programs and paths: what was assumed, left out, or looks wrong.
READING = {
    "angles-assumed": Code(WARNING, "the program doesn't state the rotary angles"),
    "angles-as-written": Code(NOTE, "angles are read as given; a control could turn the shorter direction"),
    "approach-unknown": Code(NOTE, "the first moves begin at a point that the program doesn't state"),
    "arc-centre-assumed": Code(WARNING, "the program doesn't state what an arc's centre is relative to"),
    "arc-direction": Code(WARNING, "an arc's points contradict its direction"),
    "arc-nearly-closed": Code(WARNING, "an arc's ends nearly meet: a full circle, or almost no arc"),
    "axis-assumed": Code(NOTE, "no tool axis is given: along Z"),
    "axis-from-normal": Code(NOTE, "the surface normal is used as the tool axis"),
    "cutter-compensation": Code(WARNING, "cutter compensation that only the control could compute"),
    "cycle-as-hole": Code(NOTE, "only the hole of a cycle is read"),
    "cycle-clearance": Code(WARNING, "a cycle doesn't state its retract"),
    "cycle-depth": Code(WARNING, "a cycle doesn't state its depth"),
    "cycle-from-below": Code(WARNING, "a cycle begins below its level"),
    "beyond-control": Code(
        ERROR,
        "the control's table doesn't allow a number, an offset or a line, or the control acts on a comment; "
        "an error where it stops there",
    ),
    "cycle-retracts-below": Code(WARNING, "a cycle retracts to below its start"),
    "cycle-simplified": Code(NOTE, "a cycle is read as one move down and one back"),
    "corners-assumed": Code(NOTE, "how the control takes corners is a setting of the machine"),
    "dwell-in-cut": Code(WARNING, "a dwell of more than some seconds where a feed move has ended"),
    "feed-assumed": Code(NOTE, "no feed is given"),
    "feed-unit-assumed": Code(NOTE, "the unit of the feed isn't stated"),
    "fixed-point-left-out": Code(NOTE, "moves to points that only the machine knows are left out"),
    "feed-meaning": Code(WARNING, "what F counts where linear and rotary axes move together isn't known"),
    "frame-mapped": Code(NOTE, "points are transformed from a frame that the file defines"),
    "frame-unused": Code(WARNING, "a frame that the file defines isn't used"),
    "long-dwell": Code(WARNING, "a dwell may be meant in ms"),
    "long-turn": Code(WARNING, "a rotary axis turns by more than half a turn in one move"),
    "long-turns": Code(WARNING, "more such moves than are listed one by one"),
    "machine-zero-moves": Code(NOTE, "moves in machine coordinates aren't in the path"),
    "mode-assumed": Code(WARNING, "plane, G90 or G93 aren't stated, and settings of the control say them"),
    "motion-assumed": Code(NOTE, "the first position is given without G0 or G1"),
    "no-simultaneous-path": Code(NOTE, "the program has no simultaneous 5-axis motion"),
    "normals-unused": Code(WARNING, "surface normals that the cutter can't touch in one point"),
    "plane-assumed": Code(WARNING, "how the angles of a tilted plane count isn't stated"),
    "plane-on-workpiece": Code(WARNING, "the origin of a tilted plane isn't stated"),
    "positions-assumed": Code(NOTE, "the path shows in which frame tip positions are"),
    "positions-by-part": Code(NOTE, "the part shows in which frame tip positions are"),
    "unit-by-part": Code(NOTE, "the part shows the unit of lengths"),
    "positions-doubtful": Code(WARNING, "tip positions look as if they were in the other frame"),
    "program-end": Code(
        ERROR,
        "no word ends the program, or one that ends subprograms does; an error where moves stand behind the "
        "% that ends it in a cut",
    ),
    "read-differently": Code(
        ERROR,
        "the control refuses a line, or controls read it differently: a comment within a comment; a warning "
        "outside of cuts",
    ),
    "reference-without-axes": Code(WARNING, "a move to the reference point names no axis"),
    "return-level": Code(
        WARNING,
        "a cycle with neither G98 nor G99, which go on at different levels, and nobody says which",
    ),
    "rotary-assumed": Code(WARNING, "a rotary axis is assumed to be at 0"),
    "control-characters": Code(NOTE, "control characters of a tape or a serial line are left out"),
    "skipped-blocks": Code(
        ERROR,
        "with block delete in the other position the program does otherwise; a warning where its cuts stay "
        "the same or are left out",
    ),
    "setup-read": Code(NOTE, "workpiece or tool length are what the head of a program by fiveaxis states"),
    "tool-length-differs": Code(
        ERROR, "the words of a program by fiveaxis contain another tool length than the machine's tool has"
    ),
    "tap-feed-assumed": Code(WARNING, "the feed of a tapping cycle isn't stated"),
    "tool-by-comment": Code(NOTE, "the cutter is taken as the program's comment states it"),
    "tool-differs": Code(WARNING, "the given tool isn't the file's"),
    "tool-unread": Code(WARNING, "the tool's data in the file can't be read"),
    "turn-assumed": Code(NOTE, "the program doesn't state on which turn a rotary axis begins"),
    "unknown-codes": Code(
        WARNING, "M words that aren't documented for the control are taken to switch nothing"
    ),
    "zero-by-path": Code(WARNING, "the program's zero isn't stated; the path of the tool shows it"),
    "zero-doubtful": Code(WARNING, "the program's zero isn't stated, and the path doesn't show it"),
    "increment-assumed": Code(WARNING, "axis words without decimal points, read as the control's increments"),
    "whole-word": Code(
        WARNING, "a setting of the control says what an axis word without a decimal point counts"
    ),
    "angles-doubtful": Code(WARNING, "rotary words look like radians"),
    "not-kept": Code(WARNING, "what the input states can't be written for the control"),
    "unit-doubtful": Code(WARNING, "sizes don't fit the unit of lengths; they fit the other one, or neither"),
    "unit-overridden": Code(WARNING, "the file states another unit of lengths than the one it is read in"),
    "unit-assumed": Code(WARNING, "the unit of lengths isn't stated"),
    "zero-assumed": Code(WARNING, "the position of the program's zero isn't stated"),
}
# Found by writers of programs.
WRITING = {
    "feed-floor": Code(WARNING, "blocks below the control's lowest feed run faster than planned"),
    "feed-rounded": Code(WARNING, "blocks so slow that the decimals of F change their duration"),
    "operator": Code(NOTE, "the job asks for no tool, spindle, coolant or retract: the operator sees to it"),
    "wound": Code(NOTE, "a rotary axis ends more than a turn from zero, and isn't sent home"),
    "number-assumed": Code(WARNING, "a number wasn't given, or can't be written as given"),
}
CODES: dict[str, Code] = CHECKS | PLANNING | READING | WRITING

OVERRIDABLE = tuple(name for name, code in CODES.items() if code.severity == ERROR and code.overridable)


def require_codes(names: Iterable[str]) -> tuple[str, ...]:
    """Check codes to be accepted, and return each once, in order.

    `SettingError` for a code that doesn't exist, or isn't that of an error.
    """
    given = tuple(dict.fromkeys(names))
    for name in given:
        if name in OVERRIDABLE:
            continue
        near = difflib.get_close_matches(name, OVERRIDABLE, n=1)
        hint = f"; did you mean {near[0]}?" if near else f"; known: {', '.join(sorted(OVERRIDABLE))}"
        fact = f"{name} keeps no program back" if name in CODES else f"unknown code {name!r}"
        raise SettingError(f"override: {fact}{hint}")
    return given
