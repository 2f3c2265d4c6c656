"""The machine library against its printed sources."""

import math

import numpy as np
import pytest
from support.linuxcnc_kinematics import five_axis, max5, pointing

from fiveaxis.base import Array
from fiveaxis.model import BED, Body, Box, Cylinder, Machine, load_machine, machine_names, tool_poses

# Code, from the workpiece to the tool, and the side of the bed that turns.
STRUCTURES = {
    "dmu50ev": ("650123", "table-table"),
    "dmu80p-duoblock": ("620135", "table-head"),
    "hayashi-640123": ("640123", "table-table"),
    "linuxcnc-bridgemill": ("021365", "head-head"),
    "linuxcnc-max5": ("612035", "table-head"),
    "linuxcnc-xyzac-trt": ("640123", "table-table"),
    "linuxcnc-xyzbc-trt": ("651203", "table-table"),
    "micro5": ("650123", "table-table"),
    "pocketnc-v2": ("540123", "table-table"),
    "takisawa-mac-v3": ("1203", "3-axis"),
    "umc-750": ("650123", "table-table"),
    "variaxis-630": ("640123", "table-table"),
    "variaxis-730": ("640123", "table-table"),
}
INCH = 25.4
# Library machines whose figures come from Vericut templates.
TEMPLATES = ["dmu50ev", "dmu80p-duoblock", "variaxis-630"]


def control_limits(machine: Machine, letter: str) -> tuple[float, float]:
    """Return an axis's range as its control counts it, mm or degrees."""
    axis = machine.axis(letter)
    low, high = axis.shown(axis.limits.low), axis.shown(axis.limits.high)
    return (-high, -low) if axis.reversed else (low, high)


def control_poses(machine: Machine, values: Array) -> tuple[Array, Array]:
    """Compute tip and axis from control values, mm and degrees, columns in the machine's order."""
    signs = np.array([-1.0 if a.reversed else 1.0 for a in machine.axes])
    scale = np.array([math.pi / 180.0 if a.is_rotary else 1.0 for a in machine.axes])
    return tool_poses(machine, values * signs * scale)


def random_values(machine: Machine, rng: np.random.Generator, n: int = 200) -> Array:
    """Draw control values, mm and degrees, further than any limits."""
    span = np.array([400.0 if a.is_rotary else 300.0 for a in machine.axes])
    return rng.uniform(-span, span, (n, len(span)))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(640123)


def test_the_library_holds_every_kind_of_machine():
    assert set(STRUCTURES) <= set(machine_names())
    assert {kind for _, kind in STRUCTURES.values()} == {"table-table", "table-head", "head-head", "3-axis"}


def test_every_library_machine_names_the_source_of_its_structure_and_figures():
    """What is assumed says why."""
    machines = {name: load_machine(name) for name in machine_names()}
    assert {name: machine.name for name, machine in machines.items()} == {name: name for name in machines}
    figures = [(name, p) for name, machine in machines.items() for p in machine.provenance]
    assert {name for name, p in figures if p.figure == "structure" and p.source} == set(machines)
    assert [(name, p.figure) for name, p in figures if not (p.note if p.assumed else p.source)] == []


def test_the_order_of_the_axes_is_the_published_one():
    codes = {name: load_machine(name).code for name in STRUCTURES}
    assert {name: (code.text, code.kind) for name, code in codes.items()} == STRUCTURES


@pytest.mark.parametrize(
    ("name", "letter", "low", "high"),
    [
        # xyzbc-trt.ini: AXIS_B is ±36000, JOINT_3 narrower; both are checked.
        ("linuxcnc-xyzbc-trt", "B", -100.0, 50.0),
        ("linuxcnc-xyzbc-trt", "C", -36000.0, 36000.0),
        ("linuxcnc-xyzac-trt", "A", -100.0, 50.0),
        ("linuxcnc-bridgemill", "X", -500.0, 500.0),
        ("linuxcnc-bridgemill", "Z", -500.0, 100.0),
        ("linuxcnc-bridgemill", "B", -120.0, 120.0),
        ("linuxcnc-max5", "X", -100.0, 200.0),
        ("linuxcnc-max5", "Z", -149.0, 1.0),
        ("linuxcnc-max5", "B", -90.0, 90.0),
        # PocketNC.ini is in inches; AXIS_A is inside JOINT_3 (-26…136).
        ("pocketnc-v2", "X", -2.001 * INCH, 2.551 * INCH),
        ("pocketnc-v2", "Y", -2.501 * INCH, 2.551 * INCH),
        ("pocketnc-v2", "Z", -3.451 * INCH, 0.101 * INCH),
        ("pocketnc-v2", "A", -25.0, 135.0),
        ("micro5", "X", -39.0, 39.0),
        ("micro5", "B", -10.0, 100.0),
        ("dmu50ev", "X", -500.0, 0.0),
        ("dmu50ev", "Y", -420.0, 0.0),
        ("dmu50ev", "Z", -380.0, 0.0),
        ("dmu50ev", "B", 0.0, 180.0),
        ("dmu80p-duoblock", "X", 0.0, 800.0),
        ("dmu80p-duoblock", "B", -10.0, 180.0),
        ("variaxis-630", "Y", -765.0, 0.0),
        ("variaxis-630", "A", -120.0, 30.0),
        ("variaxis-730", "A", -120.0, 30.0),
        ("variaxis-730", "C", -9999.0, 9999.0),
        ("umc-750", "B", -35.0, 110.0),
    ],
)
def test_the_limits_are_the_printed_ones_in_the_controls_own_sign(name, letter, low, high):
    assert control_limits(load_machine(name), letter) == pytest.approx((low, high), abs=1e-9)


