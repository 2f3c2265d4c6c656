"""CasADi's equations are numpy's, and their derivatives are right."""

import casadi as ca
import numpy as np

from fiveaxis.base import normalise
from fiveaxis.model import Tool, linear_positions, tool_axes
from fiveaxis.model.kinematics.symbolic import linear_axes_of_posture

RNG = np.random.default_rng(7)


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
