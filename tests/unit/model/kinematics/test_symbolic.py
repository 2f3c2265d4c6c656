"""CasADi's equations are numpy's, and their derivatives are right."""

import casadi as ca
import numpy as np
import pytest

from fiveaxis.base import normalise
from fiveaxis.model import Machine, Tool, linear_positions, load_machine, tool_axes
from fiveaxis.model.kinematics.symbolic import linear_axes_of_posture, tool_axis_of_posture

RNG = np.random.default_rng(7)
RADIUS = 5.0


def functions(machine: Machine) -> tuple[ca.Function, ca.Function]:
    pivot, rotary = ca.SX.sym("pivot", 3), ca.SX.sym("rotary", 2)
    linear = linear_axes_of_posture(machine, pivot, rotary, Tool.ball(2.0 * RADIUS).zone)
    axis = tool_axis_of_posture(machine, rotary)
    return ca.Function("linear", [pivot, rotary], [linear]), ca.Function("axis", [rotary], [axis])


@pytest.mark.parametrize("code", ["640123", "650123", "601235", "123045", "615023", "linuxcnc-xyzac-trt"])
def test_the_symbolic_equations_are_the_numeric_ones(code):
    machine = load_machine(code) if "-" in code else Machine.from_code(code)
    linear, axis = functions(machine)
    for _ in range(20):
        pivot, rotary = RNG.uniform(-50, 50, 3), RNG.uniform(-1.4, 1.4, 2)
        direction = tool_axes(machine, rotary)
        np.testing.assert_allclose(np.array(axis(rotary)).ravel(), direction, atol=1e-14)
        expected = linear_positions(machine, pivot - RADIUS * direction, rotary)
        found = np.array(linear(pivot, rotary)).ravel()
        np.testing.assert_allclose(found, expected[machine.linear_columns], atol=1e-10)


def test_the_jacobian_of_the_linear_axes_is_that_of_finite_differences(trunnion):
    pivot, rotary = ca.SX.sym("pivot", 3), ca.SX.sym("rotary", 2)
    linear = linear_axes_of_posture(trunnion, pivot, rotary, Tool.ball(2.0 * RADIUS).zone)
    jacobian = ca.Function("jacobian", [pivot, rotary], [ca.jacobian(linear, rotary)])
    p, r, h = RNG.uniform(-50, 50, 3), np.array([0.3, -0.8]), 1e-6
    for k in range(2):
        step = h * np.eye(2)[k]
        ends = [
            linear_positions(trunnion, p - RADIUS * tool_axes(trunnion, r + sign * step), r + sign * step)[:3]
            for sign in (1, -1)
        ]
        np.testing.assert_allclose(
            np.array(jacobian(p, r))[:, k], (ends[0] - ends[1]) / (2 * h), rtol=1e-7, atol=1e-6
        )


def test_a_tool_that_turns_about_its_contact_has_the_same_equations_in_both(trunnion):
    tool = Tool.bull(16, 4)
    pivot, normal, rotary = (ca.SX.sym(*name) for name in (("pivot", 3), ("normal", 3), ("rotary", 2)))
    linear = linear_axes_of_posture(trunnion, pivot, rotary, tool.zone, normal)
    function = ca.Function("linear", [pivot, normal, rotary], [linear])
    n = normalise(RNG.normal(size=(20, 3)))
    n[3] = 0.0  # a link: nothing is touched
    p, r = RNG.uniform(-50, 50, (20, 3)), RNG.uniform(-1.4, 1.4, (20, 2))
    tips = tool.zone.tip(p, np.where(n == 0.0, np.nan, n), tool_axes(trunnion, r))
    positions = linear_positions(trunnion, tips, r)
    for i in range(20):
        found = np.array(function(p[i], n[i], r[i])).ravel()
        np.testing.assert_allclose(found, positions[i, trunnion.linear_columns], atol=1e-9)
