"""Contacts of a programmed path with the part: surface normals for paths that have none."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import (
    CREASE,
    SURFACE_TOLERANCE,
    Array,
    BoolArray,
    CadFile,
    Finding,
    IntArray,
    Meshes,
    MeshSource,
    SettingError,
    Severity,
    ToolpathError,
    Unit,
    angle_between,
    perpendicular,
)
from fiveaxis.cam.contour.contacts import lean_limit, lean_normals
from fiveaxis.cam.mesh.distance import AT_SURFACE, SignedSurface, tree_of
from fiveaxis.cam.mesh.loading import take_mesh
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.cam.mesh.surface import Surface
from fiveaxis.model import ROUNDING, MoveKind, Toolpath, Zone

# Angles around the tool axis in the first round of a search, its rounds, and how much finer each one is.
RING, ROUNDS, NARROWING = 32, 6, 4
# mm: added to the gap of a zone that isn't touched at an angle of its own.
FOREIGN = 1e6
# rad: a normal that is off the direction of the contact found by more isn't one.
SLIP = np.radians(2.0)
# Setting -> its values, the findings that leave it open, and the one that tells its choice.
OPEN = {
    "positions": (("table", "machine"), {"positions-assumed", "positions-doubtful"}, "positions-by-part"),
    "unit": (("mm", "inch"), {"unit-assumed", "unit-doubtful"}, "unit-by-part"),
}
# A reading in which more cuts touch the part, by this factor, is the one that was meant.
CLEARLY = 2.0
# Shares of a move at which its curve is held against the part; mm, depth that counts there.
SHARES, DEEP = (0.25, 0.5, 0.75), 0.01


def on_part(toolpath: Toolpath, part: Mesh | None) -> Toolpath:
    """Return a path whose zone touches with chords where its curve reaches deeper into the part than they do.

    The part has the last word on what lies between two locations: its facets may be what was designed.
    None leaves the path as it is.
    """
    if part is None or toolpath.curve is None:
        return toolpath
    surface, moves = SignedSurface.of(part), np.flatnonzero(toolpath.curved)
    straight = np.zeros(len(toolpath), dtype=bool) if toolpath.straight is None else toolpath.straight.copy()
    while len(moves) and toolpath.curve is not None:
        worse = np.zeros(len(moves), dtype=bool)
        for share in SHARES:
            point, chord = toolpath.curve.between(toolpath.pivot, np.asarray(moves - 1.0 + share))
            depth = toolpath.zone.radius - surface.nearest(point)[2]
            deep = np.flatnonzero(depth > DEEP)
            if len(deep):
                of_chord = toolpath.zone.radius - surface.nearest((point + chord)[deep])[2]
                worse[deep] |= depth[deep] > of_chord
        if not worse.any():
            break
        straight[moves[worse]] = True
        toolpath = replace(toolpath, straight=straight.copy())
        # Beside a chord the curve isn't what it was.
        beside = (moves[worse][:, None] + np.array([-1, 1])).ravel()
        moves = np.intersect1d(beside, np.flatnonzero(toolpath.curved))
    return toolpath


def count_touching(toolpath: Toolpath, part: MeshSource, *, tolerance: float) -> int:
    """Count the cuts that touch a part within a tolerance, mm, neither off it nor deep in it."""
    rows = np.flatnonzero(toolpath.cutting)
    touch = _touches(toolpath.at(rows), SignedSurface.of(take_mesh(part, name="part", allow_open=True)))
    return int((np.abs(touch.gap) <= tolerance).sum())


def find_contacts(
    toolpath: Toolpath,
    part: MeshSource,
    *,
    tolerance: float = SURFACE_TOLERANCE,
    crease: float = CREASE,
    unit: Unit | None = None,
    mesh_tolerance: float = CadFile.mesh_tolerance,
    body: str | None = None,
) -> Toolpath:
    """Find the surface normal at every cut of a programmed path.

    The cutter touches where, at its programmed tip and axis, it comes nearest to the part. The normal there
    is that of the model's surface or, without one, that of the mesh, smoothed across its facets; at a crease
    it points from there to a ball's centre and isn't the mean of the faces' normals. For cutters other than
    balls the angle around the axis is searched first, and on a mesh the normal differs from that of the
    touched facet only so far that the cutter, turned about its contact, sinks into the facet by at most
    0.005 mm. A feed move that ends farther than the tolerance from the surface becomes a link.

    Parameters
    ----------
    toolpath : with tool axes
    part : mesh file or mesh, workpiece frame
    tolerance : mm, largest gap or depth between cutter and part that counts as touching
    crease : **degrees**; facets that meet at a smaller angle are one smooth surface
    unit : of a file: ``mm``, ``inch`` or ``m``; by default what it states, or mm; a mesh is in mm
    mesh_tolerance, body : of a CAD file, as for `fiveaxis.cam.load_mesh`

    Returns
    -------
    The path with contacts and normals at its cuts, and the findings ``off-surface`` (moves beyond the
    tolerance), ``sunk`` (cuts deeper than the tolerance) and ``no-single-contact`` (cuts on the flat bottom,
    or with several points of the profile)

    Raises
    ------
    MeshError
        The part can't be read or has no area.
    SettingError
        The tolerance isn't positive, or the crease angle not within 0…90 degrees.
    ToolpathError
        The path has no tool axes, or no cut touches the part.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise SettingError(f"surface tolerance is {tolerance:g} mm; it must be a number above 0")
    if not toolpath.has_axes:
        raise ToolpathError("has no tool axes, so where it touches isn't known", file=toolpath.name)
    Meshes(crease=crease, mesh_tolerance=mesh_tolerance, body=body)  # refuses what is out of range
    rows = np.flatnonzero(toolpath.cutting)
    mesh = take_mesh(part, name="part", unit=unit, allow_open=True, mesh_tolerance=mesh_tolerance, body=body)
    model = mesh.model
    surface = Surface.from_mesh(mesh, crease=math.radians(crease))
    touch = _touches(toolpath.at(rows), SignedSurface.of(mesh, model))
    apart = touch.gap > tolerance
    several = ~apart & ~touch.single
    sunk = ~apart & (touch.gap < -tolerance)
    touched = ~apart & touch.single
    if not touched.any() and several.any():
        raise ToolpathError(
            f"{int(several.sum())} cuts touch the part, none with one point of {toolpath.tool}: it touches "
            "with its flat bottom or edge on edge; the tool can't be turned about such a contact",
            file=toolpath.name,
        )
    if not touched.any():
        raise ToolpathError(
            f"no cut touches the part within {tolerance:g} mm (the nearest is {np.abs(touch.gap).min():.4g} "
            "mm off); check zero, unit and tool, or allow more (surface_tolerance)",
            file=toolpath.name,
        )
    normal = np.full_like(toolpath.axis, np.nan)
    normal[rows[touched]] = _smoothed(toolpath.at(rows), touch, mesh, surface)[touched]
    kind = toolpath.kind.copy()
    kind[rows[~touched]] = MoveKind.LINK
    known = replace(toolpath, kind=kind).touching_at(normal)
    texts = {
        "off-surface": (apart, f"feed moves end more than {tolerance:g} mm off the part, up to {{:.4g}} mm; "
                        "they become links"),
        "sunk": (sunk, f"cuts reach more than {tolerance:g} mm into the part, up to {{:.4g}} mm; check zero, "
                 "unit and tool"),
        "no-single-contact": (several, "cuts touch with more than one point, or with none that the cutter's "
                              "profile has; they become links"),
    }  # fmt: skip
    found = [
        _finding(toolpath, code, text, rows[bad], np.abs(touch.gap[bad]))
        for code, (bad, text) in texts.items()
        if bad.any()
    ]
    return replace(known, findings=(*toolpath.findings, *found), normals_from=surface.normals_from)


