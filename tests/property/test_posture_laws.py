"""Laws of the objective and its exact local solver, on tiny paths with every term of the objective at work.

The objective is written here once more, from the design and not from the problem's code.
"""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from support.quick_optimiser import tilt_bounds

import fiveaxis as fx
from fiveaxis.base import normalise
from fiveaxis.model import (
    Machine,
    Tool,
    Toolpath,
    follow,
    linear_positions,
    motion_energy,
    tool_axes,
    travel_costs,
)
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.problem import ROTARY_EXCESS_PRICE, Problem

TILT = (10.0, 45.0)
TURN = 20.0
PRICES = {"time_price": 100.0, "smoothing": 5.0}
TOP_SPEED = {"A": 90.0, "C": 90.0, "X": 45.0, "Y": 45.0, "Z": 45.0}  # deg/s and mm/s
TOP_ACCELERATION = {"A": 300.0, "C": 300.0}  # deg/s²
STEP = np.radians(7.5)
# Relative, of the objective: what the last barrier leaves.
EXACT = 1e-5
SEEDS = range(5)


@pytest.fixture(scope="module")
def machine(hayashi) -> Machine:
    """Measured powers, taken to hold at any speed, and axes slow enough to matter."""

    def bounded(axis):
        scale = np.pi / 180.0 if axis.is_rotary else 1.0
        top = TOP_ACCELERATION.get(axis.letter)
        return replace(
            axis,
            drive=replace(axis.drive, measured_to=None),
            max_speed=TOP_SPEED[axis.letter] * scale,
            max_acceleration=None if top is None else top * scale,
        )

    return replace(hayashi, axes=tuple(bounded(a) for a in hayashi.axes))


def bumps(seed: int, n: int = 4) -> Toolpath:
    """Few contacts on a wavy side wall, 3 mm apart, at 3 m/min."""
    rng = np.random.default_rng(seed)
    heading = 0.7 * seed + np.cumsum(rng.uniform(0.1, 0.5, n))
    out = np.stack([np.cos(heading), np.sin(heading), rng.uniform(-0.2, 0.6, n)], axis=1)
    along = np.stack([-np.sin(heading), np.cos(heading), rng.uniform(-0.3, 0.3, n)], axis=1)
    contact = np.array([25.0, -5.0, 4.0]) + np.cumsum(3.0 * normalise(along), axis=0)
    return Toolpath.from_contacts(contact, out, Tool.ball(6.0), feed_mm_min=3000.0)


def found(path: Toolpath, machine: Machine, start: np.ndarray | None = None, **more):
    """Solve at the given locations alone, from the best path of a grid."""
    prices = PRICES | more
    build = {"time_price": prices["time_price"], "bend_price": prices["smoothing"]}
    bounds = tilt_bounds(path, tilt=TILT)
    problem = Problem.build(path, machine, bounds, max_turn=np.radians(TURN), **build)
    start = Objective(path, machine).best_on_grid() if start is None else start
    rotary = refine(problem, start, iterations=200, barrier=4e-2).rotary
    motion = follow(path, machine, rotary)
    return SimpleNamespace(
        problem=problem, motion=motion, machine=machine, energy=motion_energy(machine, motion)
    )


def rotary_of(solution) -> np.ndarray:
    return solution.motion.positions[:, solution.machine.rotary_columns]


