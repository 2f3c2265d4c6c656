"""A machine written to a file and read back is the same machine."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.base.errors import MachineError, SettingError
from fiveaxis.model import (
    Axis,
    Body,
    Box,
    DirectionalDrive,
    Limits,
    Machine,
    check_machine,
    load_machine,
    machine_names,
    machine_text,
    save_machine,
    tool_poses,
)
from fiveaxis.model.machine.axes import LocationError
from fiveaxis.model.machine.building import machine_document

RNG = np.random.default_rng(5)

# Every key that a machine file can have.
RICH = """name = "rich"
code = "650123"
description = "a machine with every key"
control = "haas"

[structure]
source = "brochure"
note = "page 3"

[spindle]
point = [1.5, -2.25, 400.0]
direction = [0, 0, 1]
source = "drawing"

[base_power]
value = 812.5
unit = "W"
assumed = true
note = "a guess"

[axes.X]
carries = "tool"
reversed = false
limits = { min = -20, max = 20.5, unit = "inch", source = "brochure", assumed = false }
drive = { model = "directional", plus = 0.031, minus = 0.029, unit = "W/(mm/min)", source = "measured" }
max_speed = { value = 40, unit = "m/min", source = "brochure" }
max_acceleration = { value = 4.5, unit = "m/s2", source = "brochure" }
max_jerk = { value = 40, unit = "m/s3", source = "brochure" }
moved_mass = { value = 315, unit = "kg", source = "brochure" }

[axes.Y]
line = { direction = [1e-4, 1, 0], source = "laser", note = "squareness" }

[axes.Z]
drive = { model = "directional", plus = 612.1, minus = 427.8, unit = "W", source = "measured" }
max_speed = { value = 12, unit = "inch/s", source = "brochure" }

[axes.B]
carries = "workpiece"
reversed = true
limits = { min = -30, max = 110, unit = "deg", source = "brochure" }
line = { direction = [0, 1, 1], point = [0.1, 20, 30.3], source = "drawing" }
location_error = { offset = [0.012, 0, -0.003], tilt = [8, -3, 3], tilt_unit = "arcsec", source = "R-test" }
drive = { model = "directional", plus = 0.08483, minus = 0.05736, unit = "W/(deg/min)", source = "measured" }
max_speed = { value = 25, unit = "rpm", source = "brochure" }
max_acceleration = { value = 3, unit = "rad/s2", source = "brochure" }
max_jerk = { value = 900, unit = "deg/s3", source = "brochure" }

[axes.C]
limits = { unit = "deg", assumed = true, note = "endless" }
location_error = { offset = [0.001, 0.002, 0.0], source = "R-test" }

[[bodies]]
link = "bed"
shape = "box"
size = [500, 400, 100.5]
center = [0, 0, -200]
source = "drawing"

[[bodies]]
link = "C"
shape = "cylinder"
radius = 125
height = 40
center = [0, 0, -20]
direction = [0, 0, 2]
assumed = true
note = "as seen in a photograph"

[[bodies]]
link = "B"
shape = "mesh"
file = "meshes/yoke.stl"
scale = 25.4
source = "model"
"""


@pytest.fixture
def rich(tmp_path: Path) -> Path:
    (tmp_path / "in" / "meshes").mkdir(parents=True)
    (tmp_path / "in" / "meshes" / "yoke.stl").write_text("solid")
    path = tmp_path / "in" / "rich.toml"
    path.write_text(RICH, encoding="utf-8")
    return path


def assert_same(found: Machine, wanted: Machine) -> None:
    """Everything but setup and tool length, which a machine file doesn't have."""
    assert (found.name, found.code, found.description) == (wanted.name, wanted.code, wanted.description)
    assert found.base_power == wanted.base_power
    np.testing.assert_allclose(found.chain.tool_home, wanted.chain.tool_home, rtol=0.0, atol=1e-12)
    for mine, theirs in zip(found.chain.joints, wanted.chain.joints, strict=True):
        assert mine.letter == theirs.letter
        np.testing.assert_allclose(mine.line.direction, theirs.line.direction, rtol=0.0, atol=1e-12)
        if mine.is_rotary:
            np.testing.assert_allclose(mine.line.point, theirs.line.point, rtol=0.0, atol=1e-12)
    for axis, other in zip(found.axes, wanted.axes, strict=True):
        assert_flat(axis, other)
    assert [origin(p) for p in found.provenance] == [origin(p) for p in wanted.provenance]
    assert [b.link for b in found.bodies] == [b.link for b in wanted.bodies]
    for body, other_body in zip(found.bodies, wanted.bodies, strict=True):
        assert_flat(body.shape, other_body.shape)