def find_settled_contacts(
    toolpath: Toolpath,
    part: Mesh,
    tolerance: float,
    read: Callable[[dict[str, str]], Toolpath],
    given: set[str],
    *,
    crease: float,
) -> Toolpath:
    """Find a path's contacts with a part, as `find_contacts`, in the reading that touches the part.

    Parameters
    ----------
    toolpath : as it is read by default
    read : reads the path again, with settings
    given : settings of the caller, which stay
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


def _smoothed(path: Toolpath, touch: _Touch, mesh: Mesh, surface: Surface) -> Array:
    """Return the normals of the smoothed or exact surface where cutters touch it, (n, 3).

    The touched facet's normal stays at a crease, and where the tool axis is at an angle to the smoothed one
    at which another zone of the profile would touch.
    """
    foot, triangle, _ = tree_of(mesh).nearest(touch.foot)
    limits, low, high = np.array([(_largest_lean(z), z.least, z.high) for z in path.tool.cutter.zones]).T
    if surface.model is not None:
        limits[:] = math.pi
    smooth = lean_normals(touch.normal, surface.onto(foot, triangle)[1], limits[touch.zone])
    angle = angle_between(path.axis, smooth)
    kept = surface.on_crease(foot, triangle) | (angle < low[touch.zone]) | (angle > high[touch.zone])
    return np.where(kept[:, None], touch.normal, smooth)


def _largest_lean(zone: Zone) -> float:
    """Return how far the normal of a contact may be off the touched facet's, rad.

    A ball turns about its centre, whatever the normal. Another cutter, turned about its contact, would sink
    into the facet, at most as deep as a ball of its largest radius.
    """
    return math.pi if not zone.offset else lean_limit(abs(zone.offset) + zone.radius)


def _finding(toolpath: Toolpath, code: str, text: str, rows: IntArray, off: Array) -> Finding:
    worst = int(rows[np.argmax(off)])
    message = f"{len(rows)} {text}".format(off.max())
    return Finding(Severity.WARNING, code, message, toolpath.place(worst), float(off.max()))


@dataclass(frozen=True, eq=False)
class _Touch:
    """The points of cutters nearest to the part.

    Parameters
    ----------
    normal : (n, 3), unit vectors
    gap : (n,), mm, negative where the cutter is inside the part
    single : (n,), whether the cutter has a single contact at the angle of that normal
    foot : (n, 3), mm, on the part
    zone : (n,), number of the cutter's zone
    """

    normal: Array
    gap: Array
    single: BoolArray
    foot: Array
    zone: IntArray


def _touches(path: Toolpath, surface: SignedSurface) -> _Touch:
    """Try every zone of the profile and choose the nearest of those that are touched at their own angles."""
    found = [_touch(path, number, surface) for number in range(len(path.tool.cutter.zones))]
    rank = np.array([np.where(touch.single, touch.gap, touch.gap + FOREIGN) for touch in found])
    best = rank.argmin(axis=0), np.arange(len(path))
    names = ("normal", "gap", "single", "foot")
    normal, gap, single, foot = (np.array([getattr(t, name) for t in found])[best] for name in names)
    return _Touch(normal, gap, single, foot, best[0])


def _touch(path: Toolpath, number: int, surface: SignedSurface) -> _Touch:
    zone, tip = path.tool.cutter.zones[number], path.tips(path.axis)
    if zone.offset < 0.0:
        normal, foot, gap = _nearest_on_barrel(tip, path.axis, zone, surface)
    else:
        centre = tip + zone.height * path.axis
        pivot = centre if zone.offset == 0.0 else _nearest_on_ring(centre, path.axis, zone, surface)
        normal, foot, distance = surface.nearest_exactly(pivot)
        gap = distance - zone.radius
    angle = angle_between(path.axis, normal)
    single = (angle >= zone.least - ROUNDING) & (angle <= zone.high + ROUNDING)
    # Where an edge of the cutter lies on an edge of the part, their distance is too small for a normal, and
    # the contact that such a normal implies lies elsewhere.
    contact = zone.pivot_of_tip(tip, normal, path.axis) - zone.radius * normal
    slip = np.linalg.norm(contact - foot, axis=1)
    single &= slip <= np.abs(gap) + SLIP * abs(zone.offset) + AT_SURFACE
    return _Touch(normal, gap, single, foot, np.full(len(tip), number))


def _nearest_on_ring(centre: Array, axis: Array, zone: Zone, surface: SignedSurface) -> Array:
    """Find the position of an arc's centre on its circle about the tool axis that is nearest to the part."""
    rows = np.arange(len(centre))
    best, step = np.zeros(len(centre)), 2.0 * np.pi / RING
    offsets = step * np.arange(RING)
    for _ in range(ROUNDS):
        angle = best[:, None] + offsets
        points = centre[:, None] + zone.offset * _around(axis, angle)
        _, _, distance = surface.nearest(points.reshape(-1, 3))
        best = angle[rows, distance.reshape(angle.shape).argmin(axis=1)]
        offsets = step / NARROWING * np.arange(-NARROWING, NARROWING + 1)
        step /= NARROWING
    return centre + zone.offset * _around(axis, best[:, None])[:, 0]


