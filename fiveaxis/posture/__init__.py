"""Choosing the rotary angles of every cutter location."""

from fiveaxis.posture.bound.lower_bound import LowerBound, bound_travel
from fiveaxis.posture.optimiser import optimise
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Baseline, Optima, Solution, Stage
from fiveaxis.posture.strategy.budget import EFFORTS, Budget, Search
from fiveaxis.posture.strategy.delivery import Objective
from fiveaxis.posture.strategy.front import Front, FrontPoint, find_front

__all__ = [
    "EFFORTS",
    "Baseline",
    "Budget",
    "Front",
    "FrontPoint",
    "LowerBound",
    "Objective",
    "Optima",
    "Problem",
    "Search",
    "Solution",
    "Stage",
    "bound_travel",
    "find_front",
    "optimise",
]
