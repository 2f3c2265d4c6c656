"""Drive models against mechanics written out here, and gravity against the change of potential energy."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import MachineError
from fiveaxis.model import (
    AffineDrive,
    DirectionalDrive,
    FrictionDrive,
    Machine,
    Motion,
    WeightDrive,
    drive_power,
    law_energies,
    lifting_costs,
    link_poses,
    load_machine,
    move_powers,
    power_findings,
    time_motion,
    tool_poses,
    travel_costs,
    with_powers,
)
from fiveaxis.model.energy.drives import axis_powers, gravity_forces, moved_weights
from fiveaxis.model.machine.chain import Chain, Line

RNG = np.random.default_rng(21)
G = 9.80665


def with_axes(machine: Machine, **changes: dict) -> Machine:
    return replace(machine, axes=tuple(replace(a, **changes.get(a.letter, {})) for a in machine.axes))


def test_an_affine_drive_is_a_line_either_way_and_0_at_rest():
    drive = AffineDrive(plus=(8.54, 88.82), minus=(6.502, 75.12))
    power = drive_power(drive, np.array([100.0, -100.0, 0.0]))
    np.testing.assert_allclose(power, [942.82, 725.32, 0.0])


def test_a_weight_drive_goes_with_the_weight_and_the_speed_in_metres():
    """Edem & Balogun Eq. (1): a W v + b W."""
    power = drive_power(WeightDrive(0.3, 0.05), np.array([500.0 / 60.0, -500.0 / 60.0, 0.0]), weight=3678.0)
    expected = 3678.0 * (0.3 * 0.5 / 60.0 + 0.05)
    np.testing.assert_allclose(power, [expected, expected, 0.0])


def test_a_friction_drive_pays_for_inertia_friction_and_losses():
    """In N, m, s: m = 200 kg, F_c = 150 N, B = 400 N/(m/s), efficiency 0.9, copper 1e-4 W/N²."""
    drive = FrictionDrive(
        friction=0.15, viscous=400e-6, efficiency=0.9, regeneration=0.5, copper=100.0, hold=12.0
    )
    v, a = 0.25, 1.5
    force = 200.0 * a + 150.0 + 400.0 * v
    power = drive_power(drive, np.array([1e3 * v]), acceleration=1e3 * a, inertia=200e-6)
    np.testing.assert_allclose(power, force * v / 0.9 + 1e-4 * force**2 + 12.0)
    # Braking hard returns half of what the motor takes in.
    force = 200.0 * -5.0 + 150.0 + 400.0 * v
    power = drive_power(drive, np.array([1e3 * v]), acceleration=-5e3, inertia=200e-6)
    np.testing.assert_allclose(power, force * v * 0.5 + 1e-4 * force**2 + 12.0)


def test_a_feed_force_adds_its_power_to_a_table_and_its_force_to_a_friction_drive():
    """F_f v_f of Edem & Balogun, Eqs. (1) and (5): 200 N at 0.05 m/s are 10 W in either direction."""
    speed, load = np.array([50.0, -50.0, 0.0]), np.array([0.2, -0.2, 0.2])
    for drive in (AffineDrive((8.54, 88.82), (6.502, 75.12)), WeightDrive(0.3, 0.05)):
        idle, cut = (drive_power(drive, speed, weight=3678.0, cutting=c) for c in (0.0, load))
        np.testing.assert_allclose(cut - idle, [10.0, 10.0, 0.0], atol=1e-12)
    drive = FrictionDrive(friction=0.15, efficiency=0.8)
    np.testing.assert_allclose(drive_power(drive, speed, cutting=load), [0.35 * 50 / 0.8] * 2 + [0.0])


def test_a_feed_force_is_shared_out_by_virtual_work(hayashi):
    """All axes together take F_f times the speed of the tip in the workpiece's frame."""
    positions, speeds = RNG.uniform(-1.0, 1.0, (20, 5)) * 30.0, RNG.uniform(-1.0, 1.0, (20, 5))
    speeds[0] = 0.0
    force, h = np.full(20, 80.0), 1e-6
    idle, cut = (axis_powers(hayashi, positions, speeds, feed_force=f) for f in (None, force))
    ends = [tool_poses(hayashi, positions + sign * h * speeds)[0] for sign in (1.0, -1.0)]
    velocity = np.linalg.norm(ends[0] - ends[1], axis=1) / (2.0 * h)
    np.testing.assert_allclose((cut - idle).sum(axis=1), 80.0 * velocity / 1000.0, rtol=1e-6, atol=1e-9)


