"""Choosing the rotary angles of every cutter location."""

from fiveaxis.posture.budget import Budget, Search
from fiveaxis.posture.optimiser import optimise
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Baseline, Solution, Stage

__all__ = ["Baseline", "Budget", "Problem", "Search", "Solution", "Stage", "optimise"]