def assert_flat(found: Any, wanted: Any) -> None:
    mine, theirs = flat(found), flat(wanted)
    assert mine.keys() == theirs.keys()
    for key, value in theirs.items():
        number = isinstance(value, float)
        assert mine[key] == (pytest.approx(value, rel=1e-13, abs=1e-18) if number else value), key


def flat(record: Any) -> dict[str, Any]:
    """Numbers and names of a record and of those in it, by their path."""
    found: dict[str, Any] = {}
    for key, value in vars(record).items():
        if hasattr(value, "__dataclass_fields__"):
            found |= {f"{key}.{k}": v for k, v in flat(value).items()}
        elif isinstance(value, tuple):
            found |= {f"{key}.{i}": v for i, v in enumerate(value)}
        else:
            found[key] = value.resolve() if isinstance(value, Path) else value
    return found


def origin(p: Any) -> tuple[str, str, bool, str]:
    return p.figure, p.source, p.assumed, p.note


def keys(table: Any, at: str = "") -> set[str]:
    if isinstance(table, dict):
        return {at}.union(*(keys(v, f"{at}.{k}") for k, v in table.items()))
    if isinstance(table, list) and table and isinstance(table[0], dict):
        return {at}.union(*(keys(v, f"{at}[{i}]") for i, v in enumerate(table)))
    return {at}


def round_trip(machine: Machine, tmp_path: Path) -> Machine:
    return load_machine(save_machine(machine, tmp_path / "out" / "again.toml"))


@pytest.mark.parametrize("name", machine_names())
def test_every_machine_of_the_library_comes_back(name, tmp_path):
    machine = load_machine(name)
    again = round_trip(machine, tmp_path)
    assert_same(again, machine)
    positions = RNG.uniform(-1.5, 1.5, (50, len(machine.axes)))
    for mine, theirs in zip(tool_poses(again, positions), tool_poses(machine, positions), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-11)


def test_a_file_with_every_key_comes_back(rich, tmp_path):
    assert_same(round_trip(load_machine(rich), tmp_path), load_machine(rich))


def test_the_document_has_every_key_of_the_file(rich):
    assert keys(tomllib.loads(RICH)) <= keys(machine_document(load_machine(rich)))


def test_a_key_that_the_loader_does_not_use_is_not_in_the_document(rich):
    unread = RICH.replace('note = "squareness"', 'note = "squareness", point = [1, 2, 3]')
    rich.write_text(unread, encoding="utf-8")
    extra = keys(tomllib.loads(unread)) - keys(machine_document(load_machine(rich)))
    assert extra == {".axes.Y.line.point"}


def test_writing_twice_gives_the_same_text(rich, tmp_path):
    machine = load_machine(rich)
    text = machine_text(machine)
    assert text == machine_text(machine)
    again = tmp_path / "again.toml"
    again.write_text(text, encoding="utf-8")
    assert machine_text(load_machine(again)) == text


def test_the_text_has_round_numbers_on_one_line(rich):
    text = machine_text(load_machine(rich))
    for line in (
        "min = -508",
        "max = 520.7",
        "value = 150",  # 25 rpm in deg/s
        "min = -30",
        "plus = 0.08483",
        "plus = 0.031",
        "direction = [0, 1, 1]",
        "point = [0.1, 20, 30.3]",
        "offset = [0.012, 0, -0.003]",
    ):
        assert line in text.splitlines()
    assert "assumed = false" not in text
    assert "reversed = false" not in text


def test_setup_and_tool_are_not_written(rich):
    machine = load_machine(rich)
    used = machine.with_setup((100.3, -20.1, 33.3), (0.0, 90.0, 12.5)).with_tool_length(123.4)
    assert machine_text(used) == machine_text(machine)


