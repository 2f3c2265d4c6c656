"""G-code: lines are split into words of a letter and a number, which `fiveaxis.nc.control` interprets.

ISO 6983 and RS274/NGC syntax: upper or lower case, blanks anywhere, numbers without leading zero or sign,
comments ``( )``, also nested, and ``;``, lines of ``%``, the last of which ends the program, block numbers
``N``, program numbers ``O``, block delete ``/``, the shift of G52, planes tilted by G68.2.
`fiveaxis.nc.languages.macro` runs variables, loops, jumps and calls. Anything else is refused with its
reason: a program is read completely or not at all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from fiveaxis.base import Array, product
from fiveaxis.nc.languages.block import (
    IS_CYCLE,
    NO_WORDS,
    Block,
    BlockError,
    Plane,
    number_of,
    put_word,
    reasons,
)
from fiveaxis.nc.languages.choice import tape_end
from fiveaxis.nc.languages.macro import Macros, compact_code, without_head
from fiveaxis.nc.languages.planes import rotation_onto, turns
from fiveaxis.nc.languages.runs import PlainLines, Reader
from fiveaxis.nc.writing.table_parts import Arithmetic
from fiveaxis.nc.writing.tables import DIALECTS

WORD_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(rf"([A-Z])({WORD_NUMBER})")


# Word that switches TCP on -> words that switch it off. On Fanuc and Haas it is a kind of tool length
# compensation, and those words replace one another. M428 and M429 (identity) are LinuxCNC's kinematics.
_LENGTH_WORDS = frozenset(("G43", "G44", "G49"))
TIP_WORDS: dict[str, frozenset[str]] = {
    **dict.fromkeys(("G43.4", "G43.5", "G234"), _LENGTH_WORDS),
    "G141": frozenset(("G40", "G140", "G174")),
    "M128": frozenset(("M129",)),
    "M428": frozenset(("M429",)),
}

# These switch off even if nothing was switched on.
ALWAYS_OFF = frozenset(("M129", "M429"))

# Word -> the mode that it switches off.
CANCELS = {
    "G15": "polar coordinates (G16)",
    **dict.fromkeys(("G61", "G61.1", "G64"), "path mode (G61, G64)"),
    "G187": "smoothness (G187)",
    "M11": "clamp of the 4th axis (M10)",
    "M13": "clamp of the 5th axis (M12)",
    "G40": "cutter compensation (G41, G42)",
    "G49": "length offset and TCP (G43, G43.4, G234)",
    "G50": "scaling (G51)",
    "G69": "rotation and tilted plane (G68, G68.2)",
    "G80": "fixed cycle (G81)",
    "G92.1": "shift (G92, G52)",
    "G255": "dynamic work offset (G254)",
    "G269": "tilted plane (G268)",
    "M429": "TCP (M428)",
}
# The same where the block has axis words, all 0, and nothing else; these are no positions.
CANCELS_AT_ZERO = {"G50.1": "mirror (G51.1)", "G100": "mirror (G101)"}

_PLAIN = "post the program with plain numbers"
_DIN = (
    "is DIN/ISO of Heidenhain, where G30, G98 and others mean something else; post Klartext, or another ISO"
)
_SINUMERIK = "is Sinumerik code in an ISO program (Fanuc, Haas, LinuxCNC); post it in one language"

# What a line that doesn't consist of words may be; the first match gives the reason.
NOT_WORDS = reasons(
    (r"BEGINPGM|BLKFORM|TOOLCALL|FMAX", "is Heidenhain code in an ISO program; post it in one language"),
    (r"M?CYCLE[0-9]*|MCALL", IS_CYCLE),
    (r"A?ROTS?|A?TRANS|A?MIRROR|A?SCALE", "changes the coordinates; post without it"),
    (r"TRAFOOF|SUPA|DEF|MSG", _SINUMERIK),
    (
        r"(?:IF|WHILE|REPEAT|FOR)(?=[\[(#0-9XYZ]|$)|GOTO(?=[-+\[#0-9]|$)|(?:ENDFOR|CALL|SUB|DO[0-9]|END[0-9])$",
        f"jumps or repeats, which isn't run; {_PLAIN}",
    ),
    (r"\*$", _DIN),
    (r"M94(?=[A-C])", "counts rotary axes from below a turn (Heidenhain), which isn't G-code; post Klartext"),
    (r"[#\[<]", f"is a variable or an expression, which isn't evaluated; {_PLAIN}"),
    (r"=", _SINUMERIK),
    (r"[@^]", "is a polar coordinate of LinuxCNC, which isn't read; post X and Y"),
    (r"[(]", "opens a comment that isn't closed on its line; close it"),
    (r",[A-Z]", "is a chamfer or a rounding, which isn't supported; post its moves"),
)

FRAME_WORDS = ("G52", "G53.1", "G68.2", "G69")
# P of G68.2 -> the words of each of its lines, beside P and Q. Q0 of P2 is left out: Fanuc counts it in the
# plane, LinuxCNC on the workpiece.
BY_LINES = {2.0: ("XYZ", "XYZ", "XYZ"), 3.0: ("XYZIJK", "IJK")}
# Cosine between the vectors of P3, which controls straighten or refuse, and sine of the angle
# at the origin of P2.
SAME_DIRECTION = 1e-4
_PART = re.compile(r"G0*68\.2(?![0-9])(?=.*P0*([23])\.?0*(?![0-9.]))(?=.*Q0*([1-3])\.?0*(?![0-9.]))")

_CHANGES = re.compile("M0*6(?![0-9])")
# The name of a program: <PART>, O<PART>, :0001, and $PART.MIN% of Okuma.
_NAMED = re.compile(r"(?:N[0-9]+)?(?:O?<[A-Z0-9_.+-]+>|\$[A-Z0-9_-]+\.MIN%?|:[0-9]+)")
_DELETED = re.compile("(?:N[0-9]+)?/")
_DIN_HEAD = re.compile("%[^*]*G7[01]")


class Iso(Reader):
    """G-code; empty lines, comments and ``%`` make no blocks.

    A line of ``O`` and text, which some CAM systems write for the operator to fill in, is a comment.
    """

    forms = (
        PlainLines.of_words("ABCUVWXYZ", r"[ \t]*+"),
        PlainLines.of_words("ABCUVWXYZIJK", r"[ \t]*+", "[IJK]"),
    )
    # Brackets in brackets are left to `compact_code`.
    comments = re.compile(r"\([^()\n]*+\)|;[^\n]*+")

    def _begin(self) -> None:
        # Where the control isn't known, a comparison on which one would decide otherwise has no value.
        unknown = Arithmetic(doubtful=max(d.arithmetic.same or 0.0 for d in DIALECTS.values()))
        rules = unknown if self.control is None else self.control.arithmetic
        self.last = tape_end(self.source)
        self.macros, self.frames = Macros(self.tape, rules), Frames()
        # The word that has switched TCP on.
        self.tip_word: str | None = None

    def continues(self, text: str) -> bool:
        """Whether a plane goes on after this line, with its next point or vector."""
        return "68.2" in text and is_unfinished(compact_code(text))

    def read(self, line: int, text: str) -> list[Block]:
        """Read a line, or those of a plane by points or vectors."""
        text, *rest = text.split("\n")
        code = compact_code(text)
        if not code or code[0] == "%" or _is_title(text, code):
            # The head of a program in Heidenhain's DIN/ISO, as ``%PART G71 *``.
            if code[-1:] == "*" or _DIN_HEAD.fullmatch(code):
                raise BlockError(_DIN)
            self.ended = line == self.last and self.tape.called is None
            return []
        if _NAMED.fullmatch(code):
            return [Block(line, words={"O": 0.0})]
        if "/" in code and self.block_delete and _DELETED.match(code):
            return [Block(line, skipped=True)]
        code = self.macros.take(without_head(code))
        if not code:
            assigned = tuple(f"variable {each}" for each in self.macros.assigned)
            return [Block(line, stated=assigned)] if assigned else []
        block = _parse_block(line, code)
        if not (block.g or block.m):
            return [block] if block.words else []
        block = _cancelling(_without_fast_mode(block._replace(tip_control=self._switch_tip(block))))
        block = _timed_by_x(block, text) if "G4" in block.g and "X" in block.words else block
        if frozenset(FRAME_WORDS).isdisjoint(block.g):
            return [block]
        more = [_parse_block(line, self.macros.take(without_head(compact_code(part)))) for part in rest]
        return [self.frames.take(block, more)]

    def _switch_tip(self, block: Block) -> bool | None:
        """Return True if a block switches TCP on, False if off, None if neither."""
        words = (*block.g, *block.m)
        if (on := next((word for word in words if word in TIP_WORDS), None)) is not None:
            self.tip_word = on
            return True
        if ALWAYS_OFF.union(TIP_WORDS.get(self.tip_word or "", ())).isdisjoint(words):
            return None
        self.tip_word = None
        return False


def _without_fast_mode(block: Block) -> Block:
    """Ignore ``G5 P10000``, Fanuc's high-speed mode; with axis words G5 is a spline."""
    if "G5" not in block.g or set(block.words) != {"P"}:
        return block
    return block._replace(
        g=tuple(w for w in block.g if w != "G5"),
        words=NO_WORDS,
        ignored=("G5",),
        stated=(f"G5 P{block.words['P']:g}",),
    )


