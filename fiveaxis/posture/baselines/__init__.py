"""The postures that a result is measured against, also where a mask refuses some of them."""

from fiveaxis.posture.baselines.branches import postures, spread_over_links
from fiveaxis.posture.baselines.catalogue import (
    INSIDE,
    NoBaseline,
    as_programmed,
    find_baselines,
    follow_axes,
    leaned,
    nearest_to_reference,
    uphill,
)
from fiveaxis.posture.baselines.clear import moved_clear
from fiveaxis.posture.baselines.held import nearest_held

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
    "spread_over_links",
    "uphill",
]