def test_at_rest_a_friction_drive_holds_against_gravity_and_the_counterbalance_helps():
    drive = FrictionDrive(copper=100.0, hold=5.0, counterbalance=1.2)
    np.testing.assert_allclose(drive_power(drive, np.array([0.0]), gravity=1.5), 100.0 * 0.09 + 5.0)


@pytest.mark.parametrize(
    ("drive", "up", "down"),
    [
        (DirectionalDrive(plus=600.0, minus=400.0), 600.0, 400.0),
        (AffineDrive(plus=(5.0, 90.0), minus=(4.0, 80.0)), 90.0, 80.0),
        (WeightDrive(0.3, 0.05), 50.0, 50.0),
        # Friction and heat grow with speed and load as they do below; what is drawn at rest stays.
        (FrictionDrive(friction=0.2, moving=30.0, hold=7.0, efficiency=0.8), 30.0, 30.0),
        (DirectionalDrive(plus=6.0, minus=4.0, proportional=True), 0.0, 0.0),
    ],
)
def test_beyond_the_measured_speeds_the_constant_part_is_in_proportion_to_speed(drive, up, down):
    speed = np.array([4.0, 10.0, 25.0, -10.0, -40.0, 0.0])
    measured = replace(drive, measured_from=1.0, measured_to=10.0)
    before, after = (drive_power(d, speed, weight=1000.0) for d in (drive, measured))
    np.testing.assert_allclose(after - before, [0.0, 0.0, 1.5 * up, 0.0, 3.0 * down, 0.0], atol=1e-9)


def test_the_heat_of_friction_is_part_of_what_is_constant_in_motion():
    """100 W per (J/mm)² at a load of 1.5 J/mm, with friction 0.2 more of it upwards and less downwards."""
    drive = FrictionDrive(friction=0.2, copper=100.0, measured_to=10.0)
    speed = np.array([20.0, -20.0])
    slow = drive_power(replace(drive, measured_to=None), speed, gravity=1.5)
    extra = drive_power(drive, speed, gravity=1.5) - slow
    np.testing.assert_allclose(extra, [100.0 * (1.7**2 - 1.5**2), 0.0], atol=1e-9)


def potential(machine: Machine, positions: np.ndarray) -> np.ndarray:
    """Energy of all masses, J, (n,): where they are over the bed, summed up link by link."""
    poses = link_poses(machine, positions)
    home = machine.machine_frame
    up = home[:3, :3] @ np.array(machine.vertical)

    def height(link: str | None, place: np.ndarray) -> np.ndarray:
        pose = np.broadcast_to(np.eye(4), (len(positions), 4, 4)) if link is None else poses[link]
        return (np.linalg.inv(poses["bed"]) @ pose @ np.append(place, 1.0))[:, :3] @ up

    standing = (home @ np.append(machine.load.centre, 1.0))[:3]
    energy = machine.load.mass * height(None, standing)
    for axis in machine.axes:
        # A linear axis's mass contains those that it carries; they are left out here.
        if axis.moved_mass is not None:
            place = (home @ np.append(axis.mass_centre or (0.0, 0.0, 0.0), 1.0))[:3]
            energy = energy + axis.moved_mass * height(axis.letter, place)
    return G / 1000.0 * energy


TILTED = {"A": Line((1.0, 0.0, 0.0), (0.0, 20.0, -35.0)), "C": Line((0.0, 0.0, 1.0), (3.0, -4.0, 0.0))}


