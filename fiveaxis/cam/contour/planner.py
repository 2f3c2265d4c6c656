"""The planner: sections or lines, contacts, passes, links, in this order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from fiveaxis.base import Array, Infeasible, IntArray, MeshError, MeshSource, keywords_of
from fiveaxis.cam.contour.ball_space import BallSpace, Linker
from fiveaxis.cam.contour.contacts import Contacts, Sampling, sample_loop
from fiveaxis.cam.contour.flow import flow_lines
from fiveaxis.cam.contour.leaning import Leaning
from fiveaxis.cam.contour.linking import (
    EMPTY,
    LINK_SPACING,
    LinkedPass,
    Linking,
    free_start,
    open_passes,
    shorten_links,
)
from fiveaxis.cam.contour.options import PlanOptions
from fiveaxis.cam.contour.ordering import Queue, by_levels, in_order, islands
from fiveaxis.cam.contour.passes import FARTHEST, LeftOut, Pass, split_passes
from fiveaxis.cam.contour.sections import level_curvature, scallop_levels, section_levels, section_loops
from fiveaxis.cam.contour.spiral import Turns, join_spirals
from fiveaxis.cam.mesh.cad.choice import of_faces, uncut_findings
from fiveaxis.cam.mesh.distance import tree_of
from fiveaxis.cam.mesh.loading import (
    body_findings,
    other_sizes,
    size_findings,
    size_text,
)
from fiveaxis.cam.mesh.surface import Surface
from fiveaxis.model import MoveKind, Tool, Toolpath, divide

# Rings of spirals are sampled a little finer, because their descent lengthens every step.
SPIRAL_SPACING = 0.97
# Rounds of improving an order by islands.
ROUNDS = 2


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned path with its passes.

    Parameters
    ----------
    toolpath : passes and links
    first, last : (m,), rows of the path at which each pass begins and ends, in order; all others are links
    """

    toolpath: Toolpath
    first: IntArray
    last: IntArray


@keywords_of(PlanOptions)
def plan_contour(
    part: MeshSource,
    tool: Tool,
    options: PlanOptions,
) -> Toolpath:
    """Plan finishing passes over a part's walls.

    The contacts lie on plane sections of the mesh: horizontal ones (waterlines), or vertical parallel ones
    (a raster), which also cut floors. Faces within 10 degrees of the section planes are left out, and so are
    faces that point straight down. In cuts and links the ball sinks into the mesh by at most 0.01 mm.
    Contacts where it would sink deeper are removed, and the pass is split there. Around a sharp convex edge
    the ball rolls without cutting, as a link. Only the ball is checked: not shank, holder, table or fixture.
    The postures are chosen later, so the path has no tool axes.

    Of a CAD file, the strategy flow follows the faces' own parameters instead (`fiveaxis.cam.contour.flow`),
    on all faces that don't point straight down, or on those that `faces` names, wherever they lie. Stepover
    is then measured on the surface, and the passes climb with the strip that the next one cuts to their
    right.

    Of other cutters the ball is the largest one that touches where the cutter does and is inside it at any
    lean: a bull nose's corner; the sharp edge of a flat end mill is checked for nothing. Around an edge such
    a cutter cuts, and in links the ball is the one about a point of the tool axis that holds its profile.
    Whether the whole cutter, leaned, is clear is decided with the postures.

    A scallop sets the distance of the sections by the slope and curvature of the walls
    (`fiveaxis.cam.contour.sections`), up to stepdown or stepover if given. For cutters that aren't balls it
    is that of the narrowest strip that they cut within tilt, lead and lean. A climbing waterline has the
    material to the right of the feed, seen from above. Islands go down one wall as long as that shortens
    the links, and never before the passes above are done. Arcs before and after passes are tangential, in the
    plane of feed and normal; where not even a quarter of one has room, the ball moves along the normal, and
    such leads are counted. Normals are smoothed across facets that are one surface
    (`fiveaxis.cam.mesh.surface`), and the ball rolls about sharper edges.

    Parameters
    ----------
    part : mesh file or mesh, workpiece frame with z up
    tool : any cutter with an arc or edge that mills
    unit : of a file: ``mm``, ``inch`` or ``m``; by default what it states, or mm; a mesh is in mm
    progress : called with the sections or lines done and their number

    Returns
    -------
    Toolpath; `ignored` counts what was left out and why, and the finding ``contacts-left-out`` says how many
    contacts no pass reaches: an error if they are more than half; ``part-size``, that the part is so small or
    large that its unit is doubtful. `path_quality` measures its ridges and
    chords

    Raises
    ------
    MeshError
        The mesh can't be read or planned on; it has no walls.
    Infeasible
        The ball can follow none of its walls.
    SettingError
        An option out of range, or options that exclude each other.
    ToolError
        The cutter is a drill, or several parts of its profile touch within the bounds.
    """
    return plan_passes(part, tool, options).toolpath


