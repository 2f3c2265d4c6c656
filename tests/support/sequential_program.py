"""The least time of a law's path by a sequence of linear programs, to hold the law against."""

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linprog

from fiveaxis.model import TimeLaw
from fiveaxis.model.motion.jerk_barrier import spline_basis

PLACES = np.array([0.08, 0.36, 0.64, 0.92])
ROUNDS = 25


def least_time(law: TimeLaw, intervals: int) -> float:
    """Minimise the time over ``x = ṙ²``, where r is the law's own time: there x is 1 throughout.

    The limit of jerk, ``|g| ≤ 1 / √x``, is replaced by its tangent at the last x, which lies below it. Limits
    are those at four places of each interval alone, so that the least time is rather too short.
    """
    n, step = intervals, law.total / intervals
    r = ((np.arange(n)[:, None] + PLACES) * step).ravel()
    _, q1, q2 = law.at(r)
    q3 = law.jerk(r)
    m = len(r)
    rows, columns = (
        np.repeat(np.arange(m), 4),
        (np.repeat(np.arange(n), len(PLACES))[:, None] + np.arange(4)).ravel(),
    )
    basis = spline_basis(PLACES)
    value, slope, bend = (
        sp.csr_matrix((np.tile(part, (n, 1)).ravel() / step**order, (rows, columns)), shape=(m, n + 3))
        for order, part in enumerate(basis)
    )
    speed, push, jerk = law.bounds.speed, law.bounds.acceleration, law.bounds.jerk
    with np.errstate(divide="ignore"):
        ceiling = np.minimum(((speed / np.abs(q1)) ** 2).min(axis=1), 4.0)
    pushes = [
        sp.diags(q2[:, j] / a) @ value + sp.diags(0.5 * q1[:, j] / a) @ slope for j, a in enumerate(push)
    ]
    jerks = [
        sp.diags(q3[:, j] / a) @ value
        + sp.diags(1.5 * q2[:, j] / a) @ slope
        + sp.diags(0.5 * q1[:, j] / a) @ bend
        for j, a in enumerate(jerk)
    ]
    c, trust = np.full(n + 3, 0.98), 0.3
    time = np.mean(1.0 / np.sqrt(value @ c))
    for _ in range(ROUNDS):
        x = value @ c
        tangent = sp.diags(0.5 * x**-1.5) @ value
        limits = [
            value,
            -value,
            *(s * g for g in pushes for s in (1, -1)),
            *(s * g + tangent for g in jerks for s in (1, -1)),
        ]
        most = [
            np.minimum(ceiling, x * (1 + trust)),
            -x * (1 - trust),
            *[np.ones(m)] * 10,
            *[1.5 * x**-0.5] * 10,
        ]
        found = linprog(
            -(value.T @ (0.5 * x**-1.5)),
            A_ub=sp.vstack(limits).tocsr(),
            b_ub=np.concatenate(most),
            bounds=(None, None),
        )
        better = np.mean(1.0 / np.sqrt(np.maximum(value @ found.x, 1e-9))) if found.status == 0 else np.inf
        if better < time - 1e-6:
            c, time, trust = found.x, better, min(1.5 * trust, 0.8)
        else:
            trust *= 0.4
        if trust < 1e-3:
            break
    return float(time * law.total)
