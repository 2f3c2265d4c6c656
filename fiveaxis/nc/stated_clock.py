"""The clock of the control that a program's header names."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

from fiveaxis.motion import Clock, Coordinates
from fiveaxis.nc.own_header import stated
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.tables import DIALECTS, find_dialect

COORDINATES: tuple[Coordinates, ...] = get_args(Coordinates)


def stated_clock(source: Source, control: str | Path | None = None) -> Clock:
    """Return the clock of the control that a program's header names, or of another one.

    The coordinates are those that the header states, axis positions by default. A table of its own that the
    header names isn't at hand: then the corners count as unknown.

    Raises
    ------
    SettingError
        `control` is unknown.
    """
    name, _, words = (stated(source, "control") or "").rpartition(" ")
    coordinates: Coordinates = next((known for known in COORDINATES if known == words), "axes")
    return Clock(DIALECTS.get(name) if control is None else find_dialect(control), coordinates)
