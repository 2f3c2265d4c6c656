"""Variables of G-code: simple assignments are evaluated; conditions and loops are refused."""

from __future__ import annotations

import re

from fiveaxis.nc.languages.block import BlockError
from fiveaxis.nc.languages.expressions import evaluate, evaluate_prefix

_NAME = r"#(?:[0-9]+|<[A-Z0-9_]+>)"
_ASSIGNED = re.compile(f"({_NAME})=")
# Value of a word: one variable or one pair of brackets. No control accepts X#1+2.
_VALUE = re.compile(rf"([A-Z])([+-]?)(?:({_NAME})(?![-+*/=])|(?=\[))")
_BRACKET = re.compile(r"[\[\]]")
_FLOW = re.compile(r"IF|WHILE|GOTO|REPEAT|CALL|SUB|DO[0-9#\[]|END[0-9]|[<>]=|\bO<")


class Macro:
    """The variables that have a value."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def take(self, code: str) -> str:
        """Replace variables and brackets by numbers; execute and remove assignments.

        Parameters
        ----------
        code : a block without comments and blanks, upper case

        Returns
        -------
        Words of letters and numbers. Anything else is left unchanged, for the parser to refuse.

        Raises
        ------
        BlockError
            A variable without a value, a result that isn't a number.
        """
        if _FLOW.search(code):
            return code
        return self._assign(code) if _ASSIGNED.match(code) else self._fill_in(code)

    def _assign(self, code: str) -> str:
        """Execute ``#1=5#2=#1+2``: as in RS274/NGC, all values take effect after the block."""
        found, end, values = _ASSIGNED.match(code), 0, {}
        while found is not None:
            values[_key(found[1])], end = evaluate_prefix(code, found.end(), self._look_up)
            found = _ASSIGNED.match(code, end)
        if end < len(code):
            return code[end:] if "=" in code[end:] else f"={code[end:]}"
        self.values |= values
        return ""

    def _fill_in(self, code: str) -> str:
        parts, begin = [], 0
        while (found := _VALUE.search(code, begin)) is not None:
            end = found.end() if found[3] else _closing(code, found.end())
            value = self._look_up(found[3]) if found[3] else evaluate(code[found.end() : end], self._look_up)
            # Without an exponent, as controls accept it.
            number = f"{-value if found[2] == '-' else value:.12f}".rstrip("0")
            parts.append(f"{code[begin : found.start()]}{found[1]}{number}")
            begin = end
        return "".join(parts) + code[begin:]

    def _look_up(self, name: str) -> float:
        try:
            return self.values[_key(name)]
        except KeyError:
            raise BlockError(f"{name} has no value yet; write the number") from None


def _key(name: str) -> str:
    """Return the same key for ``#1`` and ``#001``."""
    return name if name[1] == "<" else f"#{int(name[1:20])}"


def _closing(code: str, start: int) -> int:
    """Return the index after the closing bracket; the end of the block if it isn't closed."""
    depth = 0
    for sign in _BRACKET.finditer(code, start):
        depth += 1 if sign[0] == "[" else -1
        if depth == 0:
            return sign.end()
    return len(code)
