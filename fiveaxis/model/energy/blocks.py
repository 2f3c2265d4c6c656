"""What a program's blocks cost over the time that a control takes for them."""

from __future__ import annotations

from dataclasses import replace

from fiveaxis.model.energy.totals import Energy, motion_energy
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.filling import Filling
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.run_time import Clock, PredictedTime
from fiveaxis.model.toolpath.path import Toolpath


def program_energy(
    machine: Machine, toolpath: Toolpath, motion: Motion, filling: Filling, clock: Clock
) -> Energy:
    """Compute the energy of the blocks that a motion becomes, without approach and retract."""
    return blocks_energy(machine, filling.blocks(toolpath, machine, motion), clock)


def blocks_energy(machine: Machine, blocks: Motion, clock: Clock, rounding: float = 0.0) -> Energy:
    """Compute the energy of a program's blocks over the control's time, and what limits their speed.

    It takes half as long again as `timed_energy`. The rounding, mm, is as for `motion_energy`.
    """
    taken = clock(blocks, machine)
    energy = timed_energy(machine, blocks, taken, rounding)
    return replace(energy, limited=taken.limiting.by_cause)


def timed_energy(machine: Machine, blocks: Motion, taken: PredictedTime, rounding: float = 0.0) -> Energy:
    """Compute the energy of blocks over their predicted times."""
    energy = motion_energy(machine, replace(blocks, time=taken.times), rounding=rounding)
    return replace(energy, feed_time=float(blocks.time.sum()), timing=taken.basis)
