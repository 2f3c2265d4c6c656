"""Vocabulary of Sinumerik 840D, and modal state of a program.

The vocabulary, of ISO equivalents, words without effect and what is refused, is after the *NC Programming
Manual* of SINUMERIK 840D sl (Siemens 6FC5398-2BP40-3BA1), tables of G commands and statements. A word in no
table is refused: it may be a subprogram or a cycle of the machine builder.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.nc.languages.block import IS_CYCLE, IS_JUMP, Block, BlockError, Hole, Plane, reasons
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.planes import AXES, CoordinateState, turns
from fiveaxis.nc.languages.sinumerik_cycles import HOLES, Swivel

ROTARY = "ABC"

_TYPE = re.compile(r"\s*(?:REAL|INT|BOOL|(CHAR|STRING|AXIS)\s*(?:\[[^\]]*\])?)(?![A-Z0-9_])")
_DECLARED = re.compile(r"\s*([A-Z_][A-Z0-9_]*)\s*(?:\[[^\]]*\])?\s*(?:=\s*([^,]*))?(?:,|$)\s*")

# G commands with an equivalent in ISO 6983.
SAME_IN_ISO = {
    **{n: f"G{n}" for n in (0, 1, 2, 3, 4, 17, 18, 19, 40, 41, 42, 54, 55, 56, 57, 90, 91, 93, 94, 95)},
    **dict.fromkeys((70, 700), "G20"),
    **dict.fromkeys((71, 710), "G21"),
    97: "G95",
    971: "G94",
}

# G53, G153 and SUPA suppress all frames for one block: machine coordinates.
MACHINE_COORDINATES = (53, 153)

# G commands without effect on the path: corners, exact stop, approach with radius compensation off.
IGNORED_G = frozenset(
    (9, 60, 62, 64, 290, 601, 602, 603, 621, 641, 642, 643, 644, 645, 646, 140, 141, 142, 143)
) | frozenset((340, 341, 450, 451, 460, 461, 462))

# Those that set how corners are rounded.
ROUNDING_G = frozenset((60, 64, 641, 642, 643, 644, 645))

REFUSED_G = {
    **dict.fromkeys((33, 34, 35, 63, 331, 332), "cuts a thread, whose feed isn't supported"),
    **dict.fromkeys((58, 59), "shifts the coordinates; write TRANS or ATRANS"),
    **dict.fromkeys((110, 111, 112), "sets a pole; polar coordinates aren't supported"),
    **dict.fromkeys((96, 961, 962, 973), "makes the spindle speed depend on X, which isn't supported"),
    **dict.fromkeys((147, 148, 247, 248, 347, 348), "is a soft approach, whose moves the control generates"),
    291: "switches to the ISO dialect; post the program in one language",
}

_IGNORED = """
ORIWKS ORIMKS ORIAXES ORIVECT ORIPLANE ORIEULER ORIRPY ORIRPY2 ORIVIRT1 ORIVIRT2 ORISON ORISOF ORIS ORIC
ORID ORICONTO ORIPATH ORIPATHS COMPON COMPOF COMPCAD COMPCURV COMPSURF COMPPATH UPATH SPATH CPRECON
CPRECOF SOFT BRISK DRIVE SOFTA BRISKA DRIVEA JERKLIM JERKLIMA VELOLIM VELOLIMA ACCLIMA FFWON FFWOF
DYNNORM DYNPOS DYNROUGH DYNSEMIFIN DYNFINISH DYNPREC FNORM FLIN FCUB FPO CFC CFTCP CFIN FGROUP FGREF
FENDNORM FTOCON FTOCOF CDON CDOF CDOF2 CUT2D CUT2DF CUT2DD CUT2DFD CUT3DC CUT3DF CUT3DFF CUT3DFS CUT3DCC
CUT3DCCD CUT3DCD CUTCONOF CUTMOD NORM KONT KONTC KONTT STOPRE MSG DISPLAY GROUP_BEGIN GROUP_END
GROUP_ADDEND WORKPIECE SETMS SPCON SPCOF SPOS SPOSA WAITS WALIMON WALIMOF STARTFIFO STOPFIFO STOPFIFOALL
FIFOCTRL SBLON SBLOF DISPLOF DISPLON ACTBLOCNO SAVE PROC EXTERN DIAMOF DIAMCYCOF TCARR TCOABS TCOFR
TOROTOF PAROTOF TOFRAMEOF TLIFT SD TMON TMOF CYCLE832 COLLPAIR GETD RELEASE GET WAITMC CLEARM SETM
LIFTFAST TOFFOF TOFFON ROTSOF GFRAME0 GWPSON GWPSOF RTLION
"""
_SETTINGS = """
ADIS ADISPOS CTOL OTOL ATOL OVR OVRRAP OVRA ACC FL FA FGREF LIMS SPOS SPOSA DL SPI VC FPR SCC
"""

# Words and functions without effect on the path; brackets after them belong to them.
IGNORED = frozenset(_IGNORED.split())

# The same before ``=``, with or without an index.
IGNORED_SETTINGS = frozenset(_SETTINGS.split())

_TURN = "rotates the coordinates, which isn't supported; write ROT, AROT or CYCLE800"
_KINEMATICS = "is an unsupported transformation; write TRAORI"
_POLAR = "is a polar coordinate or an angle, which isn't supported; write X, Y and Z"
_EXTRA = "adds a chamfer or a rounding, which isn't supported; post its moves"
_CURVE = "is a curve, which isn't supported; post G1, G2 and G3"
_SIDE = "moves axes independently of the path, which isn't supported; write G0 or G1"
_ANGLES = "gives the tool direction by angles whose meaning depends on machine data; write A3, B3, C3"

# The first pattern that matches a whole name gives the reason.
REFUSED = reasons(
    (r"CYCLE[0-9]+|POCKET[0-9]*|SLOT[0-9]|HOLES[0-9]|LONGHOLE", IS_CYCLE),
    (r"IF|ELSE|ENDIF|GOTO[BFCS]?|LOOP|ENDLOOP|CASE", IS_JUMP),
    (
        r"WHILE|ENDWHILE|FOR|ENDFOR|REPEATB?|UNTIL|CALL|EXTCALL",
        "has words that don't belong to it; correct it",
    ),
    (r"PCALL|ISOCALL|SPRINT|INIT|START|REPOS[A-Z]*", IS_JUMP),
    (r"A?ROTS|CROTS?|TO(ROT|FRAME)[XYZ]?|PAROT", _TURN),
    (r"A?SCALE|A?MIRROR", "scales or mirrors the coordinates, which isn't supported; post without it"),
    (r"TRANSMIT|TRACYL|TRAANG|TRACON|TRAFOON|TRAORI_.*", _KINEMATICS),
    (r"AP|RP|ANG[12]?|AR", _POLAR),
    (r"CHF|CHR|RNDM?", _EXTRA),
    (r"[ABC]SPLINE|POLY|CIP|CT|INVCW|INVCCW|PO|PL|[IJK]1", _CURVE),
    (r"POSA?|POSP|FXS|MEAS?|MEAW|MOV|OSCILL|PUNCH.*", _SIDE),
    (r"[ABC][267]|THETA|LEAD|TILT|PSI|NUT|ORIRESET|ORICON[A-Z]*|ORICURVE|[XYZ]H", _ANGLES),
    (r"OFFN|TOFFL|TOFFR|TOFF", "offsets the tool from its path, which isn't supported; post without it"),
    (r"FB|FZ|FRC|FRCM|FD", "is a feed per block or per tooth, which isn't supported; write F"),
    (r"DIAMON|DIAM90", "makes X a diameter, as on lathes; post for a mill"),
    (r"\$.*", "is a system variable, whose effect is unknown; look up what it sets, and post without it"),
)


# Words of several letters that act.
_ACTING = frozenset(
    ("DEF", "TRAORI", "TRAFOOF", "SUPA", "TRANS", "ATRANS", "ROT", "AROT", "SCALE", "MIRROR", "MCALL", "RET")
)


def is_word(name: str) -> bool:
    """Check whether a name is a word of the language, and so no subprogram's."""
    known = name in IGNORED or name in HOLES or name in _ACTING
    return known or any(pattern.fullmatch(name) for pattern, _ in REFUSED)


