"""A machine that no file draws: every link is there, and stands where the chain has it."""

import numpy as np
import pytest

from fiveaxis.model import Box, Cylinder, Machine, link_poses, load_machine, machine_names
from fiveaxis.show.viewer.schematic import schematic_bodies

CODES = ("640123", "460123", "650123", "012364", "012365", "603124", "601235", "123064", "364012")


def drawn(machine):
    bodies = schematic_bodies(machine, radius=100.0, nose_height=80.0)
    links = {"bed", *machine.code.table, *machine.code.head}
    assert {body.link for body in bodies} == links
    for body in bodies:
        sizes = body.shape.size if isinstance(body.shape, Box) else (body.shape.radius, body.shape.height)
        assert np.isfinite([*sizes, *body.shape.center]).all()
        assert min(sizes) > 0.0
    return bodies


@pytest.mark.parametrize("code", CODES)
def test_every_link_of_every_code_is_drawn(code):
    drawn(Machine.from_code(code))


@pytest.mark.parametrize("name", machine_names())
def test_every_link_of_a_library_machine_is_drawn_and_the_spindle_above_the_gauge_point(name):
    machine = load_machine(name).with_tool_length(120.0)
    home = machine.setup.frame @ machine.chain.tool_home
    holds = machine.code.head[-1] if machine.code.head else "bed"
    spindle = next(b.shape for b in drawn(machine) if b.link == holds and isinstance(b.shape, Cylinder))
    above = np.array(spindle.center) - home[:3, 3]
    np.testing.assert_allclose(np.cross(above, home[:3, 2]), 0.0, atol=1e-9)
    assert above @ home[:3, 2] - spindle.height / 2.0 >= 120.0 - 1e-9


def test_a_table_turns_about_its_own_axis():
    machine = load_machine("hayashi-640123")
    disc = next(b.shape for b in drawn(machine) if b.link == "C" and isinstance(b.shape, Cylinder))
    positions = np.zeros((2, len(machine.letters)))
    positions[1, machine.column("C")] = 1.0
    moved = link_poses(machine, positions)["A"]
    centre = np.append(disc.center, 1.0)
    np.testing.assert_allclose(np.linalg.inv(moved[1]) @ centre, centre, atol=1e-9)
