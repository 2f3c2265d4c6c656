"""Milling power from formulas and wrench records: identities, independent quadrature, units."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad
from wrench import (
    absolute_sum_power,
    cutter_positions,
    net_power,
    revolution_average,
    rotation_angles,
    tooth_positions,
    tooth_velocities,
    transport_moment,
    transport_velocity,
    wrench_power,
)

from fiveaxis.base.errors import SettingError

# The paper's face mill: 63 mm, one tooth, 120 m/min, 0.1 mm/rev.
RADIUS = 31.5  # mm
CUTTING_SPEED = 120.0 * 1e3 / 60.0  # mm/s
SPIN = -CUTTING_SPEED / RADIUS  # rad/s, clockwise
FEED = 0.1 * CUTTING_SPEED / (2.0 * np.pi * RADIUS)  # mm/s
ROUNDING = 1e-9

vectors = arrays(float, (4, 3), elements=st.floats(-1e3, 1e3, allow_subnormal=False))


def power_scale(force, moment, velocity, turning, old, new):
    """Largest product in the sums, W: what rounding is measured against."""
    size = [np.linalg.norm(v, axis=-1) for v in (force, moment, velocity, turning, new - old)]
    return (size[0] * size[2] + size[1] * size[3] + 2.0 * size[0] * size[3] * size[4]) / 1e3 + 1e-9


@given(vectors, vectors, vectors, vectors, vectors, vectors)
def test_wrench_power_is_the_same_at_every_point_when_moment_and_velocity_both_move(
    force, moment, velocity, turning, old, new
):
    here = wrench_power(force, moment, velocity, turning)
    there = wrench_power(
        force,
        transport_moment(force, moment, old, new),
        transport_velocity(velocity, turning, old, new),
        turning,
    )
    scale = power_scale(force, moment, velocity, turning, old, new)
    assert (np.abs(here - there) <= 1e-12 * scale).all()


@given(vectors, vectors, vectors, vectors, vectors, vectors)
def test_the_absolute_sum_is_never_below_the_wrench_power_of_any_point(
    force, moment, velocity, turning, old, new
):
    scale = power_scale(force, moment, velocity, turning, old, new)
    moment_there = transport_moment(force, moment, old, new)
    velocity_there = transport_velocity(velocity, turning, old, new)
    true = np.abs(wrench_power(force, moment, velocity, turning))
    assert (absolute_sum_power(force, moment_there, velocity_there, turning) >= true - 1e-12 * scale).all()


@given(vectors, vectors, vectors, vectors)
def test_moving_a_moment_there_and_back_leaves_it(force, moment, old, new):
    there = transport_moment(force, moment, old, new)
    np.testing.assert_allclose(transport_moment(force, there, new, old), moment, atol=1e-8)


def test_a_force_has_no_moment_about_its_own_point_and_arm_times_force_about_another():
    """The arm runs from the new point to the old: F_y at x = 2 turns positively about the origin."""
    force, at, origin = np.array([0.0, 5.0, 0.0]), np.array([2.0, 0.0, 0.0]), np.zeros(3)
    np.testing.assert_allclose(transport_moment(force, np.zeros(3), at, origin), [0.0, 0.0, 10.0])


def test_the_absolute_sum_depends_on_the_point():
    """A tangential force alone: all of its power is moment at the centre and translation at the tooth.

    Midway between them, or beyond, opposite terms lose their signs and the sum grows.
    """
    force, turning = np.array([0.0, 100.0, 0.0]), np.array([0.0, 0.0, 10.0])
    tooth, velocity = np.array([2.0, 0.0, 0.0]), np.array([0.0, 20.0, 0.0])
    beyond = np.array([-2.0, 0.0, 0.0])
    moment_there = transport_moment(force, np.zeros(3), tooth, beyond)
    velocity_there = transport_velocity(velocity, turning, tooth, beyond)
    assert wrench_power(force, np.zeros(3), velocity, turning) == pytest.approx(2.0)
    assert absolute_sum_power(force, np.zeros(3), velocity, turning) == pytest.approx(2.0)
    assert wrench_power(force, moment_there, velocity_there, turning) == pytest.approx(2.0)
    assert absolute_sum_power(force, moment_there, velocity_there, turning) == pytest.approx(6.0)


def test_the_tooths_velocity_is_the_slope_of_its_position():
    time = np.linspace(0.0, 0.1, 60_001)
    centre = cutter_positions([1.0, 2.0, 3.0], FEED, time)
    angle = rotation_angles(SPIN, time, start=0.3)
    slope = np.gradient(tooth_positions(centre, angle, RADIUS), time, axis=0)[1:-1]
    velocity = tooth_velocities(angle, SPIN, RADIUS, FEED)[1:-1]
    np.testing.assert_allclose(slope, velocity, atol=1e-5 * CUTTING_SPEED)


def test_the_angle_grows_by_six_degrees_per_rev_per_minute_and_second():
    """Δθ = 6 n Δt, as printed, in deg and rev/min."""
    rev_min, seconds = 606.3, 0.25
    angle = rotation_angles(rev_min * 2.0 * np.pi / 60.0, [seconds])
    assert np.degrees(angle) == pytest.approx(6.0 * rev_min * seconds)
    assert cutter_positions(np.zeros(3), 90.0 / 60.0, [2.0])[0, 0] == pytest.approx(90.0 * 2.0 / 60.0)


def synthetic_record(angle):
    """A wrench with every term of Eq. (17) alive: force (N) and moment (N·mm) by tooth angle."""
    zero = np.zeros_like(angle)
    force = np.stack([400.0 * np.sin(angle) + 90.0, 250.0 * np.cos(2.0 * angle), 30.0 + zero], axis=-1)
    moment = np.stack([50.0 + zero, 70.0 + zero, 9e3 + 4e3 * np.cos(angle)], axis=-1)
    return force, moment


def printed_equation_17(angle):
    """Eq. (17) as printed, in W with m/s and N·m."""
    speed, feed = 2.0, 0.001 * FEED
    fx, fy = 400.0 * np.sin(angle) + 90.0, 250.0 * np.cos(2.0 * angle)
    torque, spindle = 9.0 + 4.0 * np.cos(angle), speed / 0.0315
    return abs(fx * (speed * np.sin(angle) + feed)) + abs(fy * speed * np.cos(angle)) + abs(torque * spindle)


def test_equation_17_is_the_absolute_sum_at_the_tooth_of_a_clockwise_spindle():
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    force, moment = synthetic_record(angle)
    velocity = tooth_velocities(angle, SPIN, RADIUS, FEED)
    power = absolute_sum_power(force, moment, velocity, np.array([0.0, 0.0, SPIN]))
    np.testing.assert_allclose(power, printed_equation_17(angle), rtol=ROUNDING)


def test_the_average_of_a_record_is_that_of_independent_quadrature():
    turn = 2.0 * np.pi / abs(SPIN)
    time = np.linspace(0.0, 1.3 * turn, 5_001)
    angle = rotation_angles(SPIN, time)
    force, moment = synthetic_record(angle)
    velocity = tooth_velocities(angle, SPIN, RADIUS, FEED)
    power = absolute_sum_power(force, moment, velocity, np.array([0.0, 0.0, SPIN]))
    kinks = np.linspace(-2.0 * np.pi, 0.0, 49)
    pieces = [quad(printed_equation_17, a, b, limit=200)[0] for a, b in pairwise(kinks)]
    assert revolution_average(power, time, SPIN) == pytest.approx(sum(pieces) / (2.0 * np.pi), rel=1e-6)


def test_the_average_cuts_the_last_interval_at_the_turns_end():
    """A ramp's mean over [0, t_rot] is its middle, wherever the samples fall."""
    time = np.array([0.0, 0.3, 0.8, 1.7])
    assert revolution_average(10.0 * time, time, 2.0 * np.pi) == pytest.approx(5.0)


