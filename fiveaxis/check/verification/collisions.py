"""The check for collisions, at the locations and throughout the moves between them."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, Severity, risk
from fiveaxis.check.collision.scene import (
    FIXTURE,
    MACHINE,
    RETRACTS,
    STOCK,
    TOOL_KINDS,
    Pair,
    build_scene,
    choose_pairs,
    describe,
)
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.collision.sweep import Hits, Sweep, join
from fiveaxis.check.collision.travel import Stretch
from fiveaxis.check.verification.check_context import WORDING, CheckContext
from fiveaxis.check.verification.model import link_poses
from fiveaxis.check.verification.report import Result
from fiveaxis.check.verification.tcp_moves import divide_tcp_moves
from fiveaxis.model import CUTTER, HOLDER, SHANK, Interpolation, MoveKind

logger = logging.getLogger(__name__)

# mm: moves this short are judged by their middle.
TOLERANCE = 0.05
# Locations whose link poses are held in memory at once.
LONGEST_STRETCH = 20_000
# mm and rad: smaller sideways movement and turn while the tool goes back along its axis are rounding.
MOST_ASIDE, MOST_TURNED = 0.01, 1e-4
# Pairs of bodies with their hits along a motion.
PairHits = Sequence[tuple[Pair, Hits]]
# Kind of pair → code of its findings, and what to do about them.
CODES = {SHANK: "shank", HOLDER: "holder", CUTTER: FIXTURE, MACHINE: MACHINE}
REMEDIES = {
    SHANK: "tilt the tool away, or take a thinner or longer one",
    HOLDER: "tilt the tool away, or clamp it with more stick-out",
    CUTTER: "route the path around it, or move it",
    MACHINE: "move the part on the table, take a longer tool, or bound the rotary axes",
}


def check_collisions(
    context: CheckContext,
    surroundings: Surroundings,
    *,
    tcp_height: float | None = None,
    stock_is_cut: bool = False,
) -> tuple[Result, ...]:
    """Check all pairs of bodies that could touch along the motion of the axes.

    Between locations all axes are linear in time, or a point of the tool moves straight; links and rapids are
    checked like cuts.

    Parameters
    ----------
    context : motion, machine, and path with the tool
    surroundings : part, stock, fixtures and clearances
    tcp_height : mm above the tip, of the point that moves straight under TCP; None with joint interpolation
    stock_is_cut : whether the tool is checked against the stock as it is at each moment
        (`fiveaxis.check.verification.removal`), and not against all of it here

    Returns
    -------
    Errors ``shank-collision``, ``holder-collision``, ``fixture-collision`` (of the cutter),
    ``machine-collision``, and warnings of the same names with ``-clearance`` for bodies that come too near.

    Raises
    ------
    MeshError
        The mesh of a body can't be read or is refused.
    """
    scene = build_scene(context.machine, context.toolpath.tool, surroundings)
    pairs, left_out = choose_pairs(scene, surroundings.clearances)
    if stock_is_cut:
        pairs = tuple(p for p in pairs if not (p.kind in TOOL_KINDS and p.second.kind == STOCK))
        left_out = [gap for gap in left_out if gap is not RETRACTS]
    sweep = Sweep(TOLERANCE)
    found = sweep_all(context, pairs, sweep, tcp_height)
    logger.info(
        "%d pairs of bodies along %d locations: %d queries, %d stretches clear by their boxes alone",
        len(pairs),
        len(context.positions),
        sweep.queries,
        sweep.culled,
    )
    unknown = int(np.isnan(context.positions).any(axis=1).sum())
    gap = risk(f"collisions at {unknown} locations whose axis values aren't finite, and in the moves to them")
    how = WORDING[Interpolation.JOINT if tcp_height is None else Interpolation.TCP]
    moves = f"collisions between locations: {how}, to {TOLERANCE:g} mm of movement"
    clear = [pair for pair in pairs if not any(pair is hit for hit, _ in found)]
    checked = (*scene.checked, *describe(clear), *((moves,) if clear else ()))
    not_checked = (*scene.not_checked, *left_out, *((gap,) if unknown else ()))
    # A body that only rapid moves are checked for is measured in these alone.
    rapid = bool(np.any(context.toolpath.kind == MoveKind.RAPID))
    measured = {pair.kind for pair in pairs if rapid or not pair.rapid_only}
    return (
        Result(f"{MACHINE}-collision", checked=checked, not_checked=not_checked),
        *(result for kind in CODES for result in results_of(kind, found, kind in measured)),
    )


def sweep_all(
    context: CheckContext, pairs: tuple[Pair, ...], sweep: Sweep, tcp_height: float | None
) -> PairHits:
    """Sweep every pair along every stretch of known axis values."""
    poses = link_poses(context.machine)
    rapid = context.toolpath.kind == MoveKind.RAPID
    back = withdrawn(context)
    found = []
    known = np.asarray(np.isfinite(context.positions).all(axis=1))
    for begin, end in known_stretches(known):
        positions, place = context.positions[begin:end], np.arange(float(end - begin))
        if tcp_height is not None:
            positions, place = divide_tcp_moves(context.machine, positions, tcp_height)
        row = np.ceil(place).astype(np.int64)
        stretch = Stretch(context.machine, poses, positions)
        # The first row may be the last one of the previous stretch.
        new = np.arange(begin, end) > (begin if begin and known[begin - 1] else -1)
        for pair in pairs:
            counted = new & rapid[begin:end] if pair.rapid_only else new
            hits = sweep.run(pair, stretch, counted[row], back[begin:end][row])
            hits = hits.at(new[row[hits.rows]])
            hits = hits if tcp_height is None else _of_rows(hits, place)
            if len(hits.rows):
                found.append((pair, hits.moved(begin)))
    return found


def withdrawn(context: CheckContext) -> BoolArray:
    """Find the moves, (n,), that retract the tool along its own axis, without a turn."""
    steps = np.diff(context.tip, axis=0, prepend=context.tip[:1])
    back = np.sum(steps * context.axis, axis=1)
    aside = np.linalg.norm(steps - back[:, None] * context.axis, axis=1)
    turns = context.steps[:, context.machine.rotary_columns].max(axis=1, initial=0.0)
    return np.asarray((back > 0.0) & (aside <= MOST_ASIDE) & (turns <= MOST_TURNED))


def _of_rows(hits: Hits, place: Array) -> Hits:
    """Convert hits to rows of the undivided moves: `place`, (m,), is the end of each part in those rows."""
    parts = np.diff(place, prepend=place[0])
    at = place[hits.rows] - (1.0 - hits.shares) * parts[hits.rows]
    row = np.ceil(place[hits.rows]).astype(np.int64)
    return replace(hits, rows=row, shares=at - row + 1.0).worst()


def known_stretches(known: BoolArray) -> Iterator[tuple[int, int]]:
    """Split rows into runs of known rows, and long runs into shorter ones that share a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int64)))
    for begin, end in edges.reshape(-1, 2).tolist():
        for start in range(begin, max(end - 1, begin + 1), LONGEST_STRETCH):
            yield start, min(start + LONGEST_STRETCH + 1, end)


