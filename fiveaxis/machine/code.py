"""The form-shaping code: a machine's structure in a few digits.

Digits 1…6 are one-axis motions along X Y Z and about X Y Z (A B C), 0 is the bed. The code is read from the
workpiece to the tool: ``640123`` = workpiece, C, A, bed, X, Y, Z, tool (Hayashi et al. 2018).
"""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.errors import CodeError

LETTERS = {"1": "X", "2": "Y", "3": "Z", "4": "A", "5": "B", "6": "C"}
AXIS_ORDER = "XYZABC"


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

    def __str__(self) -> str:
        return self.text


def parse_code(text: str) -> FormShapingCode:
    """Read a form-shaping code.

    Parameters
    ----------
    text : digits, for example ``640123``

    Raises
    ------
    CodeError
        Empty; a character that isn't a digit 0…6; no bed or two; an axis named twice; no axis at all.
    """
    if not text:
        raise CodeError(text, "is empty; write the digits from workpiece to tool, for example 640123")
    for position, character in enumerate(text, start=1):
        if character not in LETTERS and character != "0":
            raise CodeError(
                text,
                f"character {position} is {character!r}; only 1…6 (X Y Z A B C) and 0 (bed) mean something",
            )
    beds = text.count("0")
    if beds != 1:
        raise CodeError(text, f"has {beds} beds; write exactly one 0 where the bed is, for example 640123")
    for digit, letter in LETTERS.items():
        if text.count(digit) > 1:
            raise CodeError(text, f"names axis {digit} ({letter}) {text.count(digit)} times; once is enough")
    if len(text) == 1:
        raise CodeError(text, "has no axis; write for example 640123")
    table, head = text.split("0")
    return FormShapingCode(text, tuple(LETTERS[d] for d in table), tuple(LETTERS[d] for d in head))
