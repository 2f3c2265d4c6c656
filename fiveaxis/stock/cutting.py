"""A stock that a program cuts, move by move, and the result beside the part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import IntArray
from fiveaxis.stock.comparing import Deviations, compare, sweep_tolerance
from fiveaxis.stock.dexels import Removal, Stock
from fiveaxis.stock.sources import fill
from fiveaxis.stock.sweeping import Poses, Sweep, swept
from fiveaxis.toolpath import Tool

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class Blank:
    """A stock that contains the part, before anything is cut.

    Parameters
    ----------
    stock : its material
    mesh : the finished part, closed, mm, workpiece frame
    part : the part on the stock's grid
    """

    stock: Stock
    mesh: trimesh.Trimesh
    part: Stock

    @classmethod
    def of(cls, stock: Stock, mesh: trimesh.Trimesh) -> Blank:
        """Put a part into its stock.

        Raises
        ------
        MeshError
            The part's mesh isn't closed.
        JobError
            The part reaches out of the stock.
        """
        from fiveaxis.stock.comparing import require_part_inside

        part = fill(stock.emptied(), mesh)
        require_part_inside(stock, mesh, part)
        return cls(stock, mesh, part)


@dataclass(frozen=True, eq=False)
class CutStock:
    """A stock that a program has cut.

    Parameters
    ----------
    blank : the stock before
    finished : the stock after the last block
    sweeps : what was swept, with rows of the program as blocks
    first : name of row 0 on the ends of rays
    removal : what each row's move removed
    deviations : the finished stock beside the part
    """

    blank: Blank
    finished: Stock
    sweeps: tuple[Sweep, ...]
    first: int
    removal: Removal
    deviations: Deviations

    def following(self) -> Blank:
        """Return what a following program finds."""
        return Blank(self.finished, self.blank.mesh, self.blank.part)


def cut_stock(blank: Blank, tool: Tool, poses: Poses, rows: IntArray, count: int) -> CutStock:
    """Cut a stock along a program, and compare the result with the part.

    Parameters
    ----------
    blank : stays as it is
    tool : its cutter removes what it sweeps
    poses : of the tool, at fractional rows of the program
    rows : (m,), ascending, at which the moves end that are swept
    count : number of rows
    """
    stock = blank.stock.copy()
    bounds = np.array([stock.low, stock.high])
    sweeps = swept(tool, poses, rows, sweep_tolerance(stock.resolution), bounds)
    first = stock.blocks
    removal = stock.cut(*sweeps, blocks=count)
    return CutStock(blank, stock, sweeps, first, removal, compare(stock, blank.mesh, blank.part))
