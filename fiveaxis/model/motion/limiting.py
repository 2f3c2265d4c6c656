"""What limits the speed of a program, and for how long: feed, stops, an axis's speed or its acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.time_law import INSTANT, NO_MOVE, TimeLaw, levers
from fiveaxis.model.motion.timing import axis_bounds

# Columns of `Limiting.time`; each axis's speed, then each axis's acceleration, then each axis's jerk follow.
FEED, STOPS, DWELL, SHORT = range(4)
OTHERS = ("feed", "stops", "dwell", "short blocks")
RATES = ("speed", "acceleration", "jerk")
# Share of an axis's highest speed from which on that is the limit, not the feed: words of feeds are rounded.
AT_LIMIT = 0.99
# mm/s: path speed of a standstill, for rounding.
REST = 1e-6


@dataclass(frozen=True, eq=False)
class Limiting:
    """Run time by what limits the speed.

    ``feed``; ``stops``: speeding up from rest and braking to it, also for corners at which the path
    turns back, by more than 90°; ``C speed`` and so on: an axis at its highest speed; ``C acceleration``:
    other changes of speed and direction; ``C jerk``: changes of acceleration; ``short blocks``: they end
    within a cycle of the control's clock; ``dwell``.

    Parameters
    ----------
    letters : of the axes
    time : (n, c), s, of each row of a motion by cause, in the order of `causes`
    """

    letters: str
    time: Array

    @classmethod
    def of(cls, letters: str, rows: int, row: IntArray, cause: IntArray, time: Array) -> Limiting:
        """Add up pieces of time, (s,) s, each with its row and the column of its cause."""
        spent = np.zeros((rows, len(OTHERS) + len(RATES) * len(letters)))
        np.add.at(spent, (row, cause), time)
        return cls(letters, spent)

    @property
    def causes(self) -> tuple[str, ...]:
        """The names of the causes, (c,)."""
        axes = (f"{letter} {what}" for what in RATES for letter in self.letters)
        return (*OTHERS, *axes)

    @property
    def times(self) -> Array:
        """(n,), s, of each row."""
        return np.asarray(self.time.sum(axis=1))

    @property
    def by_cause(self) -> dict[str, float]:
        """For how long each cause limits the speed, s, longest first; those that never do are left out."""
        spent = zip(self.causes, self.time.sum(axis=0).tolist(), strict=True)
        return dict(sorted(((c, t) for c, t in spent if t > INSTANT), key=lambda one: -one[1]))


def law_limiting(law: TimeLaw) -> Limiting:
    """Find which limit of a time law is the active one, in two samples of each of its phases."""
    samples, phases, path = law.samples, law.phases, law.path
    letters, stations = law.motion.letters, phases.at(samples.time)
    pushes = len(OTHERS) + len(letters)
    own = law.feed_speed[samples.block]
    speeds = np.abs(samples.speed) / law.bounds.speed
    used = np.zeros((len(own), pushes + 2 * len(letters)))
    used[:, FEED] = np.nan_to_num(stations[1] / own) * (speeds.max(axis=1, initial=0.0) < AT_LIMIT)
    used[:, DWELL] = ~np.isfinite(own)
    used[:, len(OTHERS) : pushes] = speeds
    used[:, pushes : pushes + len(letters)] = np.abs(samples.acceleration) / law.bounds.acceleration
    used[:, pushes + len(letters) :] = np.abs(law.jerk(samples.time)) / law.bounds.jerk
    cause = used.argmax(axis=1)
    pushed, sample, corner = cause >= pushes, np.arange(len(cause)), path.nearest(stations[0])
    back, along = np.zeros(len(path.corners), dtype=bool), path.directions * levers(letters)
    back[1:-1] = (along[1:] * along[:-1]).sum(axis=1) < 0.0
    back = pushed & back[corner] & (np.abs(stations[0] - path.station[corner]) < path.arm[corner])
    padded = np.pad(back, 1)
    beside = padded[:-2] | back | padded[2:]
    ends = np.stack([phases.path_speed, phases.end_path_speed])[:, sample // 2]
    rest, faster = ends <= REST, ends[1] - ends[0]
    ramps = (pushed & (faster > 0.0), pushed & (faster < 0.0))
    stops = [_touching(ramp, at | beside) for ramp, at in zip(ramps, rest, strict=True)]
    cause = np.where(stops[0] | stops[1] | back, STOPS, cause)
    return Limiting.of(letters, len(law.motion), samples.block, cause, samples.weight)


def _touching(ramp: BoolArray, rest: BoolArray) -> BoolArray:
    """Keep the runs of samples, (s,), that have one at rest."""
    run = np.cumsum(ramp & ~np.append(False, ramp[:-1]))
    kept = np.bincount(run, ramp & rest, len(ramp) + 1) > 0.0
    return ramp & kept[run]


def programmed_limiting(motion: Motion, machine: Machine) -> Limiting:
    """Find what limits moves that take their programmed times: the feed, or an axis at its highest speed."""
    travel = np.abs(motion.moves)
    used = travel / np.where(motion.time > 0.0, motion.time, np.inf)[:, None] / axis_bounds(machine).speed
    cause = np.where(used.max(axis=1) < AT_LIMIT, FEED, len(OTHERS) + used.argmax(axis=1))
    cause[(travel <= NO_MOVE).all(axis=1)] = DWELL
    return Limiting.of(motion.letters, len(motion), np.arange(len(motion)), cause, motion.time)
