"""Terms of TrajOpt's problem: the travel cost as squares, and bounds; for `trajopt.py`.

Variables are the rotary angles alone, as the linear axes follow from them, so no pose is a constraint. The
travel cost, absolute and different by direction, is a sum of squares: at moves of the present size they
have its cost and its slope, as long as weights and targets are set anew after every few steps.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator

import numpy as np
from chain import Chain, limits_of
from terms import Jacobian, Terms
from tesseract_robotics import trajopt_ifopt, trajopt_sqp

# J: the unit of the cost. OSQP's tolerances are absolute.
UNIT = 1.0
# Cosine, and rad: bounds are drawn in by more than TrajOpt lets a constraint be broken.
WITHIN, TOLERANCE = 2e-4, 1e-4
# mm that count as 1 rad.
MM = 100.0
# mm: values that are further from a limit aren't constrained by it.
NEAR = 30.0
# Solver steps between two settings of the weights; price of what is broken, in units.
STEPS, PRICE = 4, 1e4


class Stretch:
    """Some locations of a path, with their costs and bounds; moves are those between neighbours."""

    def __init__(self, problem: dict, rows: np.ndarray) -> None:
        self.chain = Chain(problem["joints"], problem["centre"])
        self.points = np.array(problem["points"])[rows]
        counts = np.diff(rows)[:, None]
        plus, minus = (
            np.add.reduceat(np.array(problem[key]), rows[:-1]) / counts for key in ("plus", "minus")
        )
        self.even, self.odd = 0.5 * (plus + minus), 0.5 * (plus - minus)
        self.turns = np.add.reduceat(np.array(problem["turns"]), rows[:-1])
        self.limits = limits_of(problem)
        self.leans = [{k: np.array(v)[rows] for k, v in lean.items()} for lean in problem["leans"]]

    def part(self, rows: slice) -> Stretch:
        """Some neighbouring locations."""
        part, moves = copy.copy(self), slice(rows.start, rows.stop - 1)
        part.points = self.points[rows]
        part.even, part.odd, part.turns = self.even[moves], self.odd[moves], self.turns[moves]
        part.leans = [{key: value[rows] for key, value in lean.items()} for lean in self.leans]
        return part

    def cost(self, rotary: np.ndarray) -> float:
        steps = np.diff(self.chain.values(rotary, self.points)[0], axis=0)
        return float((self.even * np.abs(steps) + self.odd * steps).sum())

    def travel(self, rotary: np.ndarray, short: float) -> tuple[int, Callable, Callable]:
        """Terms whose squares are the cost of moves like the present ones, in units."""
        lengths = np.array([MM if joint["kind"] == "prismatic" else 1.0 for joint in self.chain.joints])
        steps = np.diff(self.chain.values(rotary, self.points)[0], axis=0)
        size = np.maximum(np.abs(steps), short * lengths)
        scale = np.sqrt(self.even / (2.0 * size * UNIT))
        shift = scale * self.odd / self.even * size
        count, axes = scale.shape
        rows = np.repeat(np.arange(count * axes).reshape(count, axes, 1), 4, axis=2)
        columns = np.broadcast_to(2 * np.arange(count)[:, None, None] + np.arange(4), rows.shape)

        def values(rotary: np.ndarray) -> np.ndarray:
            return (scale * np.diff(self.chain.values(rotary, self.points)[0], axis=0) + shift).ravel()

        def jacobian(rotary: np.ndarray) -> Jacobian:
            by = self.chain.derivatives(rotary, self.points)[0]
            return np.concatenate([-by[:-1], by[1:]], axis=2) * scale[:, :, None], rows, columns

        return scale.size, values, jacobian

    def bounds(self, rotary: np.ndarray) -> Iterator[tuple[str, int, Callable, Callable]]:
        """What must not be negative: cosines within each lean's range, turns and values near their bounds."""
        for number, lean in enumerate(self.leans):
            bounded = np.isfinite(lean["reference"]).all(axis=1)
            for key, sign, rows in (
                ("low", -1.0, np.flatnonzero(bounded & (lean["low"] > 0.0))),
                ("high", 1.0, np.flatnonzero(bounded)),
            ):
                if len(rows):
                    yield (
                        f"{key} lean {number}",
                        *self.lean(lean["reference"][rows], lean[key][rows], sign, rows),
                    )
        values = self.chain.values(rotary, self.points)[0]
        for key, sign, limits in (("low", 1.0, self.limits[:, 0]), ("high", -1.0, self.limits[:, 1])):
            rows, axes = np.nonzero(sign * (values - limits) < NEAR)
            linear = np.isin(axes, self.chain.rest)
            if linear.any():
                yield (f"{key} limits", *self.limit(rows[linear], axes[linear], sign, limits))
        moves, axes = np.nonzero(np.isfinite(self.turns))
        if len(moves):
            yield ("turns", *self.turned(moves, axes))

    def lean(
        self, reference: np.ndarray, angle: np.ndarray, sign: float, rows: np.ndarray
    ) -> tuple[int, Callable, Callable]:
        """Cosine above that of the highest lean, sign 1, or below that of the lowest, sign -1."""
        least = sign * np.cos(angle) + WITHIN
        numbers = np.repeat(np.arange(len(rows))[:, None], 2, axis=1)
        columns = 2 * rows[:, None] + np.arange(2)

        def values(rotary: np.ndarray) -> np.ndarray:
            axis = self.chain.values(rotary[rows], self.points[rows])[1]
            return sign * (axis * reference).sum(axis=1) - least

        def jacobian(rotary: np.ndarray) -> Jacobian:
            by = self.chain.derivatives(rotary[rows], self.points[rows])[1]
            return sign * np.einsum("nka,nk->na", by, reference), numbers, columns

        return len(rows), values, jacobian

    def limit(
        self, rows: np.ndarray, axes: np.ndarray, sign: float, limits: np.ndarray
    ) -> tuple[int, Callable, Callable]:
        """What is left to linear axes' limits, the low ones with sign 1."""
        columns = 2 * rows[:, None] + np.arange(2)
        numbers = np.repeat(np.arange(len(rows))[:, None], 2, axis=1)

        def values(rotary: np.ndarray) -> np.ndarray:
            here = self.chain.values(rotary[rows], self.points[rows])[0]
            return sign * (here[np.arange(len(rows)), axes] - limits[axes]) / MM - WITHIN

        def jacobian(rotary: np.ndarray) -> Jacobian:
            by = self.chain.derivatives(rotary[rows], self.points[rows])[0]
            return sign * by[np.arange(len(rows)), axes] / MM, numbers, columns

        return len(rows), values, jacobian

    def turned(self, moves: np.ndarray, axes: np.ndarray) -> tuple[int, Callable, Callable]:
        """What is left of the largest turns."""
        most = self.turns[moves, axes] - WITHIN

        def values(rotary: np.ndarray) -> np.ndarray:
            return most - np.abs(rotary[moves + 1, axes] - rotary[moves, axes])

        def jacobian(rotary: np.ndarray) -> Jacobian:
            sign = np.sign(rotary[moves + 1, axes] - rotary[moves, axes])
            rows = np.repeat(np.arange(len(moves))[:, None], 2, axis=1)
            columns = np.stack([2 * moves + axes, 2 * moves + 2 + axes], axis=1)
            return np.stack([sign, -sign], axis=1), rows, columns

        return len(moves), values, jacobian

    def solved(
        self, rotary: np.ndarray, short: float, held: tuple[bool, bool] = (False, False)
    ) -> np.ndarray:
        """Angles after some steps of TrajOpt, weighted by the given ones; the ends may be held."""
        limits = self.limits[self.chain.columns].clip(-1e4, 1e4) + np.array([TOLERANCE, -TOLERANCE])
        free = slice(int(held[0]), len(rotary) - int(held[1]))
        ends = [rotary[: free.start], rotary[free.stop :]]
        names = [joint["name"] for joint in self.chain.rotary]
        boxes = [trajopt_ifopt.Bounds(*pair) for pair in limits]
        inside = list(np.clip(rotary[free], *limits.T))
        nodes = trajopt_ifopt.createNodesVariables("angles", names, inside, boxes)
        problem = trajopt_sqp.IfoptQPProblem(trajopt_sqp.IfoptProblem(nodes))
        # The variables keep the sets alive.
        travel = Terms("travel", nodes, *self.travel(rotary, short), ends)
        problem.addCostSet(travel, trajopt_sqp.CostPenaltyType.SQUARED)
        sets = [Terms(name, nodes, *terms, ends) for name, *terms in self.bounds(rotary)]
        for one in sets:
            problem.addConstraintSet(one)
        problem.setup()
        solver = trajopt_sqp.TrustRegionSQPSolver(trajopt_sqp.OSQPEigenSolver())
        solver.params.max_iterations = STEPS
        solver.params.cnt_tolerance = TOLERANCE
        solver.params.initial_merit_error_coeff = PRICE
        solver.solve(problem)
        found = solver.getResults().best_var_vals[: 2 * len(inside)].reshape(-1, 2)
        return np.vstack([ends[0], found, ends[1]])

    def keeps(self, rotary: np.ndarray) -> bool:
        """Whether leans, turns and values are within their bounds."""
        values, axis = self.chain.values(rotary, self.points)
        fine = bool((np.abs(np.diff(rotary, axis=0)) <= self.turns).all())
        fine &= bool(((values >= self.limits[:, 0]) & (values <= self.limits[:, 1])).all())
        for lean in self.leans:
            angle = np.arccos(np.clip((axis * lean["reference"]).sum(axis=1), -1.0, 1.0))
            fine &= not ((angle < lean["low"]) | (angle > lean["high"])).any()
        return fine
