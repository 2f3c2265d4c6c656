"""Run time of blocks on a control that plans them as LinuxCNC does: in servo cycles, with its look-ahead."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion.bounds import axis_bounds
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.servo_kernel import STATE, run_cycles
from fiveaxis.motion.servo_queue import EXACT, PARABOLIC, SPAN, queue_moves

# mm or rad: an axis that moves by less stands (CART_FUZZ of LinuxCNC's posemath.h).
STANDS = 1e-8


def servo_times(
    blocks: Motion, machine: Machine, cycle: float, *, blends: bool, tolerance: float = 0.0
) -> Array:
    """Run blocks through LinuxCNC's trajectory planner, from rest to rest.

    The length of a block is that of its X, Y and Z words, or of its rotary words where these stand; the speed
    along it changes by at most ``min_j A_j / |d_j|``, d the axes' steps per length. Followed exactly (G61),
    a block ends at rest, unless neither it nor the next turns a rotary axis and their directions d₁, d₂
    differ so little that the change of speed within one cycle T needs less than a tenth of every axis's
    acceleration::

        |d₂ − d₁|_j (v / T + a) < 0.1 A_j

    Blended (G64), the next block begins while this one brakes, each with half of its acceleration; between
    two blocks of X, Y and Z alone an arc may take the corner. Blocks are taken to be read in time; that
    LinuxCNC joins nearly straight blocks under ``G64 P`` isn't followed.

    Parameters
    ----------
    blocks : one a row, in the words that the control limits; with the times at their feeds
    machine : with accelerations of all axes
    cycle : s
    blends : whether blocks are blended
    tolerance : mm, that blends may deviate along X, Y and Z; 0 for none

    Returns
    -------
    times : (n,), s; a block without a move keeps its own

    References
    ----------
    LinuxCNC 2.9, src/emc/tp/tp.c and blendmath.c.
    """
    bounds = axis_bounds(machine)
    linear, rotary = machine.linear_columns, machine.rotary_columns
    steps = np.where(np.abs(blocks.moves) < STANDS, 0.0, blocks.moves)
    along, turn = (np.linalg.norm(steps[:, columns], axis=1) for columns in (linear, rotary))
    length = np.where(along > 0.0, along, turn)
    moving = np.flatnonzero(length > 0.0)
    times = np.where(length > 0.0, 0.0, blocks.time)
    if not len(moving):
        return times
    rates = np.abs(steps[moving]) / length[moving, None]
    spans = np.zeros(len(moving), SPAN)
    spans["block"], spans["length"], spans["whole"] = moving, length[moving], length[moving]
    spans["feed"] = length[moving] / blocks.time[moving]
    with np.errstate(divide="ignore"):
        spans["most"] = (bounds.speed / rates).min(axis=1)
        spans["push"] = (bounds.acceleration / rates).min(axis=1)
    straight = np.divide(
        steps[:, linear], along[:, None], out=np.zeros((len(steps), 3)), where=along[:, None] > 0.0
    )
    straight[along == 0.0, 0] = 1.0
    spans["way"], spans["turns"] = straight[moving], turn[moving] > 0.0
    spans["rapid"] = blocks.rapid[moving]
    spans["join"], spans["kink"] = PARABOLIC if blends else EXACT, np.inf
    limits = np.array([bounds.acceleration[linear], bounds.speed[linear]])
    joined = queue_moves(spans, limits, tolerance, cycle)
    spent = run_cycles(joined, np.zeros(len(joined), STATE), tolerance, cycle)
    return np.asarray(times + np.bincount(joined["block"], spent, len(times)))
