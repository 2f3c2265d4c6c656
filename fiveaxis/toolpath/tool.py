"""The cutter."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fiveaxis.errors import ToolError


@dataclass(frozen=True)
class Tool:
    """A ball end mill.

    The cutter reference point is the tool tip; the ball's centre lies ``radius`` behind it along the tool
    axis. Turning the tool about the ball's centre leaves the contact with the surface where it is.

    Parameters
    ----------
    diameter : mm
    """

    diameter: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.diameter) and self.diameter > 0.0):
            raise ToolError(f"tool diameter is {self.diameter:g} mm; it must be a positive length")

    @classmethod
    def ball(cls, diameter: float) -> Tool:
        """Make a ball end mill of a diameter in mm."""
        return cls(diameter=float(diameter))

    @property
    def radius(self) -> float:
        """Radius of the ball, mm."""
        return self.diameter / 2.0

    def __str__(self) -> str:
        return f"ball:{self.diameter:g}"


def parse_tool(text: str) -> Tool:
    """Read a tool from its short form.

    Parameters
    ----------
    text : ``ball:10`` is a ball end mill of 10 mm diameter

    Raises
    ------
    ToolError
        Another shape, or a diameter that isn't a positive number.
    """
    shape, _, size = text.partition(":")
    if shape.strip().lower() != "ball":
        raise ToolError(f"tool {text!r}: only ball end mills are offered; write for example ball:10 (mm)")
    try:
        diameter = float(size)
    except ValueError:
        raise ToolError(f"tool {text!r}: {size!r} is no diameter in mm; write for example ball:10") from None
    return Tool.ball(diameter)
