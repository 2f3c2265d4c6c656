"""What a plan leaves out: contacts that no pass reaches, with the reason, and other things, counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.contour.contacts import Contacts
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import BoolArray

# Reasons, which are also what is counted.
GOUGING = "contacts where the ball would gouge"
SHORT = "passes shorter than 3 contacts or the spacing"
NO_LINK = "passes without a clear link"
WEDGED = "contacts without a clear link"
# Share of the contacts that a plan may leave out without being an error.
MOST = 0.5


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

        Parameters
        ----------
        space : where the ball fits
        reached : contacts of the passes
        name : of the mesh
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
            f"highest at {where}: {reasons}; take a smaller ball, or cut the rest with another tool"
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