def _cancelling(block: Block) -> Block:
    """Return a block with the modes that it switches off; ``G50.1 X0 Y0 Z0`` moves nothing."""
    for word in CANCELS_AT_ZERO.keys() & set(block.g):
        letters = block.words.keys()
        if len(block.g) == 1 and set("XYZ") <= letters <= set("XYZABC") and not any(block.words.values()):
            return Block(block.line, m=block.m, ignored=(word,), cancels=(CANCELS_AT_ZERO[word],))
    return block._replace(cancels=tuple(CANCELS[w] for w in (*block.g, *block.m) if w in CANCELS))


def _timed_by_x(block: Block, text: str) -> Block:
    """Convert ``G4 X1.5``, Fanuc's dwell in seconds, to ``G4 P1.5``."""
    if set(block.words) != {"X"}:
        return block
    if re.search(r"X[-+]?[0-9]*\.", compact_code(text)) is None:
        raise BlockError(
            f"G4 X{block.words['X']:g} without a decimal point is in s or ms, depending on the control's "
            "settings; write it with a point, or P in s"
        )
    return block._replace(words={"P": block.words["X"]})


def _is_title(text: str, code: str) -> bool:
    """Check for a line like ``O ENTER OP AND LAST 3 DIGITS``, unlike O numbers and LinuxCNC's O words."""
    return code[0] == "O" and re.match(r"\s*O\s+[A-Z][A-Z ]+", text, re.IGNORECASE) is not None


