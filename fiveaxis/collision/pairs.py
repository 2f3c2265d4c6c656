"""The pairs of bodies that are checked, and why the others aren't."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fiveaxis.collision.pieces import PairQuery, Piece
from fiveaxis.collision.scene import BODY, PART, STOCK, TOOL_KINDS, Scene, SceneBody
from fiveaxis.collision.surroundings import Clearances
from fiveaxis.collision.travel import LONGEST_RETRACT
from fiveaxis.findings import Gap, risk
from fiveaxis.geometry import inverse_transform, product
from fiveaxis.toolpath.tool import CUTTER

MACHINE = "machine"


@dataclass(frozen=True, eq=False)
class Pair:
    """Two bodies that move relative to each other.

    Parameters
    ----------
    kind : ``cutter``, ``shank``, ``holder`` or ``machine``: sets the code of findings and the clearance
    first, second : the bodies; the first one is nearer to the tool
    clearance : mm; nearer gets a warning
    rapid_only : check rapid moves only, as the cutter may touch the stock that it cuts
    """

    kind: str
    first: SceneBody
    second: SceneBody
    clearance: float
    rapid_only: bool = False

    @property
    def pieces(self) -> Iterator[tuple[Piece, Piece, float]]:
        """Pieces of the first and the second body, with their clearance, mm.

        The shank starts at the cutter, which touches part and stock, so its first piece has no clearance to
        them and only mustn't touch.
        """
        touched = self.second.kind in (PART, STOCK)
        for i, first in enumerate(self.first.pieces):
            for second in self.second.pieces:
                beside = touched and i < self.first.beside_cut
                yield first, second, 0.0 if beside else self.clearance


RETRACTS = risk(
    f"rapid moves of the cutter out of the stock, within {LONGEST_RETRACT:g} mm or back along the tool's "
    "axis: the removal of stock isn't simulated"
)


@dataclass(frozen=True)
class Choice:
    """The pairs of a scene.

    Parameters
    ----------
    pairs : to be checked
    not_checked : pairs that are left out, with the reason
    """

    pairs: tuple[Pair, ...]
    not_checked: tuple[Gap, ...]


def choose_pairs(scene: Scene, clearances: Clearances) -> Choice:
    """Choose the pairs that can touch.

    Bodies of one link can't. Gouge checks cover the cutter against the part, and the cutter cuts the stock,
    so against that only its rapid moves count. Shank and holder don't cut, so they mustn't touch anything on
    the workpiece side. Machine bodies that carry one another often touch by construction: those that do with
    every axis at 0 aren't checked.
    """
    pairs, skipped = [], []
    for kind, first, second in _candidates(scene):
        clearance = clearances.by_kind[kind]
        if _are_connected(scene, first, second) and touch_at_home(first, second, clearance):
            skipped.append((first, second, clearance))
            continue
        rapid_only = kind == CUTTER and second.kind == STOCK
        pairs.append(Pair(kind, first, second, clearance, rapid_only))
    left_out = [
        Gap(
            f"{first.name} against {second.name}: one carries the other, and they touch by construction: "
            f"with every axis at 0 they are nearer than {clearance:g} mm"
        )
        for first, second, clearance in skipped
    ]
    left_out += [RETRACTS] if any(p.rapid_only for p in pairs) else []
    return Choice(tuple(pairs), tuple(left_out))


def touch_at_home(first: SceneBody, second: SceneBody, margin: float) -> bool:
    """Check whether two bodies are nearer than a margin, mm, with every axis at 0."""
    return any(
        PairQuery(a, b).nearer(product(inverse_transform(b.frame), a.frame), margin)
        for a in first.pieces
        for b in second.pieces
    )


def _candidates(scene: Scene) -> Iterator[tuple[str, SceneBody, SceneBody]]:
    """Yield pairs on different links, with their kind; the body nearer to the tool first."""
    order = {link: i for i, link in enumerate(scene.links)}
    for i, a in enumerate(scene.bodies):
        for b in scene.bodies[i + 1 :]:
            if a.link == b.link:
                continue
            first, second = (a, b) if order[a.link] > order[b.link] else (b, a)
            if first.kind in TOOL_KINDS:
                # The spindle holds the tool.
                apart = second.link not in scene.code.head
                if apart and not (first.kind == CUTTER and second.kind == PART):
                    yield first.kind, first, second
            else:
                yield MACHINE, first, second


def _are_connected(scene: Scene, first: SceneBody, second: SceneBody) -> bool:
    """Check whether two bodies of the machine are on neighbouring links, or both on one side of the bed."""
    if not first.kind == second.kind == BODY:
        return False
    order = {link: i for i, link in enumerate(scene.links)}
    same_side = any({first.link, second.link} <= set(s) for s in (scene.code.table, scene.code.head))
    return same_side or abs(order[first.link] - order[second.link]) == 1


def describe(pairs: Iterable[Pair]) -> Iterator[str]:
    """Describe pairs that were checked and are clear, in one sentence per first body."""
    against: dict[str, list[Pair]] = {}
    for pair in pairs:
        against.setdefault(pair.first.name, []).append(pair)
    for name, found in against.items():
        others = [
            f"{p.second.name}{' (rapid moves that enter it or stay in it)' * p.rapid_only}" for p in found
        ]
        beside = any(p.first.beside_cut and p.second.kind in (PART, STOCK) for p in found)
        above = ", to part and stock from half its diameter above the cutter" * beside
        yield (
            f"{name} against {', '.join(others)}: at every location and throughout the moves between them, "
            f"clearance {found[0].clearance:g} mm{above}"
        )