def refusal(name: str) -> str:
    """Return the reason why a name is refused."""
    for pattern, reason in REFUSED:
        if pattern.fullmatch(name):
            return f"{name} {reason}"
    return (
        f"{name} isn't a supported word, and may be a subprogram or an axis; put its file beside the "
        "program, or post one program with all moves"
    )


@dataclass
class State(CoordinateState):
    """Modal state of the control.

    Parameters
    ----------
    variables : values of R parameters and other names
    declared : names of DEF, which are local to a subprogram
    texts : declared names of texts
    motion, feed : the last ones, restored after a drilled hole
    tool_axis : letter of the axis along which cycles drill
    incremental : G91
    hole : the cycle that MCALL repeats at every position
    program : frame of TRANS, ATRANS, ROT and AROT, relative to `swivel`
    swivel : plane of CYCLE800
    angles : deg, of the rotary axes, where the program gives them
    """

    variables: dict[str, float] = field(default_factory=dict)
    declared: set[str] = field(default_factory=set)
    texts: set[str] = field(default_factory=set)
    motion: str | None = None
    feed: float | None = None
    tool_axis: str = "Z"
    incremental: bool = False
    hole: Hole | None = None
    program: Plane = field(default_factory=Plane)
    swivel: Plane = field(default_factory=Plane)
    angles: dict[str, float] = field(default_factory=dict)

    @property
    def is_plain(self) -> bool:
        """Whether blocks of axis words, directions and F mean what they say."""
        return self.hole is None and not self.incremental and not self.positioned

    def frame(self, word: str) -> Plane:
        """Return the combined frame, set by `word`."""
        return self.swivel.then(self.program).by(word)

    def declare(self, text: str) -> None:
        """Read what follows DEF, as in ``DEF REAL a, b=2``; variables start at 0."""
        kind = _TYPE.match(text)
        if kind is None:
            raise BlockError("DEF is supported with REAL, INT, BOOL, CHAR, STRING or AXIS; correct it")
        at = kind.end()
        while at < len(text):
            found = _DECLARED.match(text, at)
            if found is None:
                raise BlockError(f"{text[at : at + 20].strip()!r} isn't a name that can be declared")
            initial = (found[2] or "0").strip()
            self.declared.add(found[1])
            if kind[1]:
                self.texts.add(found[1])
            elif initial in ("TRUE", "FALSE"):
                self.variables[found[1]] = float(initial == "TRUE")
            else:
                self.variables[found[1]] = evaluate(initial, self.variables.__getitem__)
            at = found.end()

    def begin_subprogram(self) -> Callable[[], None]:
        """Put the declared variables aside; return what takes them back."""
        kept, self.declared = self.declared, set()
        values = {name: self.variables.pop(name) for name in kept if name in self.variables}

        def leave() -> None:
            for name in self.declared:
                self.variables.pop(name, None)
            self.variables |= values
            self.declared = set(kept)

        return leave

    def swivel_plane(self, swivel: Swivel | None) -> Plane:
        """Set or reset the plane of CYCLE800; either deletes the frame of TRANS and ROT."""
        if swivel is not None and swivel.additive:
            self.swivel = self.swivel.then(self.program).then(swivel.plane)
        else:
            self.swivel = Plane() if swivel is None else swivel.plane
        self.program = Plane()
        self.positioned = False
        return self.frame("CYCLE800")

    def change_frame(self, name: str, words: Mapping[str, float], plane_angle: float | None) -> Plane:
        """Set the frame by TRANS or ROT, or change it by ATRANS or AROT; missing X, Y and Z are 0.

        The plane's angle, RPL, deg, is about the tool axis, instead of the words of a rotation.
        """
        x, y, z = (words.get(c, 0.0) for c in AXES)
        if name in ("TRANS", "ATRANS"):
            step = Plane(origin=np.array([x, y, z]))
        elif plane_angle is not None:
            step = Plane(rotation=turns(self.tool_axis, [plane_angle]))
        else:
            # RPY angles, the default of machine data 10600 (1): about Z, then Y', then X''.
            step = Plane(rotation=turns("ZYX", [z, y, x]))
        self.program = step if name in ("TRANS", "ROT") else self.program.then(step)
        return self.frame(name)

    def remember(self, words: Mapping[str, float], increments: str = "", absolutes: str = "") -> None:
        """Update the feed and the rotary axes' end angles."""
        self.feed = words.get("F", self.feed)
        for letter in ROTARY:
            value = words.get(letter)
            if value is None:
                continue
            if letter not in increments and (not self.incremental or letter in absolutes):
                self.angles[letter] = value
            elif letter in self.angles:
                self.angles[letter] += value

    def turned(self, letter: str, value: float, mode: str) -> float:
        """Return the end angle, deg, of a rotary axis: shorter direction (DC), + (ACP) or - (ACN).

        The value is from 0 to 360 deg, and returned as it is if the axis's angle is unknown.
        """
        now = self.angles.get(letter)
        if now is None:
            return value
        forward = (value - now) % 360.0
        if mode == "ACP" or forward == 0.0 or (mode == "DC" and forward <= 180.0):
            return now + forward
        return now + forward - 360.0

    def drill(self, hole: Hole, line: int) -> Iterator[Block]:
        """Yield a hole's moves, then restore the motion, G91 and the feed that were in force."""
        absolute, relative = (("G90",), ("G91",)) if self.incremental else ((), ())
        for word, words in hole.moves(self.tool_axis):
            yield Block(line, (word,) if word == "G4" else (*absolute, word), (), words, drills=True)
        after = (*relative, *(() if self.motion is None else (self.motion,)))
        own_feed = hole.feed_down or hole.feed_back
        feed = {"F": self.feed} if own_feed and self.feed is not None else {}
        if after or feed:
            yield Block(line, after, (), feed)
