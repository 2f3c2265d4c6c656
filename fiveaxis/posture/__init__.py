"""Choice of the rotary angles of every cutter location."""

from fiveaxis.posture.bound.lower_bound import LowerBound, bound_energy, bound_travel
from fiveaxis.posture.optimiser import optimise, with_bound
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import RESULT, Baseline, Solution, Stage
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.front import Front, find_front
from fiveaxis.posture.strategy.front_points import FrontPoint

__all__ = [
    "RESULT",
    "Baseline",
    "Effort",
    "Front",
    "FrontPoint",
    "LowerBound",
    "Options",
    "Problem",
    "Solution",
    "Stage",
    "bound_energy",
    "bound_travel",
    "find_front",
    "optimise",
    "with_bound",
]
