"""Kinematics against LinuxCNC's closed form, and one NX operation posted for two machines."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base import Array, angle_between
from fiveaxis.model import Axis, Machine, axis_positions, linear_positions, load_machine, tool_poses
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code
from fiveaxis.model.machine.linuxcnc import read_linuxcnc

RNG = np.random.default_rng(20261122)
TOOL = 30.0  # mm, tool length
OFFSET = {"xyzac": np.array([0.0, 20.0, 10.0]), "xyzbc": np.array([-20.0, 0.0, -15.0])}
ROTATION_POINT = np.array([3.5, -7.25, 11.0])


def about(letter: str, angle: float) -> Array:
    """Rotation about X, Y or Z, written out."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array(
        {
            "A": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "B": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "C": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[letter]
    )


# LinuxCNC


def trunnion_from_ini(folder: Path, name: str, rotation_point: Array, conventional: bool = False) -> Machine:
    """The machine of an ini that sets the module's pins."""
    module = f"{name}-trt-kins"
    pins = {f"{axis}-offset": value for axis, value in zip("xyz", OFFSET[name], strict=True)}
    pins |= {f"{axis}-rot-point": value for axis, value in zip("xyz", rotation_point, strict=True)}
    pins["conventional-directions"] = int(conventional)
    commands = [f"HALCMD = setp {module}.{pin} {value}" for pin, value in pins.items()]
    traj = f"[TRAJ]\nCOORDINATES = {name.upper()}\nLINEAR_UNITS = mm"
    path = folder / f"{name}.ini"
    path.write_text("\n".join([f"[KINS]\nKINEMATICS = {module}", traj, "[HAL]", *commands]))
    return read_linuxcnc(path)


def program_position(name: str, joints: Array, tilt: float, spin: float, r: Array, sign: float) -> Array:
    """``program = Rz(-c) [Rt(-t) (J - dt z - r - d) + d] + r``; sign 1 with conventional-directions."""
    d, tool = OFFSET[name], np.array([0.0, 0.0, TOOL])
    tilted = about(name[3].upper(), sign * tilt) @ (joints - tool - r - d) + d
    return about("C", sign * spin) @ tilted + r


@pytest.mark.parametrize("conventional", [False, True])
@pytest.mark.parametrize("name", ["xyzac", "xyzbc"])
def test_linuxcncs_closed_form_is_met_with_tool_and_rotation_point(tmp_path, name, conventional):
    machine = trunnion_from_ini(tmp_path, name, ROTATION_POINT, conventional).with_tool_length(TOOL)
    joints = RNG.uniform(-200.0, 200.0, (300, 3))
    turns = RNG.uniform(-1.0, 1.0, (300, 2)) * [2.0, 7.0]  # tilt and spin in the control's own sign
    counted = 1.0 if machine.axis("C").reversed is False else -1.0
    assert counted == (1.0 if conventional else -1.0)
    tip, axis = tool_poses(machine, np.hstack([joints, counted * turns]))
    wanted = [
        program_position(name, j, t, c, ROTATION_POINT, counted)
        for j, (t, c) in zip(joints, turns, strict=True)
    ]
    np.testing.assert_allclose(tip, wanted, rtol=0.0, atol=1e-9)
    found = linear_positions(machine, np.array(wanted), counted * turns[:, ::-1])
    np.testing.assert_allclose(found[:, :3], joints, rtol=0.0, atol=1e-9)
    branches = axis_positions(machine, np.array(wanted), axis)
    off = np.abs(np.angle(np.exp(1j * (branches[..., 3:] - counted * turns)))).max(axis=2)
    assert off.min(axis=0).max() < 1e-9


@pytest.mark.parametrize("name", ["xyzac", "xyzbc"])
def test_the_library_s_trunnions_are_those_of_the_module(tmp_path, name):
    library, machine = load_machine(f"linuxcnc-{name}-trt"), trunnion_from_ini(tmp_path, name, np.zeros(3))
    assert [a.reversed for a in library.axes] == [a.reversed for a in machine.axes]
    positions = RNG.uniform(-1.0, 1.0, (50, 5)) * [100.0, 100.0, 100.0, 2.0, 7.0]
    for found, wanted in zip(tool_poses(library, positions), tool_poses(machine, positions), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-9)


