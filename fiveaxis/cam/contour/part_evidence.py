"""A part decides what its path leaves open: the frame of tip positions, and the unit of lengths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fiveaxis.base import Finding, Severity
from fiveaxis.cam.contour.touching import count_touching, find_contacts
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.model import Toolpath

# Setting -> its values, the findings that leave it open, and the one that tells its choice.
OPEN = {
    "positions": (("table", "machine"), {"positions-assumed", "positions-doubtful"}, "positions-by-part"),
    "unit": (("mm", "inch"), {"unit-assumed", "unit-doubtful"}, "unit-by-part"),
}
# A reading in which more cuts touch the part, by this factor, is the one that was meant.
CLEARLY = 2.0


def find_settled_contacts(
    toolpath: Toolpath,
    part: Mesh,
    tolerance: float,
    read: Callable[[dict[str, str]], Toolpath],
    given: set[str],
    *,
    crease: float,
) -> Toolpath:
    """Find a path's contacts with a part, in the reading that touches the part.

    Parameters
    ----------
    toolpath : as it is read by default
    part, tolerance, crease : as for `find_contacts`
    read : reads the path again, with settings
    given : settings of the caller, which stay

    Raises
    ------
    FiveAxisError
        As `find_contacts`.
    """
    settled: dict[str, str] = {}
    told: list[Finding] = []
    for name, (values, codes, code) in OPEN.items():
        first = next((f for f in toolpath.findings if f.code in codes), None)
        if first is None or name in given:
            continue
        if not toolpath.has_axes:
            continue
        cuts = {
            value: count_touching(read({**settled, name: value}), part, tolerance=tolerance)
            for value in values
        }
        best, worst = sorted(values, key=lambda value: -cuts[value])
        if cuts[best] <= CLEARLY * cuts[worst]:
            continue
        settled[name] = best
        text = (
            f"{cuts[best]} cuts touch the part as {name}={best}, as they are read, and {cuts[worst]} as "
            f"{name}={worst}; set {name} (--{name}) to override that"
        )
        told.append(Finding(Severity.NOTE, code, text, first.place))
    if settled:
        toolpath = read(settled)
        toolpath = replace(toolpath, findings=(*toolpath.findings, *told))
    return find_contacts(toolpath, part, tolerance=tolerance, crease=crease)
