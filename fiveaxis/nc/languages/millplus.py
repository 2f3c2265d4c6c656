"""MillPlus programs (Deckel Maho) as blocks of ISO words.

Differences from other G-code: indexed words ``A5=15.`` and parameters ``E254``; G93 with X, Y, Z shifts the
zero and isn't a feed mode; G7 tilts the working plane; G74 moves to machine coordinates; G79 calls a cycle
(G81, G84) at each position. G141 switches TCP on, G40 and G174 off.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from fiveaxis.base import Finding, Severity
from fiveaxis.nc.languages.block import Block, BlockError, Plane, number_of
from fiveaxis.nc.languages.iso import WORD_NUMBER, Iso
from fiveaxis.nc.languages.macro import compact_code
from fiveaxis.nc.languages.planes import turns
from fiveaxis.nc.languages.runs import Reader

# A letter and a number, or a letter with an index, an equals sign and a number or a parameter.
_WORD = re.compile(rf"([A-Z][0-9]?)=(E[0-9]+|{WORD_NUMBER})|([A-Z])({WORD_NUMBER})")

_PLANES = {frozenset("IJ"): "G17", frozenset("IK"): "G18", frozenset("JK"): "G19"}
# Indexed words without effect on the path: clamps (M10, M16, M56, M57), rapid feed under G141, tool length,
# the number of a work offset that NX adds.
_INDEXED = ("L1", "L2", "F2", "B7", "C7", "A7", "R1", "I1", "T1", "T2", "S1", "M1")
_OFF = ("G40", "G140", "G174")
CYCLES = ("G81", "G84")


class MillPlus(Reader):
    """MillPlus; parameters other than the angles that G7 stores are refused."""

    forms, comments = Iso.forms[:1], Iso.comments

    def _begin(self) -> None:
        # The shift of G93, and the cycle that G79 calls.
        self.shift = np.zeros(3)
        self.tip_control = False
        self.cycle: dict[str, float] = {}
        self.cycle_word = ""

    def read(self, line: int, text: str) -> Iterator[Block]:
        """Read a line."""
        code = compact_code(text)
        if not code or code[0] == "%":
            return
        if code[0] == "/" and self.block_delete:
            yield Block(line, skipped=True)
            return
        g, m, words, indexed = _split_words(code.removeprefix("/"))
        words.pop("N", None)
        # G54 I1 selects one of several work offset tables.
        if "G54" in g or set(words) == {"I"}:
            words.pop("I", None)
        if "G93" in g:
            yield self._shift(line, words)
        elif "G7" in g:
            yield self._tilt(line, indexed)
        elif "G74" in g:
            yield Block(line, ("G0", "G53"), (), {c: v for c, v in words.items() if c in "XYZABC"})
        elif cycles := [w for w in g if w in CYCLES]:
            self.cycle_word, self.cycle = cycles[0], words
            yield Block(line, ignored=(cycles[0],))
        elif "G79" in g:
            yield from self._drill(line, words)
        elif not indexed.keys().isdisjoint("ABC"):
            # E254 and E255 hold the angles that G7 computed: the tool points along the plane's normal.
            rest = {c: v for c, v in words.items() if c not in "ABC"}
            yield Block(line, tuple(g), tuple(m), rest, vector=(0.0, 0.0, 1.0))
        elif g or m or words:
            yield self._plain(line, g, m, words)

    def _plain(self, line: int, g: list[str], m: list[str], words: dict[str, float]) -> Block:
        tip_control = None
        if "G141" in g:
            tip_control = self.tip_control = True
        elif self.tip_control and not set(_OFF).isdisjoint(g):
            tip_control = self.tip_control = False
        centre = frozenset(c for c in "IJK" if c in words)
        if not centre:
            return Block(line, tuple(g), tuple(m), words, tip_control=tip_control)
        # The letters give the plane of the arc, and the vector goes from its centre to its start.
        words = {c: -value if c in centre else value for c, value in words.items()}
        message = (
            "I, J and K are taken from an arc's centre to its start, as NX writes them for this control; "
            "check full circles, which also fit the reverse"
        )
        g = [_PLANES[centre], *g] if centre in _PLANES else g
        findings = self._warn(line, "arc-centre-assumed", message)
        return Block(line, tuple(g), tuple(m), words, tip_control=tip_control, findings=findings)

    def _shift(self, line: int, words: dict[str, float]) -> Block:
        """Read ``G93 X Y Z``: the program zero relative to the work offset."""
        self.shift = np.array([words.get(c, old) for c, old in zip("XYZ", self.shift, strict=True)])
        return Block(line, frame=Plane(self.shift, word="G93"))

    def _tilt(self, line: int, indexed: dict[str, float | str]) -> Block:
        """Read ``G7 A5= B5= C5=``: angles about fixed X, Y and Z, in this order."""
        a, b, c = (float(indexed.get(f"{letter}5", 0.0)) for letter in "ABC")
        plane = Plane(self.shift, turns("ZYX", (c, b, a)))
        block = Block(line, frame=plane.by("G7"))
        if sum(v != 0.0 for v in (a, b, c)) <= 1:
            return block
        message = (
            f"G7 A5={a:g} B5={b:g} C5={c:g} is taken as angles about X, then Y, then Z of the work offset; "
            "check it if the machine is set up differently"
        )
        return block._replace(findings=self._warn(line, "plane-assumed", message))

    def _warn(self, line: int, code: str, message: str) -> tuple[Finding, ...]:
        return (self.source.finding(Severity.WARNING, code, message, line),)

    def _drill(self, line: int, words: dict[str, float]) -> Iterator[Block]:
        """Read ``G79 X Y Z``: the cycle in force, from a surface at Z.

        In ``G81 Y Z B``, Y is the clearance above it, Z the depth, B the height of the retract.
        """
        if not self.cycle_word:
            raise BlockError("G79 calls a cycle, and none is in force; write G81 or G84 before")
        cycle = self.cycle
        surface = words.get("Z", cycle.get("surface", 0.0))
        cycle["surface"] = surface
        clear = surface + cycle.get("Y", 0.0)
        feed = {"F": cycle["F"]} if "F" in cycle else {}
        yield Block(line, ("G0",), (), {c: v for c, v in words.items() if c in "XYABC"})
        yield Block(line, ("G0",), (), {"Z": clear})
        yield Block(line, ("G1",), (), {"Z": surface + cycle.get("Z", 0.0), **feed})
        yield Block(line, ("G1",) if self.cycle_word == "G84" else ("G0",), (), {"Z": clear})
        yield Block(line, ("G0",), (), {"Z": surface + cycle.get("B", cycle.get("Y", 0.0))})


def _split_words(code: str) -> tuple[list[str], list[str], dict[str, float], dict[str, float | str]]:
    """Split a line into G words, M words, words of one letter, and indexed words."""
    g: list[str] = []
    m: list[str] = []
    words: dict[str, float] = {}
    indexed: dict[str, float | str] = {}
    end = 0
    for found in _WORD.finditer(code):
        if found.start() != end:
            break
        end = found.end()
        name, value = (found[1], found[2]) if found[1] else (found[3], found[4])
        number = number_of(name, value.removeprefix("E"))
        if name in ("G", "M"):
            (g if name == "G" else m).append(f"{name}{number + 0.0:g}")
        elif name in words or name in indexed:
            raise BlockError(f"{name} has two values; write one of them")
        elif found[1] and (len(name) > 1 or value[0] == "E"):
            indexed[name] = value if value[0] == "E" else number
        else:
            words[name] = number
    if end != len(code):
        raise BlockError(f"{code[end : end + 20]!r} isn't a word of MillPlus; correct it")
    _require_known(indexed)
    return g, m, words, indexed


def _require_known(indexed: dict[str, float | str]) -> None:
    for name, value in indexed.items():
        parameter = isinstance(value, str)
        if parameter != (name in ("A", "B", "C")) or not (
            parameter or name in _INDEXED or name in ("A5", "B5", "C5")
        ):
            raise BlockError(f"{name}={value} isn't supported; post the program without it")
