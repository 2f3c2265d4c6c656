"""Axis motion along a path, and its timing."""

from fiveaxis.motion.deviation import PATH_TOLERANCE, axis_deviation, path_deviation
from fiveaxis.motion.filling import Fill, Filling, fill_in, inside_rapids, own_slack, respaced
from fiveaxis.motion.limiting import Limiting
from fiveaxis.motion.motion import Motion, follow, located, motion_digest
from fiveaxis.motion.planes import AXIS_TOLERANCE, FASTEST, AxisPlanes
from fiveaxis.motion.program_motion import Interpolation, Phase, ProgramMotion
from fiveaxis.motion.run_time import (
    USUAL_CLOCK,
    Clock,
    ControlTiming,
    PredictedTime,
    block_ends,
    predicted_time,
    programmed_time,
)
from fiveaxis.motion.steadiness import (
    PeakRate,
    SpeedChange,
    Steadiness,
    axis_uses,
    measure_steadiness,
    peak_rates,
    standing_speeds,
)
from fiveaxis.motion.thinning import SPEED_TOLERANCE, Thinned, thinned
from fiveaxis.motion.time_law import Samples, TimeLaw, time_motion
from fiveaxis.motion.timing import (
    LEAST_OF_PIVOT,
    STANDSTILL,
    axis_times,
    block_times,
    feed_times,
    least_times,
    rapid_findings,
    rapid_speeds,
    times_rapids,
)
from fiveaxis.options import Coordinates

__all__ = [
    "AXIS_TOLERANCE",
    "FASTEST",
    "LEAST_OF_PIVOT",
    "PATH_TOLERANCE",
    "SPEED_TOLERANCE",
    "STANDSTILL",
    "USUAL_CLOCK",
    "AxisPlanes",
    "Clock",
    "ControlTiming",
    "Coordinates",
    "Fill",
    "Filling",
    "Interpolation",
    "Limiting",
    "Motion",
    "PeakRate",
    "Phase",
    "PredictedTime",
    "ProgramMotion",
    "Samples",
    "SpeedChange",
    "Steadiness",
    "Thinned",
    "TimeLaw",
    "axis_deviation",
    "axis_times",
    "axis_uses",
    "block_ends",
    "block_times",
    "feed_times",
    "fill_in",
    "follow",
    "inside_rapids",
    "least_times",
    "located",
    "measure_steadiness",
    "motion_digest",
    "own_slack",
    "path_deviation",
    "peak_rates",
    "predicted_time",
    "programmed_time",
    "rapid_findings",
    "rapid_speeds",
    "respaced",
    "standing_speeds",
    "thinned",
    "time_motion",
    "times_rapids",
]