def plan_passes(part: MeshSource, tool: Tool, options: PlanOptions) -> Plan:
    """Plan as `plan_contour` does, and return the rows of the passes too."""
    leaning = options.leaning(tool)
    name = str(part) if isinstance(part, str | Path) else "mesh"
    mesh = options.mesh(part, name)
    model = mesh.model
    surface = Surface.from_mesh(mesh, crease=np.radians(options.crease))
    chosen = surface if options.faces is None else surface.part(of_faces(model, options.faces, name))
    size, unit = mesh.extents, options.unit or "mm"
    sized = size_findings(size, unit=unit, diameter=tool.diameter, name=name)
    extent = float(size.max())
    options.check_size(extent, mesh.area, options.strip_radius(leaning))
    if tool.diameter > extent:
        raise MeshError(
            f"the part measures {size_text(size)}, read in {unit}, and the cutter "
            f"{tool.diameter:g} mm: take a smaller one (--tool), or say in which unit the file is (--unit): "
            f"{other_sizes(size, unit)}",
            file=name,
        )
    space = BallSpace(tree_of(surface), leaning.ball, model)
    sampling = Sampling(leaning.ball, options.spacing, leaning.roundest)
    levels, farthest, left_out = _cut_levels(chosen, space, options, leaning, sampling, name)
    outer = leaning.outer
    linker = Linker(replace(space, radius=outer), surface.bounds, options.clearance, outer - space.radius)
    if options.spiral:
        turns = Turns(chosen, space, sampling)
        levels, apart = join_spirals(levels, turns, farthest, lambda ring: free_start(ring, linker))
        left_out += apart
    opened = _opened(levels, farthest, linker, options)
    linked = opened.joined()
    left_out += opened.left_out
    if not linked:
        _refuse(chosen, space, left_out, tool, name, options)
    path, first, last = _toolpath(linked, tool, leaning, options, name, left_out)
    found = left_out.findings(space, sum(len(p.cut.touching()) for p in linked), name)
    if model is not None and options.faces is not None:
        found += uncut_findings(model, options.faces, path.contact[path.cutting], name)
    path = replace(
        path, findings=(*sized, *body_findings(mesh, name), *found), normals_from=surface.normals_from
    )
    return Plan(path, first, last)


def _cut_levels(
    surface: Surface,
    space: BallSpace,
    options: PlanOptions,
    leaning: Leaning,
    sampling: Sampling,
    name: str,
) -> tuple[list[list[Pass]], list[float], LeftOut]:
    """Find the passes of every section or line, in cutting order, and how far apart neighbours may be, mm."""
    curves: Iterable[list[Contacts]]
    if options.spiral:
        sampling = replace(sampling, spacing=SPIRAL_SPACING * options.spacing)
    if options.strategy == "flow":
        curves, farthest = flow_lines(surface, options, leaning, sampling, name)
    else:
        turned = surface if options.strategy == "waterline" else surface.turned(options.frame)
        heights = _heights(surface, turned, leaning, options)
        curves = (_section(surface, turned, options, sampling, height) for height in heights)
        farthest = (FARTHEST * -np.diff(heights)).tolist()
    levels = []
    left_out = LeftOut()
    for done, level in enumerate(curves, start=1):
        passes: list[Pass] = []
        for contacts in level:
            along = contacts.reversed() if options.backward else contacts
            found, lost = split_passes(along, space, options)
            passes += found
            left_out += lost
        levels.append(passes)
        if options.progress is not None:
            options.progress(done, len(farthest) + 1)
    return levels, farthest, left_out


