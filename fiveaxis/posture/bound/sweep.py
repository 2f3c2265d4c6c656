"""The least cost of visiting the corners of one location after the other.

For fixed boxes, one at each visit, the least travel through them is a linear program whose constraints are
differences of two unknowns, each bounded by corners. So an optimum lies on corners, and dynamic programming
over the touched corners finds the least over all boxes. Costs are whole numbers of a quantum, so nothing is
rounded here, and of 32 bits, of which a processor adds and compares many at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.posture.bound.cells import SLACK
from fiveaxis.posture.bound.corners import FAR, Corners, Lattice

# Quanta, from one end of the lattice to the other; and most by which a cost is above the least of its visit:
# what is dearer, behind bounded turns, counts so much, which lowers the bound. Both together are below `FAR`.
ACROSS, MOST = 1 << 28, 1 << 29
# The bound on what sources may cost is found again after so many times as many groups of them.
REFRESH = 16
# rad: a wider bound on a turn counts as none. It would seldom bind, and several times as many corners would
# have to be looked at.
WIDE = np.radians(90.0)


class Prices(NamedTuple):
    """Cost of moving between two visits, in quanta.

    Parameters
    ----------
    up, down : (5,), of a step of the lattice, both rotary angles first
    first, second : (2p − 1,), (2q − 1,), of turning a rotary angle by so many steps, from −(p − 1) on: the
        cheaper direction around a circle, `FAR` where a turn is too far
    """

    up: IntArray
    down: IntArray
    first: IntArray
    second: IntArray

    @classmethod
    def of(cls, lattice: Lattice, plus: Array, minus: Array, turn: float, quantum: float) -> Prices:
        """Round prices of travel, (5,) J/rad and J/mm, down to quanta a step, and a largest turn, rad, up."""
        up, down = (np.floor(price * lattice.steps / quantum).astype(np.int64) for price in (plus, minus))
        most = np.ceil((turn if turn <= WIDE else np.inf) / lattice.steps[:2] - SLACK)
        tables = []
        for i, (count, side) in enumerate(zip(lattice.counts, lattice.sides, strict=True)):
            turns = np.arange(1 - count, count)
            ways = (turns % count, -turns % count) if side.wraps else (turns, -turns)
            costs = [
                np.where((w >= 0) & (w <= most[i]), w * p[i], FAR)
                for w, p in zip(ways, (up, down), strict=True)
            ]
            tables.append(np.minimum(*costs))
        return cls(up, down, *tables)


class Sources(NamedTuple):
    """Corners from which others are reached: those that no neighbour's cost explains; cheapest groups first.

    Parameters
    ----------
    at : (s, 2), corner of both rotary angles, by group
    start : (s + 1,), where the corners of a group begin
    group : (p, q), group of each corner of the rotary angles, −1 for none
    least : (s,), least cost of a group
    low, high : (s, 3), between which the group's corners lie
    corner : (n, 3), corners of the linear axes
    cost : (n,)
    """

    at: IntArray
    start: IntArray
    group: IntArray
    least: IntArray
    low: IntArray
    high: IntArray
    corner: IntArray
    cost: IntArray


@compiled
def reach(corners: Corners, sources: Sources, prices: Prices, begin: int, end: int) -> int:
    """Compute the least cost of the corners of some groups, from `begin` to before `end`.

    A source's cost is put on the nearest corner of the group's block, and spread from there over the block
    axis by axis; both are exact, as the cost of a move is a sum over the axes. Sources beside the group come
    first: what can't get below the dearest touched corner that they leave is passed over. Return how many
    sources, and groups of them, were looked at.
    """
    looked, up, down, count = 0, prices.up, prices.down, len(sources.least)
    middle = (len(prices.first) // 2, len(prices.second) // 2)
    for g in range(begin, end):
        p, q = corners.at[g]
        block = slice(corners.start[g], corners.start[g + 1])
        own, touched = corners.cost[block], corners.touched[block]
        low, extent = corners.first[g], corners.extent[g]
        offered, refreshed, bound = 0, 1, FAR
        # Nine groups beside this one, then all by their least cost.
        for rank in range(-9, count):
            if rank < 0:
                i, j = p + (rank + 9) // 3 - 1, q + (rank + 9) % 3 - 1
                if not (0 <= i < sources.group.shape[0] and 0 <= j < sources.group.shape[1]):
                    continue
                s = sources.group[i, j]
            else:
                s = rank
                if offered >= refreshed:
                    refreshed = REFRESH * offered
                    _spread(own, extent, up, down)
                    # The dearest touched corner.
                    bound = np.int64(np.max(np.where(touched, own, np.int32(0))))
                if sources.least[s] > bound:
                    break
                if abs(sources.at[s, 0] - p) <= 1 and abs(sources.at[s, 1] - q) <= 1:
                    continue
            if s < 0:
                continue
            looked += 1
            i, j = p - sources.at[s, 0] + middle[0], q - sources.at[s, 1] + middle[1]
            turn = prices.first[i] + prices.second[j]
            apart = turn + sources.least[s]
            for k in range(3):
                over = sources.low[s, k] - (low[k] + extent[k] - 1)
                under = low[k] - sources.high[s, k]
                if over > 0:
                    apart += over * down[2 + k]
                elif under > 0:
                    apart += under * up[2 + k]
            if turn < FAR and apart <= bound:
                rows = slice(sources.start[s], sources.start[s + 1])
                _offer(own, low, extent, sources.corner[rows], sources.cost[rows], turn, up, down)
                looked += sources.start[s + 1] - sources.start[s]
                offered += 1
        _spread(own, extent, up, down)
        for n in range(len(own)):
            own[n] = own[n] if touched[n] else FAR
    return looked


@compiled
def _offer(
    own: IntArray,
    low: IntArray,
    extent: IntArray,
    corner: IntArray,
    cost: IntArray,
    turn: int,
    up: IntArray,
    down: IntArray,
) -> None:
    """Put the costs of some sources, and of a turn, on the nearest corners of a block."""
    for n in range(len(cost)):
        paid, index = turn + cost[n], 0
        for k in range(3):
            place, last = corner[n, k] - low[k], extent[k] - 1
            if place < 0:
                paid -= place * up[2 + k]
                place = 0
            elif place > last:
                paid += (place - last) * down[2 + k]
                place = last
            index = index * extent[k] + place
        own[index] = min(own[index], paid)


@compiled
def _spread(cost: IntArray, count: IntArray, up: IntArray, down: IntArray) -> None:
    """Lower the costs of a block to what its corners cost from one another, axis by axis."""
    stride = 1
    for k in range(2, -1, -1):
        rise, fall, size = up[2 + k], down[2 + k], stride * count[k]
        for begin in range(0, len(cost), size):
            line = cost[begin : begin + size]
            if stride == 1:
                _spread_along(line, rise, fall)
                continue
            for n in range(stride, size, stride):
                _lower(line[n : n + stride], line[n - stride : n], rise)
            for n in range(size - stride, 0, -stride):
                _lower(line[n - stride : n], line[n : n + stride], fall)
        stride = size


@compiled
def _spread_along(cost: IntArray, rise: int, fall: int) -> None:
    """Lower the costs of corners in a line to what they cost from one another."""
    least = cost[0]
    for n in range(1, len(cost)):
        reached, own = np.int32(least + rise), cost[n]
        least = own if own < reached else reached
        cost[n] = least
    for n in range(len(cost) - 2, -1, -1):
        reached, own = np.int32(least + fall), cost[n]
        least = own if own < reached else reached
        cost[n] = least


@compiled
def _lower(cost: IntArray, beside: IntArray, price: int) -> None:
    """Lower costs to those of the corners beside them, and the price of a step."""
    for n in range(len(cost)):
        # Of 32 bits, and without a branch: so the compiler takes several at once.
        reached, own = np.int32(beside[n] + price), cost[n]
        cost[n] = own if own < reached else reached


class Neighbours(NamedTuple):
    """Which neighbours of a corner of the rotary angles may dominate it, on the way to the next visit.

    Parameters
    ----------
    first, second : (2, p), (2, q), the corner before and after each; −1 for none, for a step that costs
        nothing, and where some corner of the next visit isn't reached as cheaply from the neighbour
    """

    first: IntArray
    second: IntArray

    @classmethod
    def of(cls, lattice: Lattice, prices: Prices, coming: IntArray) -> Neighbours:
        """Find the neighbours, by the groups of the next visit, (p, q)."""
        found = []
        for i, turns in enumerate((prices.first, prices.second)):
            count, own = lattice.counts[i], np.arange(lattice.counts[i])[:, None]
            targets = np.flatnonzero((coming >= 0).any(axis=1 - i))
            costs = turns[targets - own + len(turns) // 2]
            for towards, step in ((-1, prices.up[i]), (1, prices.down[i])):
                beside = own[:, 0] + towards
                if lattice.sides[i].wraps:
                    beside %= count
                inside = (step > 0) & (beside >= 0) & (beside < count) & (beside != own[:, 0])
                reaches = (costs[np.where(inside, beside, 0)] <= step + costs).all(axis=1)
                found.append(np.where(inside & reaches, beside, -1))
        return cls(np.stack(found[:2]), np.stack(found[2:]))


@compiled
def find_sources(
    corners: Corners, prices: Prices, neighbours: Neighbours, begin: int, end: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Find the corners of groups that no neighbour explains: group, (s,), corner, (s, 3), and cost, (s,)."""
    most = corners.start[end] - corners.start[begin]
    of = np.empty(most, np.int64)
    corner, cost = np.empty((most, 3), np.int64), np.empty(most, np.int32)
    beside = np.empty(4, np.int64)
    price = np.array([prices.up[0], prices.down[0], prices.up[1], prices.down[1]])
    kept = 0
    for g in range(begin, end):
        p, q = corners.at[g]
        for side in range(2):
            before, other = neighbours.first[side, p], neighbours.second[side, q]
            beside[side] = corners.group[before, q] if before >= 0 else -1
            beside[2 + side] = corners.group[p, other] if other >= 0 else -1
        before = kept
        kept = _keep(corners, prices, g, beside, price, corner, cost, kept)
        of[before:kept] = g
    return of[:kept].copy(), corner[:kept].copy(), cost[:kept].copy()


