"""The electricity of a whole job by consumer: base, spindle, feed drives, cut and losses."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.base import Array, MachineError, SettingError, product
from fiveaxis.lab.cutting.cutting_forces import CuttingCoefficients, mean_cutting_power
from fiveaxis.lab.cutting.drilling import Drill, auxiliary_power, idle_power, mean_drilling_power
from fiveaxis.lab.cutting.engagement import WATT, Cut, CutCourse, EndMill, Engaged
from fiveaxis.model import (
    STANDSTILL,
    FrictionDrive,
    Machine,
    Motion,
    Provenance,
    WeightDrive,
    motion_energy,
    path_lengths,
)

logger = logging.getLogger(__name__)

JOULES_PER_KWH, SECONDS_PER_HOUR = 3.6e6, 3600.0


@dataclass(frozen=True)
class Process:
    """The cutter's engagement, constant along the path.

    Parameters
    ----------
    mill : the cutter, an end mill or a drill
    depth : mm, along the surface normal; of an end mill
    width : mm, between neighbouring passes; of an end mill
    spindle : rad/s
    coefficients : of cutter and material
    basis : of the coefficients: ``measured``, ``fitted`` or ``assumed``
    source : where the coefficients come from
    feed_force : N, of an end mill's cut against the feed; None where it isn't known
    """

    mill: EndMill | Drill
    depth: float
    width: float
    spindle: float
    coefficients: CuttingCoefficients
    basis: str = "assumed"
    source: str = ""
    feed_force: float | None = None

    def power(self, feeds: Array) -> Array:
        """Compute the mean power of the cut, (n,) W, at feeds, (n,) mm/s.

        A drill's includes what its thrust takes. An end mill's is linear in the feed, ``K_tc MRR + K_te A
        Zω/2π`` with MRR in proportion to it, so two feeds determine it.

        Raises
        ------
        SettingError, ToolError
            The engagement is impossible at one of them.
        """
        mill, spindle, k = self.mill, self.spindle, self.coefficients
        if isinstance(mill, Drill):
            return mean_drilling_power(mill, k, feeds, spindle)
        high = float(feeds.max())
        cuts = (Cut(mill, self.depth, self.width, feed, spindle) for feed in (high / 2.0, high))
        low, most = (mean_cutting_power(cut, k) for cut in cuts)
        return most + (most - low) * (feeds - high) / (high / 2.0)


@dataclass(frozen=True)
class Factors:
    """Price and emission of a kWh, and rate of the machine.

    Parameters
    ----------
    price : of 1 kWh
    currency : of the prices
    co2 : kg of CO₂ per kWh
    hour : of the machine
    """

    price: float | None = None
    currency: str = "EUR"
    co2: float | None = None
    hour: float | None = None

    def cost(self, energy: float, time: float) -> float | None:
        """Price an energy, J, and a time, s, by what has a price; None where nothing has."""
        prices = ((self.price, energy / JOULES_PER_KWH), (self.hour, time / SECONDS_PER_HOUR))
        known = [price * amount for price, amount in prices if price is not None]
        return sum(known) if known else None

    def emission(self, energy: float) -> float | None:
        """Compute the emission of an energy, J, in kg of CO₂; None without an emission per kWh."""
        return None if self.co2 is None else self.co2 * energy / JOULES_PER_KWH


@dataclass(frozen=True)
class Share:
    """One consumer's part of a job.

    Parameters
    ----------
    name : consumer
    energy : J; None where it isn't known
    basis : ``measured``, ``fitted``, ``assumed`` or ``unknown``
    source : where it comes from, or why it is unknown
    """

    name: str
    energy: float | None
    basis: str
    source: str


@dataclass(frozen=True)
class Budget:
    """The electricity of a job by consumer.

    Parameters
    ----------
    shares : consumers, also those whose energy is unknown
    time : s
    factors : price and emission of a kWh
    cut : what is removed of the stock over the time; None if no stock was cut
    """

    shares: tuple[Share, ...]
    time: float
    factors: Factors = Factors()
    cut: CutCourse | None = None

    @property
    def total(self) -> float:
        """Sum of the known energies, J."""
        return sum(s.energy for s in self.shares if s.energy is not None)

    @property
    def kwh(self) -> float:
        """The total in kWh."""
        return self.total / JOULES_PER_KWH

    @property
    def complete(self) -> bool:
        """Whether every consumer is known."""
        return all(s.energy is not None for s in self.shares)

    @property
    def cost(self) -> float | None:
        """Price of the total and of the machine's time; None without a price of either."""
        return self.factors.cost(self.total, self.time)

    @property
    def co2(self) -> float | None:
        """Emission of the total, kg; None without an emission per kWh."""
        return self.factors.emission(self.total)

    def as_dict(self) -> dict[str, Any]:
        """Return the table as plain data for JSON."""
        shares = [
            {"name": s.name, "energy": s.energy, "basis": s.basis, "said": s.source} for s in self.shares
        ]
        totals = {"total": self.total, "complete": self.complete, "kWh": self.kwh, "time": self.time}
        money = {"cost": self.cost, "currency": self.factors.currency, "co2_kg": self.co2}
        cut = {} if self.cut is None else {"cut": self.cut.as_dict()}
        return {"shares": shares} | totals | money | cut


