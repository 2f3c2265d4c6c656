"""Machines read from URDF: what `fiveaxis urdf` writes comes back, and other programs' files are read."""

from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError
from fiveaxis.model import Machine, load_machine, machine_names, tool_poses

# As a robot program has it: joints with names of their own, tables that turn by their value.
FOREIGN = """\
<?xml version="1.0"?>
<robot name="trunnion">
  <link name="base_link"/><link name="cradle"/><link name="workpiece"/>
  <link name="ram"/><link name="saddle"/><link name="head"/><link name="tool"/>
  <joint name="tilt" type="revolute">
    <parent link="base_link"/><child link="cradle"/>
    <origin xyz="0 0.01 0.05"/><axis xyz="1 0 0"/>
    <limit lower="-0.5" upper="2" effort="0" velocity="1"/>
  </joint>
  <joint name="table" type="continuous">
    <parent link="cradle"/><child link="workpiece"/><origin xyz="0 -0.01 -0.05"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="y" type="prismatic">
    <parent link="base_link"/><child link="saddle"/><axis xyz="0 1 0"/>
    <limit lower="-0.3" upper="0.3" effort="0" velocity="0.5"/>
  </joint>
  <joint name="x" type="prismatic">
    <parent link="saddle"/><child link="head"/><axis xyz="1 0 0"/>
    <limit lower="-0.4" upper="0.4" effort="0" velocity="0.5"/>
  </joint>
  <joint name="z" type="prismatic">
    <parent link="head"/><child link="ram"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.5" effort="0" velocity="0.5"/>
  </joint>
  <joint name="gauge" type="fixed">
    <parent link="ram"/><child link="tool"/><origin xyz="0 0 0.4"/>
  </joint>
</robot>
"""


def read(folder: Path, text: str) -> Machine:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def values_of(machine: Machine) -> np.ndarray:
    return np.random.default_rng(3).uniform(-3.0, 3.0, (100, len(machine.axes)))


@pytest.mark.parametrize("root", ["bed", "workpiece"])
@pytest.mark.parametrize("name", machine_names())
def test_a_written_machine_comes_back_with_the_same_kinematics(name, root, tmp_path):
    machine = load_machine(name)
    again = read(tmp_path, machine.to_urdf(root))
    assert again.code == machine.code
    values = values_of(machine)
    for one, other in zip(tool_poses(machine, values), tool_poses(again, values), strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)
    for axis, found in zip(machine.axes, again.axes, strict=True):
        assert found.limits.unlimited == axis.limits.unlimited
        np.testing.assert_allclose([found.limits.low, found.limits.high], [axis.limits.low, axis.limits.high])
        assert (found.max_speed is None) == (axis.max_speed is None)
        assert found.max_speed == pytest.approx(axis.max_speed)


def test_a_setup_is_part_of_the_frame_that_is_read(tmp_path):
    machine = (
        load_machine("variaxis-630").with_setup((10.0, -20.0, 30.0), (0.0, 0.0, 30.0)).with_tool_length(80.0)
    )
    again = read(tmp_path, machine.to_urdf("bed"))
    values = values_of(machine)
    for one, other in zip(tool_poses(machine, values), tool_poses(again, values), strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)


def test_joints_of_other_names_are_the_axes_that_lie_nearest(tmp_path):
    machine = read(tmp_path, FOREIGN)
    assert machine.code.text == "640213"
    # The joints turn the table, so the tool turns against them relative to the workpiece.
    assert [a.letter for a in machine.axes if a.reversed] == ["A", "C"]
    assert machine.axis("A").limits.ends == pytest.approx((-2.0, 0.5))
    assert machine.axis("C").limits.unlimited
    assert machine.axis("X").max_speed == pytest.approx(500.0)


def test_the_table_turns_by_the_joint_s_value(tmp_path):
    machine = read(tmp_path, FOREIGN)
    angle = 0.3
    controls = np.array([[0.0, 0.0, 0.0, angle, 0.0]])
    signs = np.array([-1.0 if a.reversed else 1.0 for a in machine.axes])
    tip, axis = tool_poses(machine, controls * signs)
    # The cradle turns by +angle about x, so the upright spindle leans by -angle in the workpiece.
    np.testing.assert_allclose(axis[0], [0.0, np.sin(angle), np.cos(angle)], atol=1e-12)
    # The gauge point seen from the cradle's line, 10 mm beside and 50 mm above zero.
    y, z = -10.0, 350.0
    turned = [0.0, 10.0 + np.cos(angle) * y + np.sin(angle) * z, 50.0 + np.cos(angle) * z - np.sin(angle) * y]
    np.testing.assert_allclose(tip[0], turned, atol=1e-9)


def test_a_bed_that_is_not_named_is_said(tmp_path):
    machine = read(tmp_path, FOREIGN.replace("base_link", "column"))
    structure = next(p for p in machine.provenance if p.figure == "structure")
    assert structure.assumed
    assert "'column'" in structure.note


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("</robot>", "", "isn't XML"),
        ("<robot", "<!DOCTYPE robot><robot", "document type"),
        ('<robot name="trunnion">', "<scene>", "isn't XML"),
        ('<link name="tool"/>', "", "between links that aren't all there"),
        ('name="workpiece"', 'name="part"', "aren't all there"),
        ('type="continuous"', 'type="floating"', "type 'floating'"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "length 0"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1"/>', "isn't three numbers"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>', "second axis X"),
        ('lower="-0.3"', 'lower="inf"', "isn't a number"),
        ('lower="-0.3"', 'lower="3"', "exchange them"),
        ('<parent link="base_link"/><child link="saddle"/>', '<child link="saddle"/>', "no parent"),
        ('<child link="saddle"/>', '<child link="cradle"/>', "child of two joints"),
    ],
)
def test_a_damaged_urdf_is_one_message_with_its_file(tmp_path, old, new, fault):
    assert old in FOREIGN
    with pytest.raises(MachineError, match=rf"robot\.urdf.*{fault}"):
        read(tmp_path, FOREIGN.replace(old, new, 1))


def test_a_urdf_without_a_workpiece_says_how_to_name_it(tmp_path):
    with pytest.raises(MachineError, match=r"no link 'workpiece'; name the link"):
        read(tmp_path, FOREIGN.replace('"workpiece"', '"part"'))
