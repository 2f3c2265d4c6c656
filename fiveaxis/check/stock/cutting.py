"""A stock that a program cuts, move by move, and the result beside the part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import STOCK_TOLERANCE, Array, IntArray
from fiveaxis.cam import Mesh
from fiveaxis.check.stock.comparing import Deviations, compare, require_part_inside, sweep_tolerance
from fiveaxis.check.stock.dexels import Removal, Stock
from fiveaxis.check.stock.sources import fill
from fiveaxis.check.stock.sweeping import Poses, Sweep, cutter_bodies, outline_bodies, swept
from fiveaxis.model import CUTTER, HOLDER, SHANK, Tool

# Blocks that are cut at once where nothing but the cutter is near; tolerances by which shank and holder may
# reach into the stock.
MOST_AT_ONCE, SLACK = 512, 3.0
# Parts of a range of blocks in which something touches the stock as it was before.
PARTS = 16


@dataclass(frozen=True, eq=False)
class Blank:
    """A stock that contains the part, before anything is cut.

    Parameters
    ----------
    stock : its material
    mesh : the finished part, closed, mm, workpiece frame
    part : the part on the stock's grid
    tolerance : mm, distance from the part within which it is finished
    """

    stock: Stock
    mesh: Mesh
    part: Stock
    tolerance: float = STOCK_TOLERANCE

    @classmethod
    def of(cls, stock: Stock, mesh: Mesh) -> Blank:
        """Put a part into its stock: `MeshError` if its mesh isn't closed, `JobError` if it reaches out."""
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
    touched : shank and holder, where known, and the cutter at rapid: mm³ of the stock, as it was then, that
        each row's move touches
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
        return replace(self.blank, stock=self.finished)


def cut_stock(
    blank: Blank, tool: Tool, poses: Poses, rows: IntArray, count: int, rapid: IntArray | None = None
) -> CutStock:
    """Cut a copy of a blank along a program of `count` rows, and compare the result with the part.

    Poses are of the tool, at fractional rows. Rows, (m,), ascending, are those at which the moves end that
    are swept; in those of the rapid ones the cutter mustn't touch the stock either, by default none.
    """
    stock = blank.stock.copy()
    bounds, tolerance = np.array([stock.low, stock.high]), sweep_tolerance(stock.resolution)
    sweeps = swept(cutter_bodies(tool), poses, rows, tolerance, bounds)
    mustnt = {
        part.name: swept(outline_bodies(part.outline), poses, rows, tolerance, bounds)
        for part in tool.parts()
        if part.name in (SHANK, HOLDER)
    }
    if rapid is not None and len(rapid):
        mustnt[CUTTER] = swept(cutter_bodies(tool), poses, rapid, tolerance, bounds)
    # A shank as thick as its cutter slides along what that has cut, to the tolerance of both.
    others = {n: tuple(one.inflated(-SLACK * tolerance) for one in found) for n, found in mustnt.items()}
    run = _Run(stock, sweeps, others, count)
    for begin in range(0, count, MOST_AT_ONCE):
        run.cut(begin, min(begin + MOST_AT_ONCE, count))
    deviations = compare(stock, blank.mesh, blank.part)
    removal = Removal(run.volume, run.contact)
    return CutStock(blank, stock, sweeps, blank.stock.blocks, removal, deviations, run.touched)


class _Run:
    """A stock that is cut block after block, with what must not touch it."""

    def __init__(
        self, stock: Stock, sweeps: tuple[Sweep, ...], others: Mapping[str, tuple[Sweep, ...]], count: int
    ) -> None:
        self.stock, self.sweeps, self.others = stock, sweeps, others
        self.volume, self.contact = np.zeros((3, count)), np.zeros(count)
        # As last measured: of a block that may touch the stock, after that was cut; of a cutter, before.
        self.touched = {name: np.full(count, np.inf) for name in others}

    def cut(self, begin: int, end: int) -> None:
        """Cut blocks, and measure what bodies touch of the stock as it is then that mustn't.

        The stock only shrinks: blocks whose bodies touch nothing of it before a range of blocks touch nothing
        after any of them. The others are looked at again in shorter ranges, down to the block after which
        they mustn't touch.
        """
        if self._touches(begin, end) and end - begin > 1:
            step = max((end - begin) // PARTS, 1)
            for first in range(begin, end, step):
                self.cut(first, min(first + step, end))
            return
        sweeps = of_blocks(self.sweeps, begin, end)
        removal = self.stock.cut(*sweeps, blocks=end - begin)
        self.volume[:, begin:end], self.contact[begin:end] = removal.volume, removal.contact
        self._touches(begin, end, but=CUTTER)

    def _touches(self, begin: int, end: int, but: str = "") -> bool:
        """Measure what bodies touch of the stock in those of some blocks in which they did so before."""
        for name, sweeps in self.others.items():
            touched = self.touched[name][begin:end]
            if touched.any() and name != but:
                parts = [sweep.at(touched[sweep.block] > 0.0) for sweep in of_blocks(sweeps, begin, end)]
                touched[:] = self.stock.touched(*parts, blocks=end - begin)
        return any(volume[begin:end].any() for volume in self.touched.values())


def of_blocks(sweeps: tuple[Sweep, ...], begin: int, end: int) -> list[Sweep]:
    """Return the segments of some blocks, which are numbered from the first of them."""
    found = [sweep.at(slice(*np.searchsorted(sweep.block, [begin, end]))) for sweep in sweeps]
    return [sweep._replace(block=sweep.block - begin) for sweep in found if len(sweep.block)]