def job_budget(
    machine: Machine,
    motion: Motion,
    process: Process | None = None,
    factors: Factors | None = None,
    integral: Array | None = None,
    engaged: Engaged | None = None,
) -> Budget:
    """Add up the electricity of a job: base, spindle idle, feed drives, cut, auxiliary.

    The feed drives take the power integral of the motion, against the cut's feed force where it is known. The
    spindle idles all the time; the cut takes the mean power of the engagement at each cutting move's feed,
    and causes the spindle drive's load loss.

    Parameters
    ----------
    machine : every axis with a drive; base, idle and auxiliary power where its file has them
    motion : axis values and times
    process : the engagement; without it spindle, cut and auxiliary are unknown
    factors : price and emission of a kWh
    integral : as for `motion_energy`
    engaged : what the moves take away of the stock, if it was cut: the cut's energy then is that of this

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    SettingError, ToolError
        The engagement is impossible.

    References
    ----------
    Wang et al. (2019): ``P = P_idle(n) + P_cutting + P_aux``; Olteanu et al., Eq. (1), for the cut.
    """
    force = None if process is None else process.feed_force
    energy = motion_energy(machine, motion, integral, feed_force=force or 0.0)
    taken = None if process is None else cutting_energies(machine, motion, process, engaged)
    course = None if engaged is None else CutCourse(motion.time, engaged.volume, taken)
    sources = {p.figure: p for p in machine.provenance}
    drives = [sources[name] for name in _drive_figures(machine) if name in sources]
    texts = sorted({p.text for p in drives})
    against = "without the cut's feed force" if force is None else f"against a feed force of {force:g} N"
    shares = [
        _share("base", energy.base, sources.get("base_power"), "the machine's base power isn't known"),
        Share("feed drives", energy.total, _weakest_basis(drives), "; ".join([*texts, against])),
        *_spindle_shares(machine, motion.time, process, taken, sources, engaged),
    ]
    budget = Budget(tuple(shares), energy.time, factors or Factors(), course)
    unknown = ", ".join(share.name for share in shares if share.energy is None)
    logger.info(
        "whole job %.1f J in %.1f s, %s",
        budget.total,
        budget.time,
        f"without {unknown}" if unknown else "all consumers known",
    )
    for share in shares:
        known = "unknown" if share.energy is None else f"{share.energy:.1f} J"
        logger.debug("%s: %s (%s): %s", share.name, known, share.basis, share.source)
    return budget


