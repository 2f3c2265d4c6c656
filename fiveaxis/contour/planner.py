"""The planner: sections, contacts, passes, links, in this order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.contour.contacts import sample_loop
from fiveaxis.contour.levels import scallop_levels, section_levels
from fiveaxis.contour.linking import (
    LINK_SPACING,
    LinkedPass,
    Linking,
    free_start,
    open_passes,
    shorten_links,
)
from fiveaxis.contour.options import Direction, Order, PlanOptions, Strategy
from fiveaxis.contour.ordering import Queue, by_levels, in_order, islands
from fiveaxis.contour.passes import Pass, split_passes
from fiveaxis.contour.relinking import Relinker
from fiveaxis.contour.spiral import Turns, join_spirals
from fiveaxis.contour.walls import Walls
from fiveaxis.contour.ways import Linker
from fiveaxis.errors import MeshError
from fiveaxis.geometry import Array, IntArray
from fiveaxis.mesh import Surface, TriangleTree, take_mesh
from fiveaxis.mesh.sections import section_loops
from fiveaxis.toolpath import MoveKind, Tool, Toolpath, divide
from fiveaxis.toolpath.passes import Passes

if TYPE_CHECKING:
    import trimesh

Progress = Callable[[int, int], None]
# Rings of spirals are sampled a little finer: the way down makes each of their steps longer.
SPIRAL_SPACING = 0.97
# An order by islands is improved so often.
RETRIES = 2


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned path, and what its planner knows beyond it.

    Parameters
    ----------
    toolpath : the path
    passes : its passes, with a way to link them anew where they begin elsewhere
    """

    toolpath: Toolpath
    passes: Passes


def plan_contour(
    part: str | Path | trimesh.Trimesh,
    tool: Tool,
    *,
    strategy: Strategy = "waterline",
    stepdown: float | None = None,
    stepover: float | None = None,
    scallop: float | None = None,
    raster_angle: float | None = None,
    spacing: float = 0.5,
    overhang: bool = False,
    spiral: bool = False,
    direction: Direction = "climb",
    order: Order = "levels",
    lead_in: float = 0.0,
    lead_out: float = 0.0,
    min_length: float = 0.0,
    feed_mm_min: float = 1000.0,
    clearance: float = 5.0,
    allow_open: bool = False,
    progress: Progress | None = None,
) -> Toolpath:
    """Plan finishing passes over a part's walls with a ball end mill.

    The contacts lie on plane sections of the mesh: horizontal ones (waterlines), or upright parallel ones
    (a raster), which also cut floors. At each contact the ball stays out of the mesh but for 0.01 mm, and so
    it does on the links, which go from pass to pass through the air; contacts where it can't are taken out
    and the pass is split there. Around a sharp convex edge the ball rolls without cutting, as a link. Only
    the ball is looked at, not shank, holder, table or fixture. The postures are chosen later, so the path has
    no tool axes.

    Parameters
    ----------
    part : mesh file, or mesh, in mm and in the workpiece frame with z up
    tool : a ball end mill or a lollipop
    strategy : ``waterline`` or ``raster``. A face within 10 degrees of its section planes is left out, and
        so is one that looks straight down
    stepdown : mm, between a waterline's sections; 1 mm unless `scallop` is given
    stepover : mm, between a raster's sections; 1 mm unless `scallop` is given
    scallop : mm, highest ridge between neighbouring passes: sections lie as near to each other as the slope
        and the curvature of the walls ask for (`fiveaxis.contour.levels`), and no farther apart than stepdown
        or stepover, if one is given too
    raster_angle : **degrees**, direction of a raster's passes, from x towards y; 0 by default
    spacing : mm, largest distance between contacts along a section
    overhang : only walls whose normals point downward
    spiral : join closed waterlines of one wall into one that descends without a link
    direction : ``climb`` or ``conventional`` for a spindle that turns clockwise, or ``zigzag``: open passes
        are followed either way, whichever link is shorter. A climbing waterline has the material right of
        the feed seen from above
    order : ``levels`` cuts every section before the next; ``islands`` goes down one wall as long as that
        makes the links shorter, never before the passes above it are done
    lead_in, lead_out : mm, radius of the arcs that lead to and from passes, tangential, in the plane of feed
        and normal; 0 for none. Where a half or a quarter of it has no room either, the ball comes along the
        normal, and that is counted
    min_length : mm, shorter passes are left out
    feed_mm_min : mm/min, cuts and links alike
    clearance : mm, between the ball and the part's top while it crosses over; also how far it leaves the
        surface along the normal, where there is room and the ball's diameter is no less
    allow_open : go on with a mesh that isn't watertight
    progress : called with sections done and their number

    Returns
    -------
    Toolpath; `ignored` counts what was left out and why. `path_quality` measures its ridges and chords

    Raises
    ------
    MeshError
        A mesh that can't be read or planned on; no walls, or none that the ball can reach.
    SettingError
        An option outside its range, or that doesn't go with another.
    ToolError
        A cutter that isn't a ball.
    """
    options = PlanOptions(
        strategy, stepdown, stepover, scallop, raster_angle, spacing, overhang, spiral, direction, order,
        lead_in, lead_out, min_length, feed_mm_min, clearance,
    )  # fmt: skip
    return plan_passes(part, tool, options, allow_open=allow_open, progress=progress).toolpath


