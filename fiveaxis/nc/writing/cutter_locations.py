"""Cutter locations for other posts: APT (``GOTO/x,y,z,i,j,k``) and tables of points.

Tip and tool axis are in workpiece coordinates, and the feed is the programmed one: these files don't depend
on a machine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.motion import Motion
from fiveaxis.nc.writing.feeds import SECONDS
from fiveaxis.nc.writing.numbers import feed_text, fill_formats
from fiveaxis.nc.writing.wording import Wording

COLUMNS = "x,y,z,i,j,k,feed,cut,rapid"


def location_lines(motion: Motion, wording: Wording, header: Sequence[str]) -> list[str]:
    """Write every location of a motion, after the comment lines `header`."""
    values = wording.rounded(wording.values(motion.positions))
    if wording.dialect.language == "apt":
        return [*header, "UNITS/MM", "MULTAX/ON", *_apt(motion, wording, values), "FINI"]
    return [*header, COLUMNS, *_points(motion, wording, values)]


def _apt(motion: Motion, wording: Wording, values: Array) -> list[str]:
    """Write GOTO for each location, FEDRAT where the feed changes, RAPID before each rapid move."""
    goto = "GOTO/" + ",".join(f"%.{int(d)}f" for d in wording.decimals)
    rapid = motion.rapid
    texts = _feeds(motion, wording)
    formats, now = [], ""
    for is_rapid, feed in zip(rapid.tolist(), texts, strict=True):
        if is_rapid:
            formats.append(f"RAPID\n{goto}")
        elif feed != now:
            formats.append(f"FEDRAT/{feed},MMPM\n{goto}")
            now = feed
        else:
            formats.append(goto)
    return _filled(formats, values)


def _points(motion: Motion, wording: Wording, values: Array) -> list[str]:
    row = ",".join(f"%.{int(d)}f" for d in wording.decimals)
    kinds = [f"{int(cut)},{int(rapid)}" for cut, rapid in zip(motion.cutting, motion.rapid, strict=True)]
    formats = [f"{row},{feed},{kind}" for feed, kind in zip(_feeds(motion, wording), kinds, strict=True)]
    return _filled(formats, values)


def _filled(formats: list[str], values: Array) -> list[str]:
    kept = np.ones(values.shape, dtype=bool)
    return [line for text in fill_formats(formats, values, kept) for line in text.split("\n")]


def _feeds(motion: Motion, wording: Wording) -> list[str]:
    """Format the feed of each location, mm/min; few are different."""
    form = wording.dialect.feed["per_minute"]
    values, owner = np.unique(motion.feed * SECONDS, return_inverse=True)
    texts = [feed_text(value, form) for value in values.tolist()]
    return [texts[i] for i in owner.reshape(-1).tolist()]