def _parse_block(line: int, code: str) -> Block:
    g: list[str] = []
    m: list[str] = []
    words: dict[str, float] = {}
    tool = ""
    found = WORD.findall(code)
    if "".join(map("".join, found)) != code:
        raise BlockError(_explain(code))
    for letter, number in found:
        value = number_of(letter, number)
        if letter == "G":
            g.append(f"G{value + 0.0:g}")
        elif letter == "M":
            m.append(f"M{value:g}")
        elif letter == "T" and "T" in words and not tool and _CHANGES.search(code):
            # T1 T2 M6 loads T1, and T2 waits for the next change (Mazak).
            tool, words["T"] = f"T{words['T']:g}", value
        else:
            put_word(words, letter, value)
    words.pop("N", None)
    return Block(line, tuple(g), tuple(m), words or NO_WORDS, tool=tool)


def _explain(code: str) -> str:
    """Return the reason why a line doesn't consist of words."""
    for pattern, reason in NOT_WORDS:
        found = pattern.search(code)
        if found is not None:
            return f"{found[0]!r} {reason}"
    rest = next(part for part in WORD.split(code)[::3] if part)
    return f"{rest[:20]!r} isn't a word of a letter and a number; correct it"


def is_unfinished(code: str) -> bool:
    """Check whether a line without comments and blanks states a plane of which the next line is a part."""
    found = _PART.search(code)
    return found is not None and int(found[2]) < len(BY_LINES[float(found[1])])


