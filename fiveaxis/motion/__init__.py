"""Axis motion along a path, and its timing."""

from fiveaxis.motion.digest import motion_digest
from fiveaxis.motion.filling import (
    PATH_TOLERANCE,
    fill_in,
    fill_in_rows,
    led_deviation,
    midway_deviation,
    off_plane,
)
from fiveaxis.motion.motion import Motion, follow
from fiveaxis.motion.profiles import Profile, block_profiles, move_profiles
from fiveaxis.motion.rates import PeakRate, peak_rates
from fiveaxis.motion.thinning import AXIS_TOLERANCE, SPEED_TOLERANCE, Thinned, thinned
from fiveaxis.motion.time_law import Samples, TimeLaw, time_motion
from fiveaxis.motion.timing import STANDSTILL, block_times, feed_times

__all__ = [
    "AXIS_TOLERANCE",
    "PATH_TOLERANCE",
    "SPEED_TOLERANCE",
    "STANDSTILL",
    "Motion",
    "PeakRate",
    "Profile",
    "Samples",
    "Thinned",
    "TimeLaw",
    "block_profiles",
    "block_times",
    "feed_times",
    "fill_in",
    "fill_in_rows",
    "follow",
    "led_deviation",
    "midway_deviation",
    "motion_digest",
    "move_profiles",
    "off_plane",
    "peak_rates",
    "thinned",
    "time_motion",
]
