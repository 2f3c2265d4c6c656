"""The optimality residual: small at a solver's result, large elsewhere."""

import numpy as np

from fiveaxis.posture.local.optima import optimality, refine

# J/rad, scaled, and J.
FLAT, CLOSED = 0.5, 1e-4


def test_optima_of_both_solvers_have_hardly_a_residual_but_their_start_has_one(problem, start):
    for solver in ("structured", "ipopt"):
        found = refine(problem, start, iterations=200, barrier=0.1, solver=solver)
        residual = optimality(problem, found.rotary)
        assert residual.dual < FLAT
        assert residual.primal < 1e-9
        assert residual.complementarity < CLOSED
    assert optimality(problem, start).dual > 20.0 * FLAT


def test_it_grows_with_the_distance_from_the_optimum(problem, start):
    best = refine(problem, start, iterations=200, barrier=0.1).rotary
    inside = np.array([1e-3, 1e-2])
    duals = [optimality(problem, best + share * (start - best)).dual for share in inside]
    assert duals[0] > optimality(problem, best).dual
    assert max(duals) > 20.0 * FLAT
