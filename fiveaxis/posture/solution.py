"""The optimiser's result: the motion, its costs, baselines and stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, HasColumns, ShownAsTable, Table, angle_between, product
from fiveaxis.model import (
    USUAL_CLOCK,
    Clock,
    Energy,
    Filling,
    Limiting,
    Machine,
    Motion,
    TiltBounds,
    Toolpath,
    energy_draws,
    lead_lean,
    motion_energy,
    move_powers,
    tool_poses,
)
from fiveaxis.posture.bound.lower_bound import LowerBound
from fiveaxis.posture.local.optima import Optimality, optimality
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.turns.stops import Rewind

# Names of the result, and of the baseline with the input's own postures.
RESULT, AS_PROGRAMMED = "optimised", "as-programmed"
# Locations of the longest path of which distance from an optimum is measured: a million would take 7 GB.
MOST_MEASURED = 50_000


@dataclass(frozen=True)
class SolverStep:
    """Record of one step of the solver.

    Parameters
    ----------
    name : which search, or the refinement and the start it refined
    status : reported by the step, e.g. ``Solve_Succeeded``
    before, after : objective, J; `before` is None for a search, which has no start
    """

    name: str
    status: str
    before: float | None
    after: float

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Baseline:
    """A motion that the result is compared with.

    Parameters
    ----------
    motion, energy : of its program
    toolpath : its locations if they differ from the result's, since each path has its own rewinds
    note : how it deviates from what its name says; may be empty
    admitted : whether it keeps the bounds that are asked for: a program of somebody's own may not
    """

    motion: Motion
    energy: Energy
    toolpath: Toolpath | None = None
    note: str = ""
    admitted: bool = True

    def __repr__(self) -> str:
        return f"<Baseline: {self.energy!r}>"


@dataclass(frozen=True, eq=False)
class Unwrapped:
    """A path before its axes were rewound into their limits, or one without rewinds.

    Parameters
    ----------
    toolpath : without rewinds
    problem : on the machine with axes of unlimited travel; or, where the path was squeezed into fewer turns,
        within those
    rotary : (n, 2), rad, chain order
    rewinds : that take its axes back into their limits, in path order
    """

    toolpath: Toolpath
    problem: Problem
    rotary: Array
    rewinds: tuple[Rewind, ...]


@dataclass(frozen=True, eq=False)
class Optimum(ShownAsTable, HasColumns):
    """The cheapest motion that was found, and its baselines.

    Parameters
    ----------
    machine, toolpath, tilt : the problem
    motion : the result
    energy : of its program: the blocks that the motion becomes, without approach and retract
    compared : baselines by name
    missing : baselines that don't exist for this path, with the reason
    stages : what the solver did, in order
    problem : what was solved, with the prices near the result; None for a solution that was put together by
        hand or has rewinds
    unwrapped : the path of a solution with rewinds before these
    filling : how blocks are inserted between its locations, and removed
    clock : how long the control takes for blocks
    bound : on the cost of every posture, if one was asked for
    spent : (n,), J, energy so far at each location, by name, where the price of a text says it
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    motion: Motion
    energy: Energy
    compared: Mapping[str, Baseline]
    missing: Mapping[str, str]
    stages: tuple[SolverStep, ...]
    problem: Problem | None = None
    unwrapped: Unwrapped | None = None
    filling: Filling = field(default_factory=Filling)
    clock: Clock = USUAL_CLOCK
    bound: LowerBound | None = None
    spent: Mapping[str, Array] = field(default_factory=dict)

    @property
    def baselines(self) -> dict[str, Energy]:
        """Energy of every baseline, by name."""
        return {name: b.energy for name, b in self.compared.items()}

    @property
    def energies(self) -> dict[str, Energy]:
        """Energy of the result, under the name `RESULT`, and of every baseline."""
        return {RESULT: self.energy, **self.baselines}

    @cached_property
    def kkt(self) -> Optimality | None:
        """How far the path `before_rewinds` is from a local optimum; None without, or of a very long one.

        A mask isn't part of the problem: where it keeps the path from the optimum, the residual shows it.
        """
        solved = self.before_rewinds
        if solved is None or len(solved.problem) > MOST_MEASURED:
            return None
        return optimality(solved.problem, solved.rotary)

    @property
    def before_rewinds(self) -> Unwrapped | None:
        """The path that was solved, without rewinds; None for a solution that was put together by hand."""
        if self.unwrapped is not None or self.problem is None:
            return self.unwrapped
        rotary = self.motion.positions[:, self.machine.rotary_columns]
        return Unwrapped(self.toolpath, self.problem, rotary, ())

    @property
    def travel(self) -> float:
        """Travel metric at the locations, J."""
        return motion_energy(self.machine, self.motion).travel

    @property
    def gap(self) -> float | None:
        """Share of the cost above the lower bound: 0 proves the optimum. None without a bound."""
        return None if self.bound is None else self.bound.gap(self._bounded_cost)

    @property
    def left(self) -> str | None:
        """How much any posture could still save, in words; None without a bound."""
        return None if self.bound is None else self.bound.in_words(self._bounded_cost)

    @property
    def _bounded_cost(self) -> float:
        """What the lower bound is of, J, of the program's blocks."""
        of_travel = self.bound is not None and self.bound.of == "travel"
        return self.energy.travel if of_travel else self.energy.total

    def __repr__(self) -> str:
        best, against = self.cheapest(), "no baseline"
        if best in (savings := self.savings()):
            unknown = self.to_measure(best)
            known = f"{100.0 * savings[best]:.1f} % less than {best}"
            against = f"saving not known: {unknown}" if unknown else known
        what = f"{self.energy.total:.0f} J in {self.energy.time:.1f} s, {against}"
        return f"<Solution of {self.toolpath.name or 'a path'} on {self.machine.name}: {what}>"

    def _table(self) -> Table:
        savings = self.savings()
        rows = [
            (
                name,
                f"{energy.total:.1f}",
                f"{energy.time:.1f}",
                f"{savings[name]:.1%}" if name in savings else "",
                str(energy.starts),
                str(energy.reversals),
            )
            for name, energy in self.energies.items()
        ]
        return ("program", "feed drives, J", "time, s", "saved", "starts", "reversals"), rows

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the locations by columns, (n,) each.

        They are those of `Motion.columns`; ``tilt_deg``, ``lead_deg`` and ``lean_deg`` of the tool against
        surface normal and feed, NaN where there is none; ``X_W``, ``A_W`` and so on, the mean power of each
        axis in the move to the location, over the time that the control takes for it.
        """
        path, motion = self.toolpath, self.timed()
        axis = tool_poses(self.machine, motion.positions)[1]
        lead, lean = lead_lean(path, axis)
        angles = {"tilt": angle_between(path.normal, axis), "lead": lead, "lean": lean}
        found = motion.columns() | {f"{name}_deg": np.degrees(angle) for name, angle in angles.items()}
        powers = zip(motion.letters, move_powers(self.machine, motion).T, strict=True)
        return found | {f"{letter}_W": power for letter, power in powers}

    def plot(self, axes: Sequence[Any]) -> None:
        """Draw the axes along the path, over its length, mm: their values, mm and deg, and mean powers, W.

        Parameters
        ----------
        axes : two of matplotlib, as ``matplotlib.pyplot.subplots(2, sharex=True)[1]`` has them
        """
        values, powers = axes
        columns = self.columns()
        along = np.cumsum(self.toolpath.lengths)
        for axis in self.machine.axes:
            values.plot(along, columns[f"{axis.letter}_{axis.unit}"], label=f"{axis.letter}, {axis.unit}")
            powers.plot(along, columns[f"{axis.letter}_W"], label=axis.letter)
        values.set_ylabel("axis value, mm and deg")
        powers.set_ylabel("power, W")
        powers.set_xlabel("length along the path, mm")
        for drawn in axes:
            drawn.legend()

    def savings(self) -> dict[str, float]:
        """Compute the saved share of the feed drives' energy against each baseline, at most 1."""
        return {
            name: 1.0 - self.energy.total / energy.total
            for name, energy in self.baselines.items()
            if energy.total > 0.0
        }

    def cheapest(self, measure: str = "total") -> str | None:
        """Name the cheapest baseline by an attribute of `Energy`, of those within bounds if there are any."""
        fair = [name for name, one in self.compared.items() if one.admitted] or list(self.compared)
        return min(fair, key=lambda name: getattr(self.baselines[name], measure), default=None)

    def to_measure(self, baseline: str, *, with_base: bool = False) -> str:
        """Say which drives to measure where estimates leave open whether a baseline costs more; else nothing.

        Those of widest effect come first; `with_base` is as for `savings_ranges`.
        """
        low, high = self.savings_ranges(with_base=with_base).get(baseline, (0.0, 0.0))
        if not low < 0.0 < high:
            return ""
        bands, own, other = self.machine.bands, self.energy.by_axis, self.baselines[baseline].by_axis
        width = {c: abs(own[c] - other[c]) * (most - least) for c, (least, most) in bands.items()}
        widest = ", ".join(sorted(bands, key=width.__getitem__, reverse=True))
        return f"measure the drives of {widest} (fiveaxis calibrate), those of widest effect first"

    def savings_ranges(self, *, with_base: bool = False) -> dict[str, tuple[float, float]]:
        """Compute between which shares the savings lie if drives are estimated; empty if none is.

        The same program runs on machines that are drawn from the bands of the drives (`energy_draws`). With
        `with_base` the base power over the cycle time counts, where it is known.
        """
        if not self.machine.bands:
            return {}
        own, ranges = self._drawn(self.energy, with_base), {}
        for name, energy in self.baselines.items():
            if energy.total > 0.0:
                saved = 1.0 - own / self._drawn(energy, with_base)
                ranges[name] = (float(saved.min()), float(saved.max()))
        return ranges

    def energy_range(self, *, with_base: bool = False) -> tuple[float, float]:
        """Compute between which energies the program's lies, J; `with_base` is as for `savings_ranges`.

        Drives are anywhere in the bands of estimated ones; above, `Energy.most` says what they take at most.
        """
        energy, drawn = self.energy, self._drawn(self.energy, with_base)
        above = 0.0 if energy.most is None else energy.most - energy.total
        return float(drawn.min()), float(drawn.max()) + max(above, 0.0)

    def _drawn(self, energy: Energy, with_base: bool) -> Array:
        """Compute an energy on machines drawn from the bands of estimated drives, (d,) J."""
        draws, joules = energy_draws(self.machine), energy.joules
        spent = joules.sum(keepdims=True) if draws is None else product(draws, joules)
        return np.asarray(spent + ((with_base and energy.base) or 0.0))

    def time_savings(self) -> dict[str, float]:
        """Compute the saved share of the program's time against each baseline."""
        times = {name: energy.time for name, energy in self.baselines.items()}
        return {name: 1.0 - self.energy.time / time for name, time in times.items() if time}

    def timed(self, name: str = RESULT) -> Motion:
        """Return the motion, or a baseline's, with the control's times, or else the programmed ones."""
        return self._run(name)[0]

    def limiting(self, name: str = RESULT) -> Limiting:
        """Return what limits the speed in each row of the motion, or of a baseline's, and for how long."""
        return self._run(name)[1]

    @cached_property
    def _runs(self) -> dict[str, tuple[Motion, Limiting]]:
        """Motions in the control's time, and what limits them, by name: those that were asked for."""
        return {}

    def _run(self, name: str) -> tuple[Motion, Limiting]:
        if name not in self._runs:
            given = self if name == RESULT else self.compared[name]
            self._runs[name] = self._in_time(given.motion, given.toolpath or self.toolpath)
        return self._runs[name]

    def _in_time(self, motion: Motion, path: Toolpath) -> tuple[Motion, Limiting]:
        if self.clock.is_programmed(self.machine) or len(motion) == 1:
            return motion, self.clock(motion, self.machine).limiting
        fill = self.filling.thin(self.filling.fill(path, self.machine, motion))
        taken = self.clock(fill.blocks, self.machine)
        rows = np.searchsorted(fill.row, np.arange(len(motion)))

        def along(times: Array) -> Array:
            return np.diff(np.cumsum(fill.times(times))[rows], prepend=0.0)

        spent = np.stack([along(times) for times in taken.limiting.time.T], axis=1)
        return replace(motion, time=along(taken.times)), replace(taken.limiting, time=spent)

    def residuals(self) -> dict[str, float]:
        """Audit the motion against the problem; every figure is 0 for a perfect solution.

        Returned are the largest overruns ``tilt``, rad, and ``limit``, mm or rad, and as ``contact`` the
        largest distance between the path's pivot and the one that the axis values give, mm.
        """
        tip, axis = tool_poses(self.machine, self.motion.positions)
        path = self.toolpath
        reached = path.zone.pivot_of_tip(tip, path.normal, axis)
        leans = ((bound, bound.angles(axis)) for bound in self.tilt.all)
        overrun = np.concatenate([np.maximum(lean - b.high, b.low - lean) for b, lean in leans])
        return {
            # Unbounded rows are NaN.
            "tilt": float(np.nanmax(overrun, initial=0.0)),
            "limit": float(np.nanmax(self.machine.limit_excess(self.motion.positions), initial=0.0)),
            "contact": float(np.linalg.norm(reached - path.pivot, axis=1).max()),
        }
