"""Links laid again: for passes that are begun elsewhere than the planner began them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.contour.linking import LINK_SPACING, NOWHERE, Linking, lay_link
from fiveaxis.contour.ways import Lead, Linker
from fiveaxis.geometry import Array
from fiveaxis.toolpath.passes import PassEnd


@dataclass(frozen=True, eq=False)
class Relinker:
    """Lays links as the planner does: leads, shortcuts and ways over the part, all clear of it.

    Where the planner was asked for arcs, a pass may begin only where an arc has room; ends that the planner
    itself left without one stay as they are.

    Parameters
    ----------
    linker : finds the ways
    lead_in, lead_out : mm, radius of the arcs that lead to and from passes; 0 for none
    bare : keys of the ends that have no arc though one was asked for
    found : (kept by itself) leads that were asked for before
    """

    linker: Linker
    lead_in: float = 0.0
    lead_out: float = 0.0
    bare: Collection[bytes] = frozenset()
    found: dict[tuple[bytes, float], Lead | None] = field(default_factory=dict)

    @classmethod
    def like(cls, laid: Linking, lead_in: float, lead_out: float) -> Relinker:
        """Make one that lays links as those of a plan were laid."""
        leads = [(e, a) for p in laid.passes for e, a in zip(p.ends(), (p.arrival, p.departure), strict=True)]
        bare = frozenset(_key(end) for end, lead in leads if not len(lead.arc))
        return cls(laid.linker, lead_in, lead_out, bare)

    def __call__(self, leaving: PassEnd | None, arriving: PassEnd | None) -> Array | None:
        """Lay the link between two ends; `fiveaxis.toolpath.Relink`."""
        ends = (leaving, self.lead_out), (arriving, self.lead_in)
        departure, arrival = (None if end is None else self._lead(end, radius) for end, radius in ends)
        if leaving is None:
            return None if arrival is None else divided(np.vstack([arrival.arc, arrival.way])[::-1])
        if departure is None:
            return None
        if arriving is None:
            way = np.vstack([departure.arc, departure.way])
        elif arrival is None:
            return None
        else:
            way = lay_link((leaving, departure), (arriving, arrival), self.linker)
        return divided(np.vstack([leaving.pivot, way]))[1:]

    def _lead(self, end: PassEnd, radius: float) -> Lead | None:
        key = _key(end), radius
        if key not in self.found:
            self.found[key] = self._new_lead(end, radius)
        return self.found[key]

    def _new_lead(self, end: PassEnd, radius: float) -> Lead | None:
        if radius > 0.0 and _key(end) not in self.bare:
            return self.linker.lead((end.pivot, end.normal), end.outward, radius)
        way = self.linker.escape(end.pivot, end.normal)
        return None if way is None else Lead(NOWHERE, way)


def divided(way: Array) -> Array:
    """Put locations on straight moves, (k, 3) mm, no farther apart than `LINK_SPACING`, (m, 3) mm."""
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    parts = np.maximum(np.ceil(lengths / LINK_SPACING), 1.0).astype(np.int64)
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(way, way[1:], parts, strict=False)]
    return np.vstack([*pieces, way[-1:]])


def _key(end: PassEnd) -> bytes:
    return end.pivot.tobytes() + end.normal.tobytes() + end.outward.tobytes()