@pytest.mark.parametrize("code", ["640123", "601234", "012364", "361024"])
@pytest.mark.parametrize("vertical", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0)])
def test_gravity_is_the_slope_of_the_potential_energy(code, vertical):
    parsed = Machine.from_code(code)
    machine = replace(parsed, chain=Chain.from_code(parsed.code, TILTED), vertical=vertical)
    # Only the axis nearest the workpiece or the tool has a mass: nothing is carried twice.
    outermost = {parsed.code.letters[0], parsed.code.letters[-1]} & set("AC")
    masses = {c: {"moved_mass": 30.0, "mass_centre": (10.0, 25.0, -60.0)} for c in outermost}
    machine = with_axes(machine, **masses).with_setup((5.0, 6.0, 7.0), (10.0, 20.0, 30.0))
    machine = machine.with_load(17.0, (40.0, -12.0, 33.0))
    positions = RNG.uniform(-1.0, 1.0, (6, 5)) * [100.0, 100.0, 100.0, 2.0, 2.0]
    found, h = gravity_forces(machine, positions), 1e-4
    for column, axis in enumerate(machine.axes):
        step = h * np.eye(5)[column]
        slope = (potential(machine, positions + step) - potential(machine, positions - step)) / (2.0 * h)
        if axis.letter not in outermost:
            # An axis without moved_mass in its file moves nothing.
            slope = slope - _carried(machine, positions, column, h)
        np.testing.assert_allclose(found[:, column], slope, atol=2e-6)


def _carried(machine: Machine, positions: np.ndarray, column: int, h: float) -> np.ndarray:
    """Slope of what the axes' own masses alone do along a column: it isn't the load's."""
    bare = machine.with_load(0.0)
    step = h * np.eye(5)[column]
    return (potential(bare, positions + step) - potential(bare, positions - step)) / (2.0 * h)


def test_a_rising_head_bears_its_weight_and_a_rising_table_the_load_too():
    head = with_axes(Machine.from_code("640123"), Z={"moved_mass": 300.0}).with_load(50.0)
    table = with_axes(Machine.from_code("364012"), Z={"moved_mass": 300.0}).with_load(50.0)
    still = np.zeros((1, 5))
    assert gravity_forces(head, still)[0, 2] == pytest.approx(300.0 * G / 1000.0)
    # The table goes down while Z, tool relative to workpiece, grows.
    assert gravity_forces(table, still)[0, 2] == pytest.approx(-350.0 * G / 1000.0)
    np.testing.assert_allclose(moved_weights(table)[2], 350.0 * G)


def test_travel_costs_are_the_power_of_a_steady_move_over_its_speed():
    machine = Machine.from_code("640123")
    friction = FrictionDrive(friction=0.2, viscous=1e-4, efficiency=0.8, regeneration=0.3, copper=20.0)
    drives = {c: {"drive": DirectionalDrive(30.0, 20.0)} for c in "AC"} | {
        "X": {"drive": WeightDrive(0.2, 0.04), "moved_mass": 300.0},
        "Y": {"drive": AffineDrive((0.5, 40.0), (0.4, 30.0))},
        "Z": {"drive": friction, "moved_mass": 100.0},
    }
    machine = with_axes(machine, **drives)
    feed = np.array([10.0, 40.0])
    costs = travel_costs(machine, feed)
    still = axis_powers(machine, np.zeros((2, 5)), np.zeros((2, 5)))
    for column in range(5):
        unit = np.eye(5)[column] * (np.pi / 180.0 if column > 2 else 1.0)
        for sign, cost in zip((1.0, -1.0), costs, strict=True):
            speeds = sign * feed[:, None] * unit
            power = axis_powers(machine, np.zeros((2, 5)), speeds) - still
            np.testing.assert_allclose(
                cost[:, column], power[:, column] / np.abs(speeds[:, column]), rtol=1e-12
            )
    assert (costs[0][:, 2] > costs[1][:, 2]).all()


def lossless(load: float = 20.0) -> Machine:
    """A table whose A returns nothing while it brakes and loses nothing while it pushes."""
    drives = {c: {"drive": DirectionalDrive(0.0, 0.0)} for c in "XYZC"} | {"A": {"drive": FrictionDrive()}}
    return with_axes(Machine.from_code("640123"), **drives).with_load(load, (0.0, 0.0, 500.0))


@pytest.mark.parametrize("timed", ["programmed", "law"])
def test_a_long_turn_of_a_tilting_table_lifts_the_part_once(timed):
    """A from 180° to 0 raises a part of 20 kg by 1 m: 196 J, however few the blocks."""
    machine = lossless()
    motion = Motion(
        letters="XYZAC",
        positions=np.array([[0.0, 0.0, 0.0, np.pi, 0.0], [0.0] * 5]),
        feed=np.full(2, 10.0),
        time=np.array([0.0, 18.0]),
        kind=np.zeros(2, dtype=np.int64),
        source=np.arange(2),
    )
    if timed == "law":
        machine = with_axes(machine, A={"drive": FrictionDrive(), "max_acceleration": 0.5})
        joules = law_energies(machine, time_motion(motion, machine))
    else:
        joules = move_powers(machine, motion) * motion.time[:, None]
    assert joules.sum() == pytest.approx(20.0 * G * 1.0, rel=2e-3)


