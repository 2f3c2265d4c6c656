"""Laws that hold for every machine structure.

The codes stand in groups, by the order of their rotary axes and the side of the bed they are on; a failure
names the first code that breaks the law.
"""

import itertools
from collections import Counter

import casadi as ca
import numpy as np
import pytest

from fiveaxis.base import rotation_matrix
from fiveaxis.base.errors import DegenerateChain
from fiveaxis.check.verification.model import tool_poses as pinocchio_poses
from fiveaxis.model import (
    FormShapingCode,
    Machine,
    Tool,
    axis_positions,
    rotary_angles,
    tool_axes,
    tool_poses,
)
from fiveaxis.model.kinematics.inverse import redundant_axis
from fiveaxis.model.kinematics.poses import tip_slopes
from fiveaxis.model.kinematics.symbolic import linear_axes_of_posture, tool_axis_of_posture
from fiveaxis.model.machine.axes import LocationError
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import commutation_class, parse_code

BALL = Tool.ball(10).zone

TOLERANCE = 1e-9  # mm, rad and 1
POSES = 8


def codes_with(rotaries: int) -> list[FormShapingCode]:
    """Every order of X, Y, Z and some different rotary axes, the bed anywhere."""
    found = []
    for chosen in itertools.combinations("456", rotaries):
        for digits in itertools.permutations("123" + "".join(chosen)):
            text = "".join(digits)
            found += [parse_code(text[:bed] + "0" + text[bed:]) for bed in range(len(text) + 1)]
    return found


def rotaries_of(code: FormShapingCode) -> str:
    return "".join(c for c in code.letters if c in "ABC")


FIVE_AXIS = codes_with(2)
# With the tool along Z at home a C next to the tool only spins it.
ORIENTABLE = [c for c in FIVE_AXIS if rotaries_of(c)[-1] != "C"]
SPINNING = [c for c in FIVE_AXIS if rotaries_of(c)[-1] == "C"]


def random_positions(machine: Machine, rng: np.random.Generator, n: int) -> np.ndarray:
    """Axis values of ±100 mm and ±170°, but where linear axes come near to lying in one plane."""
    scale = [np.radians(170.0) if a.is_rotary else 100.0 for a in machine.axes]
    positions = rng.uniform(-1.0, 1.0, (8 * n, len(machine.axes))) * scale
    columns = tip_slopes(machine, positions)[:, :, machine.linear_columns]
    return positions[np.linalg.cond(columns) < 30.0][:n]


def group_of(code: FormShapingCode) -> str:
    return f"{rotaries_of(code)} {code.kind}"


def by_group(codes: list[FormShapingCode]) -> list:
    groups = itertools.groupby(sorted(codes, key=group_of), key=group_of)
    return [pytest.param(list(members), id=name) for name, members in groups]


