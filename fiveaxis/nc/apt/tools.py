"""Tools of an APT file: ``CUTTER`` with the seven figures of APT, ``TLDATA`` of NX, tool numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.base import Finding, IntArray, Severity, ToolError
from fiveaxis.model import InForce, Tool, shapes
from fiveaxis.nc.apt.statements import Statement, numbers_and_words
from fiveaxis.nc.operations import rows_of
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source

# mm, rounding of the figures of an APT cutter.
APT_ROUNDING = 1e-3


@dataclass(frozen=True)
class Figures:
    """A cutter in the unit of the file.

    Parameters
    ----------
    statement : that defines it
    lengths : diameter, corner radius, height, and radial distance and height of the corner's centre, None
        where they follow from the others
    angles : deg, from the bottom to the horizontal and from the side to the axis
    """

    statement: Statement
    lengths: tuple[float, float, float, float | None, float | None]
    angles: tuple[float, float]

    def tool(self, scale: float) -> Tool:
        """Create the tool; `scale` is mm in the unit of the file. Raises as `cutter_from_apt`."""
        d, r, h, e, f = (None if length is None else length * scale for length in self.lengths)
        return cutter_from_apt(d or 0.0, r or 0.0, e, f, *self.angles, h)


@dataclass
class Tools:
    """What is known of the tool, spindle and coolant while a file is read.

    Parameters
    ----------
    source : the file
    cutter : stated last: its figures, or a statement of unknown form
    now : what is in force besides
    changes : rows from which cutter and the rest hold, with both
    used : the cutter of the operation that is read
    """

    source: Source
    cutter: Figures | Statement | None = None
    now: InForce = field(default_factory=InForce)
    changes: list[tuple[int, tuple[Figures | Statement | None, InForce]]] = field(default_factory=list)
    used: Figures | Statement | None = None

    def state(self, statement: Statement, row: int) -> None:
        """Process ``CUTTER`` or ``TLDATA`` before a row."""
        read = _read_cutter if statement.word != "TLDATA" else _read_tldata
        self.cutter = read(statement) or statement
        self._change(row)

    def load(self, statement: Statement, row: int) -> None:
        """Process a tool number: ``LOADTL/1,…``, ``LOAD/TOOL,1,…``; a second one is the length offset."""
        numbers, _ = numbers_and_words(statement.minors)
        tool, offset = [*(f"{number:g}" for number in numbers[:2]), "", ""][:2]
        self._change(row, tool=tool, length_offset=offset if "ADJUST" in statement.minors else "")

    def run_spindle(self, statement: Statement, speed: float | None, row: int) -> None:
        """Process ``SPINDL``, whose speed in rev/min is None where it states none."""
        minors = statement.minors
        if minors != ["ON"]:
            sign = -1.0 if "CCLW" in minors else 1.0
            self._change(row, spindle=None if not speed or "OFF" in minors else sign * speed)

    def cool(self, statement: Statement, row: int) -> None:
        """Process ``COOLNT``."""
        words = [minor for minor in statement.minors if minor not in ("ON", "OFF")]
        self._change(row, coolant="" if "OFF" in statement.minors else (words or ["FLOOD"])[0])

    def _change(self, row: int, **now: Any) -> None:
        self.now = replace(self.now, **now)
        self.changes.append((row, (self.cutter, self.now)))

    def states(self, count: int) -> tuple[list[tuple[InForce, object]], IntArray]:
        """Return the states of `Work`, and which one is in force in each of `count` rows."""
        held = ((now, (now.tool, str(_key(cutter)))) for _, (cutter, now) in self.changes)
        states: list[tuple[InForce, object]] = [(InForce(), None), *held]
        return states, rows_of(self.changes, np.arange(count))

    def use(self, row: int) -> None:
        """Take the cutter in force at a row; the first one before any is."""
        known = [cutter for begin, (cutter, _) in self.changes if begin <= row and cutter is not None]
        later = (cutter for _, (cutter, _) in self.changes if cutter is not None)
        self.used = known[-1] if known else next(later, None)

    def diameter(self) -> float | None:
        """Return the diameter of the file's cutter in the file's unit, None if it isn't known."""
        try:
            stated = self._stated(1.0)
        except ToolError:
            return None
        return None if stated is None else stated.diameter

    def settle(self, options: ReadOptions, scale: float) -> tuple[Tool, list[Finding]]:
        """Return the path's tool, the caller's or else the file's, and findings.

        The scale is mm in the unit of the file. `ToolError` if neither specifies a tool, or the file's isn't
        supported.
        """
        findings: list[Finding] = []
        stated: Tool | None = None
        try:
            stated = self._stated(scale)
        except ToolError as fault:
            used = options.tool or options.stand_in
            if used is None:
                raise
            findings.append(self._warning("tool-unread", f"{fault.message}; {used} is used", fault.line))
        tool = options.tool_or(stated, self.source)
        if stated is not None and str(tool) != str(stated):
            line = self.used.statement.line if isinstance(self.used, Figures) else None
            text = (
                f"the file was made for the tool {stated}; it is read for {tool}, with the same tips and axes"
            )
            findings.append(self._warning("tool-differs", text, line))
        return tool, findings

    def _stated(self, scale: float) -> Tool | None:
        """Create the used tool, None if the file has none."""
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
            f"{str(self.used)!r} isn't a known form of cutter; give the tool (--tool ball:10)",
            file=self.source.name,
            line=self.used.line,
        )

    def _warning(self, code: str, text: str, line: int | None) -> Finding:
        return self.source.finding(Severity.WARNING, code, text, line)