def test_equation_1_in_shop_units_gives_the_same_watts():
    """P_n = a_p a_e v_f k_c/(60·10⁶) kW with mm/min against the inside's mm/s and W."""
    depth, width, feed_mm_min, specific = 2.0, 40.0, 318.0, 2100.0
    kilowatts = depth * width * feed_mm_min * specific / (60.0 * 1e6)
    assert net_power(depth, width, feed_mm_min / 60.0, specific) == pytest.approx(1e3 * kilowatts)


def test_powers_have_the_dimension_of_power():
    """Metre, newton metre and metre per second give watts without a factor."""
    force, moment = np.array([120.0, -40.0, 9.0]), np.array([1.5, 2.5, -7.0])  # N, N·m
    velocity, turning = np.array([1.2, 0.4, -0.3]), np.array([2.0, 3.0, 60.0])  # m/s, rad/s
    watts = force @ velocity + moment @ turning
    assert wrench_power(force, 1e3 * moment, 1e3 * velocity, turning) == pytest.approx(watts)
    # Lengths scaled by s, and forces left: power scales by s, as N·mm/s must.
    assert wrench_power(force, 7e3 * moment, 7e3 * velocity, turning) == pytest.approx(7.0 * watts)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: net_power(-2.0, 40.0, 5.0, 2100.0), "depth of cut is -2 mm; give 0 mm or more"),
        (lambda: net_power(2.0, 40.0, [5.0, np.nan], 2100.0), r"feed is nan mm/s \(value 2 of 2\)"),
        (lambda: net_power(2.0, 40.0, 5.0, 0.0), "specific cutting force is 0 N/mm²; give a number above 0"),
        (lambda: revolution_average([1.0, 1.0], [0.0, 0.4], 6.0), r"lasts 0.4 s, less than one turn of 1.0"),
        (lambda: revolution_average([1.0, 1.0], [0.0, 0.0], 6.0), "time rising"),
        (lambda: revolution_average([1.0], [0.0, 2.0], 6.0), "lists of one length"),
        (lambda: revolution_average([], [], 6.0), "lasts 0 s"),
        (lambda: revolution_average([1.0, 1.0], [0.0, 2.0], 0.0), "spindle speed"),
    ],
)
def test_a_figure_out_of_its_range_is_named_with_its_bound(call, message):
    with pytest.raises(SettingError, match=message):
        call()
