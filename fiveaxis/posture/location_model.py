"""Axis values, tool axes and their derivatives at every location of a path.

They come from CasADi's expressions of the chain (`location_tapes`). Search, local refinement, masks and
baselines ask this model, or run its tapes in their own compiled loops.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.model import Machine, TiltBounds, Zone
from fiveaxis.posture.tape import BLOCK, play
from fiveaxis.posture.terms import LocationTapes, location_tapes

# Symbols of a location's tape: two angles, pivot, normal.
ANGLES, ARGUMENTS = 2, 8
# mm: values beyond belong to linear directions that lie in one plane; such a posture has none.
FARTHEST = 1e8


class Locations(NamedTuple):
    """What compiled loops need of a path's locations.

    Parameters
    ----------
    steps, constants, registers : of the tape of values
    pivot, normal : (n, 3) each, mm and unit vectors
    references : (n, b, 3), direction of each bound; NaN where it binds nothing
    within : (b, 2), smallest and largest cosine of each bound
    """

    steps: IntArray
    constants: Array
    registers: int
    pivot: Array
    normal: Array
    references: Array
    within: Array


@dataclass(frozen=True, eq=False)
class LocationModel:
    """The locations of a path on a machine, with the tapes of the machine and the cutter's zone."""

    tapes: LocationTapes
    locations: Locations

    @classmethod
    def of(
        cls, machine: Machine, zone: Zone, pivot: Array, normal: Array, bounds: tuple[TiltBounds, ...]
    ) -> LocationModel:
        """Describe locations: pivot and normal, (n, 3) mm and unit vectors, and bounds on the lean."""
        tapes = location_tapes(machine, zone)
        # What has the layout that the loop is compiled for isn't copied: paths are long.
        given = [bound.reference for bound in bounds]
        references = given[0][:, None] if len(given) == 1 else np.stack(given, axis=1)
        within = np.array([bound.cosines for bound in bounds])
        pivot, normal, references = (np.require(c, None, ["C", "W"]) for c in (pivot, normal, references))
        return cls(tapes, Locations(*tapes.values.parts, pivot, normal, references, within))

    @cached_property
    def given(self) -> Array:
        """(n, 6), pivot in mm and normal."""
        return np.hstack([self.locations.pivot, self.locations.normal])

    def placed(self, rows: IntArray, rotary: Array) -> tuple[Array, Array]:
        """Solve axis values, (m, ..., k), and how far tool axes are out of bounds, as `Problem.placed`."""
        rotary = np.broadcast_to(rotary, (len(rows), *rotary.shape[1:]))
        count = rotary.size // ANGLES
        # A copy in any case: one that can't be written to would have the loop compiled again.
        angles = rotary.copy().reshape(count, ANGLES)
        at = np.repeat(rows, count // max(len(rows), 1))
        positions, excess = np.empty((count, self.tapes.values.outputs - 3)), np.empty(count)
        place(self.locations, at, angles, positions, excess)
        return positions.reshape(*rotary.shape[:-1], positions.shape[1]), excess.reshape(rotary.shape[:-1])


@compiled
def place(locations: Locations, rows: IntArray, rotary: Array, positions: Array, excess: Array) -> None:
    """Solve the axis values of postures, (m, 2) rad, and how far their tool axes lie outside their bounds.

    Filled in are positions, (m, k), NaN where there are none, and the cosines' excess, (m,); rows are (m,).
    """
    # By name: numba counts references to an array that it takes out of a record.
    pivot, normal = locations.pivot, locations.normal
    references, within = locations.references, locations.within
    steps, constants, registers = locations.steps, locations.constants, locations.registers
    k = positions.shape[1]
    arguments, values = np.empty((BLOCK, ARGUMENTS)), np.empty((BLOCK, k + 3))
    for begin in range(0, len(rows), BLOCK):
        count = min(BLOCK, len(rows) - begin)
        for j in range(count):
            i = rows[begin + j]
            for r in range(ANGLES):
                arguments[j, r] = rotary[begin + j, r]
            for c in range(3):
                arguments[j, ANGLES + c], arguments[j, ANGLES + 3 + c] = pivot[i, c], normal[i, c]
        play(steps, constants, registers, arguments[:count], values[:count])
        for j in range(count):
            i = rows[begin + j]
            for a in range(k):
                value = values[j, a]
                positions[begin + j, a] = value if abs(value) < FARTHEST else np.nan
            past = 0.0
            for b in range(len(within)):
                cosine = (
                    values[j, k] * references[i, b, 0]
                    + values[j, k + 1] * references[i, b, 1]
                    + values[j, k + 2] * references[i, b, 2]
                )
                # A cosine that is NaN, where nothing binds, has no excess.
                if cosine < within[b, 0]:
                    past = max(past, within[b, 0] - cosine)
                elif cosine > within[b, 1]:
                    past = max(past, cosine - within[b, 1])
            excess[begin + j] = past
