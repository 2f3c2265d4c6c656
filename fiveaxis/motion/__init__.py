"""Axis motion along a path, and its timing."""

from fiveaxis.motion.motion import Motion, follow
from fiveaxis.motion.timing import STANDSTILL, block_times

__all__ = ["STANDSTILL", "Motion", "block_times", "follow"]
