"""What a machine's owner is asked about it, and how the answers become tables of a machine file.

The same questions stand behind the dialogue and the options of `fiveaxis machine new`: an answer is a text,
and the same texts give the same file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fiveaxis.errors import CodeError, SettingError
from fiveaxis.machine.chain import UNIT_DIRECTION, Triple
from fiveaxis.machine.check import PLAUSIBLE
from fiveaxis.machine.code import parse_code
from fiveaxis.machine.dump import neat
from fiveaxis.machine.tables import ANGLE_UNITS, LINEAR_UNITS, LOOKS_LIKE_RADIANS

LINEAR, ROTARY = "XYZ", "ABC"
EVERY = LINEAR + ROTARY
ENDLESS = "endless"
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
SIZES = ("desktop", "machining-centre", "portal")

Table = dict[str, Any]
# Question and axis letter (empty for the machine itself) -> text as it was written.
Answers = Mapping[tuple[str, str], str]


@dataclass(frozen=True)
class Kind:
    """A common structure.

    Parameters
    ----------
    code : form-shaping code
    text : in words
    inclined : directions of axes that don't lie along their letter's, by letter
    """

    code: str
    text: str
    inclined: tuple[tuple[str, Triple], ...] = ()


KINDS = {
    "trunnion-ac": Kind("640123", "table-table, C in a trunnion A"),
    "trunnion-bc": Kind("650123", "table-table, C in a trunnion B"),
    "nutating-table": Kind("650123", "table-table, C on a B at 45 deg", (("B", (0.0, 1.0, -1.0)),)),
    "table-head": Kind("620135", "table-head, C in the table and a swivelling head B"),
    "nutating-head": Kind(
        "620135", "table-head, C in the table and a head B at 45 deg", (("B", (0.0, 1.0, 1.0)),)
    ),
    "head-head-ac": Kind("012364", "head-head, a fork C that carries A"),
    "head-head-bc": Kind("012365", "head-head, a fork C that carries B"),
    "3-axis": Kind("1203", "3-axis mill with a cross table"),
}


@dataclass(frozen=True)
class Question:
    """One question.

    Parameters
    ----------
    name : its option is ``--name``
    axes : letters of which it is asked; empty for one of the machine
    text : what is asked
    form : of an answer for a linear and for a rotary axis, with its unit
    read : makes a table without source of an axis letter and an answer
    key : where the table is written; empty for what has no table of its own
    again : whether the answer of the last axis of its kind is offered for the next
    """

    name: str
    axes: str
    text: str
    form: tuple[str, str]
    read: Callable[[str, str], Table]
    key: str = ""
    again: bool = False

    def form_of(self, letter: str) -> str:
        """Return the form of an answer, with its unit."""
        return self.form[letter in ROTARY and letter != ""]

    def table(self, letter: str, answer: str) -> Table:
        """Read an answer.

        Raises
        ------
        SettingError
            It has another form, or a figure that no machine has.
        """
        try:
            return self.read(letter, answer.strip())
        except SettingError as fault:
            of = f" of {letter}" if letter else ""
            raise SettingError(f"{self.name}{of}: {fault.message}") from None


def parse_axis_answers(name: str, text: str) -> dict[tuple[str, str], str]:
    """Split an option's answers about several axes: ``X=-300:300,C=endless``.

    Raises
    ------
    SettingError
        A part has no axis letter, or one that another part has.
    """
    found: dict[tuple[str, str], str] = {}
    for part in re.split(r",\s*(?=[A-Za-z]\s*=)", text):
        letter, equals, answer = part.partition("=")
        letter = letter.strip().upper()
        if not equals or len(letter) != 1 or letter not in EVERY or not answer.strip():
            raise SettingError(f"{name}: {part!r} isn't of the form AXIS=ANSWER, for example X=…,Y=…")
        if (name, letter) in found:
            raise SettingError(f"{name}: {letter} is named twice")
        found[name, letter] = answer.strip()
    return found


def read_structure(answer: str) -> tuple[str, Kind | None]:
    """Return the code of a kind or of a code, and the kind.

    Raises
    ------
    SettingError
        It is neither.
    """
    if answer in KINDS:
        return KINDS[answer].code, KINDS[answer]
    try:
        return parse_code(answer).text, None
    except CodeError as fault:
        known = ", ".join(KINDS)
        raise SettingError(f"{answer!r} is none of {known}; as a {fault.message}") from None


def _quantity(answer: str, units: Mapping[str, float], default: str) -> tuple[float, str]:
    """Split a number from its unit."""
    found = re.fullmatch(rf"({NUMBER})\s*(\S*)", answer)
    unit = default if found is None or not found[2] else found[2]
    if found is None or unit not in units:
        raise SettingError(f"{answer!r} isn't a number with one of the units {', '.join(units)}")
    return float(found[1]), unit


def _require_plausible(key: str, value: float) -> None:
    """Raise if a figure is outside the range of `check_machine`, in its unit there."""
    low, high, unit, likely = PLAUSIBLE[key]
    if not low <= value <= high:
        raise SettingError(
            f"{value:g} {unit} is implausible; machines have {low:g} to {high:g} {unit}: is it in {likely}?"
        )


def _limits(letter: str, answer: str) -> Table:
    rotary = letter in ROTARY
    if answer == ENDLESS and rotary:
        return {"unit": "deg"}
    units = (
        {"deg": ANGLE_UNITS["deg"], "rad": 1.0} if rotary else {u: LINEAR_UNITS[u] for u in ("mm", "inch")}
    )
    found = re.fullmatch(rf"({NUMBER})\s*(?::|…|\.\.|to)\s*({NUMBER})\s*(\S*)", answer)
    unit = next(iter(units)) if found is None or not found[3] else found[3]
    if found is None or unit not in units:
        form = "MIN:MAX or endless" if rotary else "MIN:MAX"
        raise SettingError(f"{answer!r} isn't of the form {form}, in {' or '.join(units)}")
    low, high = float(found[1]), float(found[2])
    if low >= high:
        raise SettingError(f"{low:g} {unit} is not below {high:g} {unit}; exchange them")
    if rotary and not found[3] and max(abs(low), abs(high)) <= LOOKS_LIKE_RADIANS:
        raise SettingError(f"{answer} looks like radians; write {answer} rad or {answer} deg")
    if not rotary:
        _require_plausible("travel", (high - low) * units[unit])
    return {"min": neat(low), "max": neat(high), "unit": unit}


def _counts(letter: str, answer: str) -> Table:
    words = ("tool", "table")
    if answer not in words:
        raise SettingError(f"{answer!r} is neither tool nor table")
    return {"reversed": answer == "table"}


def _point(letter: str, answer: str) -> Table:
    numbers = re.split(r"\s*[,;]\s*|\s+", answer)
    if len(numbers) != 3 or not all(re.fullmatch(NUMBER, text) for text in numbers):
        raise SettingError(f"{answer!r} isn't of the form X,Y,Z, in mm")
    point = [neat(float(text)) for text in numbers]
    if max(map(abs, point)) > PLAUSIBLE["travel"][1]:
        raise SettingError(f"{answer!r} is further than {PLAUSIBLE['travel'][1]:g} mm away; write mm")
    return {"point": point}


def _speed(letter: str, answer: str) -> Table:
    if letter in ROTARY:
        units = {"rpm": 360.0 / 60.0, "deg/s": 1.0, "deg/min": 1.0 / 60.0, "rad/s": math.degrees(1.0)}
    else:
        units = {"m/min": 1000.0 / 60.0, "mm/min": 1.0 / 60.0, "mm/s": 1.0, "inch/s": 25.4}
    value, unit = _quantity(answer, units, next(iter(units)))
    _require_plausible("turning_speed" if letter in ROTARY else "max_speed", value * units[unit])
    return {"value": neat(value), "unit": unit}


def _acceleration(letter: str, answer: str) -> Table:
    rotary = letter in ROTARY
    units = (
        {"deg/s2": 1.0, "rad/s2": math.degrees(1.0)}
        if rotary
        else {"m/s2": 1000.0, "mm/s2": 1.0, "inch/s2": 25.4}
    )
    value, unit = _quantity(answer, units, next(iter(units)))
    _require_plausible("turning_acceleration" if rotary else "max_acceleration", value * units[unit])
    return {"value": neat(value), "unit": unit}


def _kilograms(answer: str, key: str) -> float:
    value, unit = _quantity(answer, {"kg": 1.0, "t": 1000.0}, "kg")
    mass = value * (1000.0 if unit == "t" else 1.0)
    _require_plausible(key, mass)
    return neat(mass)


def _moved_mass(letter: str, answer: str) -> Table:
    return {"value": _kilograms(answer, "moved_mass"), "unit": "kg"}


def _motor(letter: str, answer: str) -> Table:
    rated = re.fullmatch(rf"({NUMBER})\s*A\s*({NUMBER})\s*V", answer)
    if rated is not None:
        current, voltage = float(rated[1]), float(rated[2])
        _require_plausible("motor_power", math.sqrt(3.0) * current * voltage)
        return {"current": neat(current), "voltage": neat(voltage)}
    power, unit = _quantity(answer, {"kW": 1000.0, "W": 1.0}, "kW")
    _require_plausible("motor_power", power * (1000.0 if unit == "kW" else 1.0))
    return {"power": neat(power if unit == "kW" else power / 1000.0)}


def _base_power(letter: str, answer: str) -> Table:
    value, unit = _quantity(answer, {"W": 1.0, "kW": 1000.0}, "W")
    power = value * (1000.0 if unit == "kW" else 1.0)
    _require_plausible("base_power", power)
    return {"value": neat(power)}


def _machine_mass(letter: str, answer: str) -> Table:
    return {"mass": _kilograms(answer, "machine_mass")}


def _size(letter: str, answer: str) -> Table:
    if answer not in SIZES:
        raise SettingError(f"{answer!r} is none of {', '.join(SIZES)}")
    return {"kind": answer}


def _vertical(letter: str, answer: str) -> Table:
    if re.fullmatch(r"\s*[-+]?[XYZ]\s*([,; ]\s*[-+]?[XYZ]\s*)+", answer):
        raise SettingError(f"{answer!r} names several axes; one is vertical")
    if not re.fullmatch(r"[-+]?[XYZ]", answer):
        raise SettingError(f"{answer!r} is none of X, Y, Z, or -X, -Y, -Z where the axis counts downwards")
    sign = -1.0 if answer.startswith("-") else 1.0
    return {"direction": [neat(sign * v + 0.0) for v in UNIT_DIRECTION[answer[-1]]]}


def _text(letter: str, answer: str) -> Table:
    if not answer or not answer.isprintable():
        raise SettingError(f"{answer!r} isn't a name")
    return {"text": answer}


def _structure(letter: str, answer: str) -> Table:
    return {"code": read_structure(answer)[0]}


QUESTIONS = (
    Question("name", "", "name of the machine", ("text", ""), _text),
    Question("structure", "", "structure: a kind, or a form-shaping code", ("KIND or CODE", ""), _structure),
    Question("vertical", "", "axis that is vertical", ("X, Y or Z", ""), _vertical, "vertical"),
    Question(
        "limits",
        EVERY,
        "travel, as the control shows it",
        ("MIN:MAX, mm", "MIN:MAX, deg, or endless"),
        _limits,
        "limits",
    ),
    Question(
        "counts",
        ROTARY,
        "what turns by the right-hand rule as its value grows, seen from the other",
        ("", "tool or table"),
        _counts,
    ),
    Question("points", ROTARY, "a point on its line", ("", "X,Y,Z, mm"), _point, "line"),
    Question("spindle", "", "gauge point with every axis at 0", ("X,Y,Z, mm", ""), _point, "spindle"),
    Question("speeds", EVERY, "highest speed", ("m/min", "rpm"), _speed, "max_speed", again=True),
    Question(
        "accelerations",
        EVERY,
        "highest acceleration",
        ("m/s2", "deg/s2"),
        _acceleration,
        "max_acceleration",
        again=True,
    ),
    Question(
        "masses", EVERY, "mass that it moves, without the part", ("kg", "kg"), _moved_mass, "moved_mass"
    ),
    Question("motors", EVERY, "nameplate of its motor", ("kW, or 8.5 A 400 V",) * 2, _motor, "motor"),
    Question("mass", "", "mass of the whole machine", ("kg, or t", ""), _machine_mass, "size"),
    Question("size", "", "size of the machine", (", ".join(SIZES), ""), _size, "size"),
    Question(
        "base-power",
        "",
        "power at standstill, with everything switched on",
        ("W", ""),
        _base_power,
        "base_power",
    ),
    Question("control", "", "control, as `fiveaxis controls` lists them", ("name", ""), _text),
)
BY_NAME = {question.name: question for question in QUESTIONS}
