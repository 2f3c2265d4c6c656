"""Choosing the rotary angles of every cutter location."""

from fiveaxis.posture.budget import EFFORTS, Budget, Search
from fiveaxis.posture.delivery import Objective
from fiveaxis.posture.front import Front, FrontPoint, find_front
from fiveaxis.posture.lower_bound import LowerBound, bound_travel
from fiveaxis.posture.optimiser import optimise
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Baseline, Optima, Solution, Stage

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