def _key(stated: Figures | Statement | None) -> object:
    """Return a cutter's figures, without the line that states them, for comparison."""
    if isinstance(stated, Figures):
        return (stated.lengths, stated.angles)
    return None if stated is None else stated.minors


def _read_cutter(statement: Statement) -> Figures | None:
    """Read ``CUTTER/d[,r[,e,f,α,β,h]]``, ISO 4343; None for another form."""
    numbers = _numbers(statement.minors)
    if numbers is None or len(numbers) not in (1, 2, 7):
        return None
    d, r, e, f, alpha, beta, h = numbers if len(numbers) == 7 else [*numbers, *[0.0] * 6][:7]
    # A corner can't have its centre in the tip: some systems write 0 for values that they don't compute.
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
    numbers, words = numbers_and_words([m for m in minors if m])
    return numbers if numbers and not words and all(map(math.isfinite, numbers)) else None


def cutter_from_apt(
    d: float,
    r: float = 0.0,
    e: float | None = None,
    f: float | None = None,
    alpha: float = 0.0,
    beta: float = 0.0,
    height: float | None = None,
) -> Tool:
    """Create the tool of a ``CUTTER/d,r,e,f,α,β,h`` statement (ISO 4343:2000, CUTTER).

    `ToolError` for contradictory figures, or an unsupported shape.

    Parameters
    ----------
    d : mm, diameter
    r : mm, corner radius
    e, f : mm, of the corner's centre from the axis and above the tip; by default those of a cutter with a
        flat bottom and vertical sides
    alpha : **degrees**, from the bottom to the horizontal
    beta : **degrees**, from the side to the axis
    height : mm, of the cutter; 0 counts as not given
    """
    text = f"CUTTER/{d:g},{r:g},{_figure_text(e)},{_figure_text(f)},{alpha:g},{beta:g},{_figure_text(height)}"
    shapes.require_positive(text, d=d)
    length = height or None
    if beta == 0.0 and r == 0.0 and alpha > 0.0 and _near(e, (0.0, d / 2.0)):
        return Tool(shapes.drill(d, 180.0 - 2.0 * alpha, length=length))
    if alpha == 0.0 and beta == 0.0 and _near(e, (d / 2.0 - r,)) and _near(f, (r,)):
        if r == 0.0:
            return Tool(shapes.flat(d, length=length))
        is_ball = abs(r - d / 2.0) <= APT_ROUNDING
        return Tool(shapes.ball(d, length=length) if is_ball else shapes.bull(d, r, length=length))
    if alpha == 0.0 and beta > 0.0 and r > 0.0 and height and _near(e, (0.0,)) and _near(f, (r,)):
        slope = math.radians(beta)
        upper = r * math.cos(slope) + (height - r * (1.0 - math.sin(slope))) * math.tan(slope)
        return Tool(shapes.taper(2.0 * r, beta, 2.0 * upper, length=length))
    raise ToolError(
        f"{text}: no supported cutter has these figures (ball, square, bull-nose, tapered ball, drill); give "
        "the tool (--tool), for example bull:16:4"
    )


def _near(figure: float | None, expected: tuple[float, ...]) -> bool:
    return figure is None or any(abs(figure - value) <= APT_ROUNDING for value in expected)


def _figure_text(figure: float | None) -> str:
    return "-" if figure is None else f"{figure:g}"
