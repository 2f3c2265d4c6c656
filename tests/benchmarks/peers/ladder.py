"""Descartes's search through a ladder graph, for `descartes.py`: samples and costs of edges are ours."""

from __future__ import annotations

import itertools

import numpy as np
from chain import Chain, limits_of, urdf_of
from tesseract_robotics import tesseract_command_language as language
from tesseract_robotics.tesseract_common import GeneralResourceLocator, ManipulatorInfo
from tesseract_robotics.tesseract_environment import Environment
from tesseract_robotics.tesseract_motion_planners import PlannerRequest
from tesseract_robotics.tesseract_motion_planners_descartes import (
    DescartesEdgeEvaluatorD,
    DescartesMotionPlannerD,
    DescartesMoveProfileD,
    DescartesStateD,
    DescartesStateEvaluatorD,
    DescartesStateSampleD,
    DescartesWaypointSamplerD,
    cast_DescartesMoveProfileD,
)


class Sampler(DescartesWaypointSamplerD):
    """Samples of a location: axis values."""

    def __init__(self, values: np.ndarray) -> None:
        super().__init__()
        self.values = values

    def sample(self) -> list[DescartesStateSampleD]:
        return [DescartesStateSampleD(DescartesStateD(row), 0.0) for row in self.values]


class Edges(DescartesEdgeEvaluatorD):
    """Cost of the move between two samples, J, read from a table; NaN is forbidden."""

    def __init__(self, here: np.ndarray, there: np.ndarray, table: np.ndarray) -> None:
        super().__init__()
        self.numbers = {row.tobytes(): number for number, row in enumerate(there)}
        self.table = {row.tobytes(): costs for row, costs in zip(here, table.tolist(), strict=True)}

    def evaluate(self, start: DescartesStateD, end: DescartesStateD) -> tuple[bool, float]:
        cost = self.table[start.values.tobytes()][self.numbers[end.values.tobytes()]]
        return cost == cost, cost


class Anything(DescartesStateEvaluatorD):
    """Every state is as good as another."""

    def evaluate(self, state: DescartesStateD) -> tuple[bool, float]:
        return True, 0.0


class Profile(DescartesMoveProfileD):
    """Hands out samplers and edges, one location after the other."""

    def __init__(self, values: list[np.ndarray], tables: list[np.ndarray]) -> None:
        super().__init__()
        self.samplers, self.edges = map(Sampler, values), map(Edges, values[:-1], values[1:], tables)
        # What is handed out has to live as long as the search.
        self.alive: list[object] = []

    def kept(self, made: object) -> object:
        self.alive.append(made)
        return made

    def createWaypointSampler(self, *about: object) -> object:  # noqa: N802
        return self.kept(next(self.samplers))

    def createEdgeEvaluator(self, *about: object) -> object:  # noqa: N802
        return self.kept(next(self.edges))

    def createStateEvaluator(self, *about: object) -> object:  # noqa: N802
        return self.kept(Anything())


class Search:
    """The same search again and again, with the samples that it is given.

    Parameters
    ----------
    problem : as `methods.by_tesseract` writes it
    """

    def __init__(self, problem: dict) -> None:
        self.chain = Chain(problem["joints"], problem["centre"])
        self.points, self.turns = np.array(problem["points"]), np.array(problem["turns"])
        self.plus, self.minus = np.array(problem["plus"]), np.array(problem["minus"])
        self.leans = [{key: np.array(value) for key, value in lean.items()} for lean in problem["leans"]]
        self.limits = limits_of(problem)
        self.environment = Environment()
        if not self.environment.initFromUrdfSrdf(*urdf_of(problem), GeneralResourceLocator()):
            raise SystemExit("tesseract doesn't take the machine")
        span = np.diff(self.limits[self.chain.columns])[:, 0]
        self.circles = span >= 2.0 * np.pi

    def admitted(self, row: int, rotary: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Axis values, (m, 5), of the samples at a location that keep its leans and the limits; which."""
        values, axis = self.chain.values(rotary, self.points[row])
        fine = ((values >= self.limits[:, 0]) & (values <= self.limits[:, 1])).all(axis=1)
        for lean in self.leans:
            if np.isfinite(lean["reference"][row]).all():
                angle = np.arccos(np.clip(axis @ lean["reference"][row], -1.0, 1.0))
                fine &= (angle >= lean["low"][row]) & (angle <= lean["high"][row])
        return values[fine], np.flatnonzero(fine)

    def table(self, rows: tuple[int, int], here: np.ndarray, there: np.ndarray, around: bool) -> np.ndarray:
        """Cost of the moves between all samples of two locations, J, NaN where a turn is too large."""
        moves = slice(*rows)
        steps = there[None, :] - here[:, None]
        if around:
            for column in np.array(self.chain.columns)[self.circles]:
                steps[..., column] = (steps[..., column] + np.pi) % (2.0 * np.pi) - np.pi
        plus, minus = self.plus[moves].mean(axis=0), self.minus[moves].mean(axis=0)
        cost = (np.where(steps > 0.0, plus, -minus) * steps).sum(axis=-1)
        turned = np.abs(steps[..., self.chain.columns])
        cost[(turned > self.turns[moves].sum(axis=0)).any(axis=-1)] = np.nan
        return cost

    def way(self, rows: np.ndarray, values: list[np.ndarray], around: bool = False) -> np.ndarray | None:
        """Sample of each row, (n, 5), on the cheapest way; None where Descartes finds none."""
        pairs = zip(itertools.pairwise(rows), values[:-1], values[1:], strict=True)
        tables = [self.table(*pair, around) for pair in pairs]
        request = PlannerRequest()
        request.env, request.instructions = self.environment, program(len(rows), self.chain)
        request.profiles = language.ProfileDictionary()
        # Its own variable keeps the profile alive.
        profile = Profile(values, tables)
        request.profiles.addProfile("Descartes", "path", cast_DescartesMoveProfileD(profile))
        answer = DescartesMotionPlannerD("Descartes").solve(request)
        if not answer.successful:
            return None
        moves = list(answer.results.getInstructions())
        moves = [language.InstructionPoly_as_MoveInstructionPoly(move) for move in moves]
        places = [move.getWaypoint() for move in moves]
        states = [language.WaypointPoly_as_StateWaypointPoly(place) for place in places]
        return np.array([np.array(state.getPosition()).ravel() for state in states])

    def cost(self, rows: np.ndarray, values: np.ndarray) -> float:
        """J, of axis values at some locations, (n, 5)."""
        steps, counts = np.diff(values, axis=0), np.diff(rows)[:, None]
        plus, minus = (np.add.reduceat(p, rows[:-1]) / counts for p in (self.plus, self.minus))
        return float((np.where(steps > 0.0, plus, -minus) * steps).sum())


def program(count: int, chain: Chain) -> language.CompositeInstruction:
    """As many moves as locations; where to, the samplers say."""
    names = [joint["name"] for joint in chain.joints]
    found = language.CompositeInstruction("path")
    tool = ManipulatorInfo()
    tool.manipulator, tool.working_frame, tool.tcp_frame = "all", "workpiece", "tool"
    found.setManipulatorInfo(tool)
    for _ in range(count):
        place = language.JointWaypoint(names, np.zeros(len(names)))
        move = language.MoveInstruction(
            language.JointWaypointPoly_wrap_JointWaypoint(place), language.MoveInstructionType_LINEAR, "path"
        )
        found.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
    return found
