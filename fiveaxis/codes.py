"""Every code that a finding about a path, a motion or a program can have, with what it means.

Codes are stable: scripts depend on them, and ``override`` names them. `OVERRIDABLE` holds those that keep a
motion off a machine unless someone accepts them by name.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

from fiveaxis.errors import SettingError

ERROR, WARNING, NOTE = "error", "warning", "note"


@dataclass(frozen=True)
class Code:
    """One code.

    Parameters
    ----------
    severity : the severest that it has: ``error``, ``warning`` or ``note``
    meaning : what was found
    """

    severity: str
    meaning: str


# Found by the checks on a motion.
CHECKS = {
    "not-finite": Code(ERROR, "an axis value or duration isn't a number, or a duration is negative"),
    "axis-limit": Code(ERROR, "an axis beyond its travel"),
    "contact-error": Code(ERROR, "the axis values don't lead the tool where the path wants it"),
    "tilt": Code(ERROR, "the tool leans outside the bounds that were asked for"),
    "held-axis": Code(ERROR, "a rotary axis that should stand has moved"),
    "jump": Code(
        ERROR, "a rotary axis turns far within one cutting block; a warning where gouges are checked"
    ),
    "turn-rate": Code(ERROR, "a rotary axis turns faster along the cut than asked for, deg/mm"),
    "singular-turn": Code(WARNING, "the first rotary axis turns while the tool points nearly along it"),
    "singular-crossing": Code(WARNING, "the path passes the direction in which rotary axes lose one"),
    "speed": Code(ERROR, "a block is shorter than an axis at its highest speed needs"),
    "feed-over": Code(
        WARNING, "the programmed feed asks more of an axis than its highest speed: it runs slower"
    ),
    "rotary-slows": Code(WARNING, "a rotary axis can't keep up with the feed"),
    "rotary-acceleration": Code(WARNING, "the speed of a rotary axis changes faster than it can"),
    "linear-acceleration": Code(WARNING, "the speed of a linear axis changes faster than it can"),
    "tip-deviation": Code(
        ERROR,
        "between blocks of axis words the tool leaves its straight way; a note between bare locations, and a "
        "warning in a program without its path",
    ),
    "axis-off-plane": Code(
        WARNING, "between two locations of a program the tool axis leaves the plane of its directions there"
    ),
    "gouge": Code(ERROR, "the cutting part reaches into the part, at a location or on the way to it"),
    "shank-collision": Code(ERROR, "the shank reaches into part, stock, fixture or table"),
    "holder-collision": Code(ERROR, "the holder reaches into part, stock, fixture or table"),
    "fixture-collision": Code(ERROR, "the cutter reaches into a fixture or the table"),
    "machine-collision": Code(ERROR, "bodies of the machine reach into each other, part, stock or fixture"),
    "shank-clearance": Code(WARNING, "the shank comes nearer than its clearance"),
    "holder-clearance": Code(WARNING, "the holder comes nearer than its clearance"),
    "fixture-clearance": Code(
        WARNING, "the cutter comes nearer to a fixture or the table than its clearance"
    ),
    "machine-clearance": Code(WARNING, "bodies of the machine come nearer than their clearance"),
    "approach-blocked": Code(
        ERROR, "no way to the first location is clear of part, stock, fixtures and machine"
    ),
    "retreat-blocked": Code(
        ERROR, "no way off the last location, and up from there, is clear of what stands around"
    ),
    "text-differs": Code(ERROR, "a program's text, read back, ends a block elsewhere than was planned"),
    "duration-differs": Code(
        ERROR,
        "by its F a block takes another time than was planned; a warning where F has too few digits for it",
    ),
    "rapid-in-cut": Code(ERROR, "by a program's text a move is rapid that was planned at feed"),
    "tcp-state": Code(ERROR, "TCP is on, or off, where a program's words are meant otherwise"),
    "spindle-off": Code(ERROR, "the spindle stands in a cut, or turns otherwise than asked for"),
    "off-path": Code(ERROR, "a program leads the tool where the path that it should follow isn't"),
    "path-missed": Code(ERROR, "a program doesn't come by a location of the path that it should follow"),
}
# Found by planning and optimising.
PLANNING = {
    "no-posture": Code(ERROR, "no posture keeps the bounds and joins its neighbours"),
    "no-rewind": Code(ERROR, "no place where an axis at its limit could turn back"),
    "rewind": Code(WARNING, "an axis at its limit turns back by whole turns"),
    "rewind-phase": Code(NOTE, "turned on the table the part would need fewer rewinds within cuts"),
    "free-start": Code(NOTE, "a closed pass begins elsewhere than in the input"),
    "setup-kept": Code(NOTE, "another setup looked cheaper, by no more than can be told from chance"),
    "between-locations": Code(
        WARNING, "between two locations the tool leans, or an axis goes, out of bounds: no path avoids that"
    ),
    "rapid-speed-unknown": Code(WARNING, "rapid moves of axes whose highest speed isn't known"),
    "acceleration-unknown": Code(WARNING, "the least time is asked for, and an axis states no acceleration"),
    "off-surface": Code(WARNING, "a location doesn't touch the part"),
    "sunk": Code(WARNING, "a cut reaches deeper into the part than counts as touching"),
    "no-single-contact": Code(WARNING, "a location touches the part with more than one place of the cutter"),
    "override-unused": Code(WARNING, "a code is accepted that didn't occur"),
    "no-acceleration": Code(WARNING, "the machine states no acceleration of some axes"),
}
# Said by readers of programs and paths: what was assumed, left out, or looks wrong.
READING = {
    "angles-assumed": Code(WARNING, "the program doesn't say where the rotary axes are"),
    "angles-as-written": Code(NOTE, "angles are read as given, where a control could take the shorter way"),
    "approach-unknown": Code(NOTE, "the first moves begin at a place that the program doesn't tell"),
    "arc-centre-assumed": Code(WARNING, "what an arc's centre counts from isn't said"),
    "arc-direction": Code(WARNING, "an arc's points contradict its direction"),
    "arc-nearly-closed": Code(WARNING, "an arc's ends nearly meet: a whole circle or nearly none"),
    "axis-assumed": Code(NOTE, "no tool axis is given: along Z"),
    "axis-from-normal": Code(NOTE, "the tool axis is taken from the surface normal"),
    "cutter-compensation": Code(WARNING, "cutter compensation that only the control could work out"),
    "cycle-as-hole": Code(NOTE, "a cycle is read as its hole alone"),
    "cycle-clearance": Code(WARNING, "a cycle doesn't say how far it draws back"),
    "cycle-depth": Code(WARNING, "a cycle doesn't say how deep it goes"),
    "cycle-from-below": Code(WARNING, "a cycle begins below its level"),
    "cycle-retracts-below": Code(WARNING, "a cycle draws back to below where it began"),
    "cycle-simplified": Code(NOTE, "a cycle is read as one way down and one back"),
    "feed-assumed": Code(NOTE, "no feed is given"),
    "axis-creeps": Code(NOTE, "an axis moves so slowly that it counts as standing"),
    "feed-unit-assumed": Code(NOTE, "the unit of the feed isn't said"),
    "fixed-point-left-out": Code(NOTE, "moves to places that only the machine knows"),
    "frame-mapped": Code(NOTE, "points are carried from a frame that the file defines"),
    "frame-unused": Code(WARNING, "a frame that the file defines and isn't used"),
    "long-dwell": Code(WARNING, "a dwell that may be meant in ms"),
    "long-turn": Code(WARNING, "a rotary axis turns by more than half a turn in one move"),
    "long-turns": Code(WARNING, "more such moves than are named one by one"),
    "machine-zero-moves": Code(NOTE, "moves to places of the machine that aren't in the path"),
    "no-simultaneous-path": Code(NOTE, "the program has no simultaneous 5-axis motion"),
    "normals-unused": Code(WARNING, "surface normals that the cutter can't touch in one point"),
    "plane-assumed": Code(WARNING, "how a tilted plane counts its angles isn't said"),
    "plane-on-workpiece": Code(WARNING, "where a tilted plane lies isn't said"),
    "positions-doubtful": Code(WARNING, "tip positions look as if they counted in the other frame"),
    "reference-without-axes": Code(WARNING, "a move to the reference point names no axis"),
    "rotary-assumed": Code(WARNING, "a rotary axis is taken to stand at 0"),
    "several-tools": Code(WARNING, "several tools, and all is read with one"),
    "tap-feed-assumed": Code(WARNING, "the feed of a tapping cycle isn't said"),
    "tool-change": Code(WARNING, "another tool is taken"),
    "tool-differs": Code(WARNING, "the tool that was given isn't the file's"),
    "tool-unread": Code(WARNING, "what the file says about the tool can't be read"),
    "turn-assumed": Code(NOTE, "on which of its turns a rotary axis begins isn't in the program"),
    "unit-assumed": Code(WARNING, "the unit of lengths isn't said"),
    "zero-assumed": Code(WARNING, "where the program's zero lies isn't said"),
}
# Said by writers of programs.
WRITING = {
    "feed-floor": Code(WARNING, "blocks slower than the control runs any: they go quicker than planned"),
    "feed-rounded": Code(WARNING, "blocks so slow that the decimals of F change their time"),
    "number-assumed": Code(WARNING, "a number that nobody has given, or that can't be written as given"),
}
CODES: dict[str, Code] = CHECKS | PLANNING | READING | WRITING

OVERRIDABLE = tuple(name for name, code in CODES.items() if code.severity == ERROR)


def require_codes(names: Iterable[str]) -> tuple[str, ...]:
    """Check codes that someone accepts; each once, in order.

    Raises
    ------
    SettingError
        A code that doesn't exist, or that keeps nothing off a machine.
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
