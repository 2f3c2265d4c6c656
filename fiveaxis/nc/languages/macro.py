"""Variables of G-code: simple assignments are calculated, programs that decide or repeat are refused."""

from __future__ import annotations

import re

from fiveaxis.nc.languages.expressions import ExpressionError, evaluate, evaluate_prefix
from fiveaxis.nc.source import Source

_NAME = r"#(?:[0-9]+|<[A-Z0-9_]+>)"
_ASSIGNED = re.compile(f"({_NAME})=")
# A word's value: one variable or one pair of brackets. X#1+2 is none, on no control.
_VALUE = re.compile(rf"([A-Z])([+-]?)(?:({_NAME})(?![-+*/=])|(?=\[))")
_BRACKET = re.compile(r"[\[\]]")
_FLOW = re.compile(r"IF|WHILE|GOTO|REPEAT|CALL|SUB|DO[0-9#\[]|END[0-9]|[<>]=|\bO<")


class Macro:
    """The variables that have a value so far.

    Parameters
    ----------
    source : the program
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.values: dict[str, float] = {}

    def take(self, code: str, line: int) -> str:
        """Put numbers in place of variables and brackets; nothing is left of assignments.

        Parameters
        ----------
        code : a block without comments and blanks, in capitals
        line : of the file

        Returns
        -------
        Words of letters and numbers. What is neither an assignment nor such a word stays as it is, and isn't
        a word to whoever reads on.

        Raises
        ------
        ToolpathError
            With file and line: a variable without value, a result that isn't a number.
        """
        if _FLOW.search(code):
            return code
        try:
            return self._assign(code) if _ASSIGNED.match(code) else self._fill_in(code)
        except ExpressionError as fault:
            raise self.source.error(str(fault), line) from None

    def _assign(self, code: str) -> str:
        """Take ``#1=5#2=#1+2``: as in RS274/NGC, all values count from the next block on."""
        found, place, values = _ASSIGNED.match(code), 0, {}
        while found is not None:
            values[_number(found[1])], place = evaluate_prefix(code, found.end(), self._look_up)
            found = _ASSIGNED.match(code, place)
        if place < len(code):
            return code[place:] if "=" in code[place:] else f"={code[place:]}"
        self.values |= values
        return ""

    def _fill_in(self, code: str) -> str:
        parts, place = [], 0
        while (found := _VALUE.search(code, place)) is not None:
            end = found.end() if found[3] else _closing(code, found.end())
            value = self._look_up(found[3]) if found[3] else evaluate(code[found.end() : end], self._look_up)
            parts.append(
                f"{code[place : found.start()]}{found[1]}{_shown(-value if found[2] == '-' else value)}"
            )
            place = end
        return "".join(parts) + code[place:]

    def _look_up(self, name: str) -> float:
        try:
            return self.values[_number(name)]
        except KeyError:
            raise ExpressionError(f"{name} has no value up to here; write the number") from None


def _number(name: str) -> str:
    """Make one name of ``#1`` and ``#001``."""
    return name if name[1] == "<" else f"#{int(name[1:20])}"


def _closing(code: str, start: int) -> int:
    """Find the end of the brackets that open at a place; the end of the block if they aren't closed."""
    depth = 0
    for sign in _BRACKET.finditer(code, start):
        depth += 1 if sign[0] == "[" else -1
        if depth == 0:
            return sign.end()
    return len(code)


def _shown(value: float) -> str:
    """Write a value as a control takes it, without an exponent."""
    return f"{value:.12f}".rstrip("0")
