"""URDF of machines: read by pinocchio, which must put the tool where fiveaxis does."""

import math
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from fiveaxis.base import frame_along, normalise, rotation_matrix
from fiveaxis.base.errors import MachineError
from fiveaxis.model import (
    Body,
    Box,
    Cylinder,
    Limits,
    Machine,
    MeshShape,
    load_machine,
    machine_names,
    stand_ins,
    tool_poses,
)
from fiveaxis.model.kinematics.poses import link_poses
from fiveaxis.model.machine.axes import LocationError
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.model.machine.code import parse_code
from fiveaxis.model.machine.urdf import roll_pitch_yaw

pin = pytest.importorskip("pinocchio")

TOLERANCE = 1e-9  # mm
SEED = 20261121


def built(code: str, lines: dict[str, Line] | None = None, home: np.ndarray | None = None) -> Machine:
    parsed = parse_code(code)
    chain = Chain.from_code(parsed, lines)
    if home is not None:
        chain = Chain(chain.joints, home)
    return replace(Machine.from_code(code), chain=chain)


def limited(machine: Machine, **limits: Limits) -> Machine:
    return replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, a.limits)) for a in machine.axes)
    )


NUTATING = {"B": Line((0, 1, 1), (3, 40, -25)), "C": Line((0, 0, 1), (12, -7, 0))}
PIVOTED = {"C": Line((0, 0, 1), (0, 2, 0)), "A": Line((1, 0, 0), (0, 2, 180))}
SWIVELLED = frame_along(normalise(np.array([1.0, -2.0, 0.5])), (10.0, 20.0, 30.0))
HORIZONTAL = frame_along((1.0, 0.0, 0.0), (0.0, 5.0, 0.0))
ERRORS = {
    "A": LocationError((0.0, 0.02, -0.01), (0.0, 3e-4, -2e-4)),
    "C": LocationError((-0.015, 0.03, 0.0), (1e-4, 2e-4, 0.0)),
}

MACHINES = {
    "table-table": built("640123"),
    "table-head": built("601234"),
    "head-head": built("012364"),
    "all on the table": built("641230"),
    "nutating table with offsets": built("650123", NUTATING),
    "nutating head with offsets": built("012365", NUTATING),
    "head with pivot length": built("012364", PIVOTED).with_tool_length(95.0),
    "swivelled home": built("640123", home=SWIVELLED).with_tool_length(60.0),
    "horizontal spindle": built("650123", home=HORIZONTAL),
    "setup": built("650123", NUTATING).with_setup((120.0, -35.0, 80.0), (10.0, -90.0, 33.0)),
    "location errors": built("640123").with_location_errors(ERRORS),
    "all of it": built("640123", {"A": Line((1, 0, 0), (0, 20, 10))}, SWIVELLED)
    .with_setup((5.0, 6.0, 7.0), (20.0, 90.0, -70.0))
    .with_location_errors(ERRORS)
    .with_tool_length(44.0),
    "3-axis": built("0123").with_setup((1.0, 2.0, 3.0), (0.0, 0.0, 30.0)),
    "3-axis, table moves": built("1230"),
    "4-axis": built("40123"),
    "redundant": built("6412305", NUTATING),
}
both_roots = pytest.mark.parametrize("root", ["workpiece", "bed"])


def machine_of(name: str) -> Machine:
    return MACHINES[name] if name in MACHINES else load_machine(name)


def random_positions(machine: Machine, n: int = 20) -> np.ndarray:
    scale = [4.0 if a.is_rotary else 400.0 for a in machine.axes]
    return np.random.default_rng(SEED).uniform(-1.0, 1.0, (n, len(scale))) * scale


def configuration(model, machine: Machine, row: np.ndarray) -> np.ndarray:
    """Axis values as pinocchio takes them: lengths in metres."""
    q = pin.neutral(model)
    for axis, value in zip(machine.axes, row, strict=True):
        q[model.joints[model.getJointId(axis.letter)].idx_q] = value if axis.is_rotary else value / 1000.0
    return q


def in_mm(pose) -> np.ndarray:
    matrix = pose.homogeneous.copy()
    matrix[:3, 3] *= 1000.0
    return matrix


