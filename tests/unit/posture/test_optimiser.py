"""The whole optimiser: cases with known numbers, laws, and infeasible paths."""

from dataclasses import replace

import numpy as np
import pytest
from support.ring_path import ring
from support.travel_optimiser import optimise

from fiveaxis.base import angle_between
from fiveaxis.base.errors import Infeasible, MachineError, SettingError, ToolpathError
from fiveaxis.check import verify
from fiveaxis.check.verification.model import tool_poses as pinocchio_poses
from fiveaxis.model import Limits, Machine, Tool, Toolpath, parse_tool, tool_axes

TOLERANCE = 1e-9


@pytest.fixture(scope="module")
def plain(hayashi):
    """The ring as it is solved on a machine without limits of C."""
    return optimise(ring(), hayashi, tilt=(15, 75), effort="normal")


def assert_sound(solution):
    residuals = solution.residuals()
    assert residuals["tilt"] <= TOLERANCE
    assert residuals["limit"] <= TOLERANCE
    assert residuals["contact"] <= 1e-9
    for name, energy in solution.baselines.items():
        assert solution.energy.travel <= energy.travel * (1 + 1e-9), name


@pytest.mark.slow
def test_the_dome_is_solved_with_and_without_a_bound_on_turns(hayashi, dome):
    free = optimise(dome, hayashi, tilt=(10, 70), max_turn=360.0, effort="quick")
    # Fast turns, over which the tool would hop out of its range between two locations, aren't taken.
    assert "between-locations" not in {finding.code for finding in free.toolpath.findings}
    assert_sound(free)
    bounded = optimise(dome, hayashi, tilt=(10, 70), effort="normal")
    assert_sound(bounded)
    turns = np.abs(bounded.motion.moves[:, hayashi.rotary_columns])
    assert np.degrees(turns.max()) <= 15.0 + 1e-6
    assert bounded.energy.travel < 33_000.0


def test_a_small_path_is_sound_and_has_a_record_of_the_solver(plain):
    solution = plain
    assert_sound(solution)
    names = [stage.name for stage in solution.stages]
    assert names[0] == "path to begin with"
    assert {name.split()[0] for name in names[1:]} >= {"search", "program,"}
    assert min(stage.after for stage in solution.stages[1:]) <= solution.energy.travel * (1.0 + 1e-3)


def test_the_other_solver_ends_as_low_and_both_where_nothing_is_left_to_gain(hayashi, plain):
    other = optimise(ring(), hayashi, tilt=(15, 75), effort="normal", solver="ipopt")
    assert_sound(other)
    assert other.energy.travel == pytest.approx(plain.energy.travel, rel=1e-2)
    for solution in (plain, other):
        assert solution.kkt.dual < 1.0
        assert solution.kkt.primal <= TOLERANCE
        assert solution.kkt.complementarity < 1e-3
    with pytest.raises(SettingError, match="solver = 'simplex' is unknown; give 'structured' or 'ipopt'"):
        optimise(ring(), hayashi, tilt=(15, 75), solver="simplex")


def test_no_axis_turns_farther_than_allowed(hayashi):
    solution = optimise(ring(), hayashi, tilt=(15, 75), max_turn=6.0)
    turns = np.degrees(np.abs(solution.motion.moves[:, hayashi.rotary_columns]))
    assert turns.max() <= 6.0 + 1e-6
    assert_sound(solution)


def test_links_are_bounded_by_limits_alone(hayashi):
    path = ring()
    links = np.zeros(len(path), dtype=bool)
    links[30:50] = True
    bounds = {"tilt": (40, 45), "max_turn": 45.0, "effort": "quick"}
    whole = optimise(path, hayashi, **bounds)
    solution = optimise(path.with_links(links), hayashi, **bounds)
    assert_sound(solution)
    assert solution.travel < whole.travel
    given = solution.motion.positions[~solution.toolpath.inserted][:, hayashi.rotary_columns]
    lean = np.degrees(angle_between(tool_axes(hayashi, given), path.normal))
    outside = (lean < 40.0 - 1e-6) | (lean > 45.0 + 1e-6)
    assert outside[links].any()
    assert not outside[~links].any()


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_shortest_paths_have_a_posture_too(hayashi, n):
    solution = optimise(ring(200).at(np.arange(n)), hayashi, tilt=(15, 75))
    assert len(solution.motion) == n
    assert_sound(solution)


def test_standing_still_costs_nothing(hayashi):
    path = ring().at(np.array([7, 7]))
    assert optimise(path, hayashi, tilt=(15, 75)).energy.travel == pytest.approx(0.0, abs=1e-6)


