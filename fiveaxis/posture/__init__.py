"""Choosing the rotary angles of every cutter location."""

from fiveaxis.posture.solution import Baseline, Solution, Stage

__all__ = ["Baseline", "Solution", "Stage"]