def plan_passes(
    part: str | Path | trimesh.Trimesh,
    tool: Tool,
    options: PlanOptions,
    *,
    allow_open: bool = False,
    progress: Progress | None = None,
) -> Plan:
    """Plan as `plan_contour` does, and hand out how to link the passes where they begin elsewhere.

    Its `Plan.passes` is what ``optimise(..., free_start=...)`` wants for passes that are reached by links.
    """
    options.check_tool(tool)
    name = str(part) if isinstance(part, str | Path) else "mesh"
    surface = Surface.from_mesh(take_mesh(part, name=name, allow_open=allow_open))
    options.check_size(float(np.ptp(surface.bounds, axis=0).max()), tool.radius)
    space = BallSpace(TriangleTree.build(surface.triangles), tool.radius)
    levels, left_out = _cut_levels(surface, space, options, progress)
    linker = Linker(space, surface.bounds, options.clearance)
    if options.spiral:
        turns = Turns(surface, space, options.spacing)
        levels, apart = join_spirals(levels, turns, options.frame[2], lambda ring: free_start(ring, linker))
        left_out += apart
    opened = _opened(levels, linker, options)
    linked = opened.joined()
    left_out += opened.left_out
    if not linked:
        raise MeshError(_nothing_left(surface, left_out, tool, overhang=options.overhang), file=name)
    path, first, last = _toolpath(linked, tool, options, name, left_out)
    relink = Relinker.like(opened, options.lead_in, options.lead_out)
    return Plan(path, Passes(first, last, len(path), relink))


def _cut_levels(
    surface: Surface, space: BallSpace, options: PlanOptions, progress: Progress | None
) -> tuple[list[list[Pass]], Counter[str]]:
    """Find the passes of every section, from the far end of the sections' normal on."""
    turned = surface if options.strategy == "waterline" else surface.turned(options.frame)
    walls = Walls(options.frame[2], options.overhang)
    heights = _heights(surface, turned, walls, space.radius, options)
    levels = []
    left_out: Counter[str] = Counter()
    for done, height in enumerate(heights, start=1):
        passes, lost = _cut_level(surface, turned, space, walls, options, height)
        levels.append(passes)
        left_out += lost
        if progress is not None:
            progress(done, len(heights))
    return levels, left_out


def _heights(surface: Surface, turned: Surface, walls: Walls, radius: float, options: PlanOptions) -> Array:
    """Heights of the sections in their own frame, mm."""
    if options.scallop is None:
        return section_levels(turned, float(options.step or 0.0))
    kept = walls.keep(surface.facet_normals) & (np.linalg.norm(surface.facet_normals, axis=1) > 0.5)
    return scallop_levels(turned, kept, radius=radius, scallop=options.scallop, step=options.step)