def _nearest_on_barrel(
    tip: Array, axis: Array, zone: Zone, surface: SignedSurface
) -> tuple[Array, Array, Array]:
    """Find normals, feet and gaps of an arc whose centre lies beyond the axis, by searching height and angle.

    The point nearest to the arc's centre doesn't help, since most of its circle isn't part of the cutter.
    """
    rows = np.arange(len(tip))
    turn, step = np.zeros(len(tip)), 2.0 * np.pi / RING
    lean, rise = np.full(len(tip), (zone.low + zone.high) / 2.0), (zone.high - zone.low) / NARROWING
    turns = np.repeat(step * np.arange(RING), 2 * NARROWING + 1)
    leans = np.tile(rise / 2.0 * np.arange(-NARROWING, NARROWING + 1), RING)
    for _ in range(ROUNDS):
        angle = turn[:, None] + turns
        phi = np.clip(lean[:, None] + leans, zone.low, zone.high)
        radius = zone.offset + zone.radius * np.sin(phi)
        height = zone.height - zone.radius * np.cos(phi)
        points = tip[:, None] + height[..., None] * axis[:, None] + radius[..., None] * _around(axis, angle)
        _, foot, distance = surface.nearest(points.reshape(-1, 3))
        least = distance.reshape(angle.shape).argmin(axis=1)
        turn, lean = angle[rows, least], phi[rows, least]
        around, along = np.meshgrid(*2 * [np.arange(-NARROWING, NARROWING + 1) / NARROWING])
        turns, leans = step * around.ravel(), rise * along.ravel()
        step, rise = step / NARROWING, rise / NARROWING
    touched = _around(axis, turn[:, None])[:, 0]
    own = np.cos(lean)[:, None] * axis - np.sin(lean)[:, None] * touched
    feet = foot.reshape(len(tip), -1, 3)[rows, least]
    return own, feet, distance.reshape(len(tip), -1)[rows, least]


def _around(axis: Array, angle: Array) -> Array:
    """Return directions normal to tool axes, (n, 3), at angles about them, (n, m) rad; (n, m, 3)."""
    u = perpendicular(axis)
    v = np.cross(axis, u)
    return np.cos(angle)[..., None] * u[:, None] + np.sin(angle)[..., None] * v[:, None]