def grouped(corners: Corners, of: IntArray, corner: IntArray, cost: IntArray) -> Sources:
    """Put the sources of `find_sources` into groups; costs are those above the least."""
    cost = np.minimum(cost - cost.min(), MOST)
    groups, start, count = np.unique(of, return_index=True, return_counts=True)
    least = np.minimum.reduceat(cost, start)
    order = np.argsort(least, kind="stable")
    rows = np.argsort(np.repeat(np.argsort(order), count), kind="stable")
    corner, cost, start = corner[rows], cost[rows], np.append(0, np.cumsum(count[order]))
    at, own = corners.at[groups[order]], np.full_like(corners.group, -1)
    own[tuple(at.T)] = np.arange(len(groups))
    low, high = (end.reduceat(corner, start[:-1]) for end in (np.minimum, np.maximum))
    return Sources(at, start, own, least[order], low, high, corner, cost)


@compiled
def _keep(
    corners: Corners,
    prices: Prices,
    g: int,
    beside: IntArray,
    price: IntArray,
    corner: IntArray,
    cost: IntArray,
    kept: int,
) -> int:
    """Append the corners of a group that nothing dominates; return how many there are then."""
    low, count, n = corners.first[g], corners.extent[g], corners.start[g]
    strides = (count[1] * count[2], count[2], 1)
    place = np.empty(3, np.int64)
    for a in range(count[0]):
        for b in range(count[1]):
            for c in range(count[2]):
                value = corners.cost[n]
                if value >= FAR:
                    n += 1
                    continue
                place[0], place[1], place[2] = a, b, c
                dominated = False
                for k in range(3):
                    up, down = prices.up[2 + k], prices.down[2 + k]
                    if place[k] > 0 and up > 0:
                        dominated |= corners.cost[n - strides[k]] + up <= value
                    if place[k] < count[k] - 1 and down > 0:
                        dominated |= corners.cost[n + strides[k]] + down <= value
                if not dominated:
                    for side in range(4):
                        h = beside[side]
                        if h < 0:
                            continue
                        index, inside = 0, True
                        for k in range(3):
                            moved = place[k] + low[k] - corners.first[h, k]
                            inside &= 0 <= moved < corners.extent[h, k]
                            index = index * corners.extent[h, k] + moved
                        if inside and corners.cost[corners.start[h] + index] + price[side] <= value:
                            dominated = True
                            break
                if not dominated:
                    corner[kept] = place + low
                    cost[kept] = value
                    kept += 1
                n += 1
    return kept
