"""Drilling power: the lips' closed form against their integral, and the tables of its paper.

Tables: Wang, Zhang, Chen, Zhang, Wu, Appl. Sci. 2019, 9(22), 4801, doi 10.3390/app9224801; machine YH850Z,
work GH4169, drill 10 mm.
"""

from itertools import product

import numpy as np
import pytest
from drilling import CUTTING, FEEDS, SPEEDS
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from fiveaxis.base.errors import SettingError, ToolError
from fiveaxis.lab import CuttingCoefficients, Drill
from fiveaxis.lab.cutting.drilling import auxiliary_power, idle_power, mean_drilling_power

REV_MIN = 2.0 * np.pi / 60.0  # rad/s
IDLE = np.array([1221.0, 0.0524 / REV_MIN, 0.0003 / REV_MIN**2])
PAPER = CuttingCoefficients(4196.8, 202.6, thrust=5395.7, thrust_edge=339.2)


def test_no_web_and_no_point_angle_give_the_printed_cutting_powers():
    """The nearest is 2.9 % off, with a web of more than half the drill; a usual one is 50 % off."""

    def worst(web, half_point):
        drill = Drill(10.0, web, half_point)
        shares = [
            mean_drilling_power(drill, PAPER, n * FEEDS[[0, 3]] / 60.0, n * REV_MIN) / cut[[0, 3]] - 1.0
            for n, cut in zip(SPEEDS[[0, 3]], CUTTING[[0, 3]], strict=True)
        ]
        return np.abs(shares).max()

    grid = product(np.linspace(0.0, 9.5, 39), np.radians(np.linspace(20.0, 90.0, 36)))
    error, web = min((worst(web, half), web) for web, half in grid)
    assert error == pytest.approx(0.029, abs=1e-3)
    assert web > 5.0
    assert worst(1.5, np.radians(59.0)) > 0.5


drills = st.builds(
    lambda diameter, share, half, lips: Drill(diameter, share * diameter, half, lips),
    st.floats(0.5, 50.0),
    st.floats(0.0, 0.9),
    st.floats(0.2, np.pi / 2.0),
    st.integers(1, 4),
)


@given(drills, st.floats(0.01, 0.4), st.floats(5.0, 500.0))
def test_the_power_is_the_integral_over_the_lips(drill, advance, spindle):
    """f ΣdF_z + ΣV(r) dF_t with dF = (K_c h + K_e) db, h = (c/Z) sinκ and db = dr/sinκ, on Z lips."""
    sine, feed = np.sin(drill.half_point), advance * spindle / (2.0 * np.pi)
    chip = advance / drill.lips * sine

    def element(r):
        tangential = (PAPER.tangential * chip + PAPER.tangential_edge) / sine
        thrust = (PAPER.thrust * chip + PAPER.thrust_edge) / sine
        return drill.lips * (spindle * r * tangential + feed * thrust)

    expected = quad(element, drill.web / 2.0, drill.diameter / 2.0)[0] / 1e3
    assert mean_drilling_power(drill, PAPER, feed, spindle) == pytest.approx(expected, rel=1e-9)


def test_sharp_lips_take_the_coefficient_times_the_removal_rate():
    """Without web and edge forces, as in milling: P = K_tc MRR, with MRR = π d² f/4."""
    feed = 76.4 / 60.0
    power = mean_drilling_power(Drill(10.0), CuttingCoefficients(4196.8), feed, 400.0 * REV_MIN)
    assert power == pytest.approx(4196.8 * np.pi / 4.0 * 10.0**2 * feed / 1e3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"diameter": -1.0}, "drill diameter is -1 mm; give a number above 0"),
        ({"web": 10.0}, "web is 10 mm; it must be below the drill diameter 10 mm"),
        ({"web": -1.0}, "web is -1 mm; give 0 mm or more"),
        ({"half_point": 59.0}, "half point angle is 3380.45 deg; it must lie above 0"),
        ({"lips": 0}, "number of lips is 0; give a whole number"),
    ],
)
def test_an_impossible_drill_is_refused(arguments, message):
    with pytest.raises(ToolError, match=message):
        Drill(**{"diameter": 10.0} | arguments)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: CuttingCoefficients(1.0, thrust=-1.0), "thrust cutting coefficient is -1 N/mm²"),
        (lambda: CuttingCoefficients(1.0, thrust_edge=-1.0), "thrust edge coefficient is -1 N/mm"),
        (lambda: mean_drilling_power(Drill(10.0), PAPER, 0.0, 40.0), "feed is 0 mm/s; give a number above 0"),
        (lambda: mean_drilling_power(Drill(10.0), PAPER, 1.0, -40.0), "spindle speed is -40 rad/s"),
        (
            lambda: mean_drilling_power(Drill(10.0), PAPER, 76.4, 40.0),
            "feed per turn is 12.0.* above 10 mm; check",
        ),
        (lambda: idle_power(40.0, [1.0, 2.0]), "idle power has 2 coefficients"),
        (lambda: idle_power(-40.0, IDLE), "spindle speed is -40 rad/s; give 0"),
        (lambda: auxiliary_power([1.0, -2.0], 0.1), r"cutting power is -2 W \(value 2 of 2\)"),
        (lambda: auxiliary_power(1.0, np.nan), r"auxiliary coefficient is nan W/W \(value 1 of 2\)"),
    ],
)
def test_a_figure_out_of_its_range_is_named_with_its_bound(call, message):
    with pytest.raises(SettingError, match=message):
        call()