GOLDEN = [
    # program X Y Z A C (TCP on, LinuxCNC's signs), joints X Y Z with tool length 0
    ((10, 0, 0, 0, 0), (10, 0, 0)),
    ((10, 0, 0, 30, 0), (10, 7.679492, -8.660254)),
    ((10, 5, -3, -45, 90), (-5, 3.736544, 7.878680)),
    ((-20, 15, 8, -30, 200), (23.924155, -4.603511, 21.895442)),
]


@pytest.mark.parametrize(("program", "joints"), GOLDEN)
def test_linuxcncs_golden_table_is_met_with_a_tool(tmp_path, program, joints):
    """A tool moves the machine up by its length: the table's third column."""
    machine = trunnion_from_ini(tmp_path, "xyzac", np.zeros(3)).with_tool_length(TOOL)
    *tip, a, c = program
    found = linear_positions(machine, np.array([tip], float), -np.radians([[c, a]]))
    x, y, z = joints
    np.testing.assert_allclose(found[0, :3], [x, y, z + TOOL], rtol=0.0, atol=5e-7)


# One NX operation for a Haas with a trunnion and a DMU 70 with a nutating table

OPERATION = "VARIABLE_CONTOUR_MCS9"
HAAS, DMU = "nx_haas_vf2tr_machine_inch.nc", "nx_dmu70_840d_traori_inch.mpf"
POSES, TURNING = 350, 311
# What rounding makes of one pose in two programs: 4 decimals of X Y Z in both, 3 of two angles at 2.4 inch.
ROUNDED_INCH = 2 * np.sqrt(3) * 0.5e-4 + 2 * np.radians(0.5e-3) * 2.4
ROUNDED_DEG = 4 * 0.5e-3


@dataclass(frozen=True)
class Posted:
    """One operation on both machines, row by row: inch and rad, in the machines' own columns."""

    haas: Machine
    dmu: Machine
    haas_positions: Array
    dmu_tip: Array
    dmu_angles: Array


def read_rows(path: Path, operation: str, letters: str) -> Array:
    """Modal words of an operation's motion blocks, one row for each block once every letter is known."""
    _, _, rest = path.read_text(encoding="utf-8").partition(f"({operation})")
    if not rest:
        _, _, rest = path.read_text(encoding="utf-8").partition(f"( {operation} )")
    state: dict[str, float] = {}
    rows = []
    for line in rest.splitlines()[1:]:
        if "(" in line or "M09" in line or "G53" in line:  # the next operation, or going home
            break
        words = re.findall(rf"([{letters}])(-?\d*\.?\d+|-?\d+\.)", line)
        state |= {letter: float(value) for letter, value in words}
        if words and len(state) == len(letters):
            rows.append([state[c] for c in letters])
    return np.array(rows)


def machine_of(code: str, lines: dict[str, Line], reverse: str) -> Machine:
    parsed = parse_code(code)
    axes = tuple(Axis(c, reversed=c in reverse) for c in sorted(parsed.letters, key="XYZABC".index))
    return Machine(code, parsed, Chain.from_code(parsed, lines), axes)


@pytest.fixture(scope="module")
def posted(data: Path) -> Posted:
    """Both programs on machines of fiveaxis, without each control's signs.

    The Haas calls the axis about Z its B: ``p = Rz(B) Rx(-A) (X, Y, Z)``, so A is reversed. The DMU's table
    nutates about (0, 1, -1), counted against ISO 841 like its library relative's.
    """
    haas = machine_of("640123", {}, reverse="A")
    dmu = machine_of("650123", {"B": Line((0.0, 1.0, -1.0))}, reverse="B")
    blocks = read_rows(data / "toolpaths" / HAAS, OPERATION, "XYZAB")
    rows = read_rows(data / "toolpaths" / DMU, OPERATION, "XYZBC")
    # The Haas program ends with a retract to Z 12, which the other makes elsewhere.
    assert (len(blocks), len(rows)) == (POSES + 1, POSES)
    assert blocks[-1, 2] == 12.0
    signs = [np.array([-1.0 if m.axis(c).reversed else 1.0 for c in m.letters[3:]]) for m in (haas, dmu)]
    positions = np.hstack([blocks[:-1, :3], np.radians(blocks[:-1, 3:]) * signs[0]])
    return Posted(haas, dmu, positions, rows[:, :3], np.radians(rows[:, 3:]) * signs[1])