def _heights(surface: Surface, turned: Surface, leaning: Leaning, options: PlanOptions) -> Array:
    """Return the heights of the sections in their own frame, mm."""
    if options.scallop is None:
        return section_levels(turned, float(options.step or 0.0))
    kept = options.is_wall(surface.facet_normals) & (np.linalg.norm(surface.facet_normals, axis=1) > 0.5)
    radius: float | Array = leaning.ball
    if not leaning.turns_in_place:
        strips = leaning.strip_radius(options.scallop, level_curvature(turned))
        radius = np.maximum(strips, options.scallop)
    return scallop_levels(turned, kept, radius=radius, scallop=options.scallop, step=options.step)


def _section(
    surface: Surface, turned: Surface, options: PlanOptions, sampling: Sampling, height: float
) -> list[Contacts]:
    """Place contacts along the curves of a section, which lie in descending order along their normal."""
    loops = section_loops(turned, height)
    curves = loops if turned is surface else [loop.turned(options.frame.T) for loop in loops]
    found = (sample_loop(curve, surface, sampling) for curve in curves)
    return [contacts for contacts in found if contacts is not None]


def _opened(levels: list[list[Pass]], farthest: list[float], linker: Linker, options: PlanOptions) -> Linking:
    """Open the passes in the order of the options."""
    leads = {"lead_in": options.lead_in, "lead_out": options.lead_out}
    reversible = options.direction == "zigzag"
    best = open_passes(by_levels(levels, reversible=reversible), linker, **leads)
    if options.order == "levels" or not best.passes:
        return best
    passes, below = islands(levels, farthest)
    nearest = open_passes(Queue(passes, below, reversible), linker, **leads)
    best = min(best, nearest, key=lambda found: found.length)
    # In another order closed passes open elsewhere, so a second round may gain more.
    for _ in range(ROUNDS):
        order = shorten_links(best, below)
        again = open_passes(in_order(passes, order, reversible=reversible), linker, **leads)
        best = min(best, again, key=lambda found: found.length)
    return best


def _refuse(
    surface: Surface, space: BallSpace, left_out: LeftOut, tool: Tool, name: str, options: PlanOptions
) -> NoReturn:
    """Raise the reason why there is no pass: no wall of the kind, or none that the ball can follow."""
    wall = "overhanging wall" if options.overhang else "wall"
    if left_out.counts:
        reasons = ", ".join(f"{count} {what}" for what, count in sorted(left_out.counts.items()))
        raise Infeasible(
            f"{name}: no {wall} can be cut with {tool} ({reasons}); take a smaller ball or corner "
            "radius, or a finer stepdown",
            left_out.findings(space, 0, name),
        )
    where = "faces" if options.strategy == "flow" else "sections"
    raise MeshError(
        f"has no {wall} on its {where} (the part measures {size_text(surface.extents)})",
        file=name,
    )


