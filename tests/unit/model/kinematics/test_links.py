"""Link poses against pinocchio on the machine's URDF, Jacobians against finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import Machine, link_poses, load_machine, tool_poses
from fiveaxis.model.kinematics.poses import tip_slopes
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code

RNG = np.random.default_rng(1)
NAMES = ["linuxcnc-xyzac-trt", "dmu50ev", "linuxcnc-bridgemill", "linuxcnc-max5"]
CODES = ["640123", "601234", "012364", "641230", "0123", "1230", "6412305"]
LINES = {
    "A": Line((1, 0, 0), (0, 20, 10)),
    "B": Line((0, 1, 1), (3, 40, -25)),
    "C": Line((0, 0, 1), (12, -7, 0)),
}


def machine_of(code: str) -> Machine:
    machine = replace(Machine.from_code(code), chain=Chain.from_code(parse_code(code), LINES))
    return machine.with_setup((30.0, -20.0, 50.0), (10.0, 20.0, 70.0)).with_tool_length(60.0)


def random_positions(machine: Machine) -> np.ndarray:
    scale = [3.0 if a.is_rotary else 300.0 for a in machine.axes]
    return np.random.default_rng(7).uniform(-1.0, 1.0, (15, len(scale))) * scale


@pytest.mark.parametrize("code", CODES)
def test_links_move_as_pinocchios_frames_do(code):
    pin = pytest.importorskip("pinocchio")
    machine = machine_of(code)
    positions = random_positions(machine)
    model = pin.buildModelFromXML(machine.to_urdf())
    found = link_poses(machine, positions)
    for i, row in enumerate(positions):
        now, home = (frames(pin, model, machine, values) for values in (row, np.zeros_like(row)))
        for link, poses in found.items():
            name = link if link == "bed" else f"link_{link}"
            np.testing.assert_allclose(poses[i], now[name] @ np.linalg.inv(home[name]), atol=1e-9, rtol=0.0)


def frames(pin, model, machine: Machine, row: np.ndarray) -> dict[str, np.ndarray]:
    """Every frame of the model, (4, 4) mm, workpiece frame."""
    data, q = model.createData(), pin.neutral(model)
    for axis, value in zip(machine.axes, row, strict=True):
        at = model.joints[model.getJointId(axis.letter)].idx_q
        q[at] = value if axis.is_rotary else value / 1000.0
    pin.framesForwardKinematics(model, data, q)
    poses = {f.name: data.oMf[i].homogeneous.copy() for i, f in enumerate(model.frames)}
    for pose in poses.values():
        pose[:3, 3] *= 1000.0
    return poses


@pytest.mark.parametrize("code", CODES)
def test_the_last_link_carries_the_tool(code):
    machine = machine_of(code)
    positions = random_positions(machine)
    *_, last = link_poses(machine, positions).values()
    tool = last @ machine.chain.tool_home
    tip, axis = tool_poses(machine, positions)
    np.testing.assert_allclose(tool[:, :3, 3], tip, atol=1e-10)
    np.testing.assert_allclose(tool[:, :3, 2], axis, atol=1e-13)


def test_links_are_named_after_the_next_axis_towards_the_bed():
    machine = Machine.from_code("640123")
    found = link_poses(machine, np.array([[1.0, 2.0, 3.0, 0.0, 0.5]]))
    assert list(found) == ["C", "A", "bed", "X", "Y", "Z"]
    # The first carries the workpiece and stands still for it; A is what C turns on, X what X moves.
    np.testing.assert_array_equal(found["C"][0], np.eye(4))
    np.testing.assert_allclose(found["A"][0][:2, 0], [np.cos(0.5), np.sin(0.5)])
    np.testing.assert_array_equal(found["A"], found["bed"])
    back = np.linalg.inv(found["bed"][0])
    np.testing.assert_allclose((back @ found["X"][0])[:3, 3], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose((back @ found["Z"][0])[:3, 3], [1.0, 2.0, 3.0], atol=1e-12)


def test_no_rows_give_no_poses():
    assert {p.shape for p in link_poses(machine_of("640123"), np.empty((0, 5))).values()} == {(0, 4, 4)}


def library_machine(name: str) -> Machine:
    return load_machine(name).with_setup((10.0, -4.0, 30.0), (5.0, 10.0, -40.0)).with_tool_length(60.0)


def five_axis_positions(n: int) -> np.ndarray:
    return RNG.uniform(-1.0, 1.0, (n, 5)) * [100.0, 100.0, 100.0, 1.3, 1.3]


@pytest.mark.parametrize("name", NAMES)
def test_the_slopes_of_the_tip_are_those_of_finite_differences(name):
    machine, positions, h = library_machine(name), five_axis_positions(10), 1e-6
    found = tip_slopes(machine, positions)
    for column, step in enumerate(h * np.eye(5)):
        plus, minus = (tool_poses(machine, positions + sign * step)[0] for sign in (1.0, -1.0))
        np.testing.assert_allclose(found[:, :, column], (plus - minus) / (2.0 * h), rtol=1e-6, atol=1e-6)
