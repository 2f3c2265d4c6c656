"""Energy of a motion."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fiveaxis.energy.drives import axis_powers, is_proportional, travel_costs
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
    total, travel : ∫P dt and travel metric of all feed drives, J
    time : s
    """

    total: float
    travel: float
    time: float


@dataclass(frozen=True)
class Energy:
    """What a motion costs: ∫P dt of the feed drives over the moves' durations.

    The *travel metric* stands beside it, ``Σ W|Δq|`` at the programmed feed, which charges every axis for its
    travel alone. They agree for drives whose power is proportional to their own speed; a drive with constant
    power pays for the whole of a move, however short its own travel.

    Parameters
    ----------
    by_axis : ∫P dt by axis letter, J
    travel_by_axis : travel metric by axis letter, J
    least : J, ∫P dt if the power of a drive that is slower than any that was measured falls with its speed;
        None where speeds within moves are known only on average
    base : base power × time, J; None where the machine's base power is unknown
    time : duration of the motion, s, at the programmed feed and the axes' highest speeds
    by_kind : what ``cut``, ``link`` and ``rapid`` moves cost, those that the motion has
    run_time : s, that a control takes for it with accelerations and corners; None where that wasn't asked
    """

    by_axis: dict[str, float]
    travel_by_axis: dict[str, float]
    least: float | None
    base: float | None
    time: float
    by_kind: dict[str, KindEnergy] = field(default_factory=dict)
    run_time: float | None = None

    @property
    def total(self) -> float:
        """∫P dt of all feed drives, J."""
        return sum(self.by_axis.values())

    @property
    def travel(self) -> float:
        """Travel metric of all axes, J."""
        return sum(self.travel_by_axis.values())

    @property
    def travel_error(self) -> float | None:
        """How far the travel metric is from ∫P dt, as a share of it; None where that is 0."""
        return self.travel / self.total - 1.0 if self.total else None

    @property
    def with_base(self) -> float | None:
        """Feed drives and base power together, J; None where the base power is unknown."""
        return None if self.base is None else self.total + self.base

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "total": self.total,
            "by_axis": dict(self.by_axis),
            "least": self.least,
            "base": self.base,
            "with_base": self.with_base,
            "time": self.time,
            "run_time": self.run_time,
            "travel": self.travel,
            "travel_by_axis": dict(self.travel_by_axis),
            "travel_error": self.travel_error,
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
    charged, least = move_energies(machine, motion), None
    if integral is None:
        integral = move_powers(machine, motion) * motion.time[:, None]
        least = float((integral * _shares_of_slow(machine, motion)).sum())
    travel, spent = charged.sum(axis=0), integral.sum(axis=0)
    time = float(motion.time.sum())
    return Energy(
        by_axis={c: float(j) for c, j in zip(machine.letters, spent, strict=True)},
        travel_by_axis={c: float(j) for c, j in zip(machine.letters, travel, strict=True)},
        least=least,
        base=None if machine.base_power is None else machine.base_power * time,
        time=time,
        by_kind=_by_kind(motion, charged, integral),
    )


def _shares_of_slow(machine: Machine, motion: Motion) -> Array:
    """Give the share of its power that a drive takes if that falls below the measured speeds, (n, k).

    A drive whose power is in proportion to its speed anyway has nothing to lose.
    """
    slowest = np.zeros(len(machine.axes))
    for column, axis in enumerate(machine.axes):
        drive = axis.drive
        if drive is not None and drive.measured_from is not None and not is_proportional(drive):
            slowest[column] = drive.measured_from
    lasting = np.where(motion.time > 0.0, motion.time, 1.0)[:, None]
    speed = np.abs(motion.moves) / lasting
    return np.divide(speed, slowest, out=np.ones_like(speed), where=(speed > 0.0) & (speed < slowest))


def _by_kind(motion: Motion, charged: Array, integral: Array) -> dict[str, KindEnergy]:
    """Add up travel metric and ∫P dt, (n, k) J, of the moves of each kind; the first row has none."""
    kinds = {kind: motion.kind[1:] == kind for kind in MoveKind}
    return {
        kind.name.lower(): KindEnergy(
            total=float(integral[1:][rows].sum()),
            travel=float(charged[1:][rows].sum()),
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
