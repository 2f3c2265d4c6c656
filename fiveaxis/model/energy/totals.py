"""Energy of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, HasColumns, IntArray, ShownAsTable, Table
from fiveaxis.model.energy.drives import axis_powers, moving_powers, travel_costs
from fiveaxis.model.machine.drives import FrictionDrive
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.steadiness import Steadiness, measure_steadiness, standing_speeds
from fiveaxis.model.motion.time_law import TimeLaw
from fiveaxis.model.toolpath.dividing import part_places
from fiveaxis.model.toolpath.operation import MoveKind

Timing = Literal["programmed", "accelerations"]
DRAWN = 100  # machines drawn from the bands of estimated drives
TORQUE_STEP = np.radians(3.0)  # rad, turn over which gravity's torque on a tilting table counts as constant


@dataclass(frozen=True)
class KindEnergy:
    """Cost of the moves of one kind: ∫P dt and travel metric of all feed drives, J, and the time, s."""

    total: float
    travel: float
    time: float


@dataclass(frozen=True)
class Energy(ShownAsTable, HasColumns):
    """Cost of a motion: ∫P dt of the feed drives over the moves' durations.

    The durations are those that the control takes with the machine's accelerations, where these are known,
    else those at the programmed feed and the axes' highest speeds.

    The *travel metric* beside it, ``Σ W|Δq|`` at the programmed feed, charges every axis for its own travel
    only. The two agree for drives whose power is in proportion to their own speed; a drive with constant
    power pays for the whole of a move in which it runs at a measured speed.

    Parameters
    ----------
    by_axis : ∫P dt by axis letter, J
    travel_by_axis : travel metric by axis letter, J
    most : J, ∫P dt if drives took all of their constant power below the slowest measured speed, too, which
        measured servo drives don't; None where ∫P dt comes from a time law
    base : base power × time, J; None where the machine's base power is unknown
    time : duration of the motion, s
    feed_time : s, at the programmed feed and the axes' highest speeds
    steadiness : starts, reversals and changes of speed of the axes
    timing : what the durations are: ``programmed``, or with ``accelerations``
    by_kind : cost of the motion's ``cut``, ``link`` and ``rapid`` moves
    limited : s, for how long each cause limits the speed (`fiveaxis.model.motion.limiting`), longest first;
        their sum is the duration. Empty where that wasn't asked for
    """

    by_axis: dict[str, float]
    travel_by_axis: dict[str, float]
    base: float | None
    time: float
    feed_time: float
    steadiness: Steadiness = field(compare=False)
    timing: Timing = "programmed"
    by_kind: dict[str, KindEnergy] = field(default_factory=dict)
    most: float | None = None
    limited: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        axes = ", ".join(f"{letter} {joule:.0f}" for letter, joule in self.by_axis.items())
        return f"<Energy {self.total:.0f} J in {self.time:.1f} s: {axes}>"

    def _table(self) -> Table:
        starts, reversals = self.steadiness.starts, self.steadiness.reversals
        rows = [
            (c, f"{joules:.1f}", f"{self.travel_by_axis[c]:.1f}", str(starts[c]), str(reversals[c]))
            for c, joules in self.by_axis.items()
        ]
        events = str(self.starts), str(self.reversals)
        rows.append(("feed drives", f"{self.total:.1f}", f"{self.travel:.1f}", *events))
        rows.append(("base power", "unknown" if self.base is None else f"{self.base:.1f}", "", "", ""))
        return ("drive", "energy, J", "travel metric, J", "starts", "reversals"), rows

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return a row per feed drive: ``drive``, ``energy_J``, ``travel_J``, ``starts``, ``reversals``."""
        by_drive: dict[str, Mapping[str, float]] = {
            "energy_J": self.by_axis,
            "travel_J": self.travel_by_axis,
            "starts": self.steadiness.starts,
            "reversals": self.steadiness.reversals,
        }
        drives = list(self.by_axis)
        return {
            "drive": np.array(drives),
            **{name: np.array([figures[c] for c in drives]) for name, figures in by_drive.items()},
        }

    @property
    def total(self) -> float:
        """∫P dt of all feed drives, J."""
        return sum(self.by_axis.values())

    @property
    def band(self) -> str | None:
        """How far the energy could lie above the price, in words; None where that is less than a joule."""
        if self.most is None or round(self.most) == round(self.total):
            return None
        return (
            f"up to {self.most:.0f} J if drives took their whole power below the slowest measured speed, too"
        )

    @property
    def joules(self) -> Array:
        """(k,), J, ∫P dt of each feed drive, in column order."""
        return np.array(list(self.by_axis.values()))

    @property
    def travel(self) -> float:
        """Travel metric of all axes, J."""
        return sum(self.travel_by_axis.values())

    @property
    def starts(self) -> int:
        """Number of starts of all axes."""
        return sum(self.steadiness.starts.values())

    @property
    def reversals(self) -> int:
        """Number of reversals of all axes."""
        return sum(self.steadiness.reversals.values())

    @property
    def travel_error(self) -> float | None:
        """Relative difference of the travel metric from ∫P dt; None where that is 0."""
        return self.travel / self.total - 1.0 if self.total else None

    @property
    def with_base(self) -> float | None:
        """Energy of feed drives and base power, J; None where the base power is unknown."""
        return None if self.base is None else self.total + self.base

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "total": self.total,
            "by_axis": dict(self.by_axis),
            "most": self.most,
            "base": self.base,
            "with_base": self.with_base,
            "time": self.time,
            "feed_time": self.feed_time,
            "timing": self.timing,
            "limited": dict(self.limited),
            "travel": self.travel,
            "travel_by_axis": dict(self.travel_by_axis),
            "travel_error": self.travel_error,
            **self.steadiness.as_dict(),
            "by_kind": {name: asdict(share) for name, share in self.by_kind.items()},
        }


