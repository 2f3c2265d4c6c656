"""Colours of a path by the power of the feed drives."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.motion import Motion

# viridis at 0, 1/8 … 1 (van der Walt and Smith, CC0): perceptually even, safe for the colour-blind.
VIRIDIS = np.array(
    [
        [0.267, 0.005, 0.329],
        [0.278, 0.175, 0.483],
        [0.230, 0.322, 0.546],
        [0.173, 0.449, 0.558],
        [0.128, 0.567, 0.551],
        [0.158, 0.684, 0.502],
        [0.369, 0.789, 0.383],
        [0.678, 0.864, 0.190],
        [0.993, 0.906, 0.144],
    ]
)
# Quantile of all powers at which the scale ends, so that one reversal doesn't darken the rest.
CLIPPED_AT = 0.98
# It also ends at this multiple of this quantile of the result's powers, because of costly baselines.
USUAL, MULTIPLE = 0.9, 3.0


def cutting_powers(powers: Array, motion: Motion) -> Array:
    """Add up the power of all feed drives, (m, k) W, in each cut.

    Returns
    -------
    (m,), W, of the move that ends at the row; NaN for the first row, links, rapids and moves without duration
    """
    power = powers.sum(axis=1)
    known = motion.cutting & (motion.time > 0.0)
    known[:1] = False
    return np.where(known, power, np.nan)


def colour_top(result: Array, *others: Array) -> float:
    """Choose the power at the end of the scale.

    Parameters
    ----------
    result, others : (n,), W, powers of the result and of its baselines; NaN is ignored

    Returns
    -------
    W, positive even if all powers are 0
    """
    together = np.concatenate([result, *others])
    known = together[np.isfinite(together)]
    usual = result[np.isfinite(result)]
    if not known.size or not known.max() > 0.0:
        return 1.0
    highest = float(np.quantile(known, CLIPPED_AT)) or float(known.max())
    bound = MULTIPLE * float(np.quantile(usual, USUAL)) if usual.size else 0.0
    return min(highest, bound) if bound > 0.0 else highest
