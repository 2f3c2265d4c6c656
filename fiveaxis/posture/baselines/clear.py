"""Baselines under a mask: a refused posture is replaced by the nearest admitted one.

Next to a fixture a baseline by its plain definition would collide, and a programmer would tip the tool aside
there, no farther than needed. A result is compared with that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, NoBaseline
from fiveaxis.model import Toolpath, follow, motion_energy, within_limits
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline

# Radii of the rings around a refused posture that are queried one after the other, and the directions on
# each, in the plane of first and second rotary angle, rad.
RINGS = np.radians([0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0])
RINGS = np.concatenate([RINGS, np.radians([26.0, 30.0, 35.0, 40.0, 45.0])])
ANGLES = np.radians(np.arange(0.0, 360.0, 15.0))
# Angles to each side of the chosen direction at which a nearer posture is tried.
ASIDE = np.radians([7.5, 3.75, 1.875])
# Rings queried after the first clear posture: a neighbour may pass on another side.
MORE_RINGS = 1
# Bisections between a refused ring and a clear one, in every direction, and again in the one that is chosen.
HALVINGS = 3
# Weight of turning beyond the bound of a move, relative to distance from the baseline.
TOO_FAR = 1e3


def moved_clear(
    compared: Mapping[str, Baseline], problem: Problem, toolpath: Toolpath, mask: Mask
) -> tuple[dict[str, Baseline], dict[str, str]]:
    """Move baselines where a mask refuses them to the nearest postures that mask and bounds admit.

    Along consecutive refused locations the posture stays on one side of the obstacle unless that is a detour.
    Moved baselines have a note; those without a clear path are returned apart, with the reason.
    """
    clear, machine = _Clear(problem, mask), problem.machine
    kept, missing = {}, {}
    for name, baseline in compared.items():
        rotary = baseline.motion.positions[:, machine.rotary_columns]
        try:
            moved = clear.moved(rotary)
        except NoBaseline as reason:
            missing[name] = str(reason)
            continue
        away = np.linalg.norm(moved - rotary, axis=1)
        if away.any():
            motion = follow(toolpath, machine, moved)
            note = (
                f"{np.count_nonzero(away)} of {len(toolpath)} locations moved to the nearest clear posture, "
                f"by up to {np.degrees(away.max()):.1f} deg"
            )
            baseline = replace(baseline, motion=motion, energy=motion_energy(machine, motion), note=note)
        kept[name] = baseline
    return kept, missing


@dataclass(frozen=True, eq=False)
class _Clear:
    """What a moved baseline has to keep; parameters as for `moved_clear`."""

    problem: Problem
    mask: Mask

    def moved(self, rotary: Array) -> Array:
        """Move a path, (n, 2) rad, where the mask refuses it; `NoBaseline` if no clear one is near enough."""
        rows = np.flatnonzero(~self.mask.admits(np.arange(len(rotary)), rotary))
        if not len(rows):
            return rotary
        inner, every = self._distances(rows, rotary[rows])
        none = rows[~np.isfinite(every).any(axis=1)]
        if len(none):
            raise NoBaseline(
                f"it isn't clear at {len(rows)} locations, and {len(none)} of them have no clear posture "
                f"within {np.degrees(RINGS[-1]):.0f} deg, first location {none[0]}"
            )
        taken = self._directions(rows, every, rotary)
        angle, paths = ANGLES[taken], []
        spread = (found[np.arange(len(rows)), taken] for found in (inner, every))
        _, far = self._between(rows, rotary[rows], angle, *spread)
        # Postures that were moved nearer one by one may need larger turns in between than before.
        for away in (self._nearest(rows, rotary[rows], angle, far), far[:, None] * _direction(angle)):
            path = rotary.copy()
            path[rows] += away
            paths.append(path)
        before = np.maximum(self.problem.turn_excess(rotary), ALLOWED)
        broken = [np.flatnonzero(self.problem.turn_excess(path) > before) for path in paths]
        if all(map(len, broken)):
            raise NoBaseline(
                f"it isn't clear at {len(rows)} locations, and moved to the nearest clear postures it turns "
                f"too far from location {broken[0][0]} to the next"
            )
        return next(path for path, turns in zip(paths, broken, strict=True) if not len(turns))

    def _admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check which postures, (m, 2) rad, keep bounds, limits and mask; the mask is queried last."""
        if not len(rows):
            return np.zeros(0, dtype=bool)
        positions, excess = self.problem.placed(rows, rotary)
        admitted: BoolArray = within_limits(self.problem.machine, positions) & (excess <= 0.0)
        at = np.flatnonzero(admitted)
        if self.mask.rough is not None:
            at = at[self.mask.roughly_admits(rows[at], rotary[at])]
        admitted[:] = False
        admitted[at] = self.mask.admits(rows[at], rotary[at])
        return admitted

    def _distances(self, rows: IntArray, rotary: Array) -> tuple[Array, Array]:
        """Query rings around refused postures, (r, 2) rad, from the innermost outwards.

        Return how far the last refused and the nearest clear posture are, (r, d) rad each; infinite for none.
        """
        inner, outer = np.zeros((len(rows), len(ANGLES))), np.full((len(rows), len(ANGLES)), np.inf)
        left = np.full(len(rows), len(RINGS))
        for last, ring in pairwise([0.0, *RINGS]):
            at, direction = np.nonzero((left > 0)[:, None] & np.isinf(outer))
            if not len(at):
                break
            clear = self._admits(rows[at], rotary[at] + ring * _direction(ANGLES[direction]))
            outer[at[clear], direction[clear]] = ring
            inner[at, direction] = last
            left = np.where(np.isfinite(outer).any(axis=1), np.minimum(left, MORE_RINGS + 1) - 1, left)
        found = at, direction = np.nonzero(np.isfinite(outer))
        spread = inner[found], outer[found]
        inner[found], outer[found] = self._between(rows[at], rotary[at], ANGLES[direction], *spread)
        return inner, outer

    def _directions(self, rows: IntArray, every: Array, rotary: Array) -> IntArray:
        """Choose a direction for each refused location, (r,): near the baseline, and as at its neighbours."""
        taken = np.empty(len(rows), dtype=np.int64)
        away = np.where(np.isfinite(every), every, 0.0)[:, None] * _direction(ANGLES).T
        for run in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) > 1) + 1):
            cost, came, last = np.zeros(1), [], np.zeros((2, 1))
            for k in run:
                step = cost[:, None] + self._change(rows[k] - 1, rotary, last, away[k])
                came.append(step.argmin(axis=0))
                cost, last = step.min(axis=0) + every[k], away[k]
            cost = cost + self._change(rows[run[-1]], rotary, last, np.zeros((2, 1)))[:, 0]
            state = int(cost.argmin())
            for k, back in zip(run[::-1], came[::-1], strict=True):
                taken[k], state = state, int(back[state])
        return taken

    def _change(self, move: int, rotary: Array, here: Array, there: Array) -> Array:
        """Price the change between offsets, (2, a) and (2, b), at the ends of a move, (a, b) rad."""
        change = there[:, None] - here[:, :, None]
        if not 0 <= move < len(rotary) - 1:
            return np.zeros(change.shape[1:])
        turn = (rotary[move + 1] - rotary[move])[:, None, None]
        beyond = np.abs(turn + change) - self.problem.max_turn[move, :, None, None]
        return np.hypot(*change) + TOO_FAR * self.problem.strict[move] * np.maximum(beyond.max(axis=0), 0.0)

    def _nearest(self, rows: IntArray, rotary: Array, angle: Array, far: Array) -> Array:
        """Find nearer postures beside a direction; their offsets, (r, 2) rad."""
        angle, far = angle.copy(), far.copy()
        for turn in (turn for aside in ASIDE for turn in (aside, -aside)):
            # A smaller gain isn't worth more queries.
            inside = far * np.cos(0.5 * turn)
            at = np.flatnonzero(self._admits(rows, rotary + inside[:, None] * _direction(angle + turn)))
            angle[at] += turn
            spread = 0.5 * inside[at], inside[at]
            for _ in range(2):
                spread = self._between(rows[at], rotary[at], angle[at], *spread)
            far[at] = spread[1]
        return far[:, None] * _direction(angle)

    def _between(
        self, rows: IntArray, rotary: Array, angle: Array, inner: Array, outer: Array
    ) -> tuple[Array, Array]:
        """Bisect between refused and clear distances; the nearest two that are found, (r,) rad each."""
        for _ in range(HALVINGS):
            middle = 0.5 * (inner + outer)
            clear = self._admits(rows, rotary + middle[:, None] * _direction(angle))
            inner, outer = np.where(clear, inner, middle), np.where(clear, middle, outer)
        return inner, outer


def _direction(angle: Array) -> Array:
    """Compute unit vectors in the plane of the rotary angles, (…, 2), with exact zeros for a held axis."""
    return np.round(np.stack([np.cos(angle), np.sin(angle)], axis=-1), 15)