class Objective:
    """What a path costs: travel, delay, acceleration excess and bends of steps, and of pairs of them."""

    def __init__(self, path: Toolpath, machine: Machine) -> None:
        self.path, self.machine = path, machine
        self.plus, self.minus = (cost[1:] for cost in travel_costs(machine, path.feed))
        self.time = path.lengths[1:] / path.feed[1:]
        self.speed = np.array([a.max_speed for a in machine.axes])
        columns = machine.rotary_columns
        self.limits = [(machine.axes[c].limits.low, machine.axes[c].limits.high) for c in columns]
        self.push = np.array([machine.axes[c].max_acceleration for c in columns])

    def placed(self, row: int, rotary: np.ndarray) -> np.ndarray:
        """Axis values of one location in postures, (m, 2) → (m, k)."""
        tips = self.path.pivot[row] - self.path.tool.radius * tool_axes(self.machine, rotary)
        return linear_positions(self.machine, tips, rotary)

    def step(self, i: int, move: np.ndarray) -> np.ndarray:
        """Cost of moves, (..., k), from location i to the next."""
        travel = np.maximum(move, 0.0) @ self.plus[i] + np.maximum(-move, 0.0) @ self.minus[i]
        late = np.maximum((np.abs(move) / self.speed).max(axis=-1) - self.time[i], 0.0)
        bend = (move[..., self.machine.rotary_columns] ** 2).sum(axis=-1)
        return travel + PRICES["time_price"] * late + PRICES["smoothing"] * bend

    def excess(self, i: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Cost of turning, (..., 2), in the move from i and then in the next."""
        allowed = self.push * (self.time[i] + self.time[i + 1]) / 2.0
        change = np.abs(second / self.time[i + 1] - first / self.time[i])
        return ROTARY_EXCESS_PRICE * np.maximum(change - allowed, 0.0).sum(axis=-1)

    def of(self, rotary: np.ndarray) -> float:
        """Cost of a path, (n, 2)."""
        moves = np.diff([self.placed(i, r[None])[0] for i, r in enumerate(rotary)], axis=0)
        turns = np.diff(rotary, axis=0)
        steps = sum(float(self.step(i, move)) for i, move in enumerate(moves))
        return steps + sum(float(self.excess(i, *turns[i : i + 2])) for i in range(len(turns) - 1))

    def leans(self, row: int, rotary: np.ndarray) -> np.ndarray:
        """Angle of the tool to the normal of a location, (m, 2) → (m,) deg."""
        cosine = tool_axes(self.machine, rotary) @ self.path.normal[row]
        return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def choices(self, row: int) -> np.ndarray:
        """Postures on a grid that keep the tilt range, (m, 2); C from −180 to 180 deg on both branches."""
        circle = np.arange(-np.pi, np.pi, STEP)
        second = np.arange(*self.limits[1], STEP)
        grid = np.stack(np.meshgrid(circle, second, indexing="ij"), axis=-1).reshape(-1, 2)
        lean = self.leans(row, grid)
        return grid[(lean >= TILT[0]) & (lean <= TILT[1])]

    def best_on_grid(self) -> np.ndarray:
        """The cheapest path through the grid, by trying all pairs of steps; (n, 2)."""
        grids = [self.choices(i) for i in range(len(self.path))]
        placed = [self.placed(i, grid) for i, grid in enumerate(grids)]
        turns = [b[None] - a[:, None] for a, b in itertools.pairwise(grids)]
        steps = [
            np.where(
                (np.abs(turn) <= np.radians(TURN)).all(axis=-1),
                self.step(i, placed[i + 1][None] - placed[i][:, None]),
                np.inf,
            )
            for i, turn in enumerate(turns)
        ]
        best, came = steps[0], []
        for i in range(1, len(steps)):
            later = np.full(steps[i].shape, np.inf)
            before = np.zeros(steps[i].shape, dtype=np.int64)
            for middle in range(len(grids[i])):
                start = np.flatnonzero(np.isfinite(best[:, middle]))
                end = np.flatnonzero(np.isfinite(steps[i][middle]))
                if len(start) and len(end):
                    first, second = turns[i - 1][start, middle][:, None], turns[i][middle, end][None]
                    whole = best[start, middle][:, None] + self.excess(i - 1, first, second)
                    later[middle, end] = whole.min(axis=0) + steps[i][middle, end]
                    before[middle, end] = start[whole.argmin(axis=0)]
            best, came = later, [*came, before]
        assert np.isfinite(best).any(), "no path through the grid is admissible"
        middle, last = np.unravel_index(np.argmin(best), best.shape)
        rows = [int(last), int(middle)]
        for before in reversed(came):
            rows.append(int(before[rows[-1], rows[-2]]))
        return np.array([grid[row] for grid, row in zip(grids, reversed(rows), strict=True)])

    def refined(self, start: np.ndarray) -> np.ndarray:
        """A local optimum near a path, by scipy: every kink of the objective is a variable with bounds."""
        n, k = len(start), len(self.machine.axes)
        m = n - 1
        sizes = np.cumsum([2 * n, m * k, m, 2 * (m - 1)])

        def parts(x):
            rotary, rise, late, sudden = np.split(x, sizes[:-1])
            return rotary.reshape(n, 2), rise.reshape(m, k), late, sudden.reshape(m - 1, 2)

        def moves(rotary):
            return np.diff([self.placed(i, r[None])[0] for i, r in enumerate(rotary)], axis=0)

        def cost(x):
            rotary, rise, late, sudden = parts(x)
            fall = rise - moves(rotary)
            bend = PRICES["smoothing"] * (np.diff(rotary, axis=0) ** 2).sum()
            travel = (self.plus * rise + self.minus * fall).sum()
            return travel + PRICES["time_price"] * late.sum() + ROTARY_EXCESS_PRICE * sudden.sum() + bend

        def slack(x):
            rotary, rise, late, sudden = parts(x)
            move, turn = moves(rotary), np.diff(rotary, axis=0)
            lasting = (self.time + late)[:, None] * self.speed
            allowed = self.push * ((self.time[1:] + self.time[:-1]) / 2.0)[:, None] + sudden
            change = np.diff(turn / self.time[:, None], axis=0)
            lean = np.array([self.leans(i, r[None])[0] for i, r in enumerate(rotary)])
            room = [rise - move, lasting - move, lasting + move, allowed - change, allowed + change]
            room += [np.radians(TURN) - turn, np.radians(TURN) + turn]
            room += [np.radians(lean - TILT[0]), np.radians(TILT[1] - lean)]
            return np.concatenate([part.ravel() for part in room])

        move = moves(start)
        late = np.maximum((np.abs(move) / self.speed).max(axis=1) - self.time, 0.0)
        allowed = self.push * ((self.time[1:] + self.time[:-1]) / 2.0)[:, None]
        change = np.abs(np.diff(np.diff(start, axis=0) / self.time[:, None], axis=0))
        x = np.concatenate(
            [p.ravel() for p in (start, np.maximum(move, 0.0), late, np.maximum(change - allowed, 0.0))]
        )
        bounds = self.limits * n + [(0.0, None)] * (len(x) - 2 * n)
        answer = minimize(
            cost,
            x,
            method="SLSQP",
            bounds=bounds,
            constraints={"type": "ineq", "fun": slack},
            options={"maxiter": 300, "ftol": 1e-9},
        )
        return parts(answer.x)[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_path_of_a_grid_nor_its_local_optimum_is_cheaper(machine, seed):
    path = bumps(seed)
    objective = Objective(path, machine)
    grid = objective.best_on_grid()
    near = objective.refined(grid)
    solution = found(path, machine)
    rotary = rotary_of(solution)
    cost = objective.of(rotary)
    # The reported cost is that of the formula, and the path is admissible.
    assert cost == pytest.approx(solution.problem.cost(solution.motion.positions), rel=1e-9)
    lean = np.array([objective.leans(i, r[None])[0] for i, r in enumerate(rotary)])
    assert ((lean >= TILT[0] - 1e-6) & (lean <= TILT[1] + 1e-6)).all()
    assert np.degrees(np.abs(np.diff(rotary, axis=0))).max() <= TURN + 1e-6
    assert cost <= objective.of(grid) * (1.0 + 1e-9)
    assert cost <= objective.of(near) * (1.0 + EXACT)


def test_every_term_is_at_work(machine):
    """Otherwise the laws below would be tested for fewer terms than they claim."""
    delays, changes = [], []
    for seed in SEEDS:
        solution = found(bumps(seed), machine)
        problem, positions = solution.problem, solution.motion.positions
        delays.append(float(problem.delay(positions).sum()))
        turn = np.diff(rotary_of(solution), axis=0) / problem.least_time[:, None]
        between = (problem.least_time[1:] + problem.least_time[:-1])[:, None] / 2.0
        allowed = between * problem.top_acceleration[machine.rotary_columns]
        changes.append(float((np.abs(np.diff(turn, axis=0)) / allowed).max()))
    assert min(delays) > 1e-3
    assert max(changes) > 0.999


def swapped(machine: Machine) -> Machine:
    """The machine for which falling costs what rising did."""
    axes = tuple(
        replace(a, drive=replace(a.drive, plus=a.drive.minus, minus=a.drive.plus)) for a in machine.axes
    )
    return replace(machine, axes=axes)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_path_run_backwards_costs_the_same_with_swapped_powers(machine, seed):
    path = bumps(seed)
    there = found(path, machine)
    start = Objective(path, machine).best_on_grid()[::-1]
    back = found(path.at(np.arange(len(path))[::-1]), swapped(machine), start)
    costs = [s.problem.cost(s.motion.positions) for s in (there, back)]
    assert costs[1] == pytest.approx(costs[0], rel=EXACT)
    # Each is the other one, backwards.
    there_back = back.problem.cost(there.motion.positions[::-1])
    assert there_back == pytest.approx(costs[0], rel=1e-12)


@pytest.mark.parametrize("factor", [0.25, 3.0])
def test_powers_and_prices_scaled_alike_scale_the_cost_and_change_nothing_else(machine, factor):
    drives = [
        replace(a.drive, plus=a.drive.plus * factor, minus=a.drive.minus * factor) for a in machine.axes
    ]
    scaled = replace(machine, axes=tuple(map(lambda a, d: replace(a, drive=d), machine.axes, drives)))
    # The price of a change of speed is fixed; without accelerations nothing but powers and prices counts.
    free = [
        replace(m, axes=tuple(replace(a, max_acceleration=None) for a in m.axes)) for m in (machine, scaled)
    ]
    start = Objective(bumps(1), machine).best_on_grid()
    once = found(bumps(1), free[0], start)
    other = found(bumps(1), free[1], start, **{name: factor * price for name, price in PRICES.items()})
    assert other.energy.total == pytest.approx(factor * once.energy.total, rel=1e-4)
    np.testing.assert_allclose(rotary_of(other), rotary_of(once), atol=np.radians(0.05))


@pytest.mark.parametrize("angle", [-2.0, 0.3, 1.9])
def test_a_part_turned_about_an_endless_c_costs_the_same_and_c_alone_turns_with_it(machine, angle):
    path = bumps(2)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = Toolpath.from_contacts(
        path.contact @ turn.T, path.normal @ turn.T, path.tool, feed_mm_min=60.0 * path.feed
    )
    one = found(path, machine)
    # The same motion but for C is a path of the turned part, at the same cost.
    for sign in (1.0, -1.0):
        shift = np.array([sign * angle, 0.0])
        shifted = rotary_of(one) + shift
        if np.allclose(tool_axes(machine, shifted), tool_axes(machine, rotary_of(one)) @ turn.T):
            break
    other = found(turned, machine, Objective(path, machine).best_on_grid() + shift)
    costs = [s.problem.cost(s.motion.positions) for s in (one, other)]
    assert costs[1] == pytest.approx(costs[0], rel=EXACT)
    assert other.problem.violation(shifted) <= 1e-9
    positions = other.problem.positions(slice(None), shifted)
    assert other.problem.cost(positions) == pytest.approx(costs[0], rel=1e-12)


@pytest.mark.parametrize("objective", ["energy", "travel", pytest.param("time", marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", SEEDS)
def test_no_baseline_in_the_table_is_cheaper_by_what_is_minimised(machine, seed, objective):
    measure = {"energy": "total"}.get(objective, objective)
    solution = fx.optimise(bumps(seed, 20), machine, tilt=TILT, effort="quick", objective=objective)
    own = getattr(solution.energy, measure)
    assert solution.baselines
    for name, energy in solution.baselines.items():
        assert own <= getattr(energy, measure) * (1.0 + 1e-9), name