def assert_closes(machine: Machine, positions: np.ndarray, held: dict[str, float] | None = None) -> None:
    """The inverse gives back the axis values, and every branch that it offers is one."""
    tip, axis = tool_poses(machine, positions)
    branches = axis_positions(machine, tip, axis, held=held)
    apart = branches - positions
    turning = machine.rotary_columns
    apart[..., turning] = np.mod(apart[..., turning] + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(apart).max(axis=2).min(axis=0).max() < TOLERANCE, machine.code
    for branch in branches:
        exists = np.isfinite(branch).all(axis=1)
        assert (exists | np.isnan(branch).all(axis=1)).all(), machine.code
        reached_tip, reached_axis = tool_poses(machine, branch[exists])
        np.testing.assert_allclose(reached_tip, tip[exists], atol=TOLERANCE, err_msg=str(machine.code))
        np.testing.assert_allclose(reached_axis, axis[exists], atol=TOLERANCE, err_msg=str(machine.code))


def test_there_are_as_many_codes_as_counted_by_hand():
    assert len({c.text for c in FIVE_AXIS}) == 3 * 120 * 6
    assert len(ORIENTABLE) == 1440
    assert Counter(c.kind for c in ORIENTABLE) == dict.fromkeys(
        ("table-table", "table-head", "head-head"), 480
    )
    assert Counter(map(rotaries_of, ORIENTABLE)) == dict.fromkeys(("AB", "BA", "CA", "CB"), 360)


def test_codes_fall_into_48_classes_and_into_432_with_the_bed():
    assert len({c.kinematic_class for c in ORIENTABLE}) == 48
    kept = {(commutation_class(c.table), commutation_class(c.head)) for c in ORIENTABLE}
    assert len(kept) == 432


@pytest.mark.parametrize("codes", by_group(ORIENTABLE))
def test_forward_after_inverse_is_the_identity(codes):
    rng = np.random.default_rng(3)
    for code in codes:
        machine = Machine.from_code(code.text)
        assert_closes(machine, random_positions(machine, rng, POSES))


@pytest.mark.parametrize("codes", by_group(SPINNING))
def test_a_c_next_to_the_tool_is_refused_with_the_reason(codes):
    for code in codes:
        machine = Machine.from_code(code.text)
        with pytest.raises(
            DegenerateChain, match=r"C, the rotary axis next to the tool.*no second orientation"
        ):
            axis_positions(machine, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def test_codes_of_one_class_move_the_tool_alike():
    rng = np.random.default_rng(4)
    linear, turns = rng.uniform(-100.0, 100.0, (POSES, 3)), rng.uniform(-3.0, 3.0, (POSES, 2))
    positions = np.hstack([linear, turns])
    classes: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for code in ORIENTABLE:
        poses = tool_poses(Machine.from_code(code.text), positions)
        first = classes.setdefault(code.kinematic_class, poses)
        for found, expected in zip(poses, first, strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12, err_msg=str(code))
    # And the classes differ: nothing is lumped together that isn't alike.
    everything = np.array([np.hstack(poses) for poses in classes.values()])
    letters = ["".join(sorted(name)) for name in classes]
    for (i, a), (j, b) in itertools.combinations(enumerate(everything), 2):
        assert letters[i] != letters[j] or np.abs(a - b).max() > 1.0


@pytest.mark.parametrize("codes", by_group(FIVE_AXIS))
def test_pinocchio_finds_the_tool_where_our_equations_do(codes):
    rng = np.random.default_rng(5)
    for code in codes:
        machine = Machine.from_code(code.text)
        positions = rng.uniform(-1.0, 1.0, (3, 5)) * [100.0, 100.0, 100.0, 7.0, 7.0]
        for found, expected in zip(
            pinocchio_poses(machine, positions), tool_poses(machine, positions), strict=True
        ):
            np.testing.assert_allclose(found, expected, atol=TOLERANCE, err_msg=str(code))


@pytest.mark.parametrize("codes", by_group(ORIENTABLE))
def test_casadis_equations_are_numpys(codes):
    rng = np.random.default_rng(6)
    pivot, rotary = ca.SX.sym("pivot", 3), ca.SX.sym("rotary", 2)
    for code in codes:
        machine = Machine.from_code(code.text)
        symbolic = ca.Function(
            "posture",
            [pivot, rotary],
            [linear_axes_of_posture(machine, pivot, rotary, BALL), tool_axis_of_posture(machine, rotary)],
        )
        position = random_positions(machine, rng, 1)
        tip, axis = tool_poses(machine, position)
        linear, direction = symbolic(tip[0] + 5.0 * axis[0], position[0, machine.rotary_columns])
        np.testing.assert_allclose(
            np.array(linear).ravel(), position[0, machine.linear_columns], atol=TOLERANCE, err_msg=str(code)
        )
        np.testing.assert_allclose(np.array(direction).ravel(), axis[0], atol=1e-12, err_msg=str(code))


@pytest.mark.parametrize("rotaries", [0, 1])
def test_machines_of_three_and_four_axes_close_too(rotaries):
    rng = np.random.default_rng(7)
    for code in codes_with(rotaries):
        machine = Machine.from_code(code.text)
        positions = random_positions(machine, rng, POSES)
        spins = rotaries_of(code) == "C"
        if spins:  # turns the part under the tool: its angle doesn't matter and is held
            positions[:, 3] = 0.7
        assert_closes(machine, positions, held={"C": 0.7} if spins else None)


@pytest.mark.parametrize("rotaries", [0, 1])
def test_a_tool_axis_that_few_axes_cannot_reach_has_no_branch(rotaries):
    away = np.array([[0.48, 0.6, 0.64]])
    for code in codes_with(rotaries):
        found = axis_positions(Machine.from_code(code.text), np.ones((1, 3)), away)
        assert np.isnan(found).all(), code


@pytest.mark.slow
def test_machines_of_six_axes_close_around_the_one_that_is_held():
    rng = np.random.default_rng(8)
    codes = codes_with(3)
    assert len(codes) == 720 * 7
    # The five-axis laws hold all codes; of these a third, each time the same.
    for code in codes[::3]:
        machine = Machine.from_code(code.text)
        spare = redundant_axis(machine)
        assert machine.code.kind.count("-") == 2
        value = 0.3
        positions = rng.uniform(-1.0, 1.0, (40, 6)) * [50.0, 50.0, 50.0, 1.0, 1.0, 1.0]
        positions[:, machine.column(spare)] = value
        assert_closes(machine, positions, held={spare: value})


STRUCTURES = {"CA": "640123", "CB": "650123", "AB": "450123", "BA": "540123"}


def nutating(code: str, letter: str, direction: tuple[float, float, float]) -> Machine:
    machine = Machine.from_code(code)
    lines = {letter: Line(direction, (3.0, -20.0, 45.0))}
    return Machine(code, machine.code, Chain.from_code(machine.code, lines), machine.axes)


MACHINES = {name: Machine.from_code(code) for name, code in STRUCTURES.items()} | {
    "nutating 45": nutating("650123", "B", (0.0, 1.0, 1.0)),
    "nutating 30": nutating("601235", "B", (0.0, 2.0, 1.0)),
    "errors": Machine.from_code("640123").with_location_errors(
        {
            "A": LocationError((0.0, 0.02, -0.01), (0.0, 4e-4, -3e-4)),
            "C": LocationError(tilt=(2e-4, 5e-4, 0.0)),
        }
    ),
}


@pytest.mark.parametrize("name", MACHINES)
def test_no_branch_is_missed_and_none_invented(name):
    """Newton from a grid of starts finds the same postures, whatever the closed form says."""
    machine = MACHINES[name]
    rng = np.random.default_rng(9)
    for _ in range(4):
        wanted = tool_axes(machine, rng.uniform(-3.0, 3.0, 2))
        closed = rotary_angles(machine, wanted[None])[:, 0]
        found = newton_solutions(machine, wanted)
        assert len(found) == 2
        for angles in found:
            apart = np.mod(closed - angles + np.pi, 2.0 * np.pi) - np.pi
            assert np.abs(apart).max(axis=1).min() < 1e-7


def newton_solutions(machine: Machine, wanted: np.ndarray) -> list[np.ndarray]:
    """Solve for the tool axis from a grid of starts, with finite differences; different solutions only."""
    grid = np.linspace(-np.pi, np.pi, 12, endpoint=False)
    angles = np.array(list(itertools.product(grid, grid)))
    step = 1e-7
    for _ in range(40):
        miss = tool_axes(machine, angles) - wanted
        slopes = [
            (tool_axes(machine, angles + step * e) - tool_axes(machine, angles - step * e)) for e in np.eye(2)
        ]
        matrix = np.stack(slopes, axis=-1) / (2.0 * step)
        move = np.linalg.pinv(matrix, rcond=1e-9) @ miss[..., None]
        angles = angles - np.clip(move[..., 0], -0.5, 0.5)
    solved = angles[np.linalg.norm(tool_axes(machine, angles) - wanted, axis=1) < 1e-9]
    found: list[np.ndarray] = []
    for row in np.mod(solved, 2.0 * np.pi):
        apart = [np.abs(np.mod(row - other + np.pi, 2.0 * np.pi) - np.pi).max() for other in found]
        if not apart or min(apart) > 1e-5:
            found.append(row)
    return found


@pytest.mark.parametrize("name", MACHINES)
def test_machines_with_offsets_tool_setup_and_errors_close(name):
    rng = np.random.default_rng(10)
    machine = MACHINES[name].with_tool_length(85.0).with_setup((12.0, -30.0, 7.5), (10.0, -20.0, 65.0))
    assert_closes(machine, random_positions(machine, rng, 200))


@pytest.mark.parametrize(
    "code", [c for c in ORIENTABLE if c.text in ("640123", "601234", "012364", "214035")]
)
def test_a_setup_moves_what_the_workpiece_sees_and_nothing_else(code):
    """T_work_tool = W⁻¹ T_table_tool, with W written out here."""
    rng = np.random.default_rng(11)
    machine = Machine.from_code(code.text)
    positions = random_positions(machine, rng, 50)
    offset, angles = np.array([5.0, -3.0, 11.0]), np.radians([20.0, -35.0, 50.0])
    rotations = [rotation_matrix(e, a) for e, a in zip(np.eye(3), angles, strict=True)]
    turn = rotations[2] @ rotations[1] @ rotations[0]
    tip, axis = tool_poses(machine, positions)
    for found in (
        machine.with_setup(tuple(offset), (20.0, -35.0, 50.0)),
        machine.with_setup((1.0, 2.0, 3.0), (40.0, 0.0, 9.0)).with_setup(tuple(offset), (20.0, -35.0, 50.0)),
    ):
        seen_tip, seen_axis = tool_poses(found, positions)
        np.testing.assert_allclose(seen_tip, (tip - offset) @ turn, atol=1e-10)
        np.testing.assert_allclose(seen_axis, axis @ turn, atol=1e-12)
