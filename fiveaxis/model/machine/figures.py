"""What a figure of a machine is, described once: a table of the machine file and all that is made from it.

A figure is a subclass of `Figure`. Its fields are the keys of its table, with unit and range; the first line
of its docstring is its meaning, in the documentation and above the table in a drafted file. `read` turns it
into fields of a `Machine` or an `Axis`, `write` turns these into the table again, `plausible` has the ranges
of other machines, and `questions` are those that the machine's owner answers. `AxisTable` and `MachineFile`
have a field for each figure; reader, writer, check, draft and dialogue go through these fields.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from fiveaxis.base import Array, FigureError, SettingError, StrictModel, models_in, normalise
from fiveaxis.model.machine.chain import Triple, as_triple

if TYPE_CHECKING:
    from fiveaxis.model.machine.model import Machine

F = TypeVar("F", bound="Figure")
NotNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0)]
Table = dict[str, Any]

LINEAR, ROTARY = "XYZ", "ABC"
# Unit of a file -> factor to mm, rad and seconds.
LINEAR_UNITS = {"mm": 1.0, "inch": 25.4, "m": 1000.0}
ANGLE_UNITS = {"deg": math.radians(1.0), "rad": 1.0, "arcsec": math.radians(1.0 / 3600.0)}
TURNING_UNITS = ANGLE_UNITS | {"rpm": 1.0}
MOST_MASS = 500_000.0  # kg, of the largest portal mills
LONGEST = 10_000.0  # mm, travels and distances of axes
FARTHEST = 20_000.0  # mm, points from zero
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
DECIMALS = 12  # of mm, or of a direction whose largest component is 1
RELATIVE = 2e-15  # a few units in the last place: rounding of a unit converted there and back


def fault(code: str, message: str) -> PydanticCustomError:
    """Make a validation fault with its own code, which `check_machine` reports."""
    return PydanticCustomError(code, "{text}", {"text": message})  # type: ignore[arg-type, unused-ignore]


@dataclass(frozen=True)
class Plausible:
    """Range of a figure on machines; a value outside it is more likely in another unit.

    Parameters
    ----------
    name : of the figure in a message
    low, high : ends, in `unit`
    unit : of the range
    likely : units in which a figure outside it more likely is
    """

    name: str
    low: float
    high: float
    unit: str
    likely: str

    def __str__(self) -> str:
        return f"machines have {self.low:g} to {self.high:g} {self.unit}: is it in {self.likely}?"


class Stage(IntEnum):
    """Stages of the dialogue with a machine's owner, in their order."""

    STRUCTURE = 1
    FRAME = 2
    TRAVEL = 3
    PIVOTS = 4
    MOTION = 5
    MASSES = 6
    STANDSTILL = 7
    CONTROL = 8


@dataclass(frozen=True)
class Question:
    """One question to a machine's owner, and the option of `fiveaxis machine new` that answers it.

    A question about a figure decorates the figure's table.

    Parameters
    ----------
    name : its option is ``--name``
    stage : of the dialogue in which it is asked
    text : what is asked
    form : of an answer, with its unit; where it differs between linear and rotary axes, one for each
    example : of the option, where it is about axes
    axes : letters of which it is asked; empty for one of the machine
    again : whether the answer of the last axis of its kind is offered for the next
    default : what Enter answers; empty for nothing
    instead : keys of figures of which each makes the answer needless; by default the figure's own
    answer : makes the keys of a table of an axis letter and an answer; by default the figure does
    key, model : of the figure; empty and None for what has no table of its own
    """

    name: str
    stage: Stage
    text: str
    form: str | tuple[str, str]
    example: str = ""
    axes: str = ""
    again: bool = False
    default: str = ""
    instead: tuple[str, ...] = ()
    answer: Callable[[str, str], Table] | None = None
    key: str = ""
    model: type[Figure] | None = None

    def __call__(self, model: type[F]) -> type[F]:
        """Ask for a figure."""
        model.questions = (replace(self, model=model), *model.questions)
        return model

    def form_of(self, letter: str) -> str:
        """Return the form of an answer, with its unit."""
        return self.form if isinstance(self.form, str) else self.form[letter in ROTARY]

    @property
    def help(self) -> str:
        """What the option's help says."""
        forms = (self.form,) if isinstance(self.form, str) else self.form
        return f"{self.text} ({'; '.join(filter(None, (self.example, *forms)))})"

    def table(self, letter: str, answer: str) -> Table:
        """Read an answer; `SettingError` if it has another form, or a figure that no machine has."""
        try:
            model = self.model or Figure
            own = (self.answer or model._answer)(letter, answer.strip())
            # Nothing is validated here: the draft is, as a whole.
            for _, value, usual in model.model_construct(**own).doubts(letter):
                raise SettingError(f"{value:g} {usual.unit} is implausible; {usual}")
        except SettingError as wrong:
            of = f" of {letter}" if letter else ""
            raise SettingError(f"{self.name}{of}: {wrong.message}") from None
        return own


