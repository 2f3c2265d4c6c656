"""Arithmetic of control languages: ``#1+3.5``, ``R1*COS(30)``, ``+Q2 / +4``, ``#1 LT 5``; nothing else.

One grammar serves all languages, because their differences don't conflict: brackets are round or square,
angles are in degrees, and a function may omit its brackets (Heidenhain's ``SIN 30``). Names and functions are
in upper case; callers convert. Where controls of one language differ (the remainder of negative numbers, a
comparison within rounding), there is no value.
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
    r"|(?P<sign>[-+*/^()\[\]]))"
)
# The blanks about a word may be missing: 1LT#2, [1]ANDSIN[30].
_OPERATOR = re.compile(r"\s*(\*\*|[-+*/^]|(?:MOD|DIV|EQ|NE|LT|LE|GT|GE|AND|OR|XOR)(?=[^A-Z_]|[A-Z]+\[))")
_ARCTANGENT = re.compile(r"/(?=\[)")

_CLOSING = {"(": ")", "[": "]"}
_STRENGTH = {
    **dict.fromkeys(("AND", "OR", "XOR"), 1),
    **dict.fromkeys(("EQ", "NE", "LT", "LE", "GT", "GE"), 2),
    **dict.fromkeys("+-", 3),
    **dict.fromkeys(("*", "/", "MOD", "DIV"), 4),
    "**": 5,
    "^": 6,
}
_SIGNS = 5  # -2*3 is (-2)*3, -2**2 is (-2)**2 (LinuxCNC), and -2^2 is -(2^2)

# Relative: numbers that differ by less may be equal to a control, which counts in decimals or fewer digits.
SAME = 1e-6


def _compared(compare: Callable[[float, float], bool]) -> Callable[[float, float], float]:
    def truth(a: float, b: float) -> float:
        if a != b and abs(a - b) <= SAME * max(1.0, abs(a), abs(b)):
            raise BlockError(
                f"{a:.12g} is compared with {b:.12g}, and whether they are the same depends on the control's "
                "rounding; compare with a number between the steps"
            )
        return float(compare(a, b))

    return truth


def _joined(join: Callable[[bool, bool], bool]) -> Callable[[float, float], float]:
    def truth(a: float, b: float) -> float:
        if not {a, b} <= {0.0, 1.0}:
            raise BlockError(f"{a:g} and {b:g} are joined, and only comparisons can be; compare them")
        return float(join(bool(a), bool(b)))

    return truth


def _remainder(a: float, b: float) -> float:
    if a < 0.0 or b < 0.0 or a != int(a) or b != int(b):
        raise BlockError(f"{a:g} MOD {b:g} depends on the control; only whole numbers from 0 are supported")
    return math.fmod(a, b)


def _whole(toward: Callable[[float], int]) -> Callable[[float], float]:
    def whole(x: float) -> float:
        if x != round(x) and (x < 0.0 or abs(x - round(x)) <= SAME):
            raise BlockError(f"FIX or FUP of {x:.12g}: which way it is rounded depends on the control")
        return float(toward(x))

    return whole


_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "MOD": _remainder,
    "DIV": lambda a, b: float(math.trunc(a / b)),
    "**": math.pow,
    "^": math.pow,
    "EQ": _compared(operator.eq),
    "NE": _compared(operator.ne),
    "LT": _compared(operator.lt),
    "LE": _compared(operator.le),
    "GT": _compared(operator.gt),
    "GE": _compared(operator.ge),
    "AND": _joined(operator.and_),
    "OR": _joined(operator.or_),
    "XOR": _joined(operator.xor),
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
    "FIX": _whole(math.floor),
    "FUP": _whole(math.ceil),
    "EXP": math.exp,
    "LN": math.log,
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
            found = _OPERATOR.match(self.text, self.end)
            if found is None or _STRENGTH[found[1]] <= weakest:
                return left
            self.end = found.end()
            left = _OPERATORS[found[1]](left, self.sum(_STRENGTH[found[1]]))

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
            value = function(of := self.operand())
            ratio = _ARCTANGENT.match(self.text, self.end) if name == "ATAN" else None
            return value if ratio is None else self._arctangent(of, ratio.end())
        try:
            return self.lookup(name)
        except KeyError:
            raise BlockError(f"{name} has no value yet; write the number") from None

    def _arctangent(self, height: float, at: int) -> float:
        """Read ``ATAN[y]/[x]``, the angle, deg, of the point x, y."""
        self.end = at
        width = self.operand()
        if height < 0.0:
            raise BlockError(
                f"ATAN[{height:g}]/[{width:g}] is negative on LinuxCNC and above 180 on Fanuc; write a number"
            )
        return math.degrees(math.atan2(height, width))