def test_a_table_that_turns_by_plus_a_has_its_limits_negated_and_exchanged():
    limits = load_machine("pocketnc-v2").axis("A").limits
    assert np.degrees([limits.low, limits.high]) == pytest.approx([-135.0, 25.0])


@pytest.mark.parametrize("name", ["dmu50ev", "dmu80p-duoblock", "micro5", "umc-750", "variaxis-630"])
def test_tables_without_a_stop_turn_without_end(name: str):
    assert load_machine(name).axis("C").limits.unlimited


@pytest.mark.parametrize("name", TEMPLATES)
def test_defaults_of_a_simulation_program_are_not_machine_data(name: str):
    # The templates' rapid 5000 and accelerations 125 and 250 are Vericut's own.
    for axis in load_machine(name).axes:
        assert axis.max_speed is None
        assert axis.max_acceleration is None


def test_speeds_and_masses_are_converted_to_internal_units():
    micro5 = load_machine("micro5")
    assert micro5.axis("X").max_speed == pytest.approx(500.0)  # 30 m/min
    assert micro5.axis("X").max_acceleration == pytest.approx(25000.0)
    assert micro5.axis("B").max_speed == pytest.approx(400.0 * 2.0 * math.pi / 60.0)
    assert micro5.axis("B").max_acceleration == pytest.approx(800.0)
    assert [a.moved_mass for a in micro5.axes] == [9.6, 8.6, 3.3, 4.1, 0.95]
    pocket = load_machine("pocketnc-v2")
    assert pocket.axis("X").max_speed == pytest.approx(25.4)
    assert pocket.axis("A").max_acceleration == pytest.approx(math.radians(300.0))
    assert load_machine("variaxis-730").axis("Z").max_speed == pytest.approx(40000.0 / 60.0)


def test_the_takisawa_has_its_measured_base_power_and_masses():
    machine = load_machine("takisawa-mac-v3")
    assert machine.base_power == 2763.18
    assert [machine.axis(c).moved_mass for c in "XYZ"] == [315.0, 750.0, None]
    assert machine.load.mass == 60.0  # vice and workpiece


def test_the_head_of_the_bridge_mill_turns_250_mm_above_its_gauge_point():
    machine = load_machine("linuxcnc-bridgemill")
    line = next(j.line for j in machine.chain.joints if j.letter == "B")
    gauge = machine.chain.tool_home[:3, 3]
    off = gauge - np.array(line.point)
    across = off - (off @ np.array(line.direction)) * np.array(line.direction)
    assert np.linalg.norm(across) == pytest.approx(250.0)


