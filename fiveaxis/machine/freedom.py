"""Freedoms of a chain: whether its axes reach every position and lean the tool in two directions."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, product
from fiveaxis.machine.chain import Chain

FLAT = 1e-9  # volume spanned by three unit directions below which they count as lying in one plane
PARALLEL = 1e-9  # |sin| of the angle between two directions below which they count as parallel


def directions(chain: Chain, *, rotary: bool) -> Array:
    """Return the directions of the rotary or of the linear axes, every axis at 0, (r, 3), chain order."""
    return np.array([j.line.direction for j in chain.joints if j.is_rotary is rotary]).reshape(-1, 3)


def why_not_positioning(chain: Chain) -> str | None:
    """Explain why the linear axes don't reach every position; None if they do."""
    linears = chain.linears
    if len(linears) != 3:
        return (
            f"it has {len(linears)} linear axes, and a tool tip needs X, Y and Z: write all of 1, 2, 3 into "
            "the code, for example 640123"
        )
    first, second, third = directions(chain, rotary=False)
    if abs(product(np.cross(first, second), third)) < FLAT:
        return f"the directions of {', '.join(linears)} lie in one plane; they have to span space"
    return None


def spare_axes(chain: Chain) -> list[str]:
    """List the redundant rotary axes of three: without one, the others still lean the tool; tool first."""
    if len(chain.rotaries) != 3:
        return []
    return [c for c in reversed(chain.rotaries) if why_not_orienting(chain.holding(c, 0.0)) is None]


def why_not_orienting(chain: Chain) -> str | None:
    """Explain why the rotary axes aren't two that lean the tool in two directions; None if they are."""
    rotaries = chain.rotaries
    if len(rotaries) != 2:
        spare = spare_axes(chain)
        hint = f"; clamp one: machine.holding({spare[0]!r}, 0.0)" if spare else ""
        return f"it has {len(rotaries)} rotary axes, and choosing a posture needs two{hint}"
    first, second = directions(chain, rotary=True)
    if np.linalg.norm(np.cross(second, chain.tool_home[:3, 2]), axis=-1) < PARALLEL:
        return (
            f"{rotaries[1]}, the rotary axis next to the tool, only spins the tool about itself and gives no "
            "second orientation freedom; make another one the last rotary axis, as in 640123"
        )
    if np.linalg.norm(np.cross(first, second), axis=-1) < PARALLEL:
        return f"{rotaries[0]} and {rotaries[1]} are parallel, so they lean the tool in one direction only"
    return None