def results_of(kind: str, found: PairHits, measured: bool, remedy: str | None = None) -> Iterator[Result]:
    """Build the two results of a kind of pair: bodies that overlap, and bodies that come too near.

    Where no pair of the kind was `measured`, the figures are None, as nothing is known. `remedy` is what to
    do, by default as of the kind.
    """
    own = [(pair, hits) for pair, hits in found if pair.kind == kind]
    touching = [(pair, hits.at(hits.touching)) for pair, hits in own]
    bad = sorted({int(row) for _, hits in touching for row in hits.rows})
    near = [(pair, hits.at(~hits.touching & ~np.isin(hits.rows, bad))) for pair, hits in own]
    remedy = remedy or REMEDIES[kind]
    for result in (_collisions(kind, touching, remedy), _too_near(kind, near, remedy)):
        yield result if measured else replace(result, figures=dict.fromkeys(result.figures))


def _collisions(kind: str, found: PairHits, remedy: str) -> Result:
    which, row, share, depth, others = _worst_of(found, [hits.depths for _, hits in found])

    def message(i: int) -> str:
        pair, _ = found[which[i]]
        how = f"reaches {depth[i]:.3g} mm into" if np.isfinite(depth[i]) else "is wholly inside or around"
        return (
            f"the {pair.first.name} {how} the {pair.second.name} {_where(share[i])}{_more(others[i])}; "
            f"{remedy}"
        )

    deepest = float(depth.max(initial=0.0))
    return Result(
        code=f"{CODES[kind]}-collision",
        rows=row,
        values=depth,
        message=message,
        # Of a body that is wholly inside another nobody measures how deep.
        figures={f"{CODES[kind]}_overlap_mm": deepest if np.isfinite(deepest) else None},
    )


def _too_near(kind: str, found: PairHits, remedy: str) -> Result:
    lacking = [pair.clearance - hits.gaps for pair, hits in found]
    which, row, share, lack, others = _worst_of(found, lacking)

    def message(i: int) -> str:
        pair, _ = found[which[i]]
        return (
            f"the {pair.first.name} comes within {pair.clearance - lack[i]:.3g} mm of the {pair.second.name} "
            f"{_where(share[i])} (clearance {pair.clearance:g} mm){_more(others[i])}; {remedy}"
        )

    return Result(
        code=f"{CODES[kind]}-clearance",
        severity=Severity.WARNING,
        rows=row,
        values=lack,
        message=message,
        figures={f"{CODES[kind]}_clearance_lacking_mm": float(lack.max(initial=0.0))},
    )


def _worst_of(found: PairHits, values: list[Array]) -> tuple[IntArray, IntArray, Array, Array, IntArray]:
    """Keep the worst pair of every row: its index, the location, the share of the move to it, and the figure.

    Last is the number of other pairs with a hit in the row.
    """
    which = np.repeat(np.arange(len(found), dtype=np.int64), [len(v) for v in values])
    hits = join([hits for _, hits in found])
    row, share, value = hits.rows, hits.shares, np.concatenate([*values, np.empty(0)])
    order = np.lexsort((which, -value, row))
    rows, first, number = np.unique(row[order], return_index=True, return_counts=True)
    best = order[first]
    return which[best], rows, share[best], value[best], number.astype(np.int64) - 1


def _where(share: float) -> str:
    return "here" if share == 1.0 else f"in the move to here, after {100.0 * share:.3g} % of it"


def _more(others: int) -> str:
    return "" if not others else f", and {others} more {'pair does' if others == 1 else 'pairs do'}"