def test_a_limited_c_keeps_its_turn_and_offsets_are_respected(trunnion, hayashi):
    """C of the simulated trunnion goes ±100 turns, A −50…100, and its axes don't meet."""
    machine = trunnion.with_drives_of(hayashi)
    path = ring(n_z=0.3)
    turned = Toolpath.from_contacts(np.tile(path.contact, (3, 1)), np.tile(path.normal, (3, 1)), path.tool)
    solution = optimise(turned, machine, tilt=(5, 60))
    assert_sound(solution)
    c = solution.motion.positions[:, machine.column("C")]
    assert np.ptp(c) > 2.0 * 2.0 * np.pi
    # It starts near 0, not at the end of its range, though the travel metric would be the same.
    assert np.abs(c).max() < 4.0 * 2.0 * np.pi


@pytest.mark.parametrize("code", ["650123", "601235", "123045", "102653"])
def test_other_structures_are_optimised_alike(code, hayashi):
    bare = Machine.from_code(code)
    donor = {a.letter: a.drive for a in hayashi.axes}
    donor["B"] = donor["A"]
    axes = tuple(replace(a, drive=donor[a.letter]) for a in bare.axes)
    solution = optimise(ring(n_z=0.2), replace(bare, axes=axes), tilt=(5, 60))
    assert_sound(solution)


def test_a_programmed_path_is_leaned_within_its_cone(hayashi):
    turn = np.linspace(0.0, 2.0 * np.pi, 90)
    axis = np.stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), np.full(90, np.sqrt(0.75))], axis=1)
    solution = optimise(Toolpath.from_tips(30.0 * axis, axis, Tool.ball(6)), hayashi, cone=20)
    assert_sound(solution)
    assert solution.energy.travel < solution.baselines["as-programmed"].total


def test_locations_out_of_reach_are_listed_each_with_its_reason(hayashi):
    normal = ring().normal.copy()
    normal[[3, 40]] = [0.0, 0.0, -1.0]  # straight down: A would have to go beyond -120 deg
    path = Toolpath.from_contacts(ring().contact, normal, Tool.ball(6), name="ring.csv")
    with pytest.raises(Infeasible, match="2 of 80 locations have no admissible posture") as caught:
        optimise(path, hayashi, tilt=(15, 50))
    findings = caught.value.findings
    assert [f.place.location for f in findings] == [3, 40]
    assert str(findings[0]).startswith("ring.csv, location 3: no tool axis within 15…50 deg of the normal")
    assert "limit -120 deg" in findings[0].message
    # 180 − 50 = 130 deg is the least that A would need.
    assert findings[0].value == pytest.approx(10.0, abs=0.1)


def test_impossible_input_is_refused(hayashi, trunnion):
    path = ring()
    with pytest.raises(SettingError, match=r"75…15 deg is empty, reversed"):
        optimise(path, hayashi, tilt=(75, 15))
    with pytest.raises(SettingError, match=r"tilt range 15…75 deg is never met: .* by 85\.06…89 deg"):
        optimise(path, hayashi, tilt=(15, 75), lead=(60, 70), lean=(85, 89))
    with pytest.raises(SettingError, match=r"tilt range 30…60 deg is never met: .* by 0…20.08 deg"):
        optimise(path, hayashi, tilt=(30, 60), lead=(-2, 2), lean=(0, 20))
    with pytest.raises(SettingError, match="give either tilt"):
        optimise(path, hayashi)
    with pytest.raises(ToolpathError, match="no programmed tool axes"):
        optimise(path, hayashi, cone=20)
    with pytest.raises(MachineError, match="only spins the tool"):
        optimise(path, Machine.from_code("401236"), tilt=(15, 75))
    with pytest.raises(SettingError, match="up_penalty = -1 J/mm is out of range; give 0 J/mm or more"):
        optimise(path, hayashi, tilt=(15, 75), up_penalty=-1.0)


def upright_y(machine: Machine) -> tuple[Machine, str, float]:
    """A horizontal machine: the head goes up along Y."""
    return replace(machine, vertical=(0.0, 1.0, 0.0)), "Y", 1.0


def knee(machine: Machine) -> tuple[Machine, str, float]:
    """A knee: the table goes up along Z, whose value (tool relative to workpiece) falls then."""
    bare = Machine.from_code("641302")
    return replace(bare, axes=tuple(machine.axis(a.letter) for a in bare.axes)), "Z", -1.0


@pytest.mark.parametrize(("made", "objective"), [(upright_y, "energy"), (knee, "travel"), (knee, "time")])
def test_the_up_penalty_keeps_down_what_the_vertical_axis_lifts(hayashi, made, objective):
    machine, letter, upwards = made(hayashi)
    axes = (replace(a, max_speed=1.5 if a.is_rotary else 100.0) for a in machine.axes)
    machine = replace(machine, axes=tuple(axes))

    def lifted(penalty: float) -> float:
        told = {"objective": objective, "up_penalty": penalty, "effort": "quick", "max_turn": 30.0}
        motion = optimise(ring(40), machine, tilt=(15, 75), **told).motion
        return float(np.maximum(upwards * motion.moves[:, machine.column(letter)], 0.0).sum())

    least = lifted(100.0)
    assert least < 1e-5
    assert least <= lifted(0.0) + 1e-6


