"""A plain machine for the simulation where the machine file draws none: rails, slides, tables, spindle.

It is placed by the chain alone (directions, points on rotary axes, travels), so it moves as the machine does;
its thicknesses are invented, and nothing is checked against it.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, normalise
from fiveaxis.model import BED, Body, Box, Cylinder, Line, Machine, as_triple

# mm, by which everything is scaled to the size of the part: a table of this radius carries it.
TABLE = 100.0
# Of a linear axis without limits, and the longest that is drawn, in radii of the table.
SOME_TRAVEL, MOST_TRAVEL = 4.0, 12.0
SPINDLE = ((0.28, 0.0, 0.5), (0.5, 0.5, 1.6))  # radius, begin and end above the gauge point, of the table's
UP = np.array([0.0, 0.0, 1.0])


def schematic_bodies(machine: Machine, radius: float = TABLE, nose_height: float = TABLE) -> tuple[Body, ...]:
    """Draw a machine from its chain, every axis at 0.

    Parameters
    ----------
    radius : mm, of the table; the part's size
    nose_height : mm, from the tip to the spindle's nose if the machine has no tool length

    Returns
    -------
    Bodies in the machine frame, at least one for each link
    """
    lines = {joint.letter: joint.line.moved(machine.setup.frame) for joint in machine.chain.joints}
    draft = _Draft(machine, lines, radius)
    draft.table_side()
    draft.head_side(machine.tool_length or nose_height)
    return tuple(draft.bodies)


class _Draft:
    """The bodies so far, stacked from the table down to the bed and from the spindle up to it.

    Parameters
    ----------
    lines : of each axis, machine frame
    radius : mm, of the table
    """

    def __init__(self, machine: Machine, lines: dict[str, Line], radius: float) -> None:
        self.machine, self.lines, self.radius = machine, lines, radius
        self.bodies: list[Body] = []

    def table_side(self) -> None:
        """Draw the links from the workpiece to the bed."""
        links = (*self.machine.code.table, BED)
        level = np.zeros(3)
        for number, (link, carrier) in enumerate(pairwise(links)):
            line = self.lines[link]
            if link in "ABC":
                level = self._turned(link, carrier, line, level, table=number == 0)
            else:
                level = self._slid(link, carrier, line, level, -UP)
        self._box(BED, level - 0.3 * self.radius * UP, np.array([3.0, 3.0, 0.6]))

    def head_side(self, nose_height: float) -> None:
        """Draw the links from the spindle to the bed."""
        home = self.machine.setup.frame @ self.machine.chain.tool_home
        axis = home[:3, 2]
        nose = home[:3, 3] + nose_height * axis
        links = (*self.machine.code.head[::-1], BED)
        for size, begin, end in SPINDLE:
            middle = nose + 0.5 * (begin + end) * self.radius * axis
            self._cylinder(links[0], middle, axis, size, end - begin)
        level = nose + SPINDLE[-1][2] * self.radius * axis
        for link, carrier in pairwise(links):
            line = self.lines[link]
            if link in "ABC":
                level = self._swivelled(link, carrier, line, level)
            else:
                level = self._slid(link, carrier, line, level, UP)
        if len(links) > 1:
            self._box(BED, level + 0.2 * self.radius * UP, np.array([2.0, 0.8, 0.4]))

    def _turned(self, link: str, carrier: str, line: Line, level: Array, *, table: bool) -> Array:
        """Draw a table or a cradle that turns; return where it is carried."""
        radius, direction = self.radius, np.array(line.direction)
        point = np.array(line.point)
        upright = abs(direction @ UP) > math.cos(math.radians(46.0))
        if upright:
            centre = point + ((level - point) @ direction) * direction
            sense = math.copysign(1.0, direction @ UP)
            self._cylinder(link, centre - 0.1 * radius * sense * direction, direction, 1.0, 0.2)
            self._cylinder(carrier, centre - 0.3 * radius * sense * direction, direction, 0.7, 0.2)
            return np.asarray(centre - 0.4 * radius * UP)
        # A trunnion: two journals on the axis, and a bridge between them below the table.
        middle = point + ((level - point) @ direction) * direction
        below = level - 0.1 * radius * UP
        if table:
            self._cylinder(link, level - 0.05 * radius * UP, UP, 1.0, 0.1)
        for side in (-1.0, 1.0):
            end = middle + side * 1.45 * radius * direction
            self._cylinder(link, end, direction, 0.35, 0.3)
            self._cylinder(carrier, end + side * 0.35 * radius * direction, direction, 0.45, 0.4)
            drop = 0.5 * (below + middle) + side * 1.25 * radius * direction
            height = abs(float((middle - below) @ UP)) / radius
            drop = drop - ((drop - 0.5 * (below + middle)) @ UP) * UP
            self._box(link, drop, _along(direction, 0.12, 0.4) + np.array([0.0, 0.0, height + 0.1]))
        self._box(link, below, _along(direction, 2.6, 0.7) + np.array([0.0, 0.0, 0.12]))
        low = min(float(below @ UP), float(middle @ UP)) - 1.2 * radius
        foot = middle - ((middle @ UP) - low) * UP
        for side in (-1.0, 1.0):
            end = middle + side * 1.85 * radius * direction
            height = (float(middle @ UP) - low) / radius
            self._box(
                carrier,
                end - 0.5 * height * radius * UP,
                _along(direction, 0.3, 0.8) + np.array([0, 0, height]),
            )
        self._box(carrier, foot, _along(direction, 4.0, 1.2) + np.array([0.0, 0.0, 0.2]))
        return np.asarray(foot - 0.1 * radius * UP)

    def _swivelled(self, link: str, carrier: str, line: Line, level: Array) -> Array:
        """Draw a head that swivels: a drum on its axis, and an arm to it; return where it is carried."""
        radius, direction, point = self.radius, np.array(line.direction), np.array(line.point)
        centre = point + ((level - point) @ direction) * direction
        self._cylinder(link, centre, direction, 0.5, 0.7)
        if abs(direction @ UP) > 0.7:
            self._cylinder(carrier, centre + 0.5 * radius * UP, direction, 0.55, 0.3)
            return np.asarray(centre + 0.65 * radius * UP)
        for side in (-1.0, 1.0):
            end = centre + side * 0.5 * radius * direction + 0.25 * radius * UP
            self._box(carrier, end, _along(direction, 0.25, 0.7) + np.array([0.0, 0.0, 1.2]))
        top = centre + 0.95 * radius * UP
        self._box(carrier, top, _along(direction, 1.25, 0.7) + np.array([0.0, 0.0, 0.25]))
        return np.asarray(top + 0.12 * radius * UP)

    def _slid(self, link: str, carrier: str, line: Line, level: Array, away: Array) -> Array:
        """Draw a slide and its rails; return where they are carried."""
        radius, direction = self.radius, np.array(line.direction)
        travel, middle = self._travel(link)
        if abs(direction @ UP) > 0.7:  # a column beside what it carries
            aside = level + 1.2 * radius * np.array([0.0, 1.0, 0.0])
            self._box(link, 0.5 * (level + aside), np.array([0.7, 1.4, 0.35]))
            centre = aside + 0.3 * radius * np.array([0.0, 1.0, 0.0]) + middle * direction
            self._box(carrier, centre, np.array([0.8, 0.3, travel + 1.0]))
            return np.asarray(centre + 0.5 * (travel + 1.0) * radius * away)
        centre = level + 0.12 * radius * away
        self._box(link, centre, np.array([1.1, 1.1, 0.24]))
        rails = centre + 0.2 * radius * away + middle * direction
        across = normalise(np.cross(UP, direction))
        for side in (-1.0, 1.0):
            rail = rails + side * 0.4 * radius * across
            self._box(carrier, rail, _along(direction, travel + 1.2, 0.16) + np.array([0.0, 0.0, 0.16]))
        return np.asarray(centre + 0.28 * radius * away)

    def _travel(self, letter: str) -> tuple[float, float]:
        """Return the length of an axis's rails in radii of the table, and their middle, mm."""
        limits = self.machine.axis(letter).limits
        low, high = limits.ends
        if low is None or high is None:
            return SOME_TRAVEL, 0.0
        # The axis value is tool relative to workpiece: a table moves the other way on its rails.
        sense = -1.0 if letter in self.machine.code.table else 1.0
        return min(limits.span / self.radius, MOST_TRAVEL), sense * 0.5 * (low + high)

    def _box(self, link: str, centre: Array, size: Array) -> None:
        """Add a box whose size is in radii of the table."""
        sides = np.maximum(np.abs(size), 0.02) * self.radius
        self.bodies.append(Body(link, Box(as_triple(sides), as_triple(centre))))

    def _cylinder(self, link: str, centre: Array, axis: Array, radius: float, height: float) -> None:
        """Add a cylinder whose radius and height are in radii of the table."""
        scale = self.radius
        shape = Cylinder(radius * scale, height * scale, as_triple(centre), as_triple(axis))
        self.bodies.append(Body(link, shape))


def _along(direction: Array, length: float, width: float) -> Array:
    """Return the sides of a flat box with its length along the nearest of X and Y."""
    return np.array([length, width, 0.0] if abs(direction[0]) > abs(direction[1]) else [width, length, 0.0])