def test_bridge_mill_follows_the_published_5axiskins(rng):
    machine = load_machine("linuxcnc-bridgemill")
    for tool in (0.0, 87.5):
        values = random_values(machine, rng)
        tip, axis = control_poses(machine.with_tool_length(tool), values)
        joints, turns = values[:, :3], np.radians(values[:, 3:]).T
        # The control's Z counts from the tip of the tool, the chain's from the gauge point.
        expected = five_axis(joints, *turns, 250.0 + tool)
        np.testing.assert_allclose(tip + np.array([0.0, 0.0, tool]), expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(axis, pointing(*turns), rtol=0.0, atol=1e-12)


def test_max5_follows_the_published_maxkins(rng):
    """The pivot length of max5 is 0; a tool takes its place."""
    machine = load_machine("linuxcnc-max5")
    for tool in (0.0, 112.0):
        values = random_values(machine, rng)
        tip, axis = control_poses(machine.with_tool_length(tool), values)
        joints, turns = values[:, :3], np.radians(values[:, 3:]).T
        expected = max5(joints, *turns, tool)
        np.testing.assert_allclose(tip + np.array([0.0, 0.0, tool]), expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(axis, pointing(*turns), rtol=0.0, atol=1e-12)


def test_pocket_nc_follows_its_makers_kinematics(rng):
    """Tip of `pocketnckins`, for joints J, tilt a, table b: ``tip = Ry(−b) Rx(−a) J``.

    From PocketNC/Settings : features/five_axis_kinematics/pocketnckins.c, kinematicsForwardFromState, written
    out by components for a tool offset of 0.
    """
    machine = load_machine("pocketnc-v2")
    values = random_values(machine, rng)
    tip, _ = control_poses(machine, values)
    x, y, z = values[:, :3].T
    a, b = np.radians(values[:, 3:]).T
    up = z * np.cos(a) - y * np.sin(a)
    expected = np.column_stack(
        [
            x * np.cos(b) - up * np.sin(b),
            y * np.cos(a) + z * np.sin(a),
            x * np.sin(b) + up * np.cos(b),
        ]
    )
    np.testing.assert_allclose(tip, expected, rtol=0.0, atol=1e-9)


def test_the_nutating_table_leans_aside_and_ends_upright():
    machine = load_machine("dmu50ev")
    line = next(j.line for j in machine.chain.joints if j.letter == "B")
    assert line.direction == pytest.approx((0.0, math.sqrt(0.5), -math.sqrt(0.5)))
    # Half a turn about a line inclined by 45 deg leans the table by 90 deg, towards -Y; a quarter by 60 deg.
    values = np.zeros((3, 5))
    values[:, 3] = 0.0, 90.0, 180.0
    _, axis = control_poses(machine, values)
    np.testing.assert_allclose(axis[:, 2], [1.0, 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(axis[2], [0.0, -1.0, 0.0], atol=1e-12)
    # The sense: counted like the DMU 70's, whose program test_oracles.py holds against another machine.
    np.testing.assert_allclose(axis[1], [-math.sqrt(0.5), -0.5, 0.5], atol=1e-12)


@pytest.mark.parametrize("point", [(0.0, 310.128, -155.064), (0.0, 309.950, -154.975)])
def test_simulation_template_and_postprocessor_agree_on_the_nutating_line(point):
    # dmu50_MILL_PLUS.tcl has the rotary centre of two machines; the template rounds to whole millimetres.
    line = next(j.line for j in load_machine("dmu50ev").chain.joints if j.letter == "B")
    across = np.cross(np.array(point) - np.array(line.point), line.direction)
    assert np.linalg.norm(across) < 0.1


def test_the_nutating_head_lays_the_spindle_down():
    machine = load_machine("dmu80p-duoblock")
    values = np.zeros((2, 5))
    values[:, :3] = 400.0, -500.0, -800.0
    values[1, 3] = 180.0
    tip, axis = control_poses(machine, values)
    # Upright over the table's centre, the gauge point is 150 mm above it.
    np.testing.assert_allclose(tip[0], [0.0, 0.0, 150.0], atol=1e-9)
    np.testing.assert_allclose(axis, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "centred", "above"),
    [
        ("dmu50ev", {"X": -250.0, "Y": -155.0, "Z": -380.0}, 162.0),
        ("variaxis-630", {"X": -315.0, "Y": -315.0, "Z": -510.0}, 230.0),
    ],
)
def test_the_lowest_gauge_point_over_the_table_is_where_the_template_has_it(name, centred, above):
    machine = load_machine(name)
    values = np.array([[centred.get(c, 0.0) for c in machine.letters]])
    tip, _ = control_poses(machine, values)
    np.testing.assert_allclose(tip, [[0.0, 0.0, above]], atol=1e-9)


def heights(body: Body) -> tuple[float, float]:
    """Return the lowest and highest z of a box or cylinder, mm."""
    shape = body.shape
    if isinstance(shape, Box):
        half = shape.size[2] / 2.0
    else:
        assert isinstance(shape, Cylinder)
        up = abs(shape.direction[2])
        half = shape.height / 2.0 * up + shape.radius * math.sqrt(1.0 - up * up)
    return shape.center[2] - half, shape.center[2] + half


@pytest.mark.parametrize("name", ["linuxcnc-xyzac-trt", "linuxcnc-bridgemill"])
def test_at_home_the_bodies_leave_the_workpiece_room(name: str):
    machine = load_machine(name)
    below = [b for b in machine.bodies if b.link in (BED, *machine.code.table)]
    above = [b for b in machine.bodies if b.link in machine.code.head]
    assert below
    assert above
    assert max(heights(b)[1] for b in below) <= 0.0
    assert min(heights(b)[0] for b in above) >= machine.chain.tool_home[2, 3]


@pytest.mark.parametrize(("name", "letter"), [("linuxcnc-xyzac-trt", "A"), ("linuxcnc-xyzbc-trt", "B")])
def test_the_trunnions_have_the_figures_of_the_drawn_ones(name: str, letter: str):
    """The platter is drawn about the rotation point, the yoke 30 mm under the trunnion's line."""
    machine = load_machine(name)
    line = np.array(next(j.line.point for j in machine.chain.joints if j.letter == letter))
    yoke = next(
        b for b in machine.bodies if b.link == letter and isinstance(b.shape, Box) and 130 in b.shape.size
    )
    np.testing.assert_allclose(yoke.shape.center, line - [0.0, 0.0, 30.0])
    head = next(b for b in machine.bodies if b.link == "Z" and isinstance(b.shape, Box))
    assert heights(head) == (60.0, 135.0)