def _cut_level(
    surface: Surface,
    turned: Surface,
    space: BallSpace,
    walls: Walls,
    options: PlanOptions,
    height: float,
) -> tuple[list[Pass], Counter[str]]:
    passes: list[Pass] = []
    left_out: Counter[str] = Counter()
    spacing = options.spacing * (SPIRAL_SPACING if options.spiral else 1.0)
    for loop in section_loops(turned, height):
        curve = loop if turned is surface else loop.turned(options.frame.T)
        contacts = sample_loop(curve, surface, radius=space.radius, spacing=spacing)
        if contacts is None:
            continue
        if options.backward:
            contacts = contacts.take(np.arange(len(contacts))[::-1], closed=contacts.closed)
        found, lost = split_passes(
            contacts, space, walls, spacing=options.spacing, min_length=options.min_length
        )
        passes += found
        left_out += lost
    return passes, left_out


def _opened(levels: list[list[Pass]], linker: Linker, options: PlanOptions) -> Linking:
    """Open the passes in the order that was asked for."""
    leads = {"lead_in": options.lead_in, "lead_out": options.lead_out}
    either_way = options.direction == "zigzag"
    best = open_passes(by_levels(levels, either_way=either_way), linker, **leads)
    if options.order == "levels" or not best.passes:
        return best
    passes, below = islands(levels, options.frame[2])
    nearest = open_passes(Queue(passes, below, either_way), linker, **leads)
    best = min(best, nearest, key=lambda found: found.length)
    # Closed passes open elsewhere in another order, which leaves room for a second try.
    for _ in range(RETRIES):
        order = shorten_links(best, below)
        again = open_passes(in_order(passes, order, either_way=either_way), linker, **leads)
        best = min(best, again, key=lambda found: found.length)
    return best


def _nothing_left(surface: Surface, left_out: Counter[str], tool: Tool, *, overhang: bool) -> str:
    """Say why there is no pass: no such wall, or none that the ball can follow."""
    wall = "overhanging wall" if overhang else "wall"
    if left_out:
        reasons = ", ".join(f"{count} {what}" for what, count in sorted(left_out.items()))
        return f"no {wall} can be cut with {tool} ({reasons}); take a smaller ball or a finer stepdown"
    size = " × ".join(f"{extent:.4g}" for extent in np.ptp(surface.bounds, axis=0))
    return f"has no {wall} on its sections (the part measures {size} mm)"


def _toolpath(
    linked: list[LinkedPass], tool: Tool, options: PlanOptions, name: str, left_out: Counter[str]
) -> tuple[Toolpath, IntArray, IntArray]:
    """Make one path of passes and links; with the rows at which each pass begins and ends."""
    pivot, contact, normal, kind = (
        np.concatenate(column) for column in zip(*map(_rows, linked), strict=True)
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
        ignored=dict(sorted(left_out.items())),
    )
    in_air = path.kind[1:] == MoveKind.LINK
    parts = np.where(in_air, np.ceil(path.lengths[1:] / LINK_SPACING), 1.0).astype(np.int64)
    parts = np.maximum(parts, 1)
    path = divide(path, parts)
    ends = np.cumsum([len(p.approach) + len(p.cut) + len(p.retreat) for p in linked])
    last = ends - 1 - [len(p.retreat) for p in linked]
    row = np.concatenate([[0], np.cumsum(parts)])
    first, last = row[last + 1 - [len(p.cut) for p in linked]], row[last]
    return replace(path, source=np.arange(1, len(path) + 1)), first, last


def _rows(linked: LinkedPass) -> tuple[Array, Array, Array, IntArray]:
    """Pivot, contact, normal and kind of a pass with its links."""
    contacts = linked.cut.contacts
    air = [np.full((len(way), 3), np.nan) for way in (linked.approach, linked.retreat)]
    touching = ~contacts.rolling
    on_part = [np.where(touching[:, None], rows, np.nan) for rows in (contacts.points, contacts.normals)]
    kind = np.full(len(linked.approach) + len(contacts) + len(linked.retreat), MoveKind.LINK, dtype=np.int64)
    kind[len(linked.approach) :][: len(contacts)][touching] = MoveKind.CUT
    pivot = np.vstack([linked.approach, linked.cut.centres, linked.retreat])
    return pivot, np.vstack([air[0], on_part[0], air[1]]), np.vstack([air[0], on_part[1], air[1]]), kind