def test_a_link_turns_farther_than_it_should_only_where_it_must(hayashi):
    """Two cuts on opposite sides, joined by a single link location: C has to go half round in two steps."""
    angle = np.concatenate([np.linspace(0.0, 0.2, 10), [0.2], np.linspace(np.pi, np.pi + 0.2, 10)])
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(21, -0.3)], axis=1)
    links = np.zeros(21, dtype=bool)
    links[10] = True
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6)).with_links(links)
    solution = optimise(path, hayashi, tilt=(15, 40), max_turn=5.0)
    assert solution.residuals()["tilt"] <= TOLERANCE
    given = solution.motion.positions[~solution.toolpath.inserted][:, hayashi.rotary_columns]
    turns = np.degrees(np.abs(np.diff(given, axis=0, prepend=given[:1]))).max(axis=1)
    assert turns[~links].max() <= 5.0 + 1e-6
    assert turns[10] > 45.0


def with_c(machine: Machine, low: float, high: float) -> Machine:
    limits = Limits(np.radians(low), np.radians(high))
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


@pytest.mark.parametrize("c", [(-180, 540), (200, 3000)])
def test_where_the_range_of_c_lies_doesnt_matter_as_long_as_it_is_wide(hayashi, plain, c):
    free = plain
    bounded = optimise(ring(), with_c(hayashi, *c), tilt=(15, 75), effort="normal")
    assert_sound(bounded)
    assert bounded.energy.travel == pytest.approx(free.energy.travel, rel=0.02)
    for name, energy in free.baselines.items():
        assert bounded.baselines[name].total == pytest.approx(energy.total, rel=0.02), name


def test_a_path_of_links_only_is_refused_as_such(hayashi):
    path = ring().with_links(np.ones(80, dtype=bool))
    with pytest.raises(ToolpathError, match="has links only"):
        optimise(path, hayashi, tilt=(15, 75))


def test_an_unreachable_sequence_names_the_bound_on_turns(hayashi):
    # 30 deg between neighbours, and at most 15 deg of turn.
    with pytest.raises(Infeasible) as caught:
        optimise(ring(12), hayashi, tilt=(15, 75))
    assert "--max-turn" in " ".join([str(caught.value), *(f.message for f in caught.value.findings)])
    assert_sound(optimise(ring(12), hayashi, tilt=(15, 75), max_turn=60.0))


@pytest.mark.parametrize(
    ("text", "tilt"), [("bull:6:1", (15, 75)), ("flat:6", (5, 60)), ("taper:3:4:8", (15, 75))]
)
def test_any_cutter_keeps_the_contacts_of_the_path(hayashi, text, tilt):
    path, tool = ring(), parse_tool(text)
    solution = optimise(Toolpath.from_contacts(path.contact, path.normal, tool), hayashi, tilt=tilt)
    assert_sound(solution)
    tip, axis = pinocchio_poses(hayashi, solution.motion.positions)
    given = ~solution.toolpath.inserted
    touched = tool.cutter.contacts(tip[given], path.normal, axis[given])
    np.testing.assert_allclose(touched, path.contact, atol=1e-8)
    assert verify(solution.motion, hayashi, solution.toolpath, tilt=tilt).ok


def test_a_cone_about_the_programmed_axis_keeps_a_bull_nose_on_its_corner(hayashi):
    path, tool = ring(), Tool.bull(6, 1)
    side = np.cross(path.normal, [0.0, 0.0, 1.0])
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    lean = np.radians(82.0)
    axis = np.cos(lean) * path.normal + np.sin(lean) * np.cross(side, path.normal)
    tip = tool.cutter.tips(path.contact, path.normal, axis)
    programmed = Toolpath.from_tips(tip, axis, tool).touching_at(path.normal)
    solution = optimise(programmed, hayashi, cone=20)
    assert_sound(solution)
    given = solution.toolpath.at(np.flatnonzero(~solution.toolpath.inserted))
    _, found = pinocchio_poses(hayashi, solution.motion.positions[~solution.toolpath.inserted])
    # The cone alone would let the tool lean to 102 deg, where a bull nose doesn't touch with its corner.
    assert np.sum(found * path.normal, axis=1).min() >= -1e-9
    assert np.degrees(np.arccos(np.sum(found * axis, axis=1).clip(-1, 1))).max() <= 20.0 + 1e-6
    touched = tool.cutter.contacts(given.tips(found), path.normal, found)
    np.testing.assert_allclose(touched, path.contact, atol=1e-8)