class Frames:
    """Shift and tilted plane of an ISO program (Fanuc Series 30i-A, Descriptions B-63942EN, 5.44).

    ``G52 X Y Z`` moves the zero of every work offset. ``G68.2 X Y Z I J K`` puts the plane at X, Y, Z of it
    and rotates it by Euler angles: I about Z, J about the new X, K about the new Z. With ``P2`` three lines
    ``Q1`` to ``Q3`` state its origin, a point on its X and one on the side of its Y, with ``P3`` two lines
    ``Q1`` and ``Q2`` its origin with the direction of its X, and that of its Z. ``G53.1`` turns the tool
    normal to it. ``G69`` cancels the plane.
    """

    def __init__(self) -> None:
        self.shift, self.plane, self.tilted = Plane(), Plane(), False

    def take(self, block: Block, more: Sequence[Block] = ()) -> Block:
        """Return a block with its change of the frame.

        `more` are further lines of a plane by points or vectors. `BlockError` for G68.2 by several angles
        about axes (P1), points or vectors that make no plane, or two of these words in one block.
        """
        present = [word for word in FRAME_WORDS if word in block.g]
        if len(present) > 1:
            raise BlockError(f"{' and '.join(present)} in one block; write one of them")
        [word] = present
        if word == "G53.1":
            return block._replace(vector=(0.0, 0.0, 1.0))
        if word == "G52":
            return self._move_zero(block)
        rest, self.plane, self.tilted = block.words, Plane(), word == "G68.2"
        if self.tilted:
            self.plane = _plane([block, *more])
            rest = {c: value for c, value in rest.items() if c not in "XYZIJKPQ"}
        return block._replace(words=rest, frame=self.shift.then(self.plane).by(word))

    def _move_zero(self, block: Block) -> Block:
        old, words = self.shift.origin, block.words
        shift = np.array([words.get(c, before) for c, before in zip("XYZ", old, strict=True)])
        others = [c for c, value in words.items() if c not in "XYZ" and (c not in "ABC" or value)]
        if block.g != ("G52",) or others or not words or self.tilted:
            raise BlockError("G52 is supported for X, Y, Z, in its own block and outside of a tilted plane")
        cancels = () if shift.any() else ("shift (G92, G52)",)
        if not old.any() and not shift.any():
            return Block(block.line, m=block.m, ignored=("G52",), cancels=cancels)
        self.shift = Plane(shift)
        return Block(block.line, m=block.m, frame=self.shift.by("G52"), cancels=cancels)


def _plane(parts: Sequence[Block]) -> Plane:
    """Return the plane of G68.2 by angles, or by its lines of points or vectors.

    P2, P3: LinuxCNC, ``5axis/table-rotary_spindle-rotary-nutating/python/remap.py`` (there from Q0).
    """
    words = parts[0].words
    kind = words.get("P", 0.0)
    if kind not in BY_LINES:
        return Plane(np.array([words.get(c, 0.0) for c in "XYZ"]), _rotation(kind, words))
    wanted = BY_LINES[kind]
    whole = len(parts) == len(wanted) and all(
        part.g == ("G68.2",)
        and not part.m
        and part.words == {**part.words, "P": kind, "Q": float(number)}
        and part.words.keys() == {*letters, "P", "Q"}
        for number, (part, letters) in enumerate(zip(parts, wanted, strict=True), start=1)
    )
    if not whole:
        lines = ", ".join(f"Q{n} {' '.join(letters)}" for n, letters in enumerate(wanted, start=1))
        raise BlockError(
            f"G68.2 P{kind:g} is read with these words, in lines after one another: {lines}; write them all"
        )
    origin, *others = (np.array([part.words.get(c, 0.0) for c in "XYZ"]) for part in parts)
    if kind == 3.0:
        x, z = (np.array([part.words[c] for c in "IJK"]) for part in parts)
        lengths = np.linalg.norm([x, z], axis=-1).prod()
        if not lengths or abs(product(x, z)) > SAME_DIRECTION * lengths:
            raise BlockError("the vectors of G68.2 P3 aren't perpendicular to each other; correct them")
        return Plane(origin, rotation_onto(x, z, "G68.2 P3"))
    x, aside = (point - origin for point in others)
    normal = np.cross(x, aside)
    if np.linalg.norm(normal, axis=-1) <= SAME_DIRECTION * np.linalg.norm([x, aside], axis=-1).prod():
        raise BlockError("the points of G68.2 P2 lie on one line; correct them")
    return Plane(origin, rotation_onto(x, normal, "G68.2 P2"))


def _rotation(kind: float, words: Mapping[str, float]) -> Array:
    """Return the rotation, (3, 3), of a plane by angles."""
    angles = [words.get(c, 0.0) for c in "IJK"]
    if kind == 0.0:
        return turns("ZXZ", angles)
    if kind == 1.0 and sum(angle != 0.0 for angle in angles) <= 1:
        return turns("XYZ", angles)
    raise BlockError(
        f"G68.2 P{kind:g} isn't supported, except P1 with one angle, P2 and P3; post Euler angles I, J, K, "
        "without P"
    )
