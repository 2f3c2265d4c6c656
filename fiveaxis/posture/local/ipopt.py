"""The second solver: IPOPT on the same rows."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from fiveaxis.base import Array
from fiveaxis.posture.local.interior import LocalOptimum, central_point
from fiveaxis.posture.local.rows import ChainModel, Rows
from fiveaxis.posture.location_model import ANGLES

IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-6,
    # Results must lie inside the bounds, not within a tolerance of them.
    "bound_relax_factor": 0.0,
    "nlp_scaling_method": "none",
}
# IPOPT's status of a converged problem, and of one interrupted by Ctrl-C.
SOLVED = "Solve_Succeeded"
INTERRUPTED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")


def minimise_by_ipopt(rows: Rows, start: Array, *, iterations: int, barrier: float) -> LocalOptimum:
    """Find a local optimum, like `minimise`."""
    from scipy import sparse

    n, d = start.shape
    x, parts = ca.MX.sym("x", d, n), ca.MX.sym("parts", len(rows.sign))
    tape_values = rows.model.tapes.function.map(n)(ca.vertcat(x[:ANGLES, :], rows.model.given.T))
    wait = x[ANGLES, :] if d > ANGLES else ca.MX(1, n)
    row, column = np.nonzero(rows.quantity >= 0)
    entries = rows.coefficient[row, column], (row, rows.quantity[row, column])
    quantities = ca.vec(ca.vertcat(tape_values, wait))
    matrix = sparse.csc_matrix(entries, shape=(len(rows.first), quantities.shape[0]))
    signs = rows.sign, (rows.row, np.arange(len(rows.sign)))
    sums = sparse.csc_matrix(signs, shape=(len(rows.first), len(rows.sign)))
    values = ca.DM(matrix) @ quantities
    bound = np.flatnonzero(np.diff(rows.begin))
    apart = values - ca.DM(sums) @ parts
    problem = {
        "x": ca.veccat(x, parts),
        "f": ca.dot(rows.price, parts) + ca.dot(rows.square, values**2),
        "g": apart[bound.tolist()],
    }
    options = {**IPOPT, "max_iter": iterations, "mu_init": barrier}
    solver = ca.nlpsol("refine", "ipopt", problem, {"print_time": False, "ipopt": options})
    here = matrix @ ChainModel(rows).values(start).ravel()
    low, high = (np.where(rows.free, end, start).ravel() for end in (-np.inf, np.inf))
    answer = solver(
        x0=np.concatenate([start.ravel(), central_point(rows, here, barrier)[0][0]]),
        lbx=np.concatenate([low, rows.low]),
        ubx=np.concatenate([high, rows.high]),
        lbg=0.0,
        ubg=0.0,
    )
    stats = solver.stats()
    status = str(stats["return_status"])
    # CasADi catches a Ctrl-C in the solver and returns a result.
    if status in INTERRUPTED:
        raise KeyboardInterrupt(f"IPOPT was interrupted ({status})")
    multiplier = np.zeros(len(rows.first))
    multiplier[bound] = np.array(answer["lam_g"])[:, 0]
    found = np.array(answer["x"])[: start.size, 0].reshape(start.shape)
    return LocalOptimum(found, multiplier, status == SOLVED, int(stats["iter_count"]))
