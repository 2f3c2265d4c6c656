"""The tool as bodies of revolution: cutter, shank and holder, grown by clearances or shrunk by tolerances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.toolpath import Tool

CUTTER, SHANK, HOLDER = "cutter", "shank", "holder"
# mm: pieces of an outline lower than this are steps; the piece beside them is as wide.
LOWEST = 1e-9


@dataclass(frozen=True, eq=False)
class Solid:
    """A stack of cylinders and cones about the tool axis.

    Parameters
    ----------
    name : ``cutter``, ``shank`` or ``holder``
    frusta : (m, 4), mm: height above the tip and radius, of the lower and of the upper end
    """

    name: str
    frusta: Array

    @classmethod
    def of_outline(cls, name: str, outline: Array) -> Solid:
        """Make a solid of its outline from the bottom up, (m, 2) mm: distance from the axis, height."""
        low, high = outline[:-1], outline[1:]
        frusta = np.column_stack([low[:, 1], low[:, 0], high[:, 1], high[:, 0]])
        return cls(name, frusta[frusta[:, 2] - frusta[:, 0] > LOWEST])

    def grown(self, margin: float) -> Solid:
        """Return the solid with its surface moved out by a margin, mm; inwards where that is negative.

        Outwards every piece becomes at least as wide as all that is nearer to it than the margin, with sharp
        ends in place of round ones. Inwards the lower end of the lowest piece moves up with the surface; a
        piece that nothing is left of is dropped.
        """
        z0, r0, z1, r1 = self.frusta.T
        slope = (r1 - r0) / (z1 - z0)
        wider = margin * np.hypot(1.0, slope)
        low, high = (z0 - margin, z1 + margin) if margin > 0.0 else (z0.copy(), z1)
        if margin < 0.0 and len(low):
            low[0] -= margin
        lower, upper = r0 + slope * (low - z0) + wider, r1 + slope * (high - z1) + wider
        if margin < 0.0:
            # Where two pieces join, what is left is as wide as the narrower one is there.
            joint = np.minimum(upper[:-1], (r0 + wider)[1:])
            joined = np.abs(z1[:-1] - z0[1:]) <= LOWEST
            upper[:-1], lower[1:] = (np.where(joined, joint, own) for own in (upper[:-1], lower[1:]))
        frusta = np.column_stack([low, lower, high, upper])
        return Solid(self.name, _above_nothing(frusta))

    @property
    def reach(self) -> float:
        """Largest distance of its points from the tip, mm."""
        ends = np.concatenate([self.frusta[:, :2], self.frusta[:, 2:]])
        return float(np.hypot(*ends.T).max(initial=0.0))


def _above_nothing(frusta: Array) -> Array:
    """Cut off what has a radius below 0, (m, 4) mm."""
    z0, r0, z1, r1 = frusta.T
    kept = (np.maximum(r0, r1) > 0.0) & (z1 - z0 > LOWEST)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = z0 - r0 * (z1 - z0) / (r1 - r0)
    low, high = np.where(r0 < 0.0, crossing, z0), np.where(r1 < 0.0, crossing, z1)
    return np.column_stack([low, np.maximum(r0, 0.0), high, np.maximum(r1, 0.0)])[kept]


def tool_solids(tool: Tool) -> tuple[Solid, ...]:
    """Split a tool into its cutter, shank and holder, as far as they are known, from the tip upwards.

    A shank that nobody has described is as thick as the cutter's upper end, and cuts like it.
    """
    cutter, holder = tool.cutter.outline(), tool.holder
    if holder is None:
        return (Solid.of_outline(CUTTER, cutter),)
    top = cutter[-1, 1]
    shank = []
    if tool.shank_diameter is None:
        cutter = np.vstack([cutter, [[cutter[-1, 0], holder.stick_out]]])
    elif holder.stick_out - top > LOWEST:
        radius = tool.shank_diameter / 2.0
        shank = [Solid.of_outline(SHANK, np.array([[radius, top], [radius, holder.stick_out]]))]
    outline, height = [], holder.stick_out
    for section in holder.sections:
        upper = section.diameter if section.upper_diameter is None else section.upper_diameter
        outline += [[section.diameter / 2.0, height], [upper / 2.0, height + section.length]]
        height += section.length
    return Solid.of_outline(CUTTER, cutter), *shank, Solid.of_outline(HOLDER, np.array(outline))
