"""The optimisation problem, which can be inspected before it is solved."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model import (
    PER_LOCATION,
    Machine,
    StepTable,
    TiltBounds,
    Toolpath,
    Zone,
    axis_bounds,
    least_times,
    lifting_costs,
    per_step,
    require_orienting,
    require_positioning,
    travel_costs,
)
from fiveaxis.posture.location_model import LocationModel
from fiveaxis.posture.terms import OTHERS, Term, durations, terms_of

# Where rotary steps are bounded, no step of a thinned path is larger than this (or than the bound itself): it
# would skip postures that the path has to pass through and that weren't checked.
LONGEST_HOP = np.radians(60.0)
# Price of a change of speed beyond an axis's acceleration: J per rad/s, more than is saved by turning faster,
# and J per mm/s, that of a turn 100 mm from its centre.
ROTARY_EXCESS_PRICE, LINEAR_EXCESS_PRICE = 100.0, 1.0
# An axis value past its limit, or a cosine past its bound, by less than this is rounding (mm, rad, 1).
ALLOWED = 1e-9
# Price of a violation where it isn't forbidden, J per mm, per rad and per unit of cosine; of a cut's turn
# beyond its bound, J/rad, higher than of any turn of a link.
VIOLATION_PRICE, CUT_TURN_PRICE = 1e4, 1e5

Rows = IntArray | slice


@dataclass(frozen=True, eq=False)
class Problem(StepTable):
    """Choose two rotary angles for every location so that the objective is minimal.

    ``Σ_i [Σ_a (W⁺_a Δq⁺_a + W⁻_a Δq⁻_a) + P (τ_i − L_i/F_i) + μ_i ‖Δρ_i‖²]`` subject to the bounds on the
    tool's lean, the axis limits and the largest rotary step; the costs of travel are those of form-shaping
    Eq. 1. ``τ_i = max(L_i/F_i, max_a |Δq_a| / v_a)`` is the duration of a move. Its time at the programmed
    feed doesn't depend on the posture, so only the rest counts; of a rapid move, which has no feed, all of it
    (`least_times`). Where an axis has a highest acceleration a, a change of Δq/τ from one cut to the next
    beyond ``a (τ_i + τ_{i+1}) / 2``, with the feed's τ, would slow the machine down, and has a price. This
    record has the figures; the expressions are in `fiveaxis.posture.terms`.

    Parameters
    ----------
    machine : two rotary and three linear axes
    pivot : (n, 3), mm, workpiece frame; the tool leans about it
    normal : (n, 3), unit vectors out of the material, zero where unknown
    zone : the part of the cutter's profile whose centre is the pivot
    bounds : on the angle between tool axis and a direction; all of them hold. Rows whose direction is NaN
        (links) are bounded by the axis limits alone
    plus, minus : (n − 1, k), J/mm and J/rad of the step from row i to i + 1
    max_turn : (n − 1, 2), rad, largest step of each rotary axis, chain order; infinite where unbounded
    strict : (n − 1,), whether the step cuts, where `max_turn` is a bound; on links exceeding it has a price
    least_time : (n − 1,), s, of the step at the programmed feed; 0 for a rapid move
    top_speed : (k,), mm/s and rad/s, infinite where unknown
    top_acceleration : (k,), mm/s² and rad/s², infinite where unknown
    excess_price : (k,), J per mm/s and per rad/s, of a change of speed beyond that acceleration
    time_price : J/s, P, of a step's time beyond the least
    bend_price : (n − 1,), J/rad², μ
    ramps : (2, n − 1, k), pace in s/mm and s/rad, and grace in s: a step waits for ``pace |Δq| − grace`` of
        each axis; None for ``|Δq| / v − L/F``
    """

    machine: Machine
    pivot: Array = field(metadata=PER_LOCATION)
    normal: Array = field(metadata=PER_LOCATION)
    zone: Zone
    bounds: tuple[TiltBounds, ...] = field(metadata=PER_LOCATION)
    plus: Array = field(metadata=per_step(spread=1, opposite="minus"))
    minus: Array = field(metadata=per_step(spread=1, opposite="plus"))
    max_turn: Array = field(metadata=per_step())
    strict: BoolArray = field(metadata=per_step())
    least_time: Array = field(metadata=per_step())
    top_speed: Array
    top_acceleration: Array
    excess_price: Array
    time_price: float
    # A turn spread over m steps bends 1/m as much as the same turn in one.
    bend_price: Array = field(metadata=per_step(spread=2))
    ramps: Array | None = field(default=None, metadata=per_step(axis=1))

    @classmethod
    def build(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        tilt: TiltBounds,
        *,
        up_penalty: float = 0.0,
        max_turn: Array | float = np.inf,
        time_price: float = 0.0,
        bend_price: float = 0.0,
    ) -> Problem:
        """Build the problem of a path on a machine within bounds.

        Parameters
        ----------
        toolpath, machine, tilt : what to solve
        up_penalty : J/mm, at least 0, added to the cost of lifting what a linear axis carries
        max_turn : rad, largest turn of a rotary axis in each step (`turn_bounds`), or one for all
        time_price : J/s, at least 0, of time beyond that at the programmed feed
        bend_price : J/rad², at least 0, of ‖Δρ‖² between given locations; on the m parts of a move m times
            that, so that a turn that is spread evenly over them costs the same

        Raises
        ------
        MachineError
            An axis without power, or too few axes (`DegenerateChain`).
        """
        require_positioning(machine)
        require_orienting(machine)
        plus, minus = travel_costs(machine, toolpath.feed, toolpath.rapid)
        up, down = lifting_costs(machine, up_penalty)
        rates = axis_bounds(machine)
        # Steps of which the moves between given locations consist.
        parts = np.diff(np.flatnonzero(~toolpath.inserted), prepend=0, append=len(toolpath) - 1)
        return cls(
            machine=machine,
            pivot=toolpath.pivot,
            normal=np.nan_to_num(toolpath.normal),
            zone=toolpath.zone,
            bounds=tilt.all,
            plus=plus[1:] + up,
            minus=minus[1:] + down,
            max_turn=np.repeat(np.broadcast_to(max_turn, len(toolpath) - 1)[:, None], 2, axis=1),
            strict=toolpath.cutting[1:],
            least_time=least_times(toolpath, machine)[1:],
            top_speed=rates.speed,
            top_acceleration=rates.acceleration,
            excess_price=np.where(
                [a.is_rotary for a in machine.axes], ROTARY_EXCESS_PRICE, LINEAR_EXCESS_PRICE
            ),
            time_price=time_price,
            bend_price=np.asarray(bend_price * np.repeat(parts, parts), dtype=np.float64),
        )

    def __repr__(self) -> str:
        return f"<Problem of {len(self)} locations on {self.machine.name}>"

    def __len__(self) -> int:
        return len(self.pivot)

    @property
    def is_timed(self) -> bool:
        """Whether a step's time has a price and an axis a highest speed."""
        return self.time_price > 0.0 and bool(np.isfinite(self.top_speed).any())

    @property
    def bound_rows(self) -> BoolArray:
        """(n,), where the tool's lean is bounded."""
        return np.any([np.isfinite(b.reference).all(axis=1) for b in self.bounds], axis=0)

    def thinned(self, rows: IntArray) -> Problem:
        """Return the problem of some locations: costs are averaged, step bounds add up to `LONGEST_HOP`."""
        largest = np.max(self.max_turn, initial=0.0, where=np.isfinite(self.max_turn))
        few = super().thinned(rows)
        turns = np.minimum(few.max_turn, np.maximum(LONGEST_HOP, largest))
        return replace(few, max_turn=np.where(np.isfinite(few.max_turn), turns, np.inf), ramps=None)

    def eased(self, rotary: Array) -> Problem:
        """Return the problem with wider bounds on links on which a path, (n, 2) rad, turns too far."""
        turns = np.abs(np.diff(rotary, axis=0))
        eased = (turns > self.max_turn + ALLOWED) & ~self.strict[:, None]
        return replace(self, max_turn=np.where(eased, turns + self.max_turn, self.max_turn))

    def positions(self, rows: Rows, rotary: Array) -> Array:
        """Solve axis values; `rotary` is (m, ..., 2) rad for m rows, the result (m, ..., k)."""
        return self.placed(rows, rotary)[0]

    def placed(self, rows: Rows, rotary: Array) -> tuple[Array, Array]:
        """Solve axis values and how far each tool axis is out of bounds, of m locations at (m, ..., 2) rad.

        Axis values, (m, ..., k), are NaN where none exist; the excess, (m, ...), is a cosine past a bound.
        """
        return self.model.placed(np.arange(len(self))[rows], rotary)

    def limit_excess(self, positions: Array) -> Array:
        """Sum how far axis values, (..., k), lie past their limits (mm, rad)."""
        return np.maximum(self.machine.limit_excess(positions), 0.0).sum(axis=-1)

    def excess(self, rotary: Array) -> Array:
        """Find how far a path, (n, 2) rad, breaks bounds or limits at locations, (n,): cosine, mm or rad.

        It is infinite where linear axes have no values.
        """
        positions, excess = self.placed(slice(None), rotary)
        over = np.maximum(excess, self.limit_excess(positions))
        return np.where(np.isnan(over), np.inf, over)

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms of the objective and the bounds; not kept, as of a long path they are large."""
        return terms_of(self)

    @cached_property
    def model(self) -> LocationModel:
        """Axis values and tool axes of its locations, and their derivatives."""
        return LocationModel.of(self.machine, self.zone, self.pivot, self.normal, self.bounds)

    def quantities(self, positions: Array, axis: Array | None = None) -> Array:
        """Collect the quantities of a path's terms, (n, k + 4); its steps wait as long as they have to.

        Positions are (n, k) mm and rad, tool axes (n, 3) unit vectors, None if no term needs them.
        """
        n, k = positions.shape
        quantities = np.zeros((n, k + OTHERS))
        quantities[:, :k] = positions
        if axis is not None:
            quantities[:, k : k + 3] = axis
        if (term := durations(self)) is not None:
            late = np.maximum(term.values(quantities) - term.high, 0.0)
            quantities[:-1, -1] = late.max(axis=1)
        return quantities

    def cost(self, positions: Array) -> float:
        """Sum the objective along a path, (n, k); J."""
        quantities = self.quantities(positions)
        return sum(term.cost(term.values(quantities)) for term in self.terms if term.has_price)

    def path_cost(self, rotary: Array) -> float:
        """Sum the objective along a path, (n, 2) rad; J."""
        return self.cost(self.positions(slice(None), rotary))

    def delay(self, positions: Array) -> Array:
        """Compute how much longer the steps of a path, (n, k), take than at the feed, (n − 1,) s."""
        return np.asarray(self.quantities(positions)[:-1, -1])

    def priced(self, rotary: Array) -> float:
        """Sum a path's cost and the price of its violations, J; `rotary` is (n, 2) rad."""
        positions, excess = self.placed(slice(None), rotary)
        faults = self.place_prices(positions, excess).sum() + self.turn_prices(np.diff(rotary, axis=0)).sum()
        return self.cost(positions) + float(faults)

    def place_prices(self, positions: Array, excess: Array) -> Array:
        """Price what postures break at their locations, as `placed` gives them, (…,) J."""
        return VIOLATION_PRICE * (excess + self.limit_excess(positions))

    def turn_prices(self, turns: Array) -> Array:
        """Price by how much steps turn too far, (n − 1,) J; turns are (n − 1, 2) rad."""
        over = np.maximum(np.abs(turns) - self.max_turn, 0.0).sum(axis=1)
        return np.where(self.strict, CUT_TURN_PRICE, VIOLATION_PRICE) * over

    def violation(self, rotary: Array) -> float:
        """Find the worst violation of a path, (n, 2) rad: cosine, mm or rad; 0 if there is none."""
        worst = self.excess(rotary).max(), self.turn_excess(rotary).max(initial=0.0)
        return max(0.0, *(float(w) for w in worst))

    def turn_excess(self, rotary: Array) -> Array:
        """Compute how far cutting steps turn beyond their bound, (n − 1,) rad; 0 on links."""
        turns = (np.abs(np.diff(rotary, axis=0)) - self.max_turn).max(axis=1)
        return np.where(self.strict, np.maximum(turns, 0.0), 0.0)


@dataclass(frozen=True, eq=False)
class Instance:
    """A path with inserted locations, and its problem with the prices of travel, or of time.

    Each location has a fractional index in the given path, (n,).
    """

    path: Toolpath
    location: Array
    problem: Problem
    bounds: TiltBounds

    @property
    def own(self) -> BoolArray:
        """(n,), whether it is one of the given path's locations."""
        return self.location == np.floor(self.location)
