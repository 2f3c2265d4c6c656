"""Machine files drafted from answers."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base.errors import SettingError
from fiveaxis.base.findings import Severity
from fiveaxis.model import check_text, draft_machine, load_machine, tool_poses, with_powers
from fiveaxis.model.machine.answers import BY_NAME, KINDS, parse_axis_answers
from fiveaxis.model.machine.axis_tables import AxisTable
from fiveaxis.model.machine.figures import figure_models, meaning_of
from fiveaxis.model.machine.tables import MachineFile

FILE = Path("machine.toml")
FULL = {
    ("name", ""): "mill",
    ("structure", ""): "640123",
    ("vertical", ""): "Z",
    ("limits", "X"): "-300:300",
    ("limits", "Y"): "-10:10 inch",
    ("limits", "Z"): "0:450",
    ("limits", "A"): "-30:120",
    ("limits", "C"): "endless",
    ("counts", "A"): "table",
    ("counts", "C"): "tool",
    ("points", "A"): "0,5,50",
    ("points", "C"): "0 0 0",
    ("spindle", ""): "0, 0, 500",
    ("speeds", "X"): "40",
    ("speeds", "A"): "180 deg/s",
    ("accelerations", "X"): "5",
    ("masses", "X"): "900",
    ("masses", "C"): "0.12 t",
    ("motors", "Y"): "11 A 400 V",
    ("motors", "Z"): "3.1",
    ("mass", ""): "8 t",
    ("base-power", ""): "1.5 kW",
}


def written(answers: dict[tuple[str, str], str], folder: Path):
    path = folder / "mill.toml"
    path.write_text(draft_machine(answers).text, encoding="utf-8")
    return load_machine(path)


def test_answers_are_the_machine_s_figures_in_its_units(tmp_path):
    machine = written(FULL, tmp_path)
    assert machine.axis("Y").limits.ends == pytest.approx((-254.0, 254.0))
    # The control counts A as the table's motion: its range is turned round.
    assert machine.axis("A").reversed
    assert machine.axis("A").limits.ends == pytest.approx(tuple(np.radians((-120.0, 30.0))))
    assert machine.axis("C").limits.unlimited
    assert machine.axis("X").max_speed == pytest.approx(40_000.0 / 60.0)
    assert machine.axis("A").max_speed == pytest.approx(np.pi)
    assert machine.axis("X").max_acceleration == pytest.approx(5000.0)
    assert (machine.axis("X").moved_mass, machine.axis("C").moved_mass) == (900.0, 120.0)
    assert machine.axis("Z").motor_power == pytest.approx(3100.0)
    assert machine.axis("Y").motor_power == pytest.approx(np.sqrt(3.0) * 0.8 * 11.0 * 400.0)
    assert (machine.size.mass, machine.base_power) == (8000.0, 1500.0)
    lines = {j.letter: j.line for j in machine.chain.joints}
    assert lines["A"].point == (0.0, 5.0, 50.0)
    assert machine.chain.tool_home[:3, 3] == pytest.approx([0.0, 0.0, 500.0])


def test_every_figure_says_that_its_owner_stated_it(tmp_path):
    for p in written(FULL, tmp_path).provenance:
        assert p.source == "stated by the machine's owner"
        assert not p.assumed


def test_a_full_answer_leaves_nothing_to_complain_of_but_powers():
    findings = check_text(draft_machine(FULL).text, FILE)
    assert {f.severity for f in findings} == {Severity.NOTE}
    assert {f.code for f in findings} == {"no-powers"}


def test_powers_are_estimated_from_what_is_stated(tmp_path):
    machine = with_powers(written(FULL, tmp_path))
    assert machine.has_powers
    sources = {p.figure: p.source for p in machine.provenance}
    assert sources["X drive"] == "estimated from 900 kg moved"
    assert "the machine's 8000 kg" in sources["Y drive"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_alone_is_a_machine_whose_gaps_are_all_said(kind, tmp_path):
    answers = {("structure", ""): kind}
    text = draft_machine(answers).text
    machine = written(answers, tmp_path)
    assert machine.code.text == KINDS[kind].code
    assert not [f for f in check_text(text, FILE) if f.severity is Severity.ERROR]
    assumed = {p.figure for p in machine.provenance if p.assumed}
    assert {"structure", "vertical"} <= assumed
    if machine.rotaries:
        assert "# Pivots: not all given" in text
    for letter in machine.letters:
        said = text.partition(f"# Axis {letter}.")[2].partition("[axes")[0]
        assert all(key in said for key in ("limits", "max_speed", "max_acceleration", "moved_mass, motor"))


def test_limits_of_an_axis_whose_sense_is_not_stated_are_assumed():
    machine = draft_machine({("structure", ""): "640123", ("limits", "A"): "-120:30"}).machine
    limits = next(p for p in machine.provenance if p.figure == "A limits")
    assert limits.assumed
    assert "sense" in limits.note


def test_the_same_answers_give_the_same_text_in_any_order():
    assert draft_machine(FULL).text == draft_machine(dict(reversed(FULL.items()))).text


def test_comments_stand_above_their_tables_and_the_file_is_toml():
    text = draft_machine(FULL).text
    lines = text.splitlines()
    headers = [i for i, line in enumerate(lines) if line.startswith("[")]
    assert all(lines[i - 1].startswith("#") for i in headers)
    assert tomllib.loads(text)["axes"]["X"]["limits"]["max"] == 300


def test_figures_of_another_file_stand_where_nothing_is_answered():
    base = load_machine("variaxis-630")
    draft = draft_machine({("masses", "X"): "700", ("limits", "Z"): "-500:0"}, base)
    values = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 5))
    for one, other in zip(tool_poses(base, values), tool_poses(draft.machine, values), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    assert draft.machine.axis("Z").limits.low == -500.0
    assert draft.machine.axis("Y").limits == base.axis("Y").limits
    sources = {p.figure: p.source for p in draft.machine.provenance}
    assert sources["Y limits"] == "mazak_v7.mch, component Y"
    assert sources["X moved_mass"] == "stated by the machine's owner"
    # Nothing is taken for granted in silence.
    assert next(p for p in draft.machine.provenance if p.figure == "vertical").assumed


def test_a_stated_point_leaves_an_inclined_direction_assumed():
    answers = {("structure", ""): "nutating-table", ("points", "B"): "0,0,155"}
    machine = draft_machine(answers).machine
    line = next(p for p in machine.provenance if p.figure == "B line")
    assert line.assumed
    assert "45 deg" in line.note
    np.testing.assert_allclose(
        next(j.line.direction for j in machine.chain.joints if j.letter == "B"), [0.0, 0.5**0.5, -(0.5**0.5)]
    )


def test_a_stated_mass_leaves_the_kind_of_size():
    answers = {("structure", ""): "3-axis", ("mass", ""): "3 t", ("size", ""): "portal"}
    size = draft_machine(answers).machine.size
    assert (size.kind, size.mass) == ("portal", 3000.0)


def test_limits_of_a_reversed_axis_are_answered_in_the_control_s_sign():
    base = load_machine("linuxcnc-xyzac-trt")
    draft = draft_machine({("limits", "A"): "-90:40"}, base)
    assert draft.machine.axis("A").limits.ends == pytest.approx(tuple(np.radians((-40.0, 90.0))))


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        ({("structure", ""): "trunion"}, "structure: 'trunion' is none of trunnion-ac"),
        ({("structure", ""): "64123"}, "has no bed"),
        ({("vertical", ""): "Y,Z"}, "vertical: 'Y,Z' names several axes; one is vertical"),
        ({("vertical", ""): "A"}, "none of X, Y, Z"),
        ({("limits", "X"): "300:-300"}, "limits of X: 300 mm is not below -300 mm; exchange them"),
        ({("limits", "X"): "-0.3:0.3"}, "limits of X: 0.6 mm is implausible; machines have 1 to 10000 mm"),
        ({("limits", "X"): "600"}, "limits of X: '600' isn't of the form MIN:MAX"),
        ({("limits", "X"): "endless"}, "isn't of the form MIN:MAX"),
        ({("limits", "X"): "-30:30 deg"}, "in mm or inch"),
        ({("limits", "A"): "-2.1:0.5"}, "looks like radians; write -2.1:0.5 rad"),
        ({("limits", "B"): "-30:30"}, "limits of B: the machine has the axes X, Y, Z, A, C"),
        ({("counts", "A"): "yes"}, "neither tool nor table"),
        ({("counts", "X"): "tool"}, "counts of X: it is asked of A, B, C only"),
        ({("points", "A"): "0,0"}, "isn't of the form X,Y,Z"),
        ({("points", "A"): "0,0,1e9"}, "further than 20000 mm away"),
        (
            {("speeds", "X"): "40000"},
            "speeds of X: 666667 mm/s is implausible; machines have 1 to 2500 mm/s: is it in mm/min",
        ),
        ({("speeds", "X"): "20 rpm"}, "one of the units m/min"),
        ({("speeds", "A"): "10000"}, "60000 deg/s is implausible"),
        ({("accelerations", "X"): "500"}, "500000 mm/s2 is implausible"),
        ({("masses", "X"): "900 lb"}, "one of the units kg, t"),
        ({("masses", "X"): "0"}, "masses of X: 0 kg is implausible"),
        ({("masses", "X"): "-5"}, "-5 kg is implausible"),
        ({("masses", "X"): "nan"}, "isn't a number"),
        ({("masses", "X"): "9000"}, "it moves 9000 kg, and the whole machine has 8000 kg"),
        ({("masses", "A"): "50"}, "masses of A: it moves 50 kg, less than C, which it carries"),
        (
            {("motors", "Z"): "3100"},
            "motors of Z: 3.1e\\+06 W is implausible; machines have 5 to 200000 W: is it in kW",
        ),
        ({("motors", "Z"): "11 A"}, "isn't a number with one of the units kW, W"),
        ({("mass", ""): "8"}, "mass: 8 kg is implausible"),
        ({("base-power", ""): "2"}, "base-power: 2 W is implausible"),
        ({("size", ""): "huge"}, "none of desktop"),
        ({("name", ""): "a\nb"}, "isn't a name"),
    ],
)
def test_an_impossible_answer_is_one_message(changed, fault):
    with pytest.raises(SettingError, match=fault):
        draft_machine(FULL | changed)


def test_without_a_structure_nothing_is_guessed():
    with pytest.raises(SettingError, match="structure is missing: write a kind"):
        draft_machine({("limits", "X"): "-300:300"})


def test_answers_about_several_axes_are_split():
    assert parse_axis_answers("points", "a=0,12.5,50, C = 0,0,0") == {
        ("points", "A"): "0,12.5,50",
        ("points", "C"): "0,0,0",
    }
    for text in ("300", "X=1,X=2", "Q=3", "X=", ""):
        with pytest.raises(SettingError, match="limits"):
            parse_axis_answers("limits", text)


def test_every_question_says_the_form_of_its_answer():
    for question in BY_NAME.values():
        for letter in question.axes or ("",):
            assert question.form_of(letter)


@pytest.mark.parametrize("tables", [MachineFile, AxisTable])
def test_every_figure_has_a_meaning_that_stands_above_its_table(tables):
    for key in figure_models(tables):
        sentence = meaning_of(tables, key, "X")
        assert sentence[0].isupper()
        assert sentence.endswith(".")
        assert "the axis " not in sentence


def test_a_power_at_standstill_is_drafted_with_its_unit():
    table = tomllib.loads(draft_machine(FULL).text)["base_power"]
    assert (table["value"], table["unit"]) == (1500, "W")