def test_a_drive_that_depends_on_the_moved_mass_is_refused_without_one():
    machine = with_axes(
        Machine.from_code("640123"),
        **{c: {"drive": DirectionalDrive(1.0, 1.0)} for c in "YZAC"},
        X={"drive": WeightDrive(0.2, 0.1)},
    )
    with pytest.raises(MachineError, match=r"drive of X .* moved mass.*\[axes.X.moved_mass\]"):
        travel_costs(machine, np.array([10.0]))
    with pytest.raises(MachineError, match="needs the moved weight"):
        drive_power(WeightDrive(0.2, 0.1), np.array([1.0]))


@pytest.mark.parametrize("code", ["640123", "364012", "641302", "012364", "120354"])
@pytest.mark.parametrize("vertical", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
def test_lifting_is_charged_where_and_as_far_as_an_axis_works_against_gravity(code, vertical):
    masses = {c: {"moved_mass": 1000.0 / G} for c in "XYZ"}
    machine = with_axes(replace(Machine.from_code(code), vertical=vertical), **masses)
    machine = machine.with_setup((5.0, 6.0, 7.0), (10.0, 20.0, 30.0))
    forces = gravity_forces(machine, np.zeros((1, len(machine.axes))))[0]
    plus, minus = lifting_costs(machine, 3.0)
    np.testing.assert_allclose(plus, 3.0 * np.maximum(forces, 0.0), atol=1e-10)
    np.testing.assert_allclose(minus, 3.0 * np.maximum(-forces, 0.0), atol=1e-10)
    # Of three directions at right angles, the shares of the vertical.
    assert np.sum((plus + minus) ** 2) == pytest.approx(9.0)


def test_on_hayashis_machine_nothing_but_z_going_up_is_charged_for_lifting(hayashi):
    plus, minus = lifting_costs(hayashi, 2.5)
    np.testing.assert_array_equal(plus, [0.0, 0.0, 2.5, 0.0, 0.0])
    np.testing.assert_array_equal(minus, np.zeros(5))


def test_an_assumed_slowest_speed_of_a_drive_with_a_constant_power_is_told_once(hayashi):
    assert power_findings(hayashi) == ()
    steady = {"X": AffineDrive((0.1, 5.0), (0.1, 0.0)), "Y": AffineDrive((0.1, 0.0), (0.1, 0.0))}
    drives = {c: replace(d, measured_to=8.0) for c, d in steady.items()}
    drives |= {"Z": WeightDrive(0.3, 0.05), "C": DirectionalDrive(40.0, 40.0)}
    machine = with_axes(hayashi, **{c: {"drive": drive, "moved_mass": 300.0} for c, drive in drives.items()})
    (found,) = power_findings(with_axes(machine, X={"drive": drives["X"], "max_speed": 2.0}))
    assert (found.severity, found.code) == ("note", "slow-speed-assumed")
    assert found.message == (
        "constant powers are assumed to fall in proportion to speed below 120 mm/min (X), 250 mm/min (Z), "
        "250 deg/min (C); state measured_from of these drives in the machine's file"
    )


def test_estimates_say_in_their_own_sentence_below_which_speed_they_fall(hayashi):
    (found,) = power_findings(with_powers(load_machine("umc-750")))
    assert found.code == "powers-estimated"
    falls = (
        "; constant powers are assumed to fall in proportion to speed below 250 mm/min (X Y Z); state masses"
    )
    assert falls in found.message
    # Estimates tell of their own drives only.
    partly = with_axes(hayashi, X={"drive": None}, Z={"drive": DirectionalDrive(5.0, 5.0)})
    texts = {f.code: f.message for f in power_findings(with_powers(partly))}
    assert "below 250 mm/min (X); state masses" in texts["powers-estimated"]
    assert "below 250 mm/min (Z); state measured_from" in texts["slow-speed-assumed"]
