"""Methods that choose postures: ours, and what a user would take instead."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from case import Case
from scipy.optimize import dual_annealing
from tesseract import CannotDoError, by_tesseract

import fiveaxis as fx
from fiveaxis.model import follow
from fiveaxis.posture.baselines.catalogue import along_normal, lead_lean
from fiveaxis.posture.local.optima import refine

# rad: steps of the plain lattice.
LATTICE = np.radians([4.0, 6.0])
# Longest path for a search without gradients, and how often it may ask for the cost.
SHORT, EVALUATIONS = 100, 200_000
# s of processor time that TrajOpt and Descartes may take.
SECONDS = 100.0
# J per rad, mm or unit of cosine beyond a bound, in that search.
PENALTY = 1e5


Postures = tuple[fx.Toolpath, np.ndarray]


def ours(objective: str, effort: str) -> Callable[[Case], Postures]:
    def run(case: Case) -> Postures:
        around = {"part": case.part, "fixtures": case.fixtures}
        asked = {"objective": objective, "effort": effort, "bound": False}
        found = fx.optimise(case.toolpath, case.machine, **case.options, **around, **asked)
        return found.toolpath, found.motion.positions[:, case.machine.rotary_columns]

    return run


def normal(case: Case) -> Postures:
    """Tool along the normal, leaned up as far as the range asks for."""
    return case.toolpath, along_normal(case.toolpath, case.machine, case.tilt)


def constant_lead_lean(case: Case) -> Postures:
    """The cheapest constant lead and lean, of a grid: what CAM systems offer, chosen well."""
    return case.toolpath, lead_lean(case.toolpath, case.machine, case.tilt)


def ipopt(case: Case) -> Postures:
    """IPOPT on the plain problem, all locations at once, from the constant lead and lean."""
    start = lead_lean(case.toolpath, case.machine, case.tilt)
    found = refine(case.problem, start, iterations=1000, barrier=0.1, solver="ipopt")
    return case.toolpath, found.rotary


def annealing(case: Case) -> Postures:
    """scipy's dual annealing over all angles, with a penalty on what is broken."""
    if len(case.toolpath) > SHORT:
        raise CannotDoError(f"more than {SHORT} locations")
    problem, start = case.problem, along_normal(case.toolpath, case.machine, case.tilt)

    def cost(x: np.ndarray) -> float:
        rotary = x.reshape(-1, 2)
        positions, excess = problem.placed(slice(None), rotary)
        past = np.maximum(np.abs(np.diff(rotary, axis=0)) - problem.max_turn, 0.0).sum()
        past += excess.sum() + problem.limit_excess(positions).sum()
        return float(problem.cost(positions) + PENALTY * past)

    spread = np.pi / 3.0
    bounds = np.stack([start.ravel() - spread, start.ravel() + spread], axis=1)
    found = dual_annealing(cost, bounds, x0=start.ravel(), maxfun=EVALUATIONS, rng=np.random.default_rng(0))
    return case.toolpath, found.x.reshape(-1, 2)


def lattice(case: Case) -> Postures:
    """The cheapest path on a fixed grid of both rotary angles, without refinement."""
    problem, machine = case.problem, case.machine
    columns = machine.rotary_columns
    grids, circle = [], []
    for column, step in zip(columns, LATTICE[::-1], strict=True):
        limits = machine.axes[column].limits
        circle.append(limits.span >= 2.0 * np.pi)
        low, high = (-np.pi, np.pi - step) if circle[-1] else (limits.low, limits.high)
        grids.append(np.arange(low, high + 1e-9, step))
    grid = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 2)
    before: list[np.ndarray] = []
    chosen: list[np.ndarray] = []
    cost = positions = rotary = None
    for i in range(len(problem)):
        there, excess = problem.placed(np.full(len(grid), i), grid)
        admitted = (excess == 0.0) & (problem.limit_excess(there) == 0.0)
        if not admitted.any():
            raise CannotDoError(f"no posture of the grid at location {i}")
        there, angles = there[admitted], grid[admitted]
        if cost is None:
            cost = np.zeros(len(there))
        else:
            cost, back = step_to(case, i - 1, cost, (positions, rotary), (there, angles), circle)
            before.append(back)
        positions, rotary = there, angles
        chosen.append(angles)
    if not np.isfinite(cost).any():
        raise CannotDoError("no path on the grid keeps the largest turns")
    rows = [int(np.argmin(cost))]
    for back in reversed(before):
        rows.append(int(back[rows[-1]]))
    path = np.array([angles[row] for angles, row in zip(chosen, reversed(rows), strict=True)])
    for axis in range(2):
        if circle[axis]:
            path[:, axis] = np.unwrap(path[:, axis])
    return case.toolpath, path


def step_to(case: Case, move: int, cost: np.ndarray, here: tuple, there: tuple, circle: list) -> tuple:
    """Cheapest way from each posture of a location to those of the next one."""
    problem, machine = case.problem, case.machine
    paid = np.repeat(cost[:, None], len(there[0]), axis=1)
    for axis, column in enumerate(machine.rotary_columns):
        turn = there[1][None, :, axis] - here[1][:, None, axis]
        if circle[axis]:
            turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
        paid += np.where(turn > 0.0, problem.plus[move, column], -problem.minus[move, column]) * turn
        if problem.strict[move]:
            paid[np.abs(turn) > problem.max_turn[move, axis] + 1e-9] = np.inf
    for column in machine.linear_columns:
        step = there[0][None, :, column] - here[0][:, None, column]
        paid += np.where(step > 0.0, problem.plus[move, column], -problem.minus[move, column]) * step
    back = paid.argmin(axis=0)
    return paid[back, np.arange(paid.shape[1])], back


def trajopt(case: Case) -> Postures:
    """TrajOpt by tesseract's Python wheel, in an environment of its own, as `trajopt.py` says."""
    return case.toolpath, np.array(by_tesseract("trajopt.py", case, SECONDS))


def descartes(case: Case) -> Postures:
    """Descartes by the same wheel, as `descartes.py` says."""
    return case.toolpath, np.array(by_tesseract("descartes.py", case, SECONDS))


# No method, but what none can be better than.
BOUND = "lower bound"

METHODS: dict[str, Callable[[Case], Postures]] = {
    "fiveaxis, energy, normal": ours("energy", "normal"),
    "fiveaxis, energy, quick": ours("energy", "quick"),
    "fiveaxis, travel, normal": ours("travel", "normal"),
    "fiveaxis, travel, quick": ours("travel", "quick"),
    "IPOPT": ipopt,
    "lattice": lattice,
    "dual annealing": annealing,
    "TrajOpt": trajopt,
    "Descartes": descartes,
    "lead and lean": constant_lead_lean,
    "normal": normal,
}


def axis_values(case: Case, postures: Postures) -> np.ndarray:
    """Axis values, (n, k) mm and rad, at the given locations of what a method chose."""
    path, rotary = postures
    given = ~path.inserted if len(path) != len(case.toolpath) else slice(None)
    return follow(path, case.machine, rotary).positions[given]
