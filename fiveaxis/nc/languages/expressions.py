"""Arithmetic of control languages: ``#1+3.5``, ``R1*COS(30)``, ``+Q2 / +4``; nothing else is evaluated.

One grammar serves all languages, because their differences don't conflict: brackets are round or square,
angles are in degrees, and a function may omit its brackets (Heidenhain's ``SIN 30``). Names and functions are
in upper case; callers convert.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable

from fiveaxis.nc.languages.block import BlockError, number_of

Lookup = Callable[[str], float]

# Nested brackets: no post-processor writes more, and they would reach Python's recursion limit.
DEEPEST = 40

_TOKEN = re.compile(
    r"\s*(?:(?P<number>[0-9]+\.?[0-9]*|\.[0-9]+)"
    r"|(?P<name>#[0-9]+|#<[A-Z0-9_ ]+>|[A-Z_$][A-Z0-9_]*)"
    r"|(?P<sign>\*\*|[-+*/^()\[\]]))"
)

_CLOSING = {"(": ")", "[": "]"}
_WORDS = {"MOD": "MOD", "DIV": "DIV"}
_STRENGTH = {"+": 1, "-": 1, "*": 2, "/": 2, "MOD": 2, "DIV": 2, "**": 4, "^": 4}
_SIGNS = 3  # -2*3 is (-2)*3, and -2**2 is -(2**2)

_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "MOD": math.fmod,
    "DIV": lambda a, b: float(math.trunc(a / b)),
    "**": math.pow,
    "^": math.pow,
}

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ATAN": lambda x: math.degrees(math.atan(x)),
    "SQRT": math.sqrt,
    "ABS": math.fabs,
    "TRUNC": lambda x: float(math.trunc(x)),
    "FIX": lambda x: float(math.floor(x)),
    "FUP": lambda x: float(math.ceil(x)),
    "ROUND": lambda x: math.copysign(math.floor(math.fabs(x) + 0.5), x),
}


def evaluate(text: str, lookup: Lookup) -> float:
    """Evaluate an expression that is the whole text.

    Parameters
    ----------
    text : upper case
    lookup : value of a variable by name (``#101``, ``R1``, ``_HOME``); raises KeyError if it has none

    Raises
    ------
    BlockError
        Not arithmetic, a variable without a value, a result that isn't finite.
    """
    value, end = evaluate_prefix(text, 0, lookup)
    if text[end:].strip():
        raise BlockError(f"{text[end:].strip()[:20]!r} isn't supported arithmetic")
    return value


def evaluate_prefix(text: str, start: int, lookup: Lookup) -> tuple[float, int]:
    """Evaluate the longest expression from an index on, ``R1*2`` in ``X=R1*2 Y=3``.

    Returns
    -------
    The value and the index after the expression

    Raises
    ------
    BlockError
        As `evaluate`.
    """
    parser = _Parser(text, start, lookup)
    try:
        value = parser.sum(0)
    except (ZeroDivisionError, OverflowError, ValueError) as fault:
        if isinstance(fault, BlockError):
            raise
        raise BlockError(f"{text[start : start + 40].strip()!r} has no value: {fault}") from None
    if not math.isfinite(value):
        raise BlockError(f"{text[start : start + 40].strip()!r} has no finite value")
    return value, parser.end


class _Parser:
    """Precedence climbing; `end` is the index after the last token used."""

    def __init__(self, text: str, start: int, lookup: Lookup) -> None:
        self.text, self.end, self.lookup = text, start, lookup
        self.depth = 0

    def sum(self, weakest: int) -> float:
        """Evaluate operands and the operators between them that bind more tightly than `weakest`."""
        left = self.operand()
        while True:
            found = _TOKEN.match(self.text, self.end)
            sign = None if found is None else found["sign"] or _WORDS.get(found["name"] or "")
            strength = 0 if sign is None else _STRENGTH.get(sign, 0)
            if found is None or sign is None or strength <= weakest:
                return left
            self.end = found.end()
            left = _OPERATORS[sign](left, self.sum(strength))

    def operand(self) -> float:
        found = _TOKEN.match(self.text, self.end)
        if found is None:
            rest = self.text[self.end :].strip()[:20]
            raise BlockError(f"{rest!r} isn't a number or a variable" if rest else "a number is missing")
        self.end = found.end()
        if found["number"] is not None:
            return number_of("", found["number"])
        self.depth += 1
        if self.depth > DEEPEST:
            raise BlockError(f"more than {DEEPEST} brackets, signs and functions; write the number")
        value = self._signed(found["sign"]) if found["name"] is None else self._named(found["name"])
        self.depth -= 1
        return value

    def _signed(self, sign: str) -> float:
        if sign in "+-":
            value = self.sum(_SIGNS)
            return -value if sign == "-" else value
        if sign not in _CLOSING:
            raise BlockError(f"{sign!r} where a number or a variable is expected")
        value = self.sum(0)
        found = _TOKEN.match(self.text, self.end)
        if found is None or found["sign"] != _CLOSING[sign]:
            raise BlockError(f"{sign!r} isn't closed")
        self.end = found.end()
        return value

    def _named(self, name: str) -> float:
        function = FUNCTIONS.get(name)
        if function is not None:
            return function(self.operand())
        try:
            return self.lookup(name)
        except KeyError:
            raise BlockError(f"{name} has no value yet; write the number") from None
