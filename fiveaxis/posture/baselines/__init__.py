"""The motions that a result is compared with, also where a mask refuses some of their postures."""

from fiveaxis.posture.baselines.branches import (
    INSIDE,
    NoBaseline,
    follow_axes,
    nearest_held,
    nearest_to_reference,
    postures,
    require_blocks,
)
from fiveaxis.posture.baselines.catalogue import as_programmed, find_baselines, leaned
from fiveaxis.posture.baselines.clear import moved_clear

__all__ = [
    "INSIDE",
    "NoBaseline",
    "as_programmed",
    "find_baselines",
    "follow_axes",
    "leaned",
    "moved_clear",
    "nearest_held",
    "nearest_to_reference",
    "postures",
    "require_blocks",
]
