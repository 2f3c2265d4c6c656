"""What stands on every machine although its file has no bodies there: a table under the part, a spindle nose.

Both are bodies like those of a machine file, and what the file describes on a side replaces them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, product
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.model import BED, Body, Cylinder, Machine, Tool, Toolpath, Triple, as_triple

TABLE, NOSE = "assumed table", "assumed spindle nose"
# mm: diameter of spindle nose no. 40 (ISO 297, DIN 2079); travel where that of X and Y isn't known; thickness
# of the table, which moves are followed through, so that none jumps over it.
NOSE_DIAMETER, SOME_STROKE, THICK = 88.882, 500.0, 100.0


def is_described(machine: Machine, links: tuple[str, ...]) -> bool:
    """Check whether a machine has a body on one of some links; without links, on the bed."""
    return any(body.link in (links or (BED,)) for body in machine.bodies)


def with_nose(machine: Machine, tool: Tool) -> Machine:
    """Add the spindle nose where the head has no bodies, and where it begins is known.

    It begins at the gauge point, or else at the holder's upper end, is as wide as `NOSE_DIAMETER` or the
    holder, and as high as wide.
    """
    top = max(float(part.outline[-1, 1]) for part in tool.parts())
    begin = machine.tool_length or (0.0 if tool.holder is None else top)
    if begin == 0.0 or is_described(machine, machine.code.head):
        return machine
    holder = 0.0 if tool.holder is None else 2.0 * float(tool.holder.outline()[:, 0].max())
    width = max(NOSE_DIAMETER, holder)
    home = product(machine.setup.frame, machine.chain.tool_home)
    middle, along = home[:3, 3] + (begin + width / 2.0) * home[:3, 2], as_triple(home[:3, 2])
    nose = Body(machine.code.links[-1], Cylinder(width / 2.0, width, as_triple(middle), along), NOSE)
    return replace(machine, bodies=(*machine.bodies, nose))


@dataclass(frozen=True)
class AssumedTable:
    """The face of a table under the part, the lower part of which may be raised over it.

    Parameters
    ----------
    link : that carries it
    middle : (3,), mm, machine frame: under the middle of what stands on it, as high as its lowest point
    up : (3,), unit vector off the face, machine frame
    radius : mm: half the longer travel of X and Y, and at least as far as what stands on it
    """

    link: str
    middle: Triple
    up: Triple
    radius: float

    @classmethod
    def of(cls, machine: Machine, surroundings: Surroundings, cuts: Array) -> AssumedTable | None:
        """Assume the table of a machine, across its vertical with every axis at 0.

        Points of the cuts, (n, 3) mm, workpiece frame, stand for the part where there is neither part nor
        stock nor fixture. None where the workpiece's side has bodies, or there is nothing to stand on a
        table.
        """
        points = surroundings.points if len(surroundings.points) else cuts[np.isfinite(cuts).all(axis=1)]
        if is_described(machine, machine.code.table) or not len(points):
            return None
        frame, up = machine.setup.frame, np.array(machine.vertical)
        placed = product(points, frame[:3, :3].T) + frame[:3, 3]
        middle = (placed.min(axis=0) + placed.max(axis=0)) / 2.0
        middle = middle + (float(product(placed, up).min()) - float(product(middle, up))) * up
        aside = placed - middle
        aside = aside - product(aside, up)[:, None] * up
        strokes = [axis.limits.span for axis in machine.axes if axis.letter in "XY"]
        radius = max((stroke for stroke in strokes if np.isfinite(stroke)), default=SOME_STROKE) / 2.0
        radius = max(radius, float(np.linalg.norm(aside, axis=1).max()))
        return cls(machine.code.links[0], as_triple(middle), as_triple(up), radius)

    def body(self, below: float) -> Body:
        """Return the table with its face so far below the lowest point of what stands on it, mm."""
        middle = np.array(self.middle) - (below + THICK / 2.0) * np.array(self.up)
        return Body(self.link, Cylinder(self.radius, THICK, as_triple(middle), self.up), TABLE)


@dataclass(frozen=True)
class Standing:
    """How high the part stands over an assumed table.

    Parameters
    ----------
    table : what is assumed
    height : mm, of the lowest point of part, stock and fixtures over its face
    needed : mm, whole, the least height at which all moves keep their clearances; 0 where the part may stand
        on the table itself
    stated : whether somebody stated the height; else it is the needed one
    """

    table: AssumedTable
    height: float
    needed: float
    stated: bool

    @property
    def body(self) -> Body:
        """The table, where it was checked."""
        return self.table.body(self.height)

    def __str__(self) -> str:
        if self.stated:
            return f"its lowest point {self.height:g} mm above the table"
        high = f"at least {self.height:g} mm above the table" if self.height else "on the table or above it"
        return f"its lowest point {high} (assumed; nobody described it)"

    def as_dict(self) -> dict[str, float | bool]:
        """Return the heights as plain data for JSON."""
        return {"above_mm": self.height, "needed_mm": self.needed, "stated": self.stated}


def with_stated_table(machine: Machine, surroundings: Surroundings, path: Toolpath) -> Machine:
    """Add the assumed table where somebody stated how high the part stands over it."""
    if surroundings.above_table is None:
        return machine
    known = np.isfinite(path.contact)
    table = AssumedTable.of(machine, surroundings, np.where(known, path.contact, path.pivot)[path.cutting])
    if table is None:
        return machine
    return replace(machine, bodies=(*machine.bodies, table.body(surroundings.above_table)))
