"""Energy of a motion."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fiveaxis.energy.drives import axis_powers, travel_costs
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import FrictionDrive, Machine
from fiveaxis.motion import Motion, TimeLaw
from fiveaxis.toolpath import MoveKind, part_places

# rad: gravity's torque on a tilting table is taken as steady over turns up to this.
TORQUE_STEP = np.radians(3.0)


@dataclass(frozen=True)
class KindEnergy:
    """What the moves of one kind cost.

    Parameters
    ----------
    metric, integral : travel metric and ∫P dt of all feed drives, J
    time : s
    """

    metric: float
    integral: float
    time: float


@dataclass(frozen=True)
class Energy:
    """What a motion costs.

    Two measures of the feed drives' energy stand side by side. The *travel metric* charges every axis for
    its travel, ``Σ W|Δq|`` at the programmed feed: what the optimiser minimises. The *power integral* is
    ``∫P dt`` of the drives over the moves' durations. They agree for drives whose power is proportional to
    their own speed; a drive with constant power pays in the integral for the whole move, however short its
    own travel.

    Parameters
    ----------
    by_axis : travel metric by axis letter, J
    integral_by_axis : ∫P dt of each feed drive, J
    base : base power × time, J; None where the machine's base power is unknown
    time : duration of the motion, s
    by_kind : what ``cut``, ``link`` and ``rapid`` moves cost, those that the motion has
    """

    by_axis: dict[str, float]
    integral_by_axis: dict[str, float]
    base: float | None
    time: float
    by_kind: dict[str, KindEnergy] = field(default_factory=dict)

    @property
    def total(self) -> float:
        """Travel metric of all axes, J."""
        return sum(self.by_axis.values())

    @property
    def power_integral(self) -> float:
        """∫P dt of all feed drives, J."""
        return sum(self.integral_by_axis.values())

    @property
    def metric_error(self) -> float | None:
        """How far the travel metric is from the power integral, as a share of it; None where that is 0."""
        return self.total / self.power_integral - 1.0 if self.power_integral else None

    @property
    def with_base(self) -> float | None:
        """Power integral and base power together, J; None where the base power is unknown."""
        return None if self.base is None else self.power_integral + self.base

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "total": self.total,
            "by_axis": dict(self.by_axis),
            "power_integral": self.power_integral,
            "base": self.base,
            "with_base": self.with_base,
            "time": self.time,
            "integral_by_axis": dict(self.integral_by_axis),
            "metric_error": self.metric_error,
            "by_kind": {name: asdict(share) for name, share in self.by_kind.items()},
        }


def motion_energy(machine: Machine, motion: Motion, integral: Array | None = None) -> Energy:
    """Add up what a motion costs.

    Parameters
    ----------
    machine : every axis with a drive
    motion : axis values and times
    integral : (n, k), J, ∫P dt by move and axis, where it is known better than from mean speeds
        (`law_energies`)

    Raises
    ------
    MachineError
        An axis without known power.

    References
    ----------
    Hayashi et al. (2018), Eq. (1), for the travel metric.
    """
    charged = move_energies(machine, motion)
    if integral is None:
        integral = move_powers(machine, motion) * motion.time[:, None]
    travel, spent = charged.sum(axis=0), integral.sum(axis=0)
    time = float(motion.time.sum())
    return Energy(
        by_axis={c: float(j) for c, j in zip(machine.letters, travel, strict=True)},
        integral_by_axis={c: float(j) for c, j in zip(machine.letters, spent, strict=True)},
        base=None if machine.base_power is None else machine.base_power * time,
        time=time,
        by_kind=_by_kind(motion, charged, integral),
    )


def _by_kind(motion: Motion, charged: Array, integral: Array) -> dict[str, KindEnergy]:
    """Add up travel metric and ∫P dt, (n, k) J, of the moves of each kind; the first row has none."""
    kinds = {kind: motion.kind[1:] == kind for kind in MoveKind}
    return {
        kind.name.lower(): KindEnergy(
            metric=float(charged[1:][rows].sum()),
            integral=float(integral[1:][rows].sum()),
            time=float(motion.time[1:][rows].sum()),
        )
        for kind, rows in kinds.items()
        if rows.any()
    }


def move_energies(machine: Machine, motion: Motion) -> Array:
    """Compute the travel metric of every move by axis.

    Returns
    -------
    (n, k), J: ``W⁺Δq⁺ + W⁻Δq⁻`` of the move that ends at the row, 0 for the first

    References
    ----------
    Hayashi et al. (2018), Eqs. (1), (6)-(8).
    """
    plus, minus = travel_costs(machine, motion.feed, motion.rapid)
    moves = motion.moves
    return plus * np.maximum(moves, 0.0) + minus * np.maximum(-moves, 0.0)


def move_powers(machine: Machine, motion: Motion, rounding: float = 0.0) -> Array:
    """Compute the drives' power in every move, at the move's mean speeds.

    Parameters
    ----------
    machine : every axis with a drive
    motion : axis values and times
    rounding : mm, ways of linear axes that are no more than this are none

    Returns
    -------
    (n, k), W, of the move that ends at the row; 0 where a move takes no time

    References
    ----------
    Drive models as in `drive_power`; no paper has the integral over moves.
    """
    moving = motion.time > 0.0
    is_linear = np.array([not axis.is_rotary for axis in machine.axes])
    parts = _parts(machine, np.where(moving[:, None], motion.moves, 0.0)) * moving
    row, begin = part_places(parts)
    # The middle of each part: a torque that changes along the move counts as it is there.
    rest = 1.0 - begin - 0.5 / parts[row]
    places = motion.positions[row] - rest[:, None] * motion.moves[row]
    real = ~is_linear | (np.abs(motion.moves) > rounding)
    speeds = np.where(real, motion.moves, 0.0)[row] / motion.time[row, None]
    powers = np.zeros_like(motion.moves)
    np.add.at(powers, row, axis_powers(machine, places, speeds) / parts[row, None])
    return powers


def _parts(machine: Machine, moves: Array) -> IntArray:
    """Say into how many parts moves, (n, k), are cut so that gravity's torque hardly changes in one, (n,)."""
    if not any(isinstance(axis.drive, FrictionDrive) for axis in machine.axes):
        return np.ones(len(moves), dtype=np.int64)
    turns = np.abs(moves[:, machine.rotary_columns]).max(axis=1, initial=0.0)
    return np.maximum(1, np.ceil(turns / TORQUE_STEP)).astype(np.int64)


def law_energies(machine: Machine, law: TimeLaw) -> Array:
    """Integrate the drives' power over a time law: over real speeds and accelerations.

    Returns
    -------
    (n, k), J: ∫P dt of the move that ends at the row, by axis

    References
    ----------
    Drive models as in `drive_power`; no paper has the integral over a time law.
    """
    phases = law.phases
    start, _, _ = law.at(phases.start)
    end, _, _ = law.at(phases.start + phases.duration)
    samples = law.sampled(_parts(machine, end - start))
    powers = axis_powers(machine, samples.position, samples.speed, samples.acceleration)
    energies = np.zeros((len(law.motion), len(machine.axes)))
    np.add.at(energies, samples.block, powers * samples.weight[:, None])
    return energies
