"""The baselines that a result is compared with.

Every baseline is a motion that a programmer might actually run: it keeps the limits and, unless it follows
programmed axes, the tilt range. If it can't, it doesn't exist for that path, and the reason is given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product as product_of

import numpy as np

from fiveaxis.base import (
    UNKEPT,
    Array,
    BoolArray,
    Checkpoint,
    IntArray,
    NoBaseline,
    arcsin,
    arctan2,
    compiled,
    cross,
    product,
)
from fiveaxis.model import (
    INSIDE,
    ON_LIMIT,
    TURN,
    Machine,
    TiltBounds,
    Toolpath,
    feed_directions,
    follow,
    linear_positions,
    motion_energy,
    tool_axes,
    travel_costs,
    within_limits,
)
from fiveaxis.posture.baselines.branches import follow_axes, follow_each, nearest_held, nearest_to_reference
from fiveaxis.posture.location_model import LocationModel, Locations, place
from fiveaxis.posture.solution import AS_PROGRAMMED, Baseline
from fiveaxis.posture.strategy.rotary_bounds import free_angles, is_holding

# Step of the lead and lean angles of `lead-lean`.
LEAN_STEP = np.radians(15.0)
# Grid of the single posture of `fixed`, share of its cost that is rounding, and postures placed at once.
FIXED_STEP, ROUNDING, FIXED_ROWS = np.radians(3.0), 1e-9, 50_000
# Candidates of `lead-lean` are ranked on about this many locations; the best few are priced on all.
RANKING_LOCATIONS, RANKED_KEPT = 400, 6
# Distance of unit vectors that is rounding.
SAME_AXIS = 1e-9
# Offsets that `greedy` tries around the previous posture (rad): none, and a ring of directions at each scale.
RING = np.radians(np.arange(0.0, 360.0, 30.0))
RING = np.stack([np.cos(RING), np.sin(RING)], axis=1)
COARSE, FINE = (
    np.concatenate([np.zeros((1, 2)), *(scale * RING for scale in np.radians(scales))])
    for scales in ([16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.1], [0.06, 0.03, 0.015, 0.005])
)
# Distances inside the bounds at which `lead-lean` tries a pair if its grid misses a narrow range (rad).
INSETS = np.radians([2.0, 0.5, 0.1, 0.02])


def find_baselines(
    toolpath: Toolpath, machine: Machine, tilt: TiltBounds, checkpoint: Checkpoint = UNKEPT
) -> tuple[dict[str, Baseline], dict[str, str]]:
    """Find every baseline of a path by name, and of those that don't exist the reason.

    They are ``as-programmed`` (the input's own tool axes, or a program's own angles), ``normal`` (along the
    reference direction, tilted up as far as the range requires), ``lead-lean`` (the cheapest constant lead
    and lean), ``fixed`` (the cheapest single posture, 3+2) and ``greedy`` (at each location the cheapest move
    from the one before). A checkpoint takes their postures.
    """
    makers: dict[str, Callable[..., Array]] = {
        AS_PROGRAMMED: as_programmed,
        "normal": along_normal,
        "lead-lean": lead_lean,
        "fixed": single_posture,
        "greedy": greedy,
    }
    found: dict[str, Baseline] = {}
    missing: dict[str, str] = {}
    for name, make in makers.items():
        if name == "greedy" and "normal" in found:
            make = partial(greedy, anchor=found["normal"].motion.positions[:, machine.rotary_columns])
        try:
            rotary = checkpoint.found(partial(make, toolpath, machine, tilt))
            motion = follow(toolpath, machine, rotary)
        except NoBaseline as reason:
            missing[name] = str(reason)
        else:
            found[name] = Baseline(motion, motion_energy(machine, motion))
    return found, missing


def as_programmed(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> Array:
    """Follow the input's own angles, if they fit this machine, or else its tool axes; (n, 2) rad."""
    if not toolpath.has_axes:
        raise NoBaseline("the input has no tool axes")
    own = toolpath.rotary
    if own is not None and own.shape[1] == len(machine.rotary_columns) and np.isfinite(own).all():
        off = np.linalg.norm(tool_axes(machine, own) - toolpath.axis, axis=1)
        kept = within_limits(machine, follow(toolpath, machine, own).positions)
        if (off <= SAME_AXIS).all() and kept.all():
            return own
    return follow_axes(toolpath, machine, toolpath.axis)


