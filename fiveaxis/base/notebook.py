"""How objects show in a notebook: a short table in HTML, and their columns as a pandas frame."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from fiveaxis.base.errors import MissingDependency

if TYPE_CHECKING:
    import pandas

# Rows of a table in a notebook; a report may have hundreds of causes.
MOST_ROWS = 30

Table = tuple[Sequence[str], Iterable[Sequence[object]]]


class ShownAsTable(ABC):
    """An object that a notebook shows as a table: its `repr` above, a few rows below."""

    @abstractmethod
    def _table(self) -> Table:
        """Return the heads and the rows, with numbers as they are to be read."""

    def _repr_html_(self) -> str:
        """Write the table in HTML; names and messages of files are text in it, never markup."""
        heads, rows = self._table()
        listed = list(rows)
        body = "".join(_row(row, "td") for row in listed[:MOST_ROWS])
        more = len(listed) - MOST_ROWS
        body += _row([f"… {more} more"], "td") if more > 0 else ""
        caption = escape(repr(self).removeprefix("<").removesuffix(">"))
        return (
            f'<table><caption style="text-align:left">{caption}</caption>'
            f"<thead>{_row(heads, 'th')}</thead><tbody>{body}</tbody></table>"
        )


def _row(cells: Iterable[object], tag: str) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(str(cell))}</{tag}>' for cell in cells)}</tr>"


class HasColumns(ABC):
    """Rows whose values are arrays: a table for pandas, polars, or a spreadsheet."""

    @abstractmethod
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns, (n,) each, by names that end in their unit: ``X_mm``, ``A_deg``, ``time_s``."""

    def as_lists(self) -> dict[str, list[Any]]:
        """Return the columns as plain data for JSON and CSV; what isn't a number is None."""
        return {
            name: [None if value != value else value for value in values.tolist()]
            for name, values in self.columns().items()
        }

    def to_frame(self) -> pandas.DataFrame:
        """Return the columns as a pandas frame; other libraries take `columns` itself.

        `MissingDependency` if pandas isn't installed.
        """
        try:
            import pandas
        except ModuleNotFoundError as fault:
            if fault.name != "pandas":
                raise
            raise MissingDependency(
                "pandas", "to_frame", "install it with `pip install 'fiveaxis[notebook]'`, or take columns()"
            ) from None
        return pandas.DataFrame(dict(self.columns()))