def frames(machine: Machine, root: str, row: np.ndarray) -> dict[str, np.ndarray]:
    """Every frame in the workpiece frame, mm, as pinocchio finds it from the URDF."""
    model = pin.buildModelFromXML(machine.to_urdf(root))
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration(model, machine, row))
    work = data.oMf[model.getFrameId("workpiece")].inverse()
    return {f.name: in_mm(work * data.oMf[i]) for i, f in enumerate(model.frames)}


@both_roots
@pytest.mark.parametrize("name", [*MACHINES, *machine_names()])
def test_pinocchio_puts_the_tool_where_the_kinematics_do(name, root):
    machine = machine_of(name)
    positions = random_positions(machine)
    tip, axis = tool_poses(machine, positions)
    for row, r, o in zip(positions, tip, axis, strict=True):
        tool = frames(machine, root, row)["tool"]
        np.testing.assert_allclose(tool[:3, 3], r, atol=TOLERANCE, rtol=0.0)
        np.testing.assert_allclose(tool[:3, 2], o, atol=1e-12)


@both_roots
def test_the_tool_frame_keeps_its_spin_about_the_tool_axis(root):
    machine = MACHINES["swivelled home"]
    home = frames(machine, root, np.zeros(5))["tool"]
    np.testing.assert_allclose(home, machine.chain.tool_home, atol=TOLERANCE)


@pytest.mark.parametrize(
    ("code", "links"),
    [
        ("640123", ["link_C", "link_A", "bed", "link_X", "link_Y", "link_Z"]),
        ("012364", ["bed", "link_X", "link_Y", "link_Z", "link_C", "link_A"]),
        ("1230", ["link_X", "link_Y", "link_Z", "bed"]),
    ],
)
def test_from_the_workpiece_the_links_are_one_branch(code, links):
    robot = ElementTree.fromstring(Machine.from_code(code).to_urdf())
    assert [e.get("name") for e in robot.findall("link")] == ["workpiece", *links, "tool"]
    pairs = [(j.find("parent").get("link"), j.find("child").get("link")) for j in robot.findall("joint")]
    branch = ["workpiece", *links, "tool"]
    assert sorted(pairs) == sorted(pairwise(branch))


def test_from_the_bed_there_is_a_branch_to_the_workpiece_and_one_to_the_tool():
    robot = ElementTree.fromstring(Machine.from_code("640123").to_urdf("bed"))
    parents = {j.find("child").get("link"): j.find("parent").get("link") for j in robot.findall("joint")}
    assert parents == {
        "workpiece": "link_C",
        "link_C": "link_A",
        "link_A": "bed",
        "link_X": "bed",
        "link_Y": "link_X",
        "link_Z": "link_Y",
        "tool": "link_Z",
    }


def test_seen_from_the_bed_a_table_axis_turns_the_workpiece_backwards_and_leaves_the_tool():
    machine = Machine.from_code("640123")
    turned = frames(machine, "bed", np.array([0.0, 0.0, 0.0, 0.0, 0.3]))
    bed = np.linalg.inv(turned["bed"])
    np.testing.assert_allclose((bed @ turned["tool"]), np.eye(4), atol=1e-12)
    back = rotation_matrix((0.0, 0.0, 1.0), -0.3)
    np.testing.assert_allclose(np.linalg.inv(turned["bed"])[:3, :3], back, atol=1e-12)


def limits_of(machine: Machine) -> dict[str, tuple[str, dict[str, str]]]:
    robot = ElementTree.fromstring(machine.to_urdf())
    moving = [j for j in robot.findall("joint") if j.get("type") != "fixed"]
    return {j.get("name"): (j.get("type"), j.find("limit").attrib) for j in moving}


def test_limits_and_speeds_are_in_metres_and_radians(trunnion):
    found = limits_of(trunnion)
    limit = {"lower": "-0.2", "upper": "0.2", "effort": "1000000", "velocity": "0.02"}
    assert found["X"] == ("prismatic", limit)
    kind, limit = found["A"]
    assert kind == "revolute"
    assert float(limit["lower"]) == pytest.approx(math.radians(-50))
    assert float(limit["upper"]) == pytest.approx(math.radians(100))
    assert float(limit["velocity"]) == pytest.approx(math.radians(30))


