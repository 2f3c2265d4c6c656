"""Tools from the seven figures of APT."""

from __future__ import annotations

import math

from fiveaxis.errors import ToolError
from fiveaxis.toolpath import shapes
from fiveaxis.toolpath.shapes import require_positive
from fiveaxis.toolpath.tool import Tool

# mm: figures of an APT cutter are rounded to so much.
APT_ROUNDING = 1e-3


def cutter_from_apt(
    d: float,
    r: float = 0.0,
    e: float | None = None,
    f: float | None = None,
    alpha: float = 0.0,
    beta: float = 0.0,
    height: float | None = None,
) -> Tool:
    """Make the tool of a ``CUTTER/d,r,e,f,α,β,h`` statement.

    Parameters
    ----------
    d : mm, diameter
    r : mm, corner radius
    e, f : mm, of the corner's centre from the axis and above the tip; by default those of a cutter with a
        flat bottom and upright sides
    alpha : **degrees**, from the bottom to the horizontal
    beta : **degrees**, from the side to the axis
    height : mm, of the cutter; 0 counts as not given

    Raises
    ------
    ToolError
        Figures that contradict each other, or a shape that isn't offered.

    References
    ----------
    ISO 4343:2000, CUTTER.
    """
    text = f"CUTTER/{d:g},{r:g},{_shown(e)},{_shown(f)},{alpha:g},{beta:g},{_shown(height)}"
    require_positive(text, d=d)
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
        f"{text}: no cutter of these figures is offered (ball, square, bull-nose, tapered ball, drill); say "
        "which it is with tool (--tool), for example bull:16:4"
    )


def _near(figure: float | None, expected: tuple[float, ...]) -> bool:
    return figure is None or any(abs(figure - value) <= APT_ROUNDING for value in expected)


def _shown(figure: float | None) -> str:
    return "-" if figure is None else f"{figure:g}"
