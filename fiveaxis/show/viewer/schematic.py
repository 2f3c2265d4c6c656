"""A plain machine for the simulation where the machine file draws none: rails, slides, tables, spindle.

It is placed by the chain alone (directions, points on rotary axes, travels), so it moves as the machine does;
its thicknesses are invented, and nothing is checked against it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, normalise
from fiveaxis.model import BED, Body, Box, Cylinder, Machine, as_triple

# mm, by which everything is scaled to the size of the part: a table of this radius carries it.
TABLE = 100.0
# Of a linear axis without limits, and the longest that is drawn, in radii of the table.
SOME_TRAVEL, MOST_TRAVEL = 4.0, 12.0
SPINDLE = ((0.28, 0.0, 0.5), (0.5, 0.5, 1.6))  # radius, begin and end above the gauge point, of the table's
UP, BEHIND = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


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
    draft = _Draft(machine, radius)
    draft.table_side()
    draft.head_side(machine.tool_length or nose_height)
    return tuple(draft.bodies)


class _Draft:
    """The bodies so far, stacked from the table down to the bed and from the spindle up to it."""

    def __init__(self, machine: Machine, radius: float) -> None:
        self.machine, self.radius = machine, radius
        self.lines = {joint.letter: joint.line.moved(machine.setup.frame) for joint in machine.chain.joints}
        self.bodies: list[Body] = []

    def table_side(self) -> None:
        """Draw the links from the workpiece to the bed."""
        links = (*self.machine.code.table, BED)
        self._cylinder(links[0], -0.05 * self.radius * UP, UP, 1.0, 0.1)
        level = self._stacked(links, -0.1 * self.radius * UP, -UP, 1.0)
        self._box(BED, level - 0.3 * self.radius * UP, [3.0, 3.0, 0.6])

    def head_side(self, nose_height: float) -> None:
        """Draw the links from the spindle to the bed."""
        home = self.machine.setup.frame @ self.machine.chain.tool_home
        axis = home[:3, 2]
        nose = home[:3, 3] + nose_height * axis
        links = (*self.machine.code.head[::-1], BED)
        for size, begin, end in SPINDLE:
            middle = nose + 0.5 * (begin + end) * self.radius * axis
            self._cylinder(links[0], middle, axis, size, end - begin)
        level = self._stacked(links, nose + SPINDLE[-1][2] * self.radius * axis, UP, 0.5)
        if len(links) > 1:
            self._box(BED, level + 0.2 * self.radius * UP, [2.0, 0.8, 0.4])

    def _stacked(self, links: Sequence[str], level: Array, away: Array, size: float) -> Array:
        """Draw links, each held by the next; return where the last one is held.

        Parameters
        ----------
        level : (3,), mm, where the first one holds table or spindle
        away : (3,), from there to the bed
        size : of rotary axes, in radii of the table
        """
        for link, carrier in pairwise(links):
            draw = self._turned if link in "ABC" else self._slid
            level = np.asarray(draw(link, carrier, level, away, size))
        return level

    def _turned(self, link: str, carrier: str, level: Array, away: Array, size: float) -> Array:
        """Draw a disc on an upright axis, and its bearing; on another one a yoke in a fork."""
        direction, point = np.array(self.lines[link].direction), np.array(self.lines[link].point)
        centre, radius = point + ((level - point) @ direction) * direction, size * self.radius
        if abs(direction @ UP) > math.cos(math.radians(46.0)):
            along = math.copysign(radius, direction @ away) * direction
            self._cylinder(link, centre + 0.1 * along, direction, size, 0.2 * size)
            self._cylinder(carrier, centre + 0.3 * along, direction, 0.7 * size, 0.2 * size)
            return np.asarray(centre + 0.4 * radius * away)
        yoke = level + 0.1 * radius * away
        fork = centre + (max(0.0, float((yoke - centre) @ away)) + 1.2 * radius) * away
        self._between(link, yoke, yoke, size * _along(direction, 2.6, 0.7, 0.12))
        self._between(carrier, fork, fork, size * _along(direction, 4.0, 1.2, 0.2))
        for side in (-radius * direction, radius * direction):
            self._cylinder(link, centre + 1.45 * side, direction, 0.35 * size, 0.3 * size)
            self._cylinder(carrier, centre + 1.8 * side, direction, 0.45 * size, 0.4 * size)
            cheek, arm = _along(direction, 0.12, 0.4, 0.1), _along(direction, 0.3, 0.8, 0.1)
            self._between(link, yoke + 1.25 * side, centre + 1.25 * side, size * cheek)
            self._between(carrier, centre + 1.85 * side, fork + 1.85 * side, size * arm)
        return fork + 0.1 * radius * away

    def _slid(self, link: str, carrier: str, level: Array, away: Array, _size: float) -> Array:
        """Draw a slide and its rails; of an upright axis a column beside what it carries."""
        radius, direction = self.radius, np.array(self.lines[link].direction)
        travel, middle = self._travel(link)
        if abs(direction @ UP) > 0.7:
            aside = level + 1.2 * radius * BEHIND
            self._between(link, level, aside, np.array([0.7, 0.2, 0.35]))
            centre = aside + 0.3 * radius * BEHIND + middle * direction
            self._box(carrier, centre, [0.8, 0.3, travel + 1.0])
            return np.asarray(centre + 0.5 * (travel + 1.0) * radius * away)
        centre = level + 0.12 * radius * away
        self._box(link, centre, [1.1, 1.1, 0.24])
        rails, across = centre + 0.2 * radius * away + middle * direction, normalise(np.cross(UP, direction))
        for side in (-0.4, 0.4):
            self._box(carrier, rails + side * radius * across, _along(direction, travel + 1.2, 0.16, 0.16))
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

    def _between(self, link: str, begin: Array, end: Array, size: Array) -> None:
        """Add a box of a size, in radii of the table, that is drawn out from one place to another."""
        self._box(link, 0.5 * (begin + end), np.abs(end - begin) / self.radius + size)

    def _box(self, link: str, centre: Array, size: ArrayLike) -> None:
        """Add a box whose size is in radii of the table."""
        sides = np.maximum(np.abs(size), 0.02) * self.radius
        self.bodies.append(Body(link, Box(as_triple(sides), as_triple(centre))))

    def _cylinder(self, link: str, centre: Array, axis: Array, radius: float, height: float) -> None:
        """Add a cylinder whose radius and height are in radii of the table."""
        scale = self.radius
        shape = Cylinder(radius * scale, height * scale, as_triple(centre), as_triple(axis))
        self.bodies.append(Body(link, shape))


def _along(direction: Array, length: float, width: float, height: float) -> Array:
    """Return the sides of a box with its length along the nearest of X and Y."""
    level = [length, width] if abs(direction[0]) > abs(direction[1]) else [width, length]
    return np.array([*level, height])
