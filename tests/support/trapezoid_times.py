"""The closed form of a move from rest to rest, to hold the time law against."""

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model import Machine, Motion


def rest_times(motion: Motion, machine: Machine) -> Array:
    """How long blocks take, each from rest to rest; (n,) s.

    In a block all axes move in proportion: axis a covers ``Δq_a`` while the share goes from 0 to 1. So the
    share's speed is at most ``v_a / |Δq_a|``, and no more than the block's time allows, and its acceleration
    at most ``A_a / |Δq_a|``: a trapezoid of speed or, where that isn't reached, a triangle.

    References
    ----------
    Edem & Balogun (2018), Eqs. (2)-(3), for one axis; their triangle is misprinted: its time is
    ``2 sqrt(D / a)``.
    """
    moves = np.abs(motion.moves)
    bounds = [[a.max_speed, a.max_acceleration] for a in machine.axes]
    speed, acceleration = np.array([[np.inf if b is None else b for b in row] for row in bounds]).T
    times = np.zeros(len(motion))
    for i in np.flatnonzero(moves.any(axis=1)):
        axes = moves[i] > 0.0
        top = min(1.0 / motion.time[i] if motion.time[i] else np.inf, (speed[axes] / moves[i, axes]).min())
        rate = (acceleration[axes] / moves[i, axes]).min()
        times[i] = 2.0 / np.sqrt(rate) if top**2 > rate else 1.0 / top + top / rate
    return times
