from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError, UnknownMachine
from fiveaxis.model import load_machine, machine_names
from fiveaxis.model.machine.files import library_files

GOOD = """name = "m"
code = "640123"

[axes.A]
limits = { min = -120, max = 30, unit = "deg", source = "a data sheet" }

[axes.X.drive]
model = "directional"
plus = 1.0
minus = 2.0
unit = "W"
source = "measured"
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "m.toml"
    path.write_text(text, encoding="utf-8")
    return path


SLOW = "model = 'directional', plus = 5, minus = 6, unit = 'W', measured_from = 100"
FROM = "measured_from of C is 100 deg/min, above"


@pytest.mark.parametrize(
    ("drive", "rpm", "message"),
    [
        (f"{SLOW}, measured_to = 40", 30, f"{FROM} measured_to, 40 deg/min; exchange them"),
        (SLOW, 0.1, f"{FROM} max_speed, 36 deg/min; correct the unit of one of them"),
        (
            "model = 'directional', unit = 'W'",
            30,
            "axes.C.drive.plus is missing; axes.C.drive.minus is missing",
        ),
        ("fitted = false", 30, "axes.C.drive: Unable to extract tag using discriminator 'model'"),
    ],
)
def test_a_drive_that_no_axis_has_is_one_error_with_file_and_line(tmp_path, drive, rpm, message):
    axis = f"drive = {{ {drive}, source = 'log' }}\n"
    axis += f"max_speed = {{ value = {rpm}, unit = 'rpm', source = 'log' }}"
    path = write(tmp_path, f'name = "m"\ncode = "640123"\n[axes.C]\n{axis}\n')
    with pytest.raises(MachineError) as caught:
        load_machine(path)
    assert str(caught.value) == f"{path}:4: {message}"


@pytest.mark.parametrize("speed", ["100", "250.3", "0.7"])
def test_an_axis_may_be_as_slow_as_its_drive_was_measured(tmp_path, speed):
    axis = f"drive = {{ {SLOW}, measured_to = {speed}, source = 'log' }}\n".replace("100", speed)
    axis += f"max_speed = {{ value = {speed}, unit = 'deg/min', source = 'log' }}\n"
    machine = load_machine(write(tmp_path, f'name = "m"\ncode = "640123"\n[axes.C]\n{axis}'))
    assert machine.axis("C").drive.measured_from == pytest.approx(machine.axis("C").max_speed)


def test_the_powers_of_hayashi_are_the_printed_ones(hayashi):
    z, a = hayashi.axis("Z").drive, hayashi.axis("A").drive
    assert (z.plus, z.minus, z.proportional) == (612.1, 427.8, False)
    # 8.483e-2 W per deg/min, inside W per rad/s
    assert a.plus == pytest.approx(8.483e-2 * 60.0 * 180.0 / np.pi)
    assert hayashi.base_power is None
    assert hayashi.axis("C").limits.unlimited
    assumed = {p.figure for p in hayashi.provenance if p.assumed}
    assert assumed == {"A limits", "C limits", "A line", "C line"}


def test_the_library_is_found_beside_the_package_in_a_checkout():
    assert [p.stem for p in library_files()] == machine_names()


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("limits =", "limit =", 5, "unknown key 'axes.A.limit'; the nearest known one is 'limits'"),
        ("plus = 1.0", "pluss = 1.0", 9, "nearest known one is 'plus'"),
        ('name = "m"', 'nam = "m"', 1, "unknown key 'nam'; the nearest known one is 'name'"),
        ("min = -120", "min = 40", 5, "min 40 deg is not below max 30 deg"),
        ('source = "a data sheet"', "assumed = true", 5, "needs a note"),
        (', source = "a data sheet"', "", 5, "needs a source, or assumed = true with a note"),
        ('unit = "deg"', 'unit = "mm"', None, "axis A is rotary; its unit can't be mm"),
        ("plus = 1.0", "plus = nan", 9, "finite number"),
        ("[axes.A]", "[axes.B]", None, "[axes.B] is not an axis of code 640123"),
        ("[axes.A]", "[axes.A", 4, "is not valid TOML"),
        ('"640123"', '"64012"', None, None),
        ('"640123"', '"6401231"', None, "names axis 1 (X) 2 times"),
    ],
)
def test_a_fault_is_named_with_file_and_line(tmp_path, old, new, line, message):
    assert old in GOOD
    path = write(tmp_path, GOOD.replace(old, new, 1))
    if message is None:
        assert load_machine(path).letters == "XYAC"
        return
    with pytest.raises(MachineError) as caught:
        load_machine(path)
    assert message in str(caught.value)
    if line is not None:
        assert str(caught.value).startswith(f"{path}:{line}: ")


def test_an_unknown_machine_lists_the_nearest_names():
    with pytest.raises(UnknownMachine, match="did you mean hayashi-640123"):
        load_machine("hayashi-640132")
    with pytest.raises(UnknownMachine, match=r"known: .*linuxcnc-xyzac-trt"):
        load_machine("qqqq")


def test_borrowed_powers_are_marked_as_assumed(trunnion, hayashi):
    assert not trunnion.has_powers
    borrowed = trunnion.with_drives_of(hayashi)
    assert borrowed.axis("Z").drive == hayashi.axis("Z").drive
    entry = next(p for p in borrowed.provenance if p.figure == "Z drive")
    assert entry.assumed
    assert "hayashi-640123" in entry.origin


def test_a_machine_whose_arrays_are_changed_is_loaded_as_its_file_has_it():
    changed = load_machine("hayashi-640123")
    low = changed.low.copy()
    changed.low[:] = 0.0
    np.testing.assert_array_equal(load_machine("hayashi-640123").low, low)