def along_normal(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> Array:
    """Keep the tool as near to the reference as range and limits allow, leaning upwards; (n, 2) rad."""
    if is_holding(machine):
        rotary, open_rows = nearest_held(toolpath, machine, tilt)
        if open_rows.any():
            raise NoBaseline(f"{int(open_rows.sum())} locations have no posture with the held axes")
        return rotary
    axis, open_rows = nearest_to_reference(toolpath, machine, tilt)
    if open_rows.any():
        raise NoBaseline(f"{int(open_rows.sum())} locations have no posture with the tool leaning upwards")
    return follow_axes(toolpath, machine, axis)


def lead_lean(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> Array:
    """Hold the cheapest pair of a grid of lead (towards the feed) and lean (sideways) angles; (n, 2) rad."""
    forward = feed_directions(toolpath, tilt.reference)
    bound = np.isfinite(tilt.reference).all(axis=1)
    cuts = np.flatnonzero(bound)
    # Links stay in the sample: the cost of a posture between passes counts as well.
    sample = np.union1d(cuts[:: max(1, len(cuts) // RANKING_LOCATIONS)], np.flatnonzero(~bound))

    pairs = [*_leads_and_leans(tilt), *_drawn_pairs(tilt, forward)]
    found = _priced_pairs(toolpath, machine, tilt, forward, sample, pairs)
    ranked = [pair for _, _, pair in sorted(found, key=lambda one: (one[0], one[2]))]
    # On the whole path the first is the best.
    contenders = RANKED_KEPT if len(sample) < len(toolpath) else 1
    every = np.arange(len(toolpath))
    while ranked:
        some, ranked = ranked[:contenders], ranked[contenders:]
        contenders = 1
        if held := list(_priced_pairs(toolpath, machine, tilt, forward, every, some)):
            return min(held, key=lambda one: one[0])[1]
    raise NoBaseline("no constant lead and lean of the tilt range stays within the axis limits")


def _priced_pairs(
    toolpath: Toolpath,
    machine: Machine,
    tilt: TiltBounds,
    forward: Array,
    rows: IntArray,
    pairs: list[tuple[float, float]],
) -> Iterator[tuple[float, Array, tuple[float, float]]]:
    """Yield energy, J, and rotary angles, (m, 2) rad, at some locations, of the pairs that are possible."""
    part = toolpath.at(rows)
    plus, minus = costs = travel_costs(machine, part.feed, part.rapid)
    at_once = max(1, FIXED_ROWS // max(1, len(rows)))
    for first in range(0, len(pairs), at_once):
        some = pairs[first : first + at_once]
        axes = np.stack([leaned(tilt.reference[rows], forward[rows], *pair) for pair in some])
        if tilt.beside:
            admitted = tilt.admits(axes.swapaxes(0, 1), rows).all(axis=0)
            some, axes = [some[i] for i in np.flatnonzero(admitted)], axes[admitted]
        followed = zip(some, follow_each(part, machine, axes, costs) if some else (), strict=True)
        if not (found := [(pair, one) for pair, (one, _) in followed if one is not None]):
            continue
        rotary = np.stack([one for _, one in found])
        moves = np.diff(linear_positions(machine, part.tips(tool_axes(machine, rotary)), rotary), axis=1)
        spent = plus[1:] * np.maximum(moves, 0.0) + minus[1:] * np.maximum(-moves, 0.0)
        for (pair, one), each in zip(found, spent, strict=True):
            yield float(each.sum()), one, pair


def leaned(reference: Array, forward: Array, lead: float, lean: float) -> Array:
    """Turn the reference by lead towards the feed direction, then by lean about the feed direction."""
    side = cross(forward, reference)
    return np.cos(lean) * (np.cos(lead) * reference + np.sin(lead) * forward) + np.sin(lean) * side


def _leads_and_leans(tilt: TiltBounds) -> Iterator[tuple[float, float]]:
    """Yield the pairs of a grid that are in the tilt range; those on its edge are scaled to lie inside."""
    for lead, lean in product_of(LEAN_STEP * np.arange(-5, 6), repeat=2):
        angle = math.acos(np.cos(lead) * np.cos(lean))
        inside = np.clip(angle, tilt.low + INSIDE, tilt.high - INSIDE)
        if abs(angle - inside) < 10.0 * INSIDE:
            scale = inside / angle if angle > 0.0 else 1.0
            yield float(lead * scale), float(lean * scale)


def _drawn_pairs(tilt: TiltBounds, forward: Array) -> Iterator[tuple[float, float]]:
    """Yield the median lead and lean of the reference drawn into all bounds."""
    for inset in INSETS if tilt.beside else ():
        drawn = tilt.draw_in(tilt.reference, inset)
        ahead = arctan2(np.sum(drawn * forward, axis=1), np.sum(drawn * tilt.reference, axis=1))
        aside = arcsin(np.clip(np.sum(drawn * np.cross(forward, tilt.reference), axis=1), -1.0, 1.0))
        yield float(np.nanmedian(ahead)), float(np.nanmedian(aside))


def single_posture(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> Array:
    """Hold one posture for the whole path, the cheapest of a grid (3+2 machining); (n, 2) rad."""
    grid = free_angles(machine, FIXED_STEP)
    grid = grid[_admitted_everywhere(tool_axes(machine, grid), tilt)]
    costs = _fixed_costs(toolpath, machine, grid)
    if not np.isfinite(costs).any():
        raise NoBaseline("no single posture keeps the tilt range and the axis limits at every location")
    # Of postures that cost the same but for rounding, the first.
    cheapest = int(np.argmax(costs <= np.min(costs) * (1.0 + ROUNDING)))
    return np.tile(grid[cheapest], (len(toolpath), 1))


def _admitted_everywhere(axis: Array, tilt: TiltBounds) -> BoolArray:
    """Check which tool axes, (g, 3), keep the tilt range at every location."""
    admitted = np.ones(len(axis), dtype=bool)
    for bound in tilt.all:
        reference = bound.reference[np.isfinite(bound.reference).all(axis=1)]
        for rows in np.array_split(reference, max(1, len(reference) // 256)):
            cosine = product(axis[admitted], rows.T)
            inside = (cosine >= bound.cosines[0]) & (cosine <= bound.cosines[1])
            admitted[admitted] = inside.all(axis=1)
    return admitted


def _fixed_costs(toolpath: Toolpath, machine: Machine, grid: Array) -> Array:
    """Price postures, (g, 2) rad, each held for the whole path; (g,) J, infinite beyond a limit."""
    linear = machine.linear_columns
    plus, minus = (c[:, linear].T for c in travel_costs(machine, toolpath.feed[1:], toolpath.rapid[1:]))
    ends = np.stack([machine.low[linear] - ON_LIMIT, machine.high[linear] + ON_LIMIT])[..., None]
    # While the angles stay, linear axes are linear in the tip: four tips tell where they are at all others.
    corners = np.vstack([np.zeros(3), np.eye(3)])
    costs = np.empty(len(grid))
    at_once = max(1, FIXED_ROWS // len(toolpath))
    for first in range(0, len(grid), at_once):
        rotary = grid[first : first + at_once, None, :]
        origin, *along = linear_positions(machine, corners, rotary)[..., linear].swapaxes(0, 1)
        axis = np.broadcast_to(tool_axes(machine, rotary), (len(rotary), len(toolpath), 3))
        slope = np.stack(along, axis=2) - origin[..., None]
        positions = product(slope, toolpath.tips(axis).swapaxes(1, 2)) + origin[..., None]
        moves = np.diff(positions, axis=2)
        spent = np.sum(plus * np.maximum(moves, 0.0) + minus * np.maximum(-moves, 0.0), axis=(1, 2))
        inside = ((ends[0] <= positions) & (positions <= ends[1])).all(axis=(1, 2))
        costs[first : first + at_once] = np.where(inside, spent, np.inf)
    return costs


def greedy(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, anchor: Array | None = None) -> Array:
    """Take the cheapest move at every location; else the anchor's, by default `along_normal`; (n, 2) rad."""
    anchor = along_normal(toolpath, machine, tilt) if anchor is None else anchor
    normal = np.nan_to_num(toolpath.normal)
    model = LocationModel.of(machine, toolpath.zone, toolpath.pivot, normal, tilt.all)
    limits = np.stack([machine.low - ON_LIMIT, machine.high + ON_LIMIT])
    prices = travel_costs(machine, toolpath.feed, toolpath.rapid)
    anchored, columns = follow(toolpath, machine, anchor).positions, np.array(machine.rotary_columns)
    return walk(model.locations, limits, columns, *prices, anchored, COARSE, FINE)


@compiled
def walk(
    locations: Locations,
    limits: Array,
    columns: IntArray,
    plus: Array,
    minus: Array,
    anchored: Array,
    coarse: Array,
    fine: Array,
) -> Array:
    """Take the cheapest move at every location, first coarse then fine, or the one to the anchor; (n, 2) rad.

    The anchored path, (n, k) mm and rad, is admissible everywhere, and brought near by whole turns. Limits
    are (2, k) mm and rad; columns are of the rotary axes, chain order; prices, plus and minus, (n, k) J/mm
    and J/rad, are of the move into each location; offsets, (m, 2), are in rad.
    """
    axes, count = anchored.shape[1], max(len(coarse), len(fine))
    rotary, around, here, there = np.empty((len(anchored), 2)), np.empty(2), np.empty(axes), np.empty(axes)
    rows, tried = np.empty(count, dtype=np.int64), np.empty((count, 2))
    positions, excess = np.empty((count, axes)), np.empty(count)
    for a in range(axes):
        here[a] = anchored[0, a]
    rotary[0, 0], rotary[0, 1] = here[columns[0]], here[columns[1]]
    for i in range(1, len(anchored)):
        around[0], around[1] = here[columns[0]], here[columns[1]]
        to_anchor = 0.0
        for c in columns:
            # The anchor may be whole turns away.
            near = anchored[i, c] - TURN * np.rint((anchored[i, c] - here[c]) / TURN)
            if limits[0, c] <= near <= limits[1, c]:
                anchored[i, c] = near
        for a in range(axes):
            step = anchored[i, a] - here[a]
            to_anchor += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
        for offsets in (coarse, fine):
            for m in range(len(offsets)):
                rows[m] = i
                tried[m, 0], tried[m, 1] = around[0] + offsets[m, 0], around[1] + offsets[m, 1]
            place(locations, rows[: len(offsets)], tried, positions, excess)
            least, best = to_anchor, -1
            for m in range(len(offsets)):
                cost = 0.0 if excess[m] == 0.0 else np.inf
                for a in range(axes):
                    if not limits[0, a] <= positions[m, a] <= limits[1, a]:
                        cost = np.inf
                        break
                    step = positions[m, a] - here[a]
                    cost += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
                # Of moves that cost the same the first offset is taken, and the anchor last.
                if cost < least or (cost == least and best < 0):
                    least, best = cost, m
            # The anchor's posture where no offset is admissible, or none cheaper.
            for a in range(axes):
                there[a] = positions[best, a] if best >= 0 else anchored[i, a]
            for r in range(2):
                around[r] = tried[best, r] if best >= 0 else there[columns[r]]
        rotary[i, 0], rotary[i, 1] = around[0], around[1]
        for a in range(axes):
            here[a] = there[a]
    return rotary
