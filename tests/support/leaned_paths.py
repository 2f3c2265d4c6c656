"""Postures of a planned path, for tests of what a leaning cutter leaves."""

from dataclasses import replace

import numpy as np

from fiveaxis.base import normalise
from fiveaxis.model import Toolpath, feed_directions


def leaned(path: Toolpath, lead: float, lean: float = 0.0) -> Toolpath:
    """The path with one lead and lean, deg, at its cuts; upright in the air."""
    feed = feed_directions(path, path.normal)
    aside = np.cross(path.normal, feed)
    axis = normalise(path.normal + np.tan(np.radians(lead)) * feed + np.tan(np.radians(lean)) * aside)
    return replace(path, axis=np.where(np.isfinite(axis), axis, [0.0, 0.0, 1.0]))
