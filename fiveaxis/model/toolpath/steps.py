"""Tables along a path: some of its locations, a part of it, or all of it the other way round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from fiveaxis.base import Array, IntArray

# Metadata of a field with a row for each of the n locations: an array, or several bounds on the lean.
PER_LOCATION = {"of": "locations"}


def per_step(*, axis: int = 0, spread: int = 0, opposite: str = "") -> dict[str, Any]:
    """Make the metadata of a field with a row for each of the n − 1 steps.

    Parameters
    ----------
    axis : of the rows; where it is 1, the first axis has figures for growing and for falling axis values
    spread : the figure of m joined steps is their sum over m to this power: 0 for a sum, 1 for a mean; of
        booleans, whether any of them holds
    opposite : the field whose figures hold on the way back
    """
    return {"of": "steps", "axis": axis, "spread": spread, "opposite": opposite}


@dataclass(frozen=True, eq=False)
class StepTable:
    """Fields with `PER_LOCATION` or `per_step` as metadata have rows; others don't depend on the place."""

    def thinned(self, rows: IntArray) -> Self:
        """Return the table of some of the locations, (m,) ascending, with the steps between them joined."""
        begin, spans = rows[:-1], np.diff(rows)

        def joined(values: Array, spread: int) -> Array:
            if not len(spans):
                return values[:0]
            if values.dtype == np.bool_:
                return np.asarray(np.logical_or.reduceat(values[: rows[-1]], begin))
            # Summed in two dimensions: in one, the order of the sum would depend on the processor.
            total = np.add.reduceat(values[: rows[-1]].reshape(rows[-1], -1), begin, axis=0)
            return (total / spans[:, None] ** spread).reshape(-1, *values.shape[1:])

        return self._with_rows(rows, joined)

    def between(self, first: int, last: int) -> Self:
        """Return the part from one location to another, both included."""
        return self._with_rows(slice(first, last + 1), lambda values, _: values[first:last])

    def backwards(self) -> Self:
        """Return the table of the path from its last location to its first."""
        turned = self._with_rows(slice(None, None, -1), lambda values, _: values[::-1])
        changes = {}
        for name, given in self._steps():
            there = getattr(turned, given["opposite"] or name)
            # In the one layout for which the search is compiled.
            changes[name] = np.ascontiguousarray(there[::-1] if given["axis"] else there)
        return replace(turned, **changes)

    def _steps(self) -> list[tuple[str, Any]]:
        """List the fields with rows for steps that have figures: name, and how they were declared."""
        stepwise = [each for each in fields(self) if each.metadata.get("of") == "steps"]
        return [(each.name, each.metadata) for each in stepwise if getattr(self, each.name) is not None]

    def _with_rows(self, rows: IntArray | slice, step: Callable[[Array, int], Array]) -> Self:
        """Take rows of locations, and change the rows of steps, which come first, with their `spread`."""
        changes: dict[str, Any] = {}
        for each in fields(self):
            if each.metadata.get("of") == "locations":
                own = getattr(self, each.name)
                taken = tuple(b.at(rows) for b in own) if isinstance(own, tuple) else own[rows]
                changes[each.name] = taken
        for name, given in self._steps():
            taken = step(np.moveaxis(getattr(self, name), given["axis"], 0), given["spread"])
            changes[name] = np.moveaxis(taken, 0, given["axis"])
        return replace(self, **changes)
