"""Passes: runs of contacts that the ball can follow without gouging, and what a plan leaves out.

Contacts that no pass reaches are left out with the reason; passes and leads are counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, Place, Severity, angle_between
from fiveaxis.cam.contour.ball_space import BallSpace, PassEnd
from fiveaxis.cam.contour.contacts import Contacts
from fiveaxis.cam.contour.options import FLATTEST_WALL, PlanOptions

# Reasons, which are also what is counted.
GOUGING = "contacts where the ball would gouge"
SHORT = "passes shorter than 3 contacts or the spacing"
NO_LINK = "passes without a clear link"
WEDGED = "contacts without a clear link"
# Share of the contacts that a plan may leave out without being an error.
MOST = 0.5
FEWEST_CONTACTS = 3
# Largest distance of neighbouring passes, as a multiple of the sections' distance: that on the flattest wall,
# and a little more for its curvature.
FARTHEST = 1.1 / float(np.sin(FLATTEST_WALL))
# Contacts whose normals differ by more are on different walls, or on opposite sides of a thin one.
WIDEST_TURN = np.radians(60.0)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What was left out.

    Parameters
    ----------
    counts : of contacts, passes and leads, by what they are
    contacts : those on walls that no pass reaches although they were asked for, by the reason
    """

    counts: Counter[str] = field(default_factory=Counter)
    contacts: Mapping[str, Sequence[Contacts]] = field(default_factory=dict)

    @classmethod
    def of(cls, reason: str, contacts: Contacts, rows: BoolArray) -> LeftOut:
        """Leave out some of the contacts, (n,), each counted."""
        lost = np.flatnonzero(rows & ~contacts.rolling)
        return cls(Counter({reason: len(lost)}), {reason: [contacts.take(lost, closed=False)]})

    @classmethod
    def of_pass(cls, reason: str, contacts: Contacts) -> LeftOut:
        """Leave out a pass, counted as one."""
        return cls(Counter({reason: 1}), cls.of(reason, contacts, ~contacts.rolling).contacts)

    def __add__(self, other: LeftOut) -> LeftOut:
        joined = {
            reason: [*self.contacts.get(reason, ()), *other.contacts.get(reason, ())]
            for reason in (*self.contacts, *other.contacts)
        }
        return LeftOut(self.counts + other.counts, joined)

    @property
    def unreached(self) -> dict[str, int]:
        """Number of contacts that no pass reaches, by reason, without those of which there are none."""
        numbers = {reason: sum(map(len, some)) for reason, some in self.contacts.items()}
        return {reason: number for reason, number in numbers.items() if number}

    def findings(self, space: BallSpace, reached: int, name: str) -> tuple[Finding, ...]:
        """Return the finding on contacts that no pass reaches: an error if they are most of all contacts.

        `reached` are the contacts of the passes, `name` is that of the mesh.
        """
        numbers = self.unreached
        lost = sum(numbers.values())
        if not lost:
            return ()
        share = lost / (lost + reached)
        points = np.vstack([contacts.points for some in self.contacts.values() for contacts in some])
        highest = points[np.argmax(points[:, 2])]
        where = " ".join(f"{letter}{value:.4g}" for letter, value in zip("XYZ", highest, strict=True))
        reasons = "; ".join(self._reason(reason, number, space) for reason, number in numbers.items())
        message = (
            f"no pass reaches {lost} of {lost + reached} contacts on the walls ({100.0 * share:.0f} %), the "
            f"highest at {where}: {reasons}; take a smaller ball or corner radius, or cut the rest with "
            "another tool"
        )
        severity = Severity.ERROR if share > MOST else Severity.WARNING
        return (Finding(severity, "contacts-left-out", message, Place(file=name), float(lost)),)

    def _reason(self, reason: str, number: int, space: BallSpace) -> str:
        if reason != GOUGING:
            return f"{number} in {reason}" if reason.startswith("passes") else f"{number} {reason}"
        room = space.rooms(
            np.vstack([c.points for c in self.contacts[reason]]),
            np.vstack([c.normals for c in self.contacts[reason]]),
        )
        return (
            f"at {number} the ball of {2.0 * space.radius:g} mm would gouge, and half of them have room for "
            f"a ball of at most {2.0 * float(np.median(room)):.2g} mm"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Pass(Contacts):
    """Contacts cut without interruption by a ball, radius in mm; a closed pass returns to its first row."""

    radius: float

    @cached_property
    def centres(self) -> Array:
        """(n, 3), mm, the ball's centre at each contact."""
        return self.points + self.radius * self.normals

    def starts(self) -> IntArray:
        """Return the rows at which the pass can start: only the first one, unless it is closed."""
        return self.touching() if self.closed else np.array([0])

    def touching(self) -> IntArray:
        """Return the rows at which the ball touches a wall and doesn't just roll about an edge."""
        return np.flatnonzero(~self.rolling)

    def ends(self) -> tuple[PassEnd, PassEnd]:
        """Return the ends at which an opened pass begins and finishes."""
        centres, normals = self.centres, self.smooth
        first = PassEnd(centres[0], normals[0], centres[0] - centres[1])
        return first, PassEnd(centres[-1], normals[-1], centres[-1] - centres[-2])

    def between(self, first: int, last: int) -> Pass:
        """Return the open pass from one row to another, inclusive."""
        return self.take(np.arange(first, last + 1), closed=False)

    def started_at(self, row: int) -> Pass:
        """Return the pass opened at a row, to which a closed one returns at its end."""
        if not self.closed:
            return self
        return self.take((row + np.arange(len(self) + 1)) % len(self), closed=False)


def split_passes(contacts: Contacts, space: BallSpace, options: PlanOptions) -> tuple[list[Pass], LeftOut]:
    """Keep the contacts on walls that the ball can touch, and split where it can't continue.

    Two neighbours stay in one pass if the normal turns by at most the crease angle, the straight move
    between them is clear and, where contacts between them were removed, the ball's centre moves by at most
    the spacing. The facets of a fillet then don't split a pass, but an inner corner does. Returned are the
    passes in the order of the section curve, and what was removed.
    """
    whole = Pass(**vars(contacts), radius=space.radius)
    wall = options.is_wall(contacts.normals) | contacts.rolling
    kept = wall & space.fits(whole.centres)
    left_out = LeftOut.of(GOUGING, contacts, wall & ~kept)
    rows = np.flatnonzero(kept)
    if not len(rows):
        return [], left_out
    joined = _continues(whole, rows, space, options)
    closed = bool(joined.all())
    # A closed pass keeps all of its rolling rows, even those beside the curve's seam.
    runs = [rows] if closed else _runs(rows, joined, contacts.rolling)
    passes = []
    for run in runs:
        length = _length(contacts.points[run], closed=closed)
        if (~contacts.rolling[run]).sum() < FEWEST_CONTACTS or length < options.spacing:
            left_out += LeftOut.of_pass(SHORT, contacts.take(run, closed=False))
        else:
            passes.append(whole.take(run, closed=closed))
    return passes, left_out


def _continues(whole: Pass, rows: IntArray, space: BallSpace, options: PlanOptions) -> BoolArray:
    """Check whether each kept row continues to the next one, and the last to the first, (k,)."""
    after, centres, normals = np.roll(rows, -1), whole.centres, whole.normals
    adjacent = (after - rows) % len(whole) == 1
    moved = np.linalg.norm(centres[after] - centres[rows], axis=1)
    gentle = angle_between(normals[rows], normals[after]) <= np.radians(options.crease)
    joined: BoolArray = gentle & (adjacent | (moved <= options.spacing))
    joined[-1] &= whole.closed
    joined[joined] = space.chords_fit(centres[rows[joined]], centres[after[joined]])
    return joined


def _runs(rows: IntArray, joined: BoolArray, rolling: BoolArray) -> list[IntArray]:
    """Split rows where they aren't joined; no run starts or ends with rolling about an edge."""
    ends = np.flatnonzero(~joined)
    # Start after the first break, so that a run across the curve's seam stays whole.
    shift = int(ends[0]) + 1
    runs = np.split(np.roll(rows, -shift), ends + 1 - shift)
    touching = [(run, np.flatnonzero(~rolling[run])) for run in runs]
    return [run[cut[0] : cut[-1] + 1] for run, cut in touching if len(cut)]


def _length(points: Array, *, closed: bool) -> float:
    steps = np.diff(points, axis=0, append=points[:1] if closed else points[-1:])
    return float(np.linalg.norm(steps, axis=1).sum())


def neighbours(upper: Sequence[Pass], lower: Sequence[Pass], farthest: float) -> set[tuple[int, int]]:
    """Pair the passes of two neighbouring levels that lie next to each other on one wall.

    Two passes are neighbours if, for some contact of one, the nearest contact in the other's level lies on
    the other, not farther than passes of one wall may be, mm. The pairs are indices: upper pass, lower pass.
    """
    if not upper or not lower:
        return set()
    down = _nearest(lower, upper, farthest)
    return {(b, a) for a, b in down} | _nearest(upper, lower, farthest)


def _nearest(own: Sequence[Pass], others: Sequence[Pass], farthest: float) -> set[tuple[int, int]]:
    """Return pairs (own, other) for which the nearest contact to some contact of own lies on the other."""
    from scipy.spatial import cKDTree

    points, normals, owner = _touching_rows(own)
    other_points, other_normals, other_owner = _touching_rows(others)
    distance, nearest = cKDTree(other_points).query(points, distance_upper_bound=farthest)
    found = np.isfinite(distance)
    owner, normals, nearest = owner[found], normals[found], nearest[found]
    same = np.einsum("ij,ij->i", normals, other_normals[nearest]) > np.cos(WIDEST_TURN)
    return set(zip(owner[same].tolist(), other_owner[nearest[same]].tolist(), strict=True))


def _touching_rows(passes: Sequence[Pass]) -> tuple[Array, Array, IntArray]:
    """Return points, normals and pass of all touching rows."""
    rows = [found.touching() for found in passes]
    points = np.vstack([p.points[r] for p, r in zip(passes, rows, strict=True)])
    normals = np.vstack([p.normals[r] for p, r in zip(passes, rows, strict=True)])
    return points, normals, np.repeat(np.arange(len(passes)), [len(r) for r in rows])
