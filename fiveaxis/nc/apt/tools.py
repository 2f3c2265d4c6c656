"""Tools that an APT file states: ``CUTTER`` with the figures of APT, ``TLDATA`` of NX, tool numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fiveaxis.errors import ToolError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.apt.statements import Statement, part_minors
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.apt_cutter import cutter_from_apt


@dataclass(frozen=True)
class Figures:
    """A cutter in the unit of the file.

    Parameters
    ----------
    statement : where it is stated
    lengths : diameter, corner radius, height, and radial distance and height of the corner's centre, None
        where they follow from the others
    angles : deg, of the bottom to the horizontal and of the side to the axis
    """

    statement: Statement
    lengths: tuple[float, float, float, float | None, float | None]
    angles: tuple[float, float]

    def tool(self, scale: float) -> Tool:
        """Make the tool; ``scale`` is mm in the unit of the file.

        Raises
        ------
        ToolError
            Figures that contradict each other, or a shape that isn't offered.
        """
        d, r, h, e, f = (None if length is None else length * scale for length in self.lengths)
        return cutter_from_apt(d or 0.0, r or 0.0, e, f, *self.angles, h)


@dataclass
class Tools:
    """What is known of the tool while a file is read.

    Parameters
    ----------
    source : the file
    now : the cutter stated last, its figures or the statement that couldn't be understood
    number : of the tool loaded last
    used, used_number : those of the first location
    changes : lines at which another tool was stated, after locations, and its statement
    """

    source: Source
    now: Figures | Statement | None = None
    number: str | None = None
    used: Figures | Statement | None = None
    used_number: str | None = None
    changes: list[Statement] = field(default_factory=list)

    def state(self, statement: Statement, *, moved: bool) -> None:
        """Take ``CUTTER`` or ``TLDATA``; ``moved`` tells whether locations came before it."""
        read = _read_cutter if statement.word != "TLDATA" else _read_tldata
        self.now = read(statement) or statement
        if not moved:
            self.used = self.now
        elif _key(self.now) != _key(self.used):
            self.changes.append(statement)

    def load(self, statement: Statement, *, moved: bool) -> None:
        """Take a tool number: ``LOADTL/1,…``, ``LOAD/TOOL,1,…``."""
        number = next((p for p in part_minors(statement.minors) if isinstance(p, float)), None)
        self.number = None if number is None else f"{number:g}"
        if not moved:
            self.used_number = self.number
        elif self.number != self.used_number and _key(self.now) == _key(self.used):
            self.changes.append(statement)

    def settle(self, options: ReadOptions, scale: float) -> tuple[Tool, list[Finding]]:
        """Give the path's tool: the caller's, or else the file's first.

        Parameters
        ----------
        scale : mm in the unit of the file

        Raises
        ------
        ToolError
            Neither names one, or the file's can't be made.
        """
        findings: list[Finding] = []
        stated: Tool | None = None
        try:
            stated = self._stated(scale)
        except ToolError as fault:
            if options.tool is None:
                raise
            findings.append(
                self._warning("tool-unread", f"{fault.message}; {options.tool} is used", fault.line)
            )
        tool = options.tool_or(stated, self.source)
        if stated is not None and str(tool) != str(stated):
            line = self.used.statement.line if isinstance(self.used, Figures) else None
            text = (
                f"the file was made for the tool {stated}; it is read for {tool}, with the same tips and axes"
            )
            findings.append(self._warning("tool-differs", text, line))
        return tool, [*(self._changed(statement, tool) for statement in self.changes), *findings]

    def _stated(self, scale: float) -> Tool | None:
        """Make the file's first tool, None if it states none."""
        if self.used is None:
            return None
        if isinstance(self.used, Figures):
            try:
                return self.used.tool(scale)
            except ToolError as fault:
                line = self.used.statement.line
                raise ToolError(
                    f"{str(self.used.statement)!r}: {fault.message}", file=self.source.name, line=line
                ) from None
        raise ToolError(
            f"{str(self.used)!r} isn't a cutter that is understood; say which tool it is (--tool ball:10)",
            file=self.source.name,
            line=self.used.line,
        )

    def _changed(self, statement: Statement, tool: Tool) -> Finding:
        text = f"{str(statement)!r} brings another tool; all of the path is read for {tool}"
        return self._warning("tool-change", text, statement.line)

    def _warning(self, code: str, text: str, line: int | None) -> Finding:
        return Finding(Severity.WARNING, code, text, Place(line=line, file=self.source.name))


def _key(stated: Figures | Statement | None) -> object:
    """Compare by figures, not by the line that states them."""
    if isinstance(stated, Figures):
        return (stated.lengths, stated.angles)
    return None if stated is None else stated.minors


def _read_cutter(statement: Statement) -> Figures | None:
    """Read ``CUTTER/d[,r[,e,f,α,β,h]]``, ISO 4343; None where it isn't that."""
    numbers = _numbers(statement.minors)
    if numbers is None or len(numbers) not in (1, 2, 7):
        return None
    d, r, e, f, alpha, beta, h = numbers if len(numbers) == 7 else [*numbers, *[0.0] * 6][:7]
    # A corner whose centre lies in the tip doesn't exist: some systems write 0 for what they don't compute.
    computed = len(numbers) == 7 and not (r > 0.0 and e == f == 0.0)
    return Figures(statement, (d, r, h, e if computed else None, f if computed else None), (alpha, beta))


def _read_tldata(statement: Statement) -> Figures | None:
    """Read ``TLDATA/MILL`` and ``TLDATA/DRILL``; None for barrels, T-cutters and turning tools.

    MILL: diameter, lower radius, length, taper angle, tip angle (to the horizontal). DRILL: a module's name,
    diameter, corner radius, length, point angle, flute length.
    """
    minors = [m for m in statement.minors if m]
    kind, rest = minors[:1], minors[1:]
    if kind == ["MILL"]:
        numbers = _numbers(rest)
        if numbers is None or len(numbers) != 5:
            return None
        d, r, h, beta, alpha = numbers
        return Figures(statement, (d, r, h, d / 2.0 - r, r), (alpha, beta))
    if kind == ["DRILL"]:
        numbers = _numbers(rest[1:])
        if numbers is None or len(numbers) < 4 or numbers[1] != 0.0:
            return None
        d, _, h, point = numbers[:4]
        return Figures(statement, (d, 0.0, h, None, None), (90.0 - point / 2.0, 0.0))
    return None


def _numbers(minors: list[str]) -> list[float] | None:
    parts = part_minors([m for m in minors if m])
    numbers = [p for p in parts if isinstance(p, float)]
    return numbers if numbers and len(numbers) == len(parts) and all(map(math.isfinite, numbers)) else None