class Figure(StrictModel):
    """One or several related figures, and their origin."""

    # Field of `Machine` or `Axis` that it states, and the field's class, whose own fields are keys of the
    # table; without a class the field has the value of the only key, or a tuple of those of all keys.
    field: ClassVar[str] = ""
    record: ClassVar[type[Any] | None] = None
    # Ranges on machines, by key; what a machine without the figure does without; what its owner is asked.
    plausible: ClassVar[Mapping[str, Plausible]] = {}
    lack: ClassVar[str] = ""
    questions: ClassVar[tuple[Question, ...]] = ()
    # Units of an answer, as factors to the unit of the figure, which is the first.
    answered: ClassVar[Mapping[str, float]] = {}

    source: str | None = Field(None, description="where the figure is printed or was measured")
    assumed: bool = Field(False, description="no source; then `note` says why this value")
    fitted: bool = Field(False, description="computed from measurements, which the source names")
    band: tuple[Positive, Positive] | None = Field(
        None, description="of an estimate: lowest and highest plausible value, as shares of it"
    )
    note: str | None = Field(None, description="a sentence")

    @model_validator(mode="after")
    def _has_provenance(self) -> Figure:
        if self.assumed and not self.note:
            raise fault("missing_source", "assumed = true needs a note that says why this value")
        if not self.assumed and not self.source:
            raise fault("missing_source", "needs a source, or assumed = true with a note")
        if self.band is not None and not self.band[0] <= 1.0 <= self.band[1]:
            low, high = self.band
            raise fault("reversed_range", f"band is {low:g}…{high:g}; the value itself, 1, must lie inside")
        return self

    def read(self, letter: str) -> dict[str, Any]:
        """Return what it states as fields of a `Machine`, or of the `Axis` of a letter, in mm, rad, s, W, kg.

        ``tool_home``, ``line`` and ``location_error`` belong to the chain. `FigureError` if it doesn't fit
        the axis; `location` begins below the figure's table.
        """
        return {self.field: self._value(letter)} if self.field else {}

    @classmethod
    def write(cls, machine: Machine, letter: str, stated: bool) -> Table | None:
        """Return the table of a machine's figure, without its origin; None where there is nothing to state.

        Parameters
        ----------
        machine : with the nominal chain in the machine frame
        stated : whether the origin of the figure is known: it then is written if it is the default, too
        """
        if not cls.field:
            return {} if stated else None
        owner = machine.axis(letter) if letter else machine
        value = getattr(owner, cls.field)
        usual = next(f.default for f in fields(owner) if f.name == cls.field)
        return None if value is None or (value == usual and not stated) else cls._table(value, letter)

    def doubts(self, letter: str) -> Iterator[tuple[str, float, Plausible]]:
        """Yield what lies outside the range on machines: key, value in the range's unit, range."""
        for key, usual in self.plausible.items():
            value = self._magnitude(key, letter)
            if value is not None and not usual.low <= value <= usual.high:
                yield key, value, usual

    @classmethod
    def _keys(cls) -> list[str]:
        """List the keys with figures."""
        others = (*Figure.model_fields, "unit", "model", "link", "shape")
        return [key for key in cls.model_fields if key not in others]

    def _value(self, letter: str) -> Any:
        """Make the value of the field."""
        own = {key: self._inside(key, getattr(self, key), letter) for key in self._keys()}
        if self.record is not None:
            return self.record(**own)
        return tuple(own.values()) if len(own) > 1 else next(iter(own.values()))

    @classmethod
    def _table(cls, value: Any, letter: str) -> Table:
        """Make the table of the field's value."""
        keys = cls._keys()
        if cls.record is not None:
            value = [getattr(value, key) for key in keys]
        own = zip(keys, value if len(keys) > 1 else [value], strict=True)
        return {key: plain(cls._outside(key, v, letter)) for key, v in own if v is not None}

    def _inside(self, key: str, value: Any, letter: str) -> Any:
        """Convert the value of a key to mm, rad, s."""
        return value

    @classmethod
    def _outside(cls, key: str, value: Any, letter: str) -> Any:
        """Convert back, to the unit in which the table is written."""
        return value

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        """Read an answer to its question: by default a number for the first key with a range, and a unit."""
        value, unit = parse_quantity(answer, tuple(cls.answered))
        table: Table = {next(iter(cls.plausible)): neat(value * cls.answered[unit])}
        return table | ({"unit": next(iter(cls.answered))} if "unit" in cls.model_fields else {})

    def _magnitude(self, key: str, letter: str) -> float | None:
        """Return what is compared with a range of `plausible`; None if nothing is."""
        value: float | None = getattr(self, key)
        return value