def test_both_controls_move_the_tool_through_the_same_positions(posted):
    tip, _ = tool_poses(posted.haas, posted.haas_positions)
    apart = np.linalg.norm(tip - posted.dmu_tip, axis=1)
    assert len(apart) == POSES
    assert apart.max() < ROUNDED_INCH
    assert apart.max() == pytest.approx(1.31e-4, abs=1e-6)  # inch
    assert np.abs(tip - posted.dmu_tip).max() == pytest.approx(1.15e-4, abs=1e-6)
    assert np.median(apart) < 1e-4


def tool_axes_of_both(posted: Posted) -> tuple[Array, Array]:
    _, haas = tool_poses(posted.haas, posted.haas_positions)
    _, dmu = tool_poses(posted.dmu, np.hstack([np.zeros((POSES, 3)), posted.dmu_angles]))
    return haas, dmu


def test_both_controls_hold_the_same_tool_axis_until_the_nutating_axis_ends(posted):
    """B ends at 101.881 deg, 66.6 deg of tilt; from there on the post moves the tip only."""
    haas, dmu = tool_axes_of_both(posted)
    tilts = [np.degrees(np.arccos(o[:, 2])) for o in (haas, dmu)]
    same = np.abs(tilts[0] - tilts[1]) < 0.01
    assert same.sum() == TURNING
    assert same[:TURNING].all()
    assert np.degrees(posted.dmu_angles[TURNING:, 0]) == pytest.approx(-101.881)
    apart = np.degrees(angle_between(haas, dmu))[same]
    assert tilts[0][same].max() > 66.0
    assert apart.max() < 1e-3
    assert apart.max() == pytest.approx(9.70e-4, abs=1e-6)  # deg


def test_a_nutating_axis_may_be_described_in_the_opposite_direction(posted):
    """About (0, 1, 1), B counts as the control does, and C stands half a turn on."""
    other = machine_of("650123", {"B": Line((0.0, 1.0, 1.0))}, reverse="")
    angles = posted.dmu_angles * [-1.0, 1.0] + [0.0, np.pi]
    _, axis = tool_poses(other, np.hstack([np.zeros((POSES, 3)), angles]))
    np.testing.assert_allclose(axis, tool_axes_of_both(posted)[1], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("of", "bound"), [("its own axes", 1e-9), ("the other program's", ROUNDED_DEG)])
def test_the_inverse_finds_the_programs_own_angles_among_its_branches(posted, of, bound):
    """From the DMU's tool axes, and from the Haas's, whose rounding the nutating axis enlarges."""
    haas, dmu = tool_axes_of_both(posted)
    tilted = slice(1, TURNING)  # the first stands upright, where C may be anything
    wanted = posted.dmu_angles[tilted]
    axes = (dmu if of == "its own axes" else haas)[tilted]
    branches = axis_positions(posted.dmu, posted.dmu_tip[tilted], axes)[..., 3:]
    off = np.degrees(np.abs(np.angle(np.exp(1j * (branches - wanted))))).max(axis=2)  # modulo turns
    assert off.shape == (2, TURNING - 1)
    assert off.min(axis=0).max() < bound
    if of != "its own axes":
        assert off.min(axis=0).max() == pytest.approx(1.255e-3, abs=1e-6)  # deg
    # The other branch is another posture: the test could fail.
    assert off.max(axis=0).min() > 0.1
