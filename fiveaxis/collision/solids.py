"""The tool as bodies of revolution: cutter, shank and holder, grown by clearances or shrunk by tolerances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.toolpath import Tool

# mm: segments of an outline lower than this are steps; the next segment has the same radius there.
LOWEST = 1e-9
# Fractions of a margin at which the space below and above a profile is divided; heights per segment at which
# its chord is compared with the exact profile.
CAP_STEPS = np.array([1.0, 0.75, 0.5, 0.25])
LIFTED = 17


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
        """Build a solid from its outline, bottom up, (m, 2) mm: distance from the axis, height."""
        low, high = outline[:-1], outline[1:]
        frusta = np.column_stack([low[:, 1], low[:, 0], high[:, 1], high[:, 0]])
        return cls(name, frusta[frusta[:, 2] - frusta[:, 0] > LOWEST])

    def grown(self, margin: float) -> Solid:
        """Return the solid with its surface offset outwards by a margin, mm; inwards if it is negative.

        An outward offset covers every point nearer than the margin; its convex edges are sharp, not rounded.
        An inward offset also raises the lower end of the lowest segment and drops segments that vanish.
        """
        if margin == 0.0:
            return self
        return Solid(
            self.name, _widened(self.frusta, margin) if margin > 0.0 else _shrunk(self.frusta, -margin)
        )


def _widened(frusta: Array, margin: float) -> Array:
    """Offset the surface of a stack, (m, 4) mm, outwards."""
    if not len(frusta):
        return frusta
    z0, r0, z1, r1 = frusta.T
    slope = (r1 - r0) / (z1 - z0)
    joined = (np.abs(z1[:-1] - z0[1:]) <= LOWEST) & (np.abs(r1[:-1] - r0[1:]) <= LOWEST)
    # Where a profile steps or bends inwards, the two sides are offset separately.
    ends = np.flatnonzero(~(joined & (slope[1:] <= slope[:-1] + LOWEST))) + 1
    return np.concatenate([_merged(_convex_widened(run, margin)) for run in np.split(frusta, ends)])


def _convex_widened(frusta: Array, margin: float) -> Array:
    """Offset the surface of a convex stack, (m, 4) mm, outwards.

    The offset body lies inside every offset line of the profile and inside the largest radius plus the
    margin. That bound is concave, so its chords, the new segments, are raised to lie outside it.
    """
    z0, r0, z1, r1 = frusta.T
    slope = (r1 - r0) / (z1 - z0)
    wider = margin * np.hypot(1.0, slope)
    widest = max(r0.max(), r1.max()) + margin
    caps = z0[0] - margin * CAP_STEPS, z1[-1] + margin * CAP_STEPS
    knots = np.unique(np.concatenate([caps[0], z0, z1, caps[1]]))
    low, high = knots[:-1, None], knots[1:, None]
    height = low + (high - low) * np.linspace(0.0, 1.0, LIFTED)
    lines = (r0 + wider)[:, None, None] + slope[:, None, None] * (height - z0[:, None, None])
    bound = np.minimum(lines.min(axis=0), widest)
    chord = bound[:, :1] + (bound[:, -1:] - bound[:, :1]) * np.linspace(0.0, 1.0, LIFTED)
    lift = (bound - chord).max(axis=1)
    return _trim_negative(np.column_stack([low[:, 0], bound[:, 0] + lift, high[:, 0], bound[:, -1] + lift]))


def _merged(frusta: Array) -> Array:
    """Merge neighbours that lie on one line, (m, 4) mm: fewer segments are quicker to test."""
    kept = [frusta[0]]
    for z0, r0, z1, r1 in frusta[1:]:
        low, radius, high, end = kept[-1]
        ahead = end + (end - radius) / (high - low) * (z1 - high)
        if abs(z0 - high) <= LOWEST and abs(r0 - end) <= LOWEST and abs(r1 - ahead) <= LOWEST:
            kept[-1] = np.array([low, radius, z1, r1])
        else:
            kept.append(np.array([z0, r0, z1, r1]))
    return np.array(kept)


def _shrunk(frusta: Array, margin: float) -> Array:
    """Offset the surface of a stack, (m, 4) mm, inwards; its upper end stays."""
    z0, r0, z1, r1 = frusta.T
    if not len(frusta):
        return frusta
    slope = (r1 - r0) / (z1 - z0)
    narrower = margin * np.hypot(1.0, slope)
    low = z0.copy()
    low[0] += margin
    lower, upper = r0 + slope * (low - z0) - narrower, r1 - narrower
    # Where two segments join, the narrower one sets the radius.
    joint = np.minimum(upper[:-1], (r0 - narrower)[1:])
    joined = np.abs(z1[:-1] - z0[1:]) <= LOWEST
    upper[:-1], lower[1:] = (np.where(joined, joint, own) for own in (upper[:-1], lower[1:]))
    return _trim_negative(np.column_stack([low, lower, z1, upper]))


def _trim_negative(frusta: Array) -> Array:
    """Trim segments, (m, 4) mm, to radii of 0 and more."""
    z0, r0, z1, r1 = frusta.T
    kept = (np.maximum(r0, r1) > 0.0) & (z1 - z0 > LOWEST)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = z0 - r0 * (z1 - z0) / (r1 - r0)
    low, high = np.where(r0 < 0.0, crossing, z0), np.where(r1 < 0.0, crossing, z1)
    return np.column_stack([low, np.maximum(r0, 0.0), high, np.maximum(r1, 0.0)])[kept]


def tool_solids(tool: Tool) -> tuple[Solid, ...]:
    """Build solids of the parts of a tool that are known (`Tool.parts`), from the tip upwards."""
    return tuple(Solid.of_outline(part.name, part.outline) for part in tool.parts())