def _toolpath(
    linked: list[LinkedPass], tool: Tool, leaning: Leaning, options: PlanOptions, name: str, left_out: LeftOut
) -> tuple[Toolpath, IntArray, IntArray]:
    """Build one path of passes and links; return the first and last row of each pass with it."""
    lifted = _lifted(linked, leaning)
    pivot, contact, normal, kind = (
        np.concatenate(column) for column in zip(*(_rows(p, n, leaning) for p, n in lifted), strict=True)
    )
    n = len(pivot)
    path = Toolpath(
        tool=tool,
        pivot=pivot,
        contact=contact,
        normal=normal,
        axis=np.full((n, 3), np.nan),
        feed=np.full(n, options.feed_mm_min / 60.0),
        kind=kind,
        source=np.arange(1, n + 1),
        name=name,
        touching=leaning.zone,
        ignored=dict(sorted(left_out.counts.items())),
    )
    in_air = path.kind[1:] == MoveKind.LINK
    if not leaning.turns_in_place:
        # Between an arc's centre and a point of the axis nothing lies halfway.
        unknown = np.isnan(path.normal[:, 0])
        in_air &= unknown[1:] & unknown[:-1]
    parts = np.where(in_air, np.ceil(path.lengths[1:] / LINK_SPACING), 1.0).astype(np.int64)
    parts = np.maximum(parts, 1)
    path = divide(path, parts)
    ends = np.cumsum([len(p.approach) + len(p.cut) + len(p.retract) for p, _ in lifted])
    last = ends - 1 - [len(p.retract) for p, _ in lifted]
    row = np.concatenate([[0], np.cumsum(parts)])
    first, last = row[last + 1 - [len(p.cut) for p in linked]], row[last]
    return replace(path, source=np.arange(1, len(path) + 1), shape="smooth", given=None), first, last


def _lifted(linked: Sequence[LinkedPass], leaning: Leaning) -> list[tuple[LinkedPass, Array]]:
    """Add to links the points at which a cutter that isn't a ball leaves its contacts, and reaches them.

    From the contact there the cutter moves as a whole, still at the contact's normal: without one its axis
    goes through the pivot. Of the links' points, which are pivots, the normals, (n, 3), are returned too.
    """
    found, left = [], EMPTY
    gap = leaning.outer - leaning.zone.radius
    for each in linked:
        first, last = each.cut.smooth[:1], each.cut.smooth[-1:]
        air = np.full_like(each.approach, np.nan), np.full_like(each.retract, np.nan)
        if leaning.turns_in_place:
            found.append((each, np.vstack(air)))
            continue
        away = each.approach[: len(left)] - gap * left
        approach = np.vstack([away, each.approach, each.approach[-1:] - gap * first])
        back = each.retract[:1] - gap * last[: len(each.retract)]
        normals = [left, air[0], first, last[: len(back)], air[1]]
        found.append((LinkedPass(approach, each.cut, np.vstack([back, each.retract])), np.vstack(normals)))
        left = last
    return found


def _rows(linked: LinkedPass, link_normals: Array, leaning: Leaning) -> tuple[Array, Array, Array, IntArray]:
    """Return pivot, contact, normal and kind of a pass with its links."""
    contacts, radius = linked.cut, leaning.ball
    inset = leaning.zone.radius - radius
    pivots = contacts.centres + inset * contacts.smooth if inset else contacts.centres
    pivot = np.vstack([linked.approach, pivots, linked.retract])
    inner = slice(len(linked.approach), len(linked.approach) + len(contacts))
    cutting = np.zeros(len(pivot), dtype=bool)
    # A ball's axis may go through its pivot, as without a normal; others stay in contact about an edge.
    touches = ~contacts.rolling if leaning.turns_in_place else np.ones(len(contacts), dtype=bool)
    cutting[inner] = touches
    contact, normal = np.full_like(pivot, np.nan), np.full_like(pivot, np.nan)
    normal[: inner.start] = link_normals[: inner.start]
    normal[inner.stop :] = link_normals[inner.start :]
    touched = contacts.take(np.flatnonzero(touches), closed=False)
    normal[cutting] = touched.smooth
    # Where facets are coarse the ball stands on one of them, and not along the smoothed normal: the contact
    # is the ball's point that the smoothed surface touches.
    contact[cutting] = touched.points + radius * (touched.normals - touched.smooth)
    return pivot, contact, normal, np.where(cutting, MoveKind.CUT, MoveKind.LINK).astype(np.int64)
