"""Which bodies are checked against which, and why the others aren't."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fiveaxis.collision.pieces import Piece, Question
from fiveaxis.collision.rapids import LONGEST_RETRACT
from fiveaxis.collision.scene import BODY, PART, STOCK, TOOL_KINDS, Scene, SceneBody
from fiveaxis.collision.surroundings import Clearances
from fiveaxis.geometry import inverse_transform
from fiveaxis.toolpath.tool import CUTTER

MACHINE = "machine"


@dataclass(frozen=True, eq=False)
class Pair:
    """Two bodies that move against each other.

    Parameters
    ----------
    kind : ``cutter``, ``shank``, ``holder`` or ``machine``: by which findings and clearances go
    first, second : the bodies; the first one is nearer to the tool
    clearance : mm, nearer than which they are worth a warning
    rapid_only : only moves in the air count: what is cut may be touched by the cutter
    """

    kind: str
    first: SceneBody
    second: SceneBody
    clearance: float
    rapid_only: bool = False

    @property
    def pieces(self) -> Iterator[tuple[Piece, Piece, float]]:
        """Pieces of the one and of the other body, with their clearance, mm.

        The shank goes on from the cutter, which touches part and stock: there its first piece needs no
        clearance, and only mustn't touch.
        """
        touched = self.second.kind in (PART, STOCK)
        for i, first in enumerate(self.first.pieces):
            for second in self.second.pieces:
                beside = touched and i < self.first.beside_cut
                yield first, second, 0.0 if beside else self.clearance


# What isn't known of moves out of the stock.
RETRACTS = (
    f"rapid moves of the cutter out of the stock, within {LONGEST_RETRACT:g} mm or back along the tool's "
    "axis: what was cut before them isn't simulated"
)


@dataclass(frozen=True)
class Choice:
    """The pairs of a scene.

    Parameters
    ----------
    pairs : to be checked
    checked, not_checked : the same in sentences, with the reasons
    """

    pairs: tuple[Pair, ...]
    checked: tuple[str, ...]
    not_checked: tuple[str, ...]


def choose_pairs(scene: Scene, clearances: Clearances) -> Choice:
    """Choose the pairs that can touch.

    Bodies of one link can't. The cutter against the part is what gouge checks are for, and it cuts the stock;
    in the air it should find neither. Shank and holder cut nothing, so they may touch nothing of the
    workpiece side. Bodies of the machine of which one carries the other often touch by construction: those
    that do with every axis at 0 aren't checked.
    """
    pairs, skipped = [], []
    for kind, first, second in _candidates(scene):
        clearance = clearances.by_kind[kind]
        if _hang_together(scene, first, second) and touch_at_home(first, second, clearance):
            skipped.append((first, second, clearance))
            continue
        rapid_only = kind == CUTTER and second.kind == STOCK
        pairs.append(Pair(kind, first, second, clearance, rapid_only))
    left_out = (*_say_skipped(skipped), *((RETRACTS,) if any(p.rapid_only for p in pairs) else ()))
    return Choice(tuple(pairs), tuple(_say_checked(pairs)), left_out)


def touch_at_home(first: SceneBody, second: SceneBody, margin: float) -> bool:
    """Tell whether two bodies come nearer than a margin, mm, where they are with every axis at 0."""
    return any(
        Question(a, b).nearer(inverse_transform(b.frame) @ a.frame, margin)
        for a in first.pieces
        for b in second.pieces
    )


def _candidates(scene: Scene) -> Iterator[tuple[str, SceneBody, SceneBody]]:
    """List pairs on different links, with their kind; the body nearer to the tool first."""
    order = {link: i for i, link in enumerate(scene.links)}
    for i, a in enumerate(scene.bodies):
        for b in scene.bodies[i + 1 :]:
            if a.link == b.link:
                continue
            first, second = (a, b) if order[a.link] > order[b.link] else (b, a)
            if first.kind in TOOL_KINDS:
                # Head and tool belong together: the spindle holds the tool.
                apart = second.link not in scene.code.head
                if apart and not (first.kind == CUTTER and second.kind == PART):
                    yield first.kind, first, second
            else:
                yield MACHINE, first, second


def _hang_together(scene: Scene, first: SceneBody, second: SceneBody) -> bool:
    """Tell whether two bodies of the machine are on neighbouring links, or both on one side of the bed."""
    if not first.kind == second.kind == BODY:
        return False
    order = {link: i for i, link in enumerate(scene.links)}
    same_side = any({first.link, second.link} <= set(s) for s in (scene.code.table, scene.code.head))
    return same_side or abs(order[first.link] - order[second.link]) == 1


def _say_checked(pairs: list[Pair]) -> Iterator[str]:
    """Say which pairs are checked, one sentence for a body with all that it is held against."""
    against: dict[str, list[Pair]] = {}
    for pair in pairs:
        against.setdefault(pair.first.name, []).append(pair)
    for name, found in against.items():
        others = [
            f"{p.second.name}{' (rapid moves that enter it or stay in it)' * p.rapid_only}" for p in found
        ]
        beside = any(p.first.beside_cut and p.second.kind in (PART, STOCK) for p in found)
        above = ", to part and stock from half its diameter above the cutter on" * beside
        yield (
            f"{name} against {', '.join(others)}: at every location and all the way between them, clearance "
            f"{found[0].clearance:g} mm{above}"
        )


def _say_skipped(skipped: list[tuple[SceneBody, SceneBody, float]]) -> Iterator[str]:
    for first, second, clearance in skipped:
        yield (
            f"{first.name} against {second.name}: one carries the other, and they touch by construction: "
            f"with every axis at 0 they are nearer than {clearance:g} mm"
        )
