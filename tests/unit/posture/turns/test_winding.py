"""Rewinds: against brute force over turn numbers, and on paths that wind further than an axis can."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.quick_optimiser import tilt_bounds
from support.travel_optimiser import optimise

from fiveaxis.base.errors import Infeasible
from fiveaxis.model import Limits, Machine, Tool, Toolpath, follow, motion_energy, tool_poses, within_limits
from fiveaxis.model.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.turns.rewinding import endless, insert_rewinds, plan_turns, winding_columns
from fiveaxis.posture.turns.stops import CLEARANCE
from fiveaxis.posture.turns.unwrapped import fewer_turns

HELIX_TURNS = 10


def limited(machine: Machine, degrees: float) -> Machine:
    """The machine with C of ± so many degrees."""
    limits = Limits(-np.radians(degrees), np.radians(degrees))
    return replace(
        machine, axes=tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    )


def helix(links: int = 0, per_turn: int = 36) -> tuple[Toolpath, np.ndarray]:
    """Ten turns round a cylinder, with postures that follow it; so many locations a turn are links."""
    n = HELIX_TURNS * per_turn
    angle = np.arange(n) * TURN / per_turn
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)
    contact = 20.0 * normal + np.outer(np.arange(n) * 0.05, [0.0, 0.0, 1.0])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6), feed_mm_min=600.0)
    # The tool leans out of the cylinder, 45 deg to its normal.
    rotary = np.stack([angle - np.pi / 2.0, np.full(n, np.radians(-45.0))], axis=1)
    air = np.arange(n) % per_turn < links
    if links:
        path = path.with_links(air)
        path = replace(path, pivot=path.pivot + np.where(air[:, None], 60.0 * normal, 0.0))
    return path, rotary


def brute_force(angles, limits, stop, up, down):
    """Least cost over all turn numbers, one on the move to each location and one on the move from it."""
    low, high = limits.low, limits.high
    least, most = np.ceil((low - angles.max()) / TURN) - 1, np.floor((high - angles.min()) / TURN) + 1
    turns = range(int(least), int(most) + 1)

    def fits(i, k):
        return low - ON_LIMIT <= angles[i] + k * TURN <= high + ON_LIMIT

    best = np.inf
    for chosen in itertools.product(turns, repeat=len(angles)):
        cost, here = 0.0, None
        for i, k in enumerate(chosen):
            if not fits(i, k) or (here is not None and not fits(i, here)):
                cost = np.inf
                break
            if here is not None and k != here:
                cost += stop[i] + (k - here) * up if k > here else stop[i] + (here - k) * down
            here = k
        best = min(best, cost)
    return best


def cost_of(turns, stop, up, down):
    before, after = turns
    change = after - before
    return float(
        np.sum(np.where(change != 0, stop, 0.0)[change != 0])
        + np.sum(up * np.maximum(change, 0) + down * np.maximum(-change, 0))
    )


@given(
    angles=st.lists(st.floats(-8.0, 8.0), min_size=2, max_size=5).map(np.cumsum),
    degrees=st.sampled_from([200.0, 360.0, 400.0]),
    data=st.data(),
)
def test_turns_are_chosen_as_by_brute_force(angles, degrees, data):
    n = len(angles)
    prices = st.lists(st.floats(0.0, 50.0), min_size=n, max_size=n).map(np.array)
    stop, up, down = data.draw(prices), data.draw(st.floats(0.0, 50.0)), data.draw(st.floats(0.0, 50.0))
    stop = np.where(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), np.inf, stop)
    limits = Limits(-np.radians(degrees), np.radians(degrees))
    found = plan_turns(angles, limits, stop, up, down)
    least = brute_force(angles, limits, stop, up, down)
    if found is None:
        assert least == np.inf
        return
    # Where the first location is a stop, the search may begin on the other side of it for nothing.
    assert cost_of(found, stop, up, down) == pytest.approx(least, abs=1e-9)
    for turns in found:
        unwrapped = angles + TURN * turns
        assert (np.abs(unwrapped) <= limits.high + 1e-8).all()
    np.testing.assert_array_equal(found[0][1:], found[1][:-1])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_towards_an_open_end_nothing_is_rewound(sign):
    angles = sign * np.linspace(0.0, 60.0, 50)
    limits = Limits(-1.0, np.inf) if sign > 0.0 else Limits(-np.inf, 1.0)
    ones = np.ones(50)
    np.testing.assert_array_equal(plan_turns(angles, limits, ones, 1.0, 1.0), np.zeros((2, 50)))
    # In the other direction it begins as many turns up as it goes down.
    before, after = plan_turns(-angles, limits, ones, 1.0, 1.0)
    np.testing.assert_array_equal(before, after)
    unwrapped = -angles + TURN * after
    assert (unwrapped >= limits.low).all()
    assert (unwrapped <= limits.high).all()


def test_a_rotary_head_rewinds_clear_of_the_part_too(hayashi):
    bare = Machine.from_code("123064")
    drives = {a.letter: a.drive for a in hayashi.axes}
    axes = tuple(replace(a, drive=drives[a.letter]) for a in bare.axes)
    machine = limited(replace(bare, axes=axes).with_tool_length(150.0), 200.0)
    angle = np.linspace(0.0, 2.5 * TURN, 120)
    contact = np.stack([30.0 * np.cos(angle), 30.0 * np.sin(angle), np.zeros(120)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (120, 1)), Tool.ball(6))
    rotary = np.stack([angle, np.full(120, np.radians(40.0))], axis=1)
    found = insert_rewinds(path, machine, rotary)
    assert found.rewinds
    motion = follow(found.toolpath, machine, found.rotary)
    assert within_limits(machine, motion.positions).all()
    for row in np.flatnonzero(np.abs(motion.moves[:, machine.column("C")]) > 6.0):
        shares = np.linspace(0.0, 1.0, 73)[:, None]
        tip, axis = tool_poses(machine, motion.positions[row - 1] + shares * motion.moves[row])
        along = tip[:, None] + np.linspace(0.0, 300.0, 101)[None, :, None] * axis[:, None]
        gap = np.linalg.norm(along[:, :, None] - contact[None, None, ::5], axis=-1).min()
        assert gap >= 3.0 + CLEARANCE - 1e-6


def test_a_path_that_fits_is_left_as_it_is(hayashi):
    path, rotary = helix()
    rotary = rotary[:30]
    found = insert_rewinds(path.at(np.arange(30)), limited(hayashi, 400), rotary)
    assert found.rewinds == ()
    assert len(found.toolpath) == 30
    np.testing.assert_allclose(np.remainder(found.rotary[:, 0] - rotary[:, 0] + 1.0, TURN), 1.0, atol=1e-9)


@pytest.mark.parametrize("degrees", [200.0, 360.0, 400.0])
def test_a_helix_of_ten_turns_is_rewound_as_often_as_needed_and_no_more(hayashi, degrees):
    machine = limited(hayashi, degrees)
    path, rotary = helix()
    found = insert_rewinds(path, machine, rotary)
    motion = follow(found.toolpath, machine, found.rotary)
    assert within_limits(machine, motion.positions).all()
    # Begun as low as the range allows and ended as high: fewer turns of rewinds aren't possible.
    first, last = np.degrees(rotary[[0, -1], 0])
    least = np.ceil((last - degrees) / 360.0) + np.ceil((-degrees - first) / 360.0)
    assert sum(abs(r.turns) for r in found.rewinds) == least
    assert all(r.in_cut and r.retract > 0.0 for r in found.rewinds)
    links = found.toolpath.kind != 0
    assert links.sum() == 3 * len(found.rewinds)
    turned = np.abs(motion.moves[:, machine.column("C")])
    assert turned[~links].max() < np.radians(15.0)


def test_the_contact_is_where_it_was_and_the_tool_far_off_while_c_rewinds(hayashi):
    machine = limited(hayashi, 400.0)
    path, rotary = helix()
    found = insert_rewinds(path, machine, rotary)
    motion = follow(found.toolpath, machine, found.rotary)
    own = np.flatnonzero(found.own)
    np.testing.assert_allclose(found.toolpath.pivot[own], path.pivot, atol=1e-12)
    turning = np.flatnonzero(np.abs(motion.moves[:, machine.column("C")]) > TURN - 1e-6)
    assert len(turning) == len(found.rewinds) >= 1
    for row in turning:
        shares = np.linspace(0.0, 1.0, 73)[:, None]
        swept = motion.positions[row - 1] + shares * motion.moves[row]
        tip, axis = tool_poses(machine, swept)
        # Every point of the tool's axis, from every angle of the turn, against everything that is cut.
        along = tip[:, None] + np.linspace(0.0, 200.0, 101)[None, :, None] * axis[:, None]
        gap = np.linalg.norm(along[:, :, None] - path.contact[None, None, ::9], axis=-1).min()
        assert gap >= 3.0 + CLEARANCE - 1e-6


def test_rewinds_take_place_where_the_tool_is_clear_if_possible(hayashi):
    machine = limited(hayashi, 400.0)
    path, rotary = helix(links=6)
    found = insert_rewinds(path, machine, rotary)
    assert found.rewinds
    assert not any(r.in_cut for r in found.rewinds)
    notes = found.findings()
    assert {(f.code, f.severity.value) for f in notes} == {("rewind", "note")}


def test_the_reported_cost_of_a_rewind_is_what_it_adds(hayashi):
    machine = limited(hayashi, 400.0)
    path, rotary = helix()
    found = insert_rewinds(path, machine, rotary)
    without = motion_energy(machine, follow(path, machine, rotary))
    with_them = motion_energy(machine, follow(found.toolpath, machine, found.rotary))
    assert with_them.total == pytest.approx(without.total + found.energy, rel=1e-9)
    assert with_them.time == pytest.approx(without.time + found.time, rel=1e-6)


def test_blocks_are_not_inserted_into_a_turn_on_the_spot(hayashi):
    machine = limited(hayashi, 400.0)
    path, rotary = helix()
    found = insert_rewinds(path, machine, rotary)
    filled, motion, _ = fill_in(found.toolpath, machine, found.rotary)
    turned = np.abs(motion.moves[:, machine.column("C")])
    assert (turned > TURN - 1e-6).sum() == len(found.rewinds)
    assert within_limits(machine, motion.positions).all()
    linear = np.abs(motion.moves[turned > TURN - 1e-6][:, machine.linear_columns])
    assert linear.max() < 1e-9
    assert len(filled) >= len(found.toolpath)


def test_without_room_to_back_off_the_error_names_the_axis_and_its_range(hayashi):
    low = tuple(
        replace(a, limits=Limits(-1.0, 1.0)) if a.letter == "Z" else a for a in limited(hayashi, 400.0).axes
    )
    path, rotary = helix()
    with pytest.raises(Infeasible, match="C winds through 3590 deg and has 800 deg"):
        insert_rewinds(path, replace(hayashi, axes=low), rotary)


def test_only_axes_with_a_whole_turn_wind(hayashi):
    assert winding_columns(hayashi) == []
    assert winding_columns(limited(hayashi, 170.0)) == []
    machine = limited(hayashi, 200.0)
    assert winding_columns(machine) == [machine.column("C")]
    assert endless(machine).axis("C").limits.unlimited
    assert endless(machine).axis("A") == machine.axis("A")


@pytest.mark.slow
def test_a_path_that_winds_further_than_c_can_is_optimised_with_rewinds(hayashi):
    machine = limited(hayashi, 200.0)
    path, _ = helix()
    path = path.at(np.arange(80))
    solution = optimise(path, machine, tilt=(15, 75))
    assert solution.residuals()["limit"] <= 1e-9
    assert solution.residuals()["tilt"] <= 1e-9
    rewinds = [f for f in solution.toolpath.findings if f.code == "rewind"]
    assert 1 <= len(rewinds) <= 3
    # Each has a link, on which the tool backs off.
    assert np.count_nonzero(np.diff(solution.toolpath.cutting.astype(int)) < 0) == len(rewinds)
    cuts = solution.motion.cutting
    turned = np.abs(solution.motion.moves[cuts][:, machine.column("C")])
    assert turned.max() <= np.radians(15.0) + 1e-9
    for name, baseline in solution.compared.items():
        # Constant lead and lean leave the range by 0.005 deg between two locations.
        leaves = name == "lead-lean"
        assert leaves or solution.energy.travel <= baseline.energy.travel * (1.0 + 1e-9), name
        # A baseline has its own rewinds.
        fill_in(baseline.toolpath, machine, baseline.motion.positions[:, machine.rotary_columns])


def test_a_path_is_drawn_into_fewer_turns_where_that_saves_a_rewind(hayashi):
    """From -90 to 310 deg a range of ±200 deg needs a rewind; drawn in a little it needs none."""
    machine = limited(hayashi, 200.0)
    path, rotary = helix()
    path, rotary = path.at(np.arange(41)), rotary[:41]
    found = insert_rewinds(path, machine, rotary)
    assert len(found.rewinds) == 1
    problem = Problem.build(path, endless(machine), tilt_bounds(path, tilt=(5, 85)))

    def refined(narrow: Problem, start: np.ndarray) -> np.ndarray:
        return refine(narrow, start, iterations=100, barrier=1e-2).rotary

    [(narrow, drawn)] = fewer_turns(problem, machine, rotary, found, refined)
    assert insert_rewinds(path, machine, drawn).rewinds == ()
    assert narrow.violation(drawn) <= 1e-9
    limits = narrow.machine.axis("C").limits
    assert limits.high - limits.low == pytest.approx(np.radians(400.0))
