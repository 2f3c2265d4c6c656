"""What tests of control languages share: blocks one by one, those of runs too."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.runs import Run


def one_by_one(items: Iterable[Block | Run]) -> Iterator[Block]:
    """Iterate over the blocks of a program, those of its runs too."""
    for item in items:
        yield from item.blocks() if isinstance(item, Run) else [item]