def cutting_energies(
    machine: Machine, motion: Motion, process: Process, engaged: Engaged | None = None
) -> Array:
    """Compute the energy that the cut takes from the spindle in every move of a motion, (n,) J.

    With the one engagement of a process, the feed of a move is the path length of the ball's centre, or of a
    flat end's tip, over the move's duration: an axis at its highest speed stretches the move, and the chips
    get thinner. A dwell cuts nothing.

    Parameters
    ----------
    engaged : what the moves take away of the stock, in place of the process's depth and width; a drill keeps
        its own engagement

    References
    ----------
    Olteanu et al., Eq. (1); `mean_cutting_power`, whose integral over a move is ``K_tc V + K_te A Z ω t/2π``.
    """
    mill = process.mill
    if engaged is not None and isinstance(mill, EndMill):
        k, passes = process.coefficients, mill.teeth * process.spindle * motion.time / (2.0 * np.pi)
        return (k.tangential * engaged.volume + k.tangential_edge * engaged.contact * passes) / WATT
    ball = isinstance(mill, EndMill) and mill.shape == "ball"
    length = path_lengths(machine, motion, mill.diameter / 2.0 if ball else 0.0)
    cutting = motion.cutting & (motion.time > 0.0) & (length > STANDSTILL)
    energies = np.zeros(len(motion))
    if cutting.any():
        times = motion.time[cutting]
        energies[cutting] = process.power(length[cutting] / times) * times
    return energies


def _spindle_shares(
    machine: Machine,
    times: Array,
    process: Process | None,
    taken: Array | None,
    sources: dict[str, Provenance],
    engaged: Engaged | None,
) -> list[Share]:
    if process is None or taken is None:
        why = "the job has no [process]"
        return [Share(name, None, "unknown", why) for name in ("spindle idle", "cutting", "auxiliary")]
    if process.spindle <= 0.0:
        raise SettingError(f"spindle speed is {process.spindle:g} rad/s; it must be above 0")
    time, energy = float(times.sum()), float(taken.sum())
    powers = np.divide(taken, times, out=np.zeros_like(taken), where=times > 0.0)
    squared = float(product(powers, taken))
    depth = f"{process.depth:g} mm deep and {process.width:g} mm wide everywhere"
    how = depth if engaged is None else f"over the stock as it is, {engaged.volume.sum():.5g} mm³"
    idle = loss = None
    if machine.spindle_idle is not None:
        power = float(idle_power(process.spindle, machine.spindle_idle))
        if power < 0.0:
            raise MachineError(
                f"spindle_idle of machine {machine.name!r} gives {power:g} W at {process.spindle:g} rad/s, "
                "below 0; check its coefficients and the range of speeds that they were fitted to"
            )
        idle = power * time
    if machine.auxiliary is not None:
        linear, quadratic = machine.auxiliary
        loss = float(auxiliary_power(energy, linear)) + quadratic * squared
    return [
        _share("spindle idle", idle, sources.get("spindle_idle"), "the machine's idle power isn't known"),
        Share("cutting", energy, process.basis, "; ".join([process.source, how])),
        _share("auxiliary", loss, sources.get("auxiliary"), "the machine's load loss isn't known"),
    ]


def _share(name: str, energy: float | None, source: Provenance | None, why_unknown: str) -> Share:
    if energy is None:
        return Share(name, None, "unknown", why_unknown)
    if source is None:
        return Share(name, energy, "assumed", "set in code")
    return Share(name, energy, _basis(source), source.text)


def _drive_figures(machine: Machine) -> list[str]:
    """List the figures that the drives' power depends on."""
    names = [f"{c} drive" for c in machine.letters]
    weighing = [a.letter for a in machine.axes if isinstance(a.drive, WeightDrive | FrictionDrive)]
    return names + [f"{c} moved_mass" for c in weighing] + (["load"] if weighing else [])


def _basis(source: Provenance) -> str:
    if source.band is not None:
        return "estimated"
    return "assumed" if source.assumed else "fitted" if source.fitted else "measured"


def _weakest_basis(sources: list[Provenance]) -> str:
    """Find the weakest basis of several figures; without any, assumed."""
    found = {_basis(p) for p in sources}
    return next((b for b in ("assumed", "estimated", "fitted", "measured") if b in found), "assumed")
