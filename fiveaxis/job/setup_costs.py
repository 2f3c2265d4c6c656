"""What a setup costs, roughly: on some of the path's locations, with nothing in the way or kept clear."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.collision.clearing import find_accessible
from fiveaxis.job.description import Job, SetupTable
from fiveaxis.machine import Machine
from fiveaxis.posture import Options, optimise
from fiveaxis.posture.masks.mask import MaskFunction
from fiveaxis.toolpath import Toolpath

# A setup is looked at roughly on at most so many locations.
ROUGH_LOCATIONS = 120


class SetupCosts:
    """Costs of setups, J, with the price of time; they raise `Infeasible` where a path can't be followed.

    Parameters
    ----------
    job : with its bounds and effort
    machine : in the given setup
    toolpath : the whole path
    around : what stands with the workpiece; None, or with nothing in it, where it keeps clear of nothing
    """

    def __init__(
        self, job: Job, machine: Machine, toolpath: Toolpath, around: Surroundings | None = None
    ) -> None:
        stride = -(-len(toolpath) // ROUGH_LOCATIONS)
        rows = np.unique(np.append(np.arange(0, len(toolpath), stride), len(toolpath) - 1))
        thinned = toolpath.at(rows)
        self.toolpath = thinned if thinned.cutting.any() else toolpath
        self.machine, self.around = machine, around
        bounds = job.constraints
        turn = None if bounds.max_turn is None else stride * bounds.max_turn
        self.constraints = replace(bounds, max_turn=turn if turn is None or turn < math.pi else 2.0 * math.pi)
        self.options = Options(
            # A rough path has no program of its own.
            objective="travel",
            up_penalty=job.up_penalty,
            time_price=job.time_price,
            effort="quick",
        )
        self.leaning = bounds.zoned(self.toolpath)
        self.price = (machine.base_power or 0.0) if job.time_price is None else job.time_price

    @property
    def has_obstacles(self) -> bool:
        """Whether there is something that a leaning tool could touch."""
        around = self.around or Surroundings()
        return self.around is not None and find_accessible(self.leaning, self.machine, around) is not None

    def free(self, setup: SetupTable) -> float:
        """Tell what a setup costs with nothing in the way."""
        return self._spent(setup, None)

    def clear(self, setup: SetupTable) -> float:
        """Tell what a setup costs where the tool keeps clear of what stands with the workpiece.

        Way and head between locations aren't looked at: on a path of some of them there is no such way.
        """
        there = self.machine.with_setup(setup.offset, setup.rotation)
        return self._spent(setup, find_accessible(self.leaning, there, self.around or Surroundings()))

    def _spent(self, setup: SetupTable, mask: MaskFunction | None) -> float:
        there = self.machine.with_setup(setup.offset, setup.rotation)
        energy = optimise(self.toolpath, there, self.constraints, replace(self.options, mask=mask)).energy
        return energy.travel + self.price * energy.time