def test_a_rotary_axis_without_limits_keeps_its_turn(hayashi):
    """One number a joint: a `continuous` one would be two for pinocchio, and forget how often it turned."""
    kind, limit = limits_of(hayashi)["C"]
    assert kind == "revolute"
    assert float(limit["upper"]) == -float(limit["lower"]) > 6000.0
    assert pin.buildModelFromXML(hayashi.to_urdf()).nq == 5


def test_a_speed_that_is_not_stated_is_no_0_which_planners_read_as_standing_still(hayashi):
    found = limits_of(hayashi)
    assert found["X"][1]["velocity"] == "100"
    assert float(found["C"][1]["velocity"]) == pytest.approx(2000.0 * math.pi)
    model = pin.buildModelFromXML(hayashi.to_urdf())
    assert (model.velocityLimit >= 100.0).all()


def test_stand_ins_are_named_in_the_file_and_states_are_not(hayashi, trunnion):
    speeds = "velocity 100 m/s or 1000 turns/s of X, Y, Z, A, C;"
    assert speeds in stand_ins(hayashi)
    assert "velocity" not in stand_ins(trunnion)
    for machine in (hayashi, trunnion):
        assert f"<!-- {stand_ins(machine)} -->" in machine.to_urdf()


def test_a_speed_that_is_not_stated_stays_unknown_when_the_file_is_read(hayashi, trunnion, tmp_path):
    for machine in (hayashi, trunnion):
        file = tmp_path / f"{machine.name}.urdf"
        file.write_text(machine.to_urdf(), encoding="utf-8")
        again = load_machine(file)
        for axis in machine.axes:
            speed = again.axis(axis.letter).max_speed
            assert speed == (None if axis.max_speed is None else pytest.approx(axis.max_speed))


@both_roots
@pytest.mark.parametrize("structure", ["table-table", "head-head", "all of it", "3-axis, table moves"])
def test_every_link_that_moves_has_a_mass_and_the_root_has_none(structure, root):
    """Simulators refuse a moving body without mass; KDL drops the mass of a root link, with a warning."""
    model = pin.buildModelFromXML(MACHINES[structure].to_urdf(root))
    moving = [model.inertias[joint] for joint in range(1, model.njoints)]
    assert len(moving) == len(MACHINES[structure].axes)
    for inertia in moving:
        assert inertia.mass == pytest.approx(1.0)
        assert np.linalg.eigvalsh(inertia.inertia).min() > 0.0
    assert model.inertias[0].mass == 0.0


def test_an_end_that_is_missing_is_far_from_the_other_one():
    machine = limited(Machine.from_code("640123"), X=Limits(low=200e3), A=Limits(high=-1e4))
    found = limits_of(machine)
    assert (found["X"][1]["lower"], found["X"][1]["upper"]) == ("200", "300")
    assert (found["Y"][1]["lower"], found["Y"][1]["upper"]) == ("-100", "100")
    kind, limit = found["A"]
    assert kind == "revolute"
    assert float(limit["lower"]) == pytest.approx(-1e4 - 2000.0 * math.pi)
    assert float(limit["upper"]) == -1e4


def with_bodies(machine: Machine, folder: Path) -> Machine:
    trimesh.creation.box((2.0, 4.0, 6.0)).export(folder / "housing.stl")
    direction = tuple(normalise(np.array([1.0, 2.0, -2.0])))
    bodies = (
        Body("C", Cylinder(90.0, 20.0, (0.0, 1.0, -10.0))),
        Body("A", Cylinder(30.0, 200.0, (5.0, 6.0, 7.0), direction)),
        Body("bed", Box((400.0, 300.0, 100.0), (0.0, 200.0, -300.0))),
        Body("bed", Cylinder(10.0, 50.0, (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))),
        Body("Z", MeshShape(folder / "housing.stl", 25.4)),
    )
    return replace(machine, bodies=bodies)


def geometry(machine: Machine, root: str, kind) -> tuple:
    text = machine.to_urdf(root)
    model = pin.buildModelFromXML(text)
    return model, pin.buildGeomFromUrdfString(model, text, kind)


