"""A stock that a program cuts, move by move, and the result beside the part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.stock.comparing import Deviations, compare, sweep_tolerance
from fiveaxis.stock.dexels import Removal, Stock
from fiveaxis.stock.sources import fill
from fiveaxis.stock.sweeping import Poses, Sweep, of_blocks, swept, swept_outline
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.tool import HOLDER, SHANK

if TYPE_CHECKING:
    import trimesh

# Blocks that are cut at once where nothing but the cutter is near; tolerances by which shank and holder may
# reach into the stock.
MOST_AT_ONCE, SLACK = 512, 3.0


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
    touched : shank and holder, where known: mm³ of the stock, as it was then, that each row's move touches
    """

    blank: Blank
    finished: Stock
    sweeps: tuple[Sweep, ...]
    first: int
    removal: Removal
    deviations: Deviations
    touched: Mapping[str, Array]

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
    first, bounds, tolerance = (
        stock.blocks,
        np.array([stock.low, stock.high]),
        sweep_tolerance(stock.resolution),
    )
    sweeps = swept(tool, poses, rows, tolerance, bounds)
    # A shank as thick as its cutter slides along what that has cut, to the tolerance of both.
    others = {
        part.name: tuple(
            sweep.inflated(-SLACK * tolerance)
            for sweep in swept_outline(part.outline, poses, rows, tolerance, bounds)
        )
        for part in tool.parts()
        if part.name in (SHANK, HOLDER)
    }
    run = _Run(stock, sweeps, others, np.zeros((3, count)), np.zeros(count), count)
    for begin in range(0, count, MOST_AT_ONCE):
        run.cut(begin, min(begin + MOST_AT_ONCE, count))
    stock.blocks = first + count
    deviations = compare(stock, blank.mesh, blank.part)
    removal = Removal(run.volume, run.contact)
    return CutStock(blank, stock, sweeps, first, removal, deviations, run.touched)


class _Run:
    """A stock that is cut block after block, with what must not touch it."""

    def __init__(
        self,
        stock: Stock,
        sweeps: tuple[Sweep, ...],
        others: Mapping[str, tuple[Sweep, ...]],
        volume: Array,
        contact: Array,
        count: int,
    ) -> None:
        self.stock, self.sweeps, self.others = stock, sweeps, others
        self.volume, self.contact, self.first = volume, contact, stock.blocks
        self.touched = {name: np.zeros(count) for name in others}

    def cut(self, begin: int, end: int) -> None:
        """Cut blocks, and measure what shank and holder touch of the stock as it is then.

        The stock only shrinks: bodies that touch nothing of it before the blocks touch nothing after any of
        them. Where they do, half of the blocks come first, down to one, after which they mustn't touch.
        """
        near = any(self._touching(begin, end).values())
        if near and end - begin > 1:
            middle = (begin + end) // 2
            self.cut(begin, middle)
            self.cut(middle, end)
            return
        self.stock.blocks = self.first
        sweeps = [sweep for s in self.sweeps if len((sweep := of_blocks(s, begin, end)).block)]
        if sweeps:
            removal = self.stock.cut(*sweeps, blocks=self.volume.shape[1])
            self.volume += removal.volume
            self.contact += removal.contact
        if near:
            for name, volume in self._touching(begin, end).items():
                self.touched[name][begin] = volume

    def _touching(self, begin: int, end: int) -> dict[str, float]:
        """Return what each body touches of the stock in some blocks, mm³."""
        found = {}
        for name, sweeps in self.others.items():
            parts = [sweep for s in sweeps if len((sweep := of_blocks(s, begin, end)).block)]
            found[name] = float(self.stock.touched(*parts, blocks=end).sum()) if parts else 0.0
        return found
