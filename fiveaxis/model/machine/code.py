"""The form-shaping code: a machine's structure in a few digits.

Digits 1…6 are one-axis motions along X Y Z and about X Y Z (A B C), 0 is the bed. The code is read from the
workpiece to the tool: ``640123`` = workpiece, C, A, bed, X, Y, Z, tool (Hayashi et al. 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fiveaxis.base import CodeError

# The link that stands still.
BED = "bed"

MEANINGS = "1…6 (X Y Z A B C) and 0 (bed)"
EXAMPLE = "write for example 640123 (workpiece, C, A, bed, X, Y, Z, tool)"
LETTERS = {"1": "X", "2": "Y", "3": "Z", "4": "A", "5": "B", "6": "C"}
DIGITS = {letter: digit for digit, letter in LETTERS.items()}
AXIS_ORDER = "XYZABC"
# Neighbours in the chain that may change places: translations among themselves, a rotation with the
# translation along its own axis.
COMMUTING = frozenset({frozenset(pair) for pair in ("XY", "XZ", "YZ", "XA", "YB", "ZC")})


@dataclass(frozen=True)
class FormShapingCode:
    """A parsed code.

    Parameters
    ----------
    text : the digits as written
    table : axis letters between workpiece and bed, from the workpiece
    head : axis letters between bed and tool, from the bed
    """

    text: str
    table: tuple[str, ...]
    head: tuple[str, ...]

    @property
    def letters(self) -> tuple[str, ...]:
        """Axis letters from the workpiece to the tool."""
        return self.table + self.head

    @property
    def links(self) -> tuple[str, ...]:
        """Links from the workpiece to the tool: the bed, and the others by the axis that carries them."""
        return (*self.table, BED, *self.head)

    @property
    def kind(self) -> str:
        """Side of the bed of each rotary axis: ``table-table``, ``table-head`` or ``head-head``.

        With a third, redundant rotary axis it is ``table-table-head`` or the like; with fewer than two,
        ``3-axis`` or ``4-axis``.
        """
        sides = [side for side in ("table", "head") for c in getattr(self, side) if c in "ABC"]
        return "-".join(sides) if len(sides) > 1 else f"{len(self.letters)}-axis"

    @property
    def kinematic_class(self) -> str:
        """Letters in an order shared by all codes with the same kinematics, without the bed.

        The bed's position decides which mass an axis moves, but not how the tool moves relative to the
        workpiece; nor does the order of neighbours that commute. The 1440 codes that lean the tool in two
        directions fall into 48 classes.
        """
        return commutation_class(self.letters)

    def __str__(self) -> str:
        return self.text


def parse_code(text: str) -> FormShapingCode:
    """Read a form-shaping code, for example ``640123``; all six axes make seven digits, one of them the bed.

    `CodeError` if it is empty, has a character other than 0…6, no bed or two, an axis twice, or no axis at
    all; the message says what to write instead.
    """
    if not text:
        raise CodeError(text, f"is empty; {EXAMPLE}")
    for position, character in enumerate(text, start=1):
        if character not in LETTERS and character != "0":
            raise CodeError(text, _explain_character(text, position, character))
    beds = text.count("0")
    if beds == 0:
        raise CodeError(text, f"has no bed; write one 0 where the bed is, {_with_bed(text)}")
    if beds > 1:
        raise CodeError(text, f"has {beds} beds; write exactly one 0 where the bed is, for example 640123")
    for digit, letter in LETTERS.items():
        if text.count(digit) > 1:
            raise CodeError(text, _explain_repeated(text, digit, letter))
    if len(text) == 1:
        raise CodeError(text, f"has no axis; {EXAMPLE}")
    table, head = text.split("0")
    return FormShapingCode(text, tuple(LETTERS[d] for d in table), tuple(LETTERS[d] for d in head))


def commutation_class(letters: Sequence[str]) -> str:
    """Sort a chain's letters as far as its kinematics allows.

    The next letter is always the first, in axis order, of those that may move to the front: the normal form
    of a product whose factors partly commute.
    """
    rest, ordered = list(letters), ""
    while rest:
        free = [c for i, c in enumerate(rest) if all(frozenset((c, d)) in COMMUTING for d in rest[:i])]
        ordered += min(free, key=AXIS_ORDER.index)
        rest.remove(ordered[-1])
    return ordered


def _explain_character(text: str, position: int, character: str) -> str:
    message = f"character {position} is {character!r}; only {MEANINGS} mean something"
    if set(text.upper()) <= {*DIGITS, *LETTERS, "0"}:
        message += f": write {''.join(DIGITS.get(c, c) for c in text.upper())}"
    return message


def _explain_repeated(text: str, digit: str, letter: str) -> str:
    message = f"names axis {digit} ({letter}) {text.count(digit)} times; once is enough"
    if len(text) > len(LETTERS):
        message = f"has {len(text)} digits and {message}: one bed and at most six different axes make seven"
    return message


def _with_bed(text: str) -> str:
    """Insert the bed where it usually is: after the rotary axes with which the code begins."""
    at = next((i for i, digit in enumerate(text) if LETTERS[digit] not in "ABC"), len(text))
    return f"for example {text[:at]}0{text[at:]}"