@both_roots
@pytest.mark.parametrize("structure", ["table-table", "head with pivot length", "all of it", "redundant"])
def test_bodies_are_where_their_links_have_moved(structure, root, tmp_path):
    machine = with_bodies(MACHINES[structure], tmp_path)
    row = random_positions(machine, 1)[0]
    model, bodies = geometry(machine, root, pin.GeometryType.COLLISION)
    data, placed = model.createData(), bodies.createData()
    q = configuration(model, machine, row)
    pin.framesForwardKinematics(model, data, q)
    pin.updateGeometryPlacements(model, data, bodies, placed, q)
    work = data.oMf[model.getFrameId("workpiece")].inverse()
    found = {g.name: in_mm(work * placed.oMg[i]) for i, g in enumerate(bodies.geometryObjects)}
    moved = link_poses(machine, row[None])
    # pinocchio numbers the bodies of each link.
    numbered = {"link_C_0": 0, "link_A_0": 1, "bed_0": 2, "bed_1": 3, "link_Z_0": 4}
    assert set(found) == set(numbered)
    for name, index in numbered.items():
        body = machine.bodies[index]
        expected = moved[body.link][0] @ machine.machine_frame @ body.shape.frame
        np.testing.assert_allclose(found[name], expected, atol=TOLERANCE, rtol=0.0)


@pytest.mark.parametrize("kind", [pin.GeometryType.COLLISION, pin.GeometryType.VISUAL])
def test_bodies_have_their_sizes_in_metres(kind, tmp_path):
    _, bodies = geometry(with_bodies(Machine.from_code("640123"), tmp_path), "workpiece", kind)
    shapes = {g.name: g for g in bodies.geometryObjects}
    assert len(shapes) == 5
    np.testing.assert_allclose(2.0 * shapes["bed_0"].geometry.halfSide, [0.4, 0.3, 0.1])
    table = shapes["link_C_0"].geometry
    assert (table.radius, 2.0 * table.halfLength) == pytest.approx((0.09, 0.02))
    mesh = shapes["link_Z_0"].geometry
    mesh.computeLocalAABB()
    box = mesh.aabb_local
    np.testing.assert_allclose(box.max_ - box.min_, np.array([2.0, 4.0, 6.0]) * 0.0254, rtol=1e-6)


def test_mesh_files_are_absolute_uris(tmp_path, monkeypatch):
    (tmp_path / "two words").mkdir()
    monkeypatch.chdir(tmp_path)
    body = Body("bed", MeshShape(Path("two words/a.stl")))
    text = replace(Machine.from_code("640123"), bodies=(body,)).to_urdf()
    assert f'filename="{tmp_path.resolve().as_uri()}/two%20words/a.stl"' in text


def test_two_writings_are_the_same_and_free_of_rounding_noise(trunnion):
    machine = trunnion.with_setup((100.0, 0.0, 20.0), (0.0, 0.0, 90.0))
    text = machine.to_urdf()
    assert text == machine.to_urdf()
    assert "e-" not in text
    assert not re.search(r"-0[ \"]", text)
    assert text.startswith('<?xml version="1.0"?>\n<robot name="linuxcnc-xyzac-trt">')


def test_another_root_is_an_error_that_names_the_two():
    with pytest.raises(MachineError, match="'workpiece' or 'bed'"):
        Machine.from_code("640123").to_urdf("tool")


def from_angles(roll: float, pitch: float, yaw: float) -> np.ndarray:
    x, y, z = np.eye(3)
    return rotation_matrix(z, yaw) @ rotation_matrix(y, pitch) @ rotation_matrix(x, roll)


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("pitch", [math.pi / 2.0, -math.pi / 2.0])
def test_roll_pitch_yaw_keep_all_digits_next_to_an_upright_pitch(pitch, gap):
    for roll, yaw in np.random.default_rng(SEED).uniform(-math.pi, math.pi, (50, 2)):
        rotation = from_angles(roll, pitch - gap, yaw)
        np.testing.assert_allclose(from_angles(*roll_pitch_yaw(rotation)), rotation, atol=3e-15)


def test_at_an_upright_pitch_the_yaw_is_0_whatever_the_rounding():
    rotation = HORIZONTAL[:3, :3].copy()
    rotation[:2, 0] = -1e-17, 1e-17
    _, pitch, yaw = roll_pitch_yaw(rotation)
    assert (pitch, yaw) == (math.pi / 2.0, 0.0)