class Directed(Figure):
    """A figure that has a direction."""

    direction: Triple | None = None

    @model_validator(mode="after")
    def _points_somewhere(self) -> Directed:
        if self.direction is not None and not any(self.direction):
            raise fault("zero_direction", "direction has length 0; give three numbers, not all zero")
        return self

    def _inside(self, key: str, value: Any, letter: str) -> Any:
        return as_triple(normalise(np.array(value))) if key == "direction" else value

    @classmethod
    def _outside(cls, key: str, value: Any, letter: str) -> Any:
        return direction_numbers(value) if key == "direction" else value


def figure_models(tables: type[BaseModel]) -> dict[str, list[type[Figure]]]:
    """List the figures of an axis or a machine: key -> models of its table, one for each kind."""
    found = {
        key: [model for model in models_in(field.annotation) if issubclass(model, Figure)]
        for key, field in tables.model_fields.items()
        if get_origin(field.annotation) is not list
    }
    return {key: models for key, models in found.items() if models}


def stated_figures(tables: BaseModel) -> Iterator[tuple[str, Figure]]:
    """Yield the figures that a file states of an axis or a machine, with their keys."""
    for key in figure_models(type(tables)):
        figure = getattr(tables, key)
        if figure is not None:
            yield key, figure


def meaning_of(tables: type[BaseModel], key: str, letter: str) -> str:
    """Say in a sentence what a figure is, of an axis by its letter."""
    text = tables.model_fields[key].description
    [model, *_] = figure_models(tables)[key]
    return (text or (model.__doc__ or "").partition("\n")[0]).replace("the axis", letter or "the axis")


def unit_factor(letter: str, unit: str) -> float:
    """Return the factor from a file's unit to mm or rad; `FigureError` for one of the other kind of axis."""
    units = TURNING_UNITS if letter in ROTARY else LINEAR_UNITS
    if unit not in units:
        kind, offered = ("rotary", "deg or rad") if letter in ROTARY else ("linear", "mm or inch")
        message = f"axis {letter} is {kind}; its unit can't be {unit}, write {offered}"
        raise FigureError((), "wrong-unit", message)
    return units[unit]


def parse_quantity(answer: str, units: Sequence[str]) -> tuple[float, str]:
    """Split an answer into a number and one of the units, by default the first; `SettingError` else."""
    found = re.fullmatch(rf"({NUMBER})\s*(\S*)", answer)
    unit = units[0] if found is None or not found[2] else found[2]
    if found is None or unit not in units:
        raise SettingError(f"{answer!r} isn't a number with one of the units {', '.join(units)}")
    return float(found[1]), unit


def parse_point(answer: str) -> Table:
    """Read a point, (3,) mm.

    `SettingError` if there aren't three numbers, or it is further away than any machine is large.
    """
    numbers = re.split(r"\s*[,;]\s*|\s+", answer)
    if len(numbers) != 3 or not all(re.fullmatch(NUMBER, text) for text in numbers):
        raise SettingError(f"{answer!r} isn't of the form X,Y,Z, in mm")
    point = [neat(float(text)) for text in numbers]
    try:
        _require_near(tuple(point))
    except ValueError as fault:
        raise SettingError(str(fault)) from None
    return {"point": point}


def _require_near(point: tuple[float, ...]) -> tuple[float, ...]:
    if max(map(abs, point)) > FARTHEST:
        shown = ", ".join(f"{value:g}" for value in point)
        raise ValueError(f"({shown}) mm is further than {FARTHEST:g} mm away, beyond any machine; write mm")
    return point


# mm, in the machine frame.
Point = Annotated[Triple, AfterValidator(_require_near)]


def direction_numbers(vector: Array | Triple) -> list[float]:
    """Write a direction with 1 as its largest component: (0, 1, 1), not (0, 0.7071…, 0.7071…)."""
    components = np.asarray(vector, dtype=float)
    return rounded(components / np.abs(components).max())


def rounded(vector: Array | Triple) -> list[float]:
    """Remove the rounding left by undoing a setup: exact zeros keep the chain's equations short."""
    return [_integer(round(float(v), DECIMALS)) for v in vector]


def neat(value: float) -> float:
    """Return the shortest number that is the value: 30 deg come back from radians as 29.999999999999996."""
    close = (float(f"{value:.{digits}g}") for digits in range(1, 17))
    return _integer(next((v for v in close if abs(v - value) <= RELATIVE * abs(value)), value))


def plain(value: Any) -> Any:
    """Write a value as TOML has it: a number as the shortest one, a tuple as a list."""
    if isinstance(value, tuple | list):
        return [plain(v) for v in value]
    return neat(float(value)) if isinstance(value, int | float) else value


def _integer(value: float) -> float:
    """Convert a whole number to an int, which TOML writes without a decimal point."""
    return int(value) if value.is_integer() else value
