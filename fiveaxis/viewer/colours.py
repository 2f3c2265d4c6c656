"""Colours for power: what the feed drives draw in each move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.energy import move_powers
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion

ByteArray = NDArray[np.uint8]

# viridis at 0, 1/8 … 1 (van der Walt and Smith, CC0): even steps for the eye, safe for the colour-blind.
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
# Links and rapids carry no colour of their own.
AIR = (0.36, 0.38, 0.42)
# Moves dearer than this share of all take the last colour, so that one reversal doesn't darken the rest;
# and the scale ends at this multiple of what nine in ten of the result's moves cost at most, so that a very
# dear baseline doesn't either.
CLIPPED_AT = 0.98
USUAL, MULTIPLE = 0.9, 3.0


def viridis(shares: Array) -> Array:
    """Map shares to colours: (n,) from 0 to 1, clipped, NaN counts as 0 → (n, 3) RGB from 0 to 1."""
    place = np.linspace(0.0, 1.0, len(VIRIDIS))
    known = np.nan_to_num(shares, nan=0.0, posinf=1.0, neginf=0.0)
    return np.stack([np.interp(known, place, channel) for channel in VIRIDIS.T], axis=1)


def cutting_powers(machine: Machine, motion: Motion) -> Array:
    """Compute the power of all feed drives in each cut, at its mean speeds.

    Returns
    -------
    (n,), W, of the move that ends at the row; NaN for the first row, for links and rapids, and where a move
    takes no time
    """
    power = move_powers(machine, motion).sum(axis=1)
    known = motion.cutting & (motion.time > 0.0)
    known[:1] = False
    return np.where(known, power, np.nan)


def colour_top(result: Array, *others: Array) -> float:
    """Choose the power that takes the last colour.

    Parameters
    ----------
    result, others : (n,), W, powers of the result and of what stands beside it; NaN is left out

    Returns
    -------
    W, positive even where nothing costs
    """
    together = np.concatenate([result, *others])
    known = together[np.isfinite(together)]
    usual = result[np.isfinite(result)]
    if not known.size or not known.max() > 0.0:
        return 1.0
    dearest = float(np.quantile(known, CLIPPED_AT)) or float(known.max())
    bound = MULTIPLE * float(np.quantile(usual, USUAL)) if usual.size else 0.0
    return min(dearest, bound) if bound > 0.0 else dearest


def move_colours(powers: Array, top: float) -> ByteArray:
    """Colour moves by power: (n,) W → (n, 3) RGB bytes; what has no power known, links too, is grey."""
    colours = np.where(np.isnan(powers)[:, None], AIR, viridis(powers / top))
    return np.round(255.0 * colours).astype(np.uint8)
