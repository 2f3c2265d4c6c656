"""How far a rotary axis may turn from one location to the next."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, angle_between
from fiveaxis.motion import STANDSTILL, feed_times
from fiveaxis.toolpath import Constraints, Toolpath

# rad/s: rotary axes turn no faster at the programmed feed where nobody asks for another bound. A table of
# usual size turns at 30 1/min (`reference/machines`: 180 deg/s of most trunnions).
USUAL_SPEED = np.radians(180.0)
# Links may turn this many times as far as cuts: nothing is touched there.
LINK_SHARE = 3.0
# rad: no rotary axis turns farther in a cutting move, however long that takes: verification calls it a jump
# where nobody asks for more.
FARTHEST = np.radians(45.0)
# rad: where the pivot stands still no feed says how long a turn takes.
ON_THE_SPOT = np.radians(15.0)
# A step may always turn by this, rad.
LEAST_TURN = np.radians(0.01)


def turn_bounds(toolpath: Toolpath, constraints: Constraints, location: Array | None = None) -> Array:
    """Bound the turn of every rotary axis in each move of a path.

    A bound on a given move holds for what lies between its ends as well: inserted locations share it out. A
    move in which the program itself turns the tool farther may turn as far; where nobody asks for a bound,
    one in which the surface turns farther, too.

    Parameters
    ----------
    toolpath : n locations
    constraints : the largest turn in a cutting move, by default what `USUAL_SPEED` allows at the programmed
        feed, as far as `FARTHEST`, and over the path of the contact in cuts. Links may turn `LINK_SHARE`
        times as far
    location : (n,), where each lies among given ones; by default all are given

    Returns
    -------
    (n − 1,), rad
    """
    max_turn, turn_rate = constraints.max_turn, constraints.turn_rate
    cutting = toolpath.cutting[1:]
    share = np.ones(len(toolpath) - 1) if location is None else np.minimum(np.diff(location), 1.0)
    if max_turn is None:
        most = USUAL_SPEED * feed_times(toolpath)[1:]
        most = np.where(toolpath.lengths[1:] > STANDSTILL, most, ON_THE_SPOT)
        most = np.minimum(most, FARTHEST * share)
    else:
        most = max_turn * share
    most = np.where(cutting, most, LINK_SHARE * most)
    for direction in (toolpath.axis, toolpath.normal)[: 2 if max_turn is None else 1]:
        most = np.maximum(most, np.nan_to_num(angle_between(direction[1:], direction[:-1])))
    if turn_rate is not None:
        # A place that is there twice would forbid every turn between its two locations.
        steep = np.maximum(turn_rate * toolpath.lengths[1:], LEAST_TURN)
        most = np.where(cutting, np.minimum(most, steep), most)
    return np.maximum(most, LEAST_TURN)
