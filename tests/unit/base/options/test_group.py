"""Groups of options: frozen records that check themselves, and keywords that are made of them."""

import inspect
from dataclasses import FrozenInstanceError, dataclass, fields, replace

import numpy as np
import pytest

import fiveaxis.base.options as every_group
from fiveaxis.base import Bounds, Reading, Search, Workpiece, keywords_of, options_of, with_default
from fiveaxis.base.errors import SettingError
from fiveaxis.base.options.group import Group, option
from fiveaxis.lab import calibrate_drive

GROUPS = [
    group for group in vars(every_group).values() if isinstance(group, type) and issubclass(group, Group)
]


@dataclass(frozen=True, kw_only=True)
class Cutting(Bounds):
    """Bounds, with a default of its own and a field that is no option."""

    max_turn: float | None = with_default(Bounds, "max_turn", 12.0)
    feed: float = 1.0
    names: dict[str, str] = option({}, "names by letter")


@keywords_of(Cutting)
def cut(path: str, cutting: Cutting) -> tuple[str, Cutting]:
    """Cut."""
    return path, cutting


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_every_field_of_a_group_is_an_option_with_a_sentence(group):
    found = options_of(group)
    assert list(found) == [field.name for field in fields(group)]
    assert all(said.about for _, said in found.values())
    for name, (_, said) in found.items():
        assert getattr(group(), name) == said.default, name


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: Search(steady=-0.1), "steady = -0.1 is out of range; give 0 or more"),
        (lambda: Search(effort="huge"), "effort = 'huge' is unknown; give 'quick' or 'normal' or 'thorough'"),
        (lambda: Bounds(cone=181.0), "cone = 181 deg is out of range; give 180 deg or less"),
        (lambda: Bounds(tilt=(0.0, float("inf"))), "tilt = inf deg is out of range; give a finite number"),
        (lambda: Bounds(singular_cone=90.0), "singular_cone = 90 deg is out of range; give less than 90 deg"),
        (lambda: replace(Workpiece(), gouge_tolerance=0.0), "give more than 0 mm"),
        (lambda: Reading(zero={"X": "18"}), "^zero = {'X': '18'} is of the wrong kind"),
    ],
)
def test_a_wrong_value_is_refused_when_the_record_is_made(make, fault):
    with pytest.raises(SettingError, match=fault):
        make()


def test_a_record_stays_as_it_is():
    with pytest.raises(FrozenInstanceError):
        Bounds().tilt = (0.0, 1.0)


def test_a_group_takes_the_fields_of_records_and_the_last_one_wins():
    found = Cutting.of(Bounds(tilt=(1.0, 2.0), max_turn=5.0), Search(effort="quick"), feed=3.0)
    assert (found.tilt, found.max_turn, found.feed) == ((1.0, 2.0), 5.0, 3.0)
    assert Bounds.of(found, Bounds(cone=4.0)).cone == 4.0
    assert Cutting.of(Search()) == Cutting()


def test_a_keyword_that_is_missing_is_named_as_one_of_the_function():
    with pytest.raises(TypeError, match=r"^calibrate_drive\(\) misses the keyword argument 'power'"):
        calibrate_drive("log.csv", axis="X", model="friction")


def test_keywords_become_the_record_and_positions_may_be_named():
    assert cut("a", tilt=(1.0, 2.0), feed=2.0) == ("a", Cutting(tilt=(1.0, 2.0), feed=2.0))
    assert cut(path="a") == ("a", Cutting())
    with pytest.raises(
        TypeError, match=r"cut\(\) got an unexpected keyword argument 'tlit'; did you mean 'tilt'"
    ):
        cut("a", tlit=(1.0, 2.0))


def test_signature_and_docstring_say_each_option():
    own = inspect.signature(cut).parameters
    assert list(own) == ["path", *(field.name for field in fields(Cutting))]
    assert own["max_turn"].default == 12.0
    assert own["tilt"].annotation == tuple[float, float] | None
    assert "cone : largest angle to the programmed tool axis, deg; 15 by default" in cut.__doc__


def test_a_default_that_could_change_is_each_records_own():
    Cutting().names["A"] = "changed"
    assert Cutting().names == {}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"tilt": 15}, r"tilt = 15 is of the wrong kind; give \(a number, a number\), deg"),
        ({"tilt": (1, 2, 3)}, "tilt = .* is of the wrong kind"),
        ({"tilt": "15:75"}, "tilt = '15:75' is of the wrong kind"),
        ({"tilt": ("a", "b")}, "tilt = .* is of the wrong kind"),
        ({"cone": "20"}, "cone = '20' is of the wrong kind; give a number, deg"),
        ({"cone": True}, "cone = True is of the wrong kind"),
        ({"hold": 5}, r"hold = 5 is of the wrong kind; give something such as \{'C': 30\}, deg"),
        ({"plane": 3}, "plane = 3 is of the wrong kind"),
    ],
)
def test_a_value_of_the_wrong_kind_is_told_with_what_to_give(given, told):
    with pytest.raises(SettingError, match=told):
        Bounds(**given)


@pytest.mark.parametrize(
    "given",
    [
        {"tilt": np.array([1.0, 2.0])},
        {"tilt": [1, 2]},
        {"cone": np.float32(3)},
        {"cone": np.int64(3)},
        {"hold": {"C": 3}},
    ],
)
def test_numbers_and_lists_of_numpy_are_of_the_kind_that_is_asked_for(given):
    assert Bounds(**given)