def energy_draws(machine: Machine) -> Array | None:
    """Draw machines whose drives lie within the bands of the estimated ones; None where none is estimated.

    They are (d, k), true power over estimated power of each drive, log-uniform in its band and 1 for a known
    drive; the same every time.
    """
    if not machine.bands:
        return None
    ends = np.log([machine.bands.get(letter, (1.0, 1.0)) for letter in machine.letters])
    share = np.random.default_rng(0).uniform(size=(DRAWN, len(ends)))
    return np.exp(ends[:, 0] + share * (ends[:, 1] - ends[:, 0]))


def motion_energy(
    machine: Machine,
    motion: Motion,
    integral: Array | None = None,
    rounding: float = 0.0,
    feed_force: float = 0.0,
    ends: BoolArray | None = None,
) -> Energy:
    """Add up the cost of a motion and its travel metric (Hayashi et al. 2018, Eq. 1); count its starts.

    Parameters
    ----------
    integral : (n, k), J, ∫P dt by move and axis from a time law (`law_energies`); from mean speeds by default
    rounding : mm, travel of a linear axis up to which it counts as standing where starts are counted
    feed_force : N, of the cut against the feed in cutting moves; not part of the travel metric
    ends : (n,), as for `measure_steadiness`

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    """
    charged, most = move_energies(machine, motion), None
    if integral is None:
        integral = move_powers(machine, motion, feed_force) * motion.time[:, None]
        most = float(integral.sum())
        if moving_powers(machine).any():
            constant = move_powers(_with_constant_powers(machine), motion, feed_force)
            most = float((constant * motion.time[:, None]).sum())
    travel, spent = charged.sum(axis=0), integral.sum(axis=0)
    time = float(motion.time.sum())
    return Energy(
        by_axis={c: float(j) for c, j in zip(machine.letters, spent, strict=True)},
        travel_by_axis={c: float(j) for c, j in zip(machine.letters, travel, strict=True)},
        base=None if machine.base_power is None else machine.base_power * time,
        time=time,
        feed_time=time,
        steadiness=measure_steadiness(machine, motion, rounding, ends),
        by_kind=_by_kind(motion, charged, integral),
        most=most,
    )


def _with_constant_powers(machine: Machine) -> Machine:
    """Return a machine whose drives take their constant power wherever an axis doesn't stand."""
    known = ((a, a.drive, float(v)) for a, v in zip(machine.axes, standing_speeds(machine), strict=True))
    axes = tuple(a if d is None else replace(a, drive=replace(d, measured_from=v)) for a, d, v in known)
    return replace(machine, axes=axes)


def _by_kind(motion: Motion, charged: Array, integral: Array) -> dict[str, KindEnergy]:
    """Add up travel metric and ∫P dt, (n, k) J, of the moves of each kind; the first row isn't a move."""
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
    """Compute the travel metric of every move by axis, (n, k) J: ``W⁺Δq⁺ + W⁻Δq⁻``, 0 for the first row.

    It is that of Hayashi et al. (2018), Eqs. 1 and 6-8.
    """
    plus, minus = travel_costs(machine, motion.feed, motion.rapid)
    moves = motion.moves
    return plus * np.maximum(moves, 0.0) + minus * np.maximum(-moves, 0.0)


def move_powers(machine: Machine, motion: Motion, feed_force: float = 0.0) -> Array:
    """Compute the drives' power in every move, (n, k) W, at the move's mean speeds; 0 where it takes no time.

    Parameters
    ----------
    feed_force : N, of the cut against the feed in cutting moves
    """
    moving, moves = motion.time > 0.0, motion.moves
    parts = _parts(machine, np.where(moving[:, None], moves, 0.0)) * moving
    row, begin = part_places(parts)
    # A torque that changes along the move is evaluated at the middle of each part.
    rest = 1.0 - begin - 0.5 / parts[row]
    middles = motion.positions[row] - rest[:, None] * moves[row]
    speeds = moves[row] / motion.time[row, None]
    powers = np.zeros_like(moves)
    force = np.where(motion.cutting[row], feed_force, 0.0) if feed_force else None
    np.add.at(powers, row, axis_powers(machine, middles, speeds, feed_force=force) / parts[row, None])
    return powers


def _parts(machine: Machine, moves: Array) -> IntArray:
    """Count the parts, (n,), of moves, (n, k), in each of which gravity's torque hardly changes."""
    if not any(isinstance(axis.drive, FrictionDrive) for axis in machine.axes):
        return np.ones(len(moves), dtype=np.int64)
    turns = np.abs(moves[:, machine.rotary_columns]).max(axis=1, initial=0.0)
    return np.maximum(1, np.ceil(turns / TORQUE_STEP)).astype(np.int64)


def law_energies(machine: Machine, law: TimeLaw, feed_force: float = 0.0) -> Array:
    """Integrate the drives' power over a time law, with its speeds and accelerations, (n, k) J by move."""
    phases = law.phases
    start, _, _ = law.at(phases.start)
    end, _, _ = law.at(phases.start + phases.duration)
    samples = law.sampled(_parts(machine, end - start))
    force = np.where(law.motion.cutting[samples.block], feed_force, 0.0) if feed_force else None
    powers = axis_powers(machine, samples.position, samples.speed, samples.acceleration, force)
    energies = np.zeros((len(law.motion), len(machine.axes)))
    np.add.at(energies, samples.block, powers * samples.weight[:, None])
    return energies