def test_a_load_that_is_stated_as_none_comes_back(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('name = "m"\ncode = "640123"\n[load]\nmass = 0\nsource = "s"\n')
    again = round_trip(load_machine(path), tmp_path)
    assert [p.figure for p in again.provenance] == ["load"]
    assert not [f for f in check_machine(path) if f.code == "unread-key"]


def test_meshes_are_named_from_the_folder_of_the_file(rich, tmp_path):
    machine = load_machine(rich)
    beside = save_machine(machine, rich.parent / "copy.toml").read_text()
    away = save_machine(machine, tmp_path / "out" / "copy.toml").read_text()
    assert 'file = "meshes/yoke.stl"' in beside
    assert 'file = "../in/meshes/yoke.stl"' in away
    assert f'file = "{(rich.parent / "meshes" / "yoke.stl").as_posix()}"' in machine_text(machine)


def test_figures_of_a_machine_made_in_code_are_marked_as_assumed(tmp_path):
    plain = Machine.from_code("640123")
    axes = tuple(
        replace(a, limits=Limits(-1.0, 1.0), drive=DirectionalDrive(1.0, 2.0), max_speed=3.0)
        for a in plain.axes
    )
    body = Body("bed", Box((1.0, 2.0, 3.0)))
    machine = replace(plain, axes=axes, base_power=5.0, bodies=(body,)).with_location_errors(
        {"C": LocationError((0.01, 0.0, 0.0), (1e-5, 0.0, 0.0))}
    )
    again = round_trip(machine, tmp_path)
    assert_same(replace(again, provenance=()), replace(machine, provenance=()))
    assert len(again.provenance) == 1 + 3 * 5 + 2 + 1 + 1  # base power, axes, lines, error of C, body
    assert all(p.assumed and p.note for p in again.provenance)


def test_borrowed_powers_stay_assumed(trunnion, hayashi, tmp_path):
    borrowed = trunnion.with_drives_of(hayashi)
    again = round_trip(borrowed, tmp_path)
    entry = next(p for p in again.provenance if p.figure == "Z drive")
    assert entry.assumed
    assert "taken from Z of hayashi-640123" in entry.note
    assert again.axis("Z").drive == borrowed.axis("Z").drive


def test_a_bare_code_states_only_that_its_axes_meet_in_zero():
    text = machine_text(Machine.from_code("601235"))
    axes = tomllib.loads(text)["axes"]
    lines = [axes[letter].pop("line") for letter in "BC"]
    assert axes == {**{letter: {"carries": "tool"} for letter in "XYZB"}, "C": {"carries": "workpiece"}}
    assert all(line["point"] == [0, 0, 0] and line["assumed"] for line in lines)
    assert "source" not in text


def test_text_with_quotes_and_line_breaks_comes_back(tmp_path):
    machine = replace(Machine.from_code("640123"), name='5" mill', description="two\n[\n    1,\n]\nlines ✓")
    again = round_trip(machine, tmp_path)
    assert (again.name, again.description) == (machine.name, machine.description)


def test_a_folder_in_the_place_of_the_file_is_an_error(tmp_path):
    (tmp_path / "m.toml").mkdir()
    with pytest.raises(SettingError, match=r"m\.toml: can't be written"):
        save_machine(Machine.from_code("640123"), tmp_path / "m.toml")


def test_a_machine_is_not_written_over_something_else(tmp_path):
    with pytest.raises(SettingError, match=r"mill\.ini: is not a name for a machine file"):
        save_machine(Machine.from_code("640123"), tmp_path / "mill.ini")
    assert not list(tmp_path.iterdir())


NUMBERS = st.floats(-1e4, 1e4, allow_subnormal=False)


@given(
    st.tuples(NUMBERS, NUMBERS).filter(lambda ends: ends[1] - ends[0] > 1e-9 * abs(ends[0])),
    st.floats(1e-3, 1e4),
)
def test_any_limits_and_speeds_come_back_to_the_last_digits(tmp_path_factory, ends, speed):
    plain = Machine.from_code("640123")
    rates = dict.fromkeys(("max_speed", "max_acceleration", "max_jerk"), speed)
    axes = tuple(Axis(a.letter, Limits(*ends), **rates) for a in plain.axes)
    again = round_trip(replace(plain, axes=axes), tmp_path_factory.mktemp("any"))
    for axis in again.axes:
        assert axis.limits.low == pytest.approx(ends[0], rel=1e-14, abs=1e-300)
        assert axis.limits.high == pytest.approx(ends[1], rel=1e-14, abs=1e-300)
        assert math.isclose(axis.max_acceleration, speed, rel_tol=1e-14)
        assert math.isclose(axis.max_jerk, speed, rel_tol=1e-14)


DRIVES = {
    "directional": 'model = "directional"\nplus = 3.5\nminus = 2\nunit = "W"\n',
    "affine": 'model = "affine"\nplus = [8540, 88.82]\nminus = [6502, 75.12]\nunit = "W/(m/s)"\n',
    "weight": 'model = "weight"\na = 0.7752\nb = 0.099\n',
    "friction": 'model = "friction"\nfriction = 190\nviscous = 3900\ncounterbalance = -20\nefficiency = 0.9\n'
    "regeneration = 0.3\ncopper = 0.0001\nhold = 12\n",
    "turning": 'model = "friction"\nfriction = 4\nviscous = 0.5\ninertia = 0.08\n',
}


@pytest.mark.parametrize("name", DRIVES)
def test_every_drive_model_comes_back(tmp_path, name):
    letter = "C" if name == "turning" else "X"
    mass = f'[axes.{letter}.moved_mass]\nvalue = 300\nsource = "s"\n' + (
        "centre = [1, 2, 3]\n" if letter == "C" else ""
    )
    text = (
        'name = "m"\ncode = "640123"\nstructure = { source = "s" }\n[vertical]\ndirection = [0, 1, 0]\n'
        'source = "s"\n[load]\nmass = 60\ncentre = [0, 0, 30]\nsource = "s"\n'
        f'{mass}[axes.{letter}.drive]\n{DRIVES[name]}source = "s"\n'
    )
    path = tmp_path / "m.toml"
    path.write_text(text)
    machine = load_machine(path)
    (tmp_path / "again.toml").write_text(machine_text(machine))
    again = load_machine(tmp_path / "again.toml")
    assert_same(again, machine)
    assert (again.vertical, again.load) == (machine.vertical, machine.load)
    assert_flat(again.axis(letter).drive, machine.axis(letter).drive)


def test_the_figures_of_a_friction_drive_are_in_newton_and_metre(tmp_path):
    path = tmp_path / "m.toml"
    mass = '[axes.X.moved_mass]\nvalue = 300\nsource = "s"\n'
    path.write_text(f'name = "m"\ncode = "640123"\n{mass}[axes.X.drive]\n{DRIVES["friction"]}source = "s"\n')
    drive = load_machine(path).axis("X").drive
    assert drive.friction == pytest.approx(0.190)  # J/mm
    assert drive.viscous == pytest.approx(3900e-6)  # J s/mm²
    assert drive.copper == pytest.approx(100.0)  # W/(J/mm)²


@pytest.mark.parametrize(
    ("axis", "drive", "message"),
    [
        ("X", "weight", "the weight drive of X needs [axes.X.moved_mass]"),
        ("X", "friction", "the friction drive of X needs [axes.X.moved_mass]"),
        ("C", "weight", "the weight drive of C is for linear axes"),
        ("X", "turning", "inertia is for a rotary axis"),
    ],
)
def test_a_drive_without_the_figures_it_needs_is_refused(tmp_path, axis, drive, message):
    path = tmp_path / "m.toml"
    path.write_text(f'name = "m"\ncode = "640123"\n[axes.{axis}.drive]\n{DRIVES[drive]}source = "s"\n')
    with pytest.raises(MachineError) as caught:
        load_machine(path)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "line", "said"),
    [
        (
            "[axes.X]\n",
            '[axes.X]\nmax_speed = { value = 5e5, unit = "mm/s", source = "typed" }\n',
            4,
            "is it in mm/min",
        ),
        ("", '[spindle]\npoint = [0, 0, 60000]\nsource = "typed"\n', 6, "further than 20000 mm"),
    ],
)
def test_a_figure_that_no_machine_has_is_one_error_on_its_line(tmp_path, before, after, line, said):
    path = tmp_path / "m.toml"
    text = 'name = "m"\ncode = "1203"\n[axes.X]\nreversed = false\n'
    path.write_text(text.replace(before, after) if before else text + after)
    with pytest.raises(MachineError, match=said) as caught:
        load_machine(str(path))
    assert caught.value.line == line


def test_a_tool_length_in_metres_is_refused(hayashi):
    with pytest.raises(MachineError, match=r"tool length is 0\.13 mm; tools have 1 to 2000 mm"):
        hayashi.with_tool_length(0.13)
