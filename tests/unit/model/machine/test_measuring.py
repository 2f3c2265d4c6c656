"""What is to be measured where pivots aren't known."""

import re

import pytest

from fiveaxis.model import Machine, load_machine, machine_names
from fiveaxis.model.machine.measuring import dimensions, draw, zero_of

WITHOUT_PIVOTS = ["hayashi-640123", "micro5", "umc-750", "variaxis-730"]


def test_machines_without_pivots_say_what_to_measure_and_others_nothing():
    assert [name for name in machine_names() if dimensions(load_machine(name))] == WITHOUT_PIVOTS


@pytest.mark.parametrize(
    "code", ["640123", "650123", "540123", "620135", "021365", "012345", "012364", "40123"]
)
def test_every_dimension_is_in_the_drawing_once(code):
    machine = Machine.from_code(code)
    marks = re.findall(r"\(([a-z, ]+)\)|^\W+([a-z])$", draw(machine), re.MULTILINE)
    named = sorted(name for group in marks for part in group for name in part.split(", ") if name)
    assert named == [d.name for d in dimensions(machine)]


def test_a_trunnion_s_line_has_two_coordinates_across_its_direction():
    keys = [d.key for d in dimensions(Machine.from_code("640123"))]
    assert keys[:2] == ["axes.A.line.point[1]", "axes.A.line.point[2]"]
    assert keys[2:] == [f"spindle.point[{i}]" for i in range(3)]
    assert dimensions(Machine.from_code("650123"))[0].key == "axes.B.line.point[0]"


def test_a_head_is_measured_from_the_gauge_point():
    machine = Machine.from_code("021365")
    assert zero_of(machine) == "the spindle's gauge point"
    assert "pivot length" in str(dimensions(machine)[1])
    # Where a table's zero is elsewhere, the gauge point is added.
    assert "plus spindle.point[2]" in dimensions(Machine.from_code("620135"))[1].key


@pytest.mark.parametrize("name", WITHOUT_PIVOTS)
def test_only_the_dimensions_named_place_the_axes(name):
    """A rotary line's point may slide along it: the coordinate that isn't asked for has no effect."""
    machine = load_machine(name)
    for joint in machine.chain.joints:
        if joint.is_rotary:
            asked = {d.key for d in dimensions(machine) if d.key.startswith(f"axes.{joint.letter}.")}
            along = [i for i, v in enumerate(joint.line.direction) if v]
            assert not asked & {f"axes.{joint.letter}.line.point[{i}]" for i in along}
