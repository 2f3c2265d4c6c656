"""Cutter locations for other posts: APT (``GOTO/x,y,z,i,j,k``) and tables of points.

The tip and the tool axis stand in workpiece coordinates, and the feed is the programmed one: these files say
where the tool goes, not how a machine gets it there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.motion import Motion
from fiveaxis.nc.writing.feeds import SECONDS
from fiveaxis.nc.writing.numbers import feed_text, fill_formats
from fiveaxis.nc.writing.places import Wording

COLUMNS = "x,y,z,i,j,k,feed,cut,rapid"


def location_lines(motion: Motion, wording: Wording, header: Sequence[str]) -> list[str]:
    """Write every location of a motion.

    Parameters
    ----------
    header : comments, already lines of the language
    """
    places = wording.rounded(wording.values(motion.positions))
    if wording.dialect.language == "apt":
        return _apt(motion, wording, places, header)
    return _points(motion, wording, places, header)


def _apt(motion: Motion, wording: Wording, places: Array, header: Sequence[str]) -> list[str]:
    """Write GOTO for each location, FEDRAT where the feed changes, RAPID before each rapid move."""
    goto = "GOTO/" + ",".join(f"%.{int(d)}f" for d in wording.decimals)
    rapid = motion.rapid
    texts = _feeds(motion, wording)
    formats, now = [], ""
    for quick, feed in zip(rapid.tolist(), texts, strict=True):
        if quick:
            formats.append(f"RAPID\n{goto}")
        elif feed != now:
            formats.append(f"FEDRAT/{feed},MMPM\n{goto}")
            now = feed
        else:
            formats.append(goto)
    return [*header, "UNITS/MM", "MULTAX/ON", *_filled(formats, places), "FINI"]


def _points(motion: Motion, wording: Wording, places: Array, header: Sequence[str]) -> list[str]:
    row = ",".join(f"%.{int(d)}f" for d in wording.decimals)
    kinds = [f"{int(cut)},{int(quick)}" for cut, quick in zip(motion.cutting, motion.rapid, strict=True)]
    formats = [f"{row},{feed},{kind}" for feed, kind in zip(_feeds(motion, wording), kinds, strict=True)]
    return [*header, COLUMNS, *_filled(formats, places)]


def _filled(formats: list[str], places: Array) -> list[str]:
    kept = np.ones(places.shape, dtype=bool)
    return [line for text in fill_formats(formats, places, kept) for line in text.split("\n")]


def _feeds(motion: Motion, wording: Wording) -> list[str]:
    """Write the feed of each location, mm/min; few of them are different."""
    form = wording.dialect.feed["per_minute"]
    values, owner = np.unique(motion.feed * SECONDS, return_inverse=True)
    texts = [feed_text(value, form) for value in values.tolist()]
    return [texts[i] for i in owner.reshape(-1).tolist()]
