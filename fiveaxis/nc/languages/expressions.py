"""Arithmetic of control languages: ``#1+3.5``, ``R1*COS(30)``, ``+Q2 / +4``, ``#1 LT 5``; nothing else.

One grammar serves all languages, because their differences don't conflict: brackets are round or square,
angles are in degrees, and a function may omit its brackets (Heidenhain's ``SIN 30``). Names and functions are
in upper case; callers convert. Where controls of one language differ (the remainder of negative numbers, a
comparison within rounding), there is no value unless the control's table (`Arithmetic`) says which.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable

from fiveaxis.nc.languages.block import BlockError, number_of
from fiveaxis.nc.writing.table_parts import Arithmetic

# Of controls whose table says nothing.
UNSAID = Arithmetic()

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
_COMPARED = 2
_STRENGTH = {
    **dict.fromkeys(("AND", "OR", "XOR"), 1),
    **dict.fromkeys(("EQ", "NE", "LT", "LE", "GT", "GE"), _COMPARED),
    **dict.fromkeys("+-", 3),
    **dict.fromkeys(("*", "/", "MOD", "DIV"), 4),
    "**": 5,
    "^": 6,
}
_SIGNS = 5  # -2*3 is (-2)*3, -2**2 is (-2)**2 (LinuxCNC), and -2^2 is -(2^2)

# Relative: numbers that differ by less may be equal to a control, which counts in decimals or fewer digits.
SAME = 1e-6


_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "MOD": lambda a, b: math.fmod(math.fmod(a, b) + abs(b), abs(b)) if a < 0.0 else math.fmod(a, b),
    "DIV": lambda a, b: math.trunc(a / b),
    "**": math.pow,
    "^": math.pow,
    "EQ": operator.eq,
    "NE": operator.ne,
    "LT": operator.lt,
    "LE": operator.le,
    "GT": operator.gt,
    "GE": operator.ge,
    "AND": lambda a, b: bool(a) and bool(b),
    "OR": lambda a, b: bool(a) or bool(b),
    "XOR": lambda a, b: bool(a) != bool(b),
}


def _require_certain(word: str, a: float, b: float, rules: Arithmetic) -> None:
    """Raise `BlockError` where an operator's value differs between controls, and no table says this one's."""
    if word in ("AND", "OR", "XOR") and rules.standard is None and not {a, b} <= {0.0, 1.0}:
        raise BlockError(f"{a:g} and {b:g} are joined, and only comparisons can be; compare them")
    if word == "MOD" and rules.standard is None and (a < 0.0 or b < 0.0 or a != int(a) or b != int(b)):
        raise BlockError(f"{a:g} MOD {b:g} depends on the control; only whole numbers from 0 are supported")
    if _STRENGTH[word] != _COMPARED or a == b or (rules.same is not None and word not in ("LE", "GE")):
        return
    near = SAME * max(1.0, abs(a), abs(b))
    if word not in ("LT", "GT"):
        near = max(near, rules.doubtful if rules.same is None else rules.same)
        near = 0.0 if word in ("LE", "GE") and _OPERATORS[word](a, b) else near  # as if they were the same
    if abs(a - b) <= near:
        raise BlockError(
            f"{a:.12g} is compared with {b:.12g}, and whether they are the same depends on the control's "
            "rounding; compare with a number between the steps"
        )


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
    # With the sign of 0, which an arctangent shows.
    "FIX": lambda x: math.copysign(math.floor(x), x),
    "FUP": lambda x: math.copysign(math.ceil(x), x),
    "EXP": math.exp,
    "LN": math.log,
    "ROUND": lambda x: math.copysign(math.floor(math.fabs(x) + 0.5), x),
}


def evaluate(text: str, lookup: Lookup, rules: Arithmetic = UNSAID) -> float:
    """Evaluate an expression that is the whole text, in upper case, by the rules of the control.

    The lookup gives the value of a variable by name (``#101``, ``R1``, ``_HOME``), and raises KeyError if it
    has none. `BlockError` for what isn't arithmetic, a variable without a value, or a result that isn't
    finite.
    """
    value, end = evaluate_prefix(text, 0, lookup, rules)
    if text[end:].strip():
        raise BlockError(f"{text[end:].strip()[:20]!r} isn't supported arithmetic")
    return value


def evaluate_prefix(text: str, start: int, lookup: Lookup, rules: Arithmetic = UNSAID) -> tuple[float, int]:
    """Evaluate the longest expression from an index on, ``R1*2`` in ``X=R1*2 Y=3``, as `evaluate`.

    The index after it is returned, too.
    """
    parser = _Parser(text, start, lookup, rules)
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

    def __init__(self, text: str, start: int, lookup: Lookup, rules: Arithmetic) -> None:
        self.text, self.end, self.lookup, self.rules = text, start, lookup, rules
        self.depth = 0

    def sum(self, weakest: int) -> float:
        """Evaluate operands and the operators between them that bind more tightly than `weakest`."""
        left = self.operand()
        while True:
            found = _OPERATOR.match(self.text, self.end)
            if found is None or _STRENGTH[found[1]] <= weakest:
                return left
            self.end, word = found.end(), found[1]
            right = self.sum(_STRENGTH[word])
            _require_certain(word, left, right, self.rules)
            same = word in ("EQ", "NE") and abs(left - right) < (self.rules.same or 0.0)
            left = float(_OPERATORS[word](left, left if same else right))

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
            of = self.operand()
            doubtful = of != round(of) and (of < 0.0 or abs(of - round(of)) <= SAME)
            if doubtful and name in ("FIX", "FUP") and self.rules.standard is None:
                raise BlockError(f"{name} of {of:.12g}: which way it is rounded depends on the control")
            value = float(function(of))
            ratio = _ARCTANGENT.match(self.text, self.end) if name == "ATAN" else None
            return value if ratio is None else self._arctangent(of, ratio.end())
        try:
            return self.lookup(name)
        except KeyError:
            fact = (
                "is Sinumerik's, and isn't evaluated; write ATAN[y]/[x], or"
                if name == "ATAN2"
                else "has no value yet; write"
            )
            raise BlockError(f"{name} {fact} the number") from None

    def _arctangent(self, height: float, at: int) -> float:
        """Read ``ATAN[y]/[x]``, the angle, deg, of the point x, y."""
        self.end = at
        width = self.operand()
        if height < 0.0 and self.rules.standard is None:
            raise BlockError(
                f"ATAN[{height:g}]/[{width:g}] is negative on LinuxCNC and above 180 on Fanuc; write a number"
            )
        return math.degrees(math.atan2(height, width))
