"""Slower cuts: where losses grow with speed they save, where power is for time or travel they don't."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds
from support.ring_path import ring

from fiveaxis.model import Filling, FrictionDrive, Machine, follow, program_energy
from fiveaxis.posture import Optimum
from fiveaxis.posture.solution import USUAL_CLOCK, Baseline
from fiveaxis.posture.strategy.front import slowed

# Rotary axes take friction and viscous losses of their own size.
VISCOUS = FrictionDrive(friction=2.0, viscous=5.0)
PLAIN = FrictionDrive(friction=2.0)


def solution_of(machine: Machine, drive: FrictionDrive, base: float | None = None) -> Optimum:
    """A ring at a lean of 30 deg, with itself as a baseline."""
    # Hardly any weight, so that gravity drives no axis.
    axes = tuple(
        replace(axis, drive=drive, moved_mass=None if axis.is_rotary else 1e-3) for axis in machine.axes
    )
    machine, path = replace(machine, axes=axes, base_power=base), ring(24)
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    motion = follow(path, machine, np.stack([turn, np.full(24, np.radians(-30.0))], axis=1))
    energy = program_energy(machine, path, motion, Filling(), USUAL_CLOCK)
    compared = {"itself": Baseline(motion, energy)}
    return Optimum(machine, path, tilt_bounds(path, (0, 180)), motion, energy, compared, {}, ())


def test_where_losses_grow_with_speed_every_cut_is_as_slow_as_allowed(hayashi):
    given = solution_of(hayashi, VISCOUS)
    found = slowed(given, 0.7, 0.0)
    np.testing.assert_allclose(found.toolpath.feed[1:], 0.7 * given.toolpath.feed[1:])
    assert found.energy.time == pytest.approx(given.energy.time / 0.7, rel=1e-6)
    assert found.energy.total < given.energy.total
    np.testing.assert_array_equal(found.motion.positions, given.motion.positions)
    # What it is compared with stays as it was.
    assert found.compared["itself"].toolpath is given.toolpath


def test_the_power_that_time_costs_keeps_the_feed(hayashi):
    assert slowed(solution_of(hayashi, VISCOUS, base=1e6), 0.7, 0.0) is None
    assert slowed(solution_of(hayashi, VISCOUS), 0.7, 1e6) is None


def test_where_power_is_in_proportion_to_speed_nothing_is_gained(hayashi):
    assert slowed(solution_of(hayashi, PLAIN), 0.7, 0.0) is None
