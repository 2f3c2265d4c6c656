"""What a block costs: a constant part at measured speeds, a part for travel, and prices near a solution."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.model import Motion, block_costs, load_machine, motion_energy, with_powers

HAYASHI, TAKISAWA = load_machine("hayashi-640123"), load_machine("takisawa-mac-v3")
# Nobody has measured its drives: they are estimated.
UMC = with_powers(load_machine("umc-750"))


def integral(machine, move, time):
    positions = np.stack([np.zeros(len(machine.axes)), move])
    still = np.zeros(2, dtype=np.int64)
    motion = Motion(machine.letters, positions, np.ones(2), np.array([0.0, time]), still, still)
    return motion_energy(machine, motion).total


def cost(costs, travel):
    """One block's cost by the record's own formula; travel (k,), signed."""
    side = np.where(travel > 0.0, 0, 1)
    at = side, 0, np.arange(len(travel))
    size = np.abs(travel)
    share = np.maximum(np.minimum(1.0, size / costs.slow[0]), size / costs.measured[0])
    return float((costs.slope[at] * size + costs.standing[at] * share).sum())


@pytest.mark.parametrize("machine", [HAYASHI, TAKISAWA], ids=["hayashi", "takisawa"])
@given(st.integers(0, 4), st.floats(0.05, 1.0), st.sampled_from([-1.0, 1.0]), st.floats(4.2, 16.0))
def test_a_block_within_the_measured_speeds_costs_its_integral(machine, axis, share, sign, feed):
    axis %= len(machine.axes)
    costs = block_costs(machine, np.array([feed]), time=np.array([0.1]))
    move = np.zeros(len(machine.axes))
    move[axis] = sign * share * costs.step[0, axis]
    expected = integral(machine, move, 0.1)
    # Drives whose power grows with speed are linearised at the programmed feed.
    assert cost(costs, move) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("machine", [HAYASHI, UMC], ids=["hayashi", "umc"])
@given(
    # Axis speeds in a block, as shares of 1000 mm/min or deg/min: up to ten times the fastest measured one.
    st.lists(st.sampled_from([0.0, 1.0, -1.0]), min_size=5, max_size=5),
    st.lists(st.floats(0.01, 10.0), min_size=5, max_size=5),
    st.floats(60.0, 12_000.0),
    st.floats(1e-3, 2.0),
)
def test_any_block_costs_what_the_program_pays_for_it(machine, signs, speeds, feed, time):
    """Search and program price by one function, also beyond the measured speeds."""
    costs = block_costs(machine, np.array([feed / 60.0]), time=np.array([time]))
    unit = np.where([a.is_rotary for a in machine.axes], np.radians(1.0), 1.0)
    move = np.array(signs) * np.array(speeds) * 1000.0 / 60.0 * unit * time
    assert cost(costs, move) == pytest.approx(integral(machine, move, time), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("machine", [HAYASHI, TAKISAWA, UMC], ids=["hayashi", "takisawa", "umc"])
@given(st.integers(0, 4), st.sampled_from([-1.0, 1.0]), st.floats(1e-9, 20.0))
def test_a_little_more_travel_costs_a_little_more(machine, axis, sign, millimetres):
    """The price has no cliff: what rounding adds to a move is no more than the dearest mm takes."""
    axis %= len(machine.axes)
    costs = block_costs(machine, np.array([10.0]), time=np.array([1.0]))
    unit = np.radians(1.0) if machine.axes[axis].is_rotary else 1.0
    less, more = np.zeros((2, len(machine.axes)))
    less[axis], more[axis] = sign * millimetres * unit, sign * (millimetres + 1e-6) * unit
    steepest = (costs.slope + costs.standing / costs.slow).max(axis=0)[0, axis] * unit
    for price in (lambda move: cost(costs, move), lambda move: integral(machine, move, 1.0)):
        assert 0.0 <= price(more) - price(less) <= 1.001 * steepest * 1e-6 + 1e-9


def test_below_the_slowest_measured_speed_power_is_in_proportion_to_speed():
    move = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    slow = 250.0 / 60.0
    energies = [integral(HAYASHI, move, time) for time in (1.0 / slow, 2.0 / slow, 100.0 / slow)]
    np.testing.assert_allclose(energies, 612.1 / slow)


def test_without_a_stated_speed_250_mm_and_deg_a_minute_are_assumed():
    stated = [replace(a.drive, measured_from=None, measured_to=None) for a in HAYASHI.axes]
    axes = tuple(replace(a, drive=d) for a, d in zip(HAYASHI.axes, stated, strict=True))
    costs = block_costs(replace(HAYASHI, axes=axes), np.array([10.0]), time=np.array([60.0]))
    np.testing.assert_allclose(costs.slow[0], np.where(HAYASHI.is_rotary, np.radians(250.0), 250.0))


def test_near_a_solution_what_creeps_pays_for_its_travel_and_what_moves_has_paid():
    costs = block_costs(HAYASHI, np.array([10.0]), time=np.array([0.1]))
    x, z = HAYASHI.column("X"), HAYASHI.column("Z")
    travel = np.zeros((1, 5))
    travel[0, x] = 0.5 * costs.step[0, x]
    plus, _ = costs.near(travel, 0.01)
    assert plus[0, z] == pytest.approx(costs.standing[0, 0, z] / costs.slow[0, z])
    assert plus[0, x] * 0.01 * costs.step[0, x] <= 0.02 * costs.standing[0, 0, x]


def test_an_axis_faster_than_measured_pays_for_its_travel():
    costs = block_costs(HAYASHI, np.array([10.0]), time=np.array([0.1]))
    z = HAYASHI.column("Z")
    fast = np.zeros((1, 5))
    fast[0, z] = 100.0
    plus, _ = costs.near(fast, 0.01)
    assert plus[0, z] == pytest.approx(612.1 / (1000.0 / 60.0))


def test_two_blocks_at_any_higher_speed_cost_the_same_as_at_the_fastest_measured_one():
    move = np.array([0.0, 0.0, 50.0, 0.0, 0.0])
    lasting = 50.0 / (1000.0 / 60.0)
    energies = [integral(HAYASHI, move, time) for time in (lasting, lasting / 2.0, lasting / 30.0)]
    np.testing.assert_allclose(energies, 612.1 * lasting)


def test_rapid_moves_pay_for_travel_alone():
    costs = block_costs(HAYASHI, np.array([10.0]), np.array([True]), time=np.array([0.0]))
    assert not costs.standing.any()
    assert (costs.slope > 0.0).all()


def test_the_way_back_costs_block_by_block_what_the_way_there_does():
    costs = block_costs(HAYASHI, np.array([5.0, 10.0]), time=np.array([0.1, 0.3]))
    last = block_costs(HAYASHI, np.array([10.0]), time=np.array([0.3]))
    for move in np.diag(last.step[0]):
        assert cost(costs.backwards(), -move) == pytest.approx(cost(last, move), rel=1e-12)


def test_travel_over_several_blocks_costs_what_it_does_in_equal_parts():
    costs = block_costs(UMC, np.full(3, 10.0), time=np.full(3, 0.1))
    for move in np.diag(costs.step[0]):
        assert cost(costs.thinned(np.array([0, 3])), 3.0 * move) == pytest.approx(3.0 * cost(costs, move))
