"""The kinematics of verification, pinocchio's and our own, against the optimiser's and each other."""

import sys

import numpy as np
import pytest

from fiveaxis.base import rotation_matrix
from fiveaxis.check.verification.model import build_model, kinematics_name, link_poses, tool_poses
from fiveaxis.model import Machine, load_machine, machine_names
from fiveaxis.model import tool_poses as own_poses
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code
from fiveaxis.model.machine.model import Axis

TOLERANCE = 1e-9  # mm and 1
SPREAD = 20  # turns of a rotary axis reach further than one revolution


def random_positions(machine: Machine, n: int = 200) -> np.ndarray:
    rng = np.random.default_rng(20261121)
    scale = [SPREAD if a.is_rotary else 300.0 for a in machine.axes]
    return rng.uniform(-1.0, 1.0, (n, len(machine.axes))) * scale


def from_code(code: str, lines: dict[str, Line] | None = None, home: np.ndarray | None = None) -> Machine:
    parsed = parse_code(code)
    chain = Chain.from_code(parsed, lines)
    if home is not None:
        chain = Chain(chain.joints, home)
    return Machine(code, parsed, chain, tuple(Axis(c) for c in sorted(parsed.letters, key="XYZABC".index)))


def tilted_home() -> np.ndarray:
    home = np.eye(4)
    home[:3, :3] = rotation_matrix(np.array([0.6, 0.0, 0.8]), 0.4)
    home[:3, 3] = [3.0, -7.0, -120.0]
    return home


NUTATING = {"B": Line((0.0, 1.0, 1.0), (0.0, 30.0, -50.0)), "C": Line((0.0, 0.0, 1.0), (5.0, 6.0, 7.0))}
CASES = {
    "table-table": from_code("640123"),
    "table-table-b": from_code("650213"),
    "head-head": from_code("012364"),
    "head-head-offsets": from_code("012364", {"A": Line((1.0, 0.0, 0.0), (0.0, 2.0, 80.0))}),
    "table-head": from_code("610235"),
    "linear-axes-on-the-table": from_code("361025"),
    "nutating": from_code("650123", NUTATING),
    "skewed-linear": from_code("640123", {"Y": Line((0.0, 1.0, 0.5))}),
    "tool-home": from_code("640123", {"A": Line((1.0, 0.0, 0.0), (0.0, 20.0, 10.0))}, tilted_home()),
    "three-axis": from_code("0123"),
}


@pytest.fixture(params=["pinocchio", "own"])
def kinematics(request, monkeypatch):
    """The kinematics that verify: where they are pinocchio's, and where it can't be imported."""
    if request.param == "own":
        monkeypatch.setitem(sys.modules, "pinocchio", None)
    else:
        pytest.importorskip("pinocchio")
    return request.param


@pytest.mark.parametrize("name", CASES)
def test_verification_finds_the_tool_where_our_equations_do(name, kinematics):
    machine = CASES[name]
    positions = random_positions(machine)
    for found, expected in zip(tool_poses(machine, positions), own_poses(machine, positions), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=TOLERANCE)


@pytest.mark.parametrize("name", machine_names())
def test_both_kinematics_place_tool_and_links_of_every_machine_alike(name, monkeypatch):
    pytest.importorskip("pinocchio")
    machine = load_machine(name)
    positions = random_positions(machine)
    expected = tool_poses(machine, positions), link_poses(machine)(positions)
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    found = tool_poses(machine, positions), link_poses(machine)(positions)
    np.testing.assert_allclose(found[0], expected[0], rtol=0.0, atol=TOLERANCE)
    assert list(found[1]) == list(expected[1])
    for link, poses in expected[1].items():
        np.testing.assert_allclose(found[1][link], poses, rtol=0.0, atol=TOLERANCE)


def test_the_kinematics_that_verify_are_named(kinematics):
    told = {"pinocchio": "pinocchio ", "own": "own URDF forward kinematics"}[kinematics]
    assert kinematics_name().startswith(told)


def test_the_trunnions_offsets_move_the_tool_as_written_by_hand(trunnion, kinematics):
    """A alone, at 90 deg about the line y = 20, z = 10: (y, z) → (20 − (z − 10), 10 + (y − 20))."""
    tip, axis = tool_poses(trunnion, np.array([[1.0, 2.0, 3.0, np.pi / 2.0, 0.0]]))
    np.testing.assert_allclose(tip, [[1.0, 27.0, -8.0]], atol=TOLERANCE)
    np.testing.assert_allclose(axis, [[0.0, -1.0, 0.0]], atol=TOLERANCE)


def test_columns_follow_the_letters_and_not_the_chain():
    pytest.importorskip("pinocchio")
    built = build_model(CASES["table-table"])
    assert built.columns.tolist() == [4, 3, 0, 1, 2]


def test_a_row_with_nan_gives_nan_and_affects_no_other(hayashi, kinematics):
    positions = random_positions(hayashi, 3)
    expected, _ = tool_poses(hayashi, positions)
    positions[1] = np.nan
    tip, axis = tool_poses(hayashi, positions)
    assert np.isnan(tip[1]).all()
    assert np.isnan(axis[1]).any()
    np.testing.assert_array_equal(tip[[0, 2]], expected[[0, 2]])
