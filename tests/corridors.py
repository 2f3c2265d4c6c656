"""Corridors as lattices, for the general search."""

from dataclasses import replace

import numpy as np

from fiveaxis.posture.search.corridor import Corridor
from fiveaxis.posture.search.lattice import Lattice
from fiveaxis.posture.search.shortest import shortest_path


def lattice_of(corridor: Corridor) -> Lattice:
    """The states of a corridor, each a neighbour of all of the next location."""
    column = corridor.problem.machine.rotary_columns[corridor.coordinates.spin]
    reach = corridor.postures(np.arange(1)).shape[1:3]
    return Lattice(lambda rows: corridor.states(rows, corridor.postures(rows)), column, 0.0, reach)


def general_path(corridor: Corridor, price=None) -> np.ndarray | None:
    """The cheapest path by the general search; `price(rows, postures)` is added to states', in J."""
    lattice = lattice_of(corridor)

    def states(rows):
        positions, prices = lattice.states(rows)
        return positions, prices + price(rows, corridor.postures(rows))

    return shortest_path(corridor.problem, lattice if price is None else replace(lattice, states=states))
