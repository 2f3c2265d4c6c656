"""What a control makes of a thinned motion at the rows that were left out."""

from dataclasses import replace

import numpy as np

from fiveaxis.model import linear_positions, tool_poses


def driven(machine, motion, kept, tcp=False):
    """Return the axes at the time of every row of a motion of which only the kept ones are written."""
    clock = np.cumsum(motion.time)
    moved = motion.positions
    if tcp:
        moved = np.hstack([tool_poses(machine, moved)[0], moved[:, machine.rotary_columns]])
    found = np.stack([np.interp(clock, clock[kept], column[kept]) for column in moved.T], axis=1)
    positions = linear_positions(machine, found[:, :3], found[:, 3:]) if tcp else found
    positions[kept] = motion.positions[kept]
    return replace(motion, positions=positions)
