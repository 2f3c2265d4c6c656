"""The waterline planner: sections, contacts, passes, links, in this order."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from fiveaxis.contour.contacts import sample_loop
from fiveaxis.contour.distance import BallSpace, TriangleTree
from fiveaxis.contour.linking import LinkedPass, Linker, link_passes
from fiveaxis.contour.mesh import check_mesh, load_mesh
from fiveaxis.contour.passes import Pass, split_passes
from fiveaxis.contour.sections import section_levels, section_loops
from fiveaxis.contour.surface import Surface
from fiveaxis.errors import MeshError, SettingError
from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath import MoveKind, Tool, Toolpath, divide

if TYPE_CHECKING:
    import trimesh

Direction = Literal["climb", "conventional"]
Progress = Callable[[int, int], None]
UNITS = {"stepdown": "mm", "spacing": "mm", "feed_mm_min": "mm/min", "clearance": "mm"}
# mm: largest distance of locations on a link. The tool leans while it crosses over, and what the axes must do
# for that is seen at the locations only.
LINK_SPACING = 2.0
# Finest stepdown and spacing as a share of the part's extent.
FINEST_SHARE = 1e-5


def plan_contour(
    part: str | Path | trimesh.Trimesh,
    tool: Tool,
    *,
    stepdown: float = 1.0,
    spacing: float = 0.5,
    overhang: bool = False,
    feed_mm_min: float = 1000.0,
    direction: Direction = "climb",
    clearance: float = 5.0,
    allow_open: bool = False,
    progress: Progress | None = None,
) -> Toolpath:
    """Plan waterline passes over a part's walls with a ball end mill.

    The contacts lie on horizontal sections of the mesh. At each the ball stays out of the mesh but for
    0.01 mm, and so it does on the links, which go from pass to pass through the air; contacts where it can't
    are taken out and the pass is split there. Around a sharp convex edge the ball rolls without cutting,
    as a link. Only the ball is looked at: shank, holder, table and fixture are for `collision`. The postures
    are chosen later, so the path has no tool axes.

    Parameters
    ----------
    part : mesh file, or mesh, in mm and in the workpiece frame with z up
    tool : the ball end mill
    stepdown : mm, between sections
    spacing : mm, largest distance between contacts along a section
    overhang : only walls whose normals point downward
    feed_mm_min : mm/min, cuts and links alike
    direction : ``climb`` keeps the material right of the feed seen from above, ``conventional`` left
    clearance : mm, between the ball and the part's top while it crosses over; also how far it leaves the
        surface along the normal, where there is room and the ball's diameter is no less
    allow_open : go on with a mesh that isn't watertight
    progress : called with sections done and their number

    Returns
    -------
    Toolpath; `ignored` counts what was left out and why

    Raises
    ------
    MeshError
        A mesh that can't be read or planned on; no walls, or none that the ball can reach.
    SettingError
        An option outside its range.
    """
    settings = _Settings(stepdown, spacing, overhang, feed_mm_min, direction, clearance)
    name, mesh = _mesh(part, allow_open)
    surface = Surface.from_mesh(mesh)
    settings.check_size(float(np.ptp(surface.bounds, axis=0).max()))
    space = BallSpace(TriangleTree.build(surface.triangles), tool.radius)
    levels, left_out = _cut_levels(surface, space, settings, progress)
    linked, unlinked = link_passes(levels, Linker(space, surface.bounds, clearance))
    left_out += unlinked
    if not linked:
        raise MeshError(_nothing_left(surface, left_out, tool, overhang=overhang), file=name)
    return _toolpath(linked, tool, settings, name, left_out)


@dataclass(frozen=True)
class _Settings:
    """The options of `plan_contour` that are numbers and words, in the units of its arguments."""

    stepdown: float
    spacing: float
    overhang: bool
    feed_mm_min: float
    direction: Direction
    clearance: float

    def __post_init__(self) -> None:
        for name, unit in UNITS.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingError(f"{name} = {value:g} {unit} is out of range; give more than 0 {unit}")
        if self.direction not in get_args(Direction):
            known = " or ".join(repr(d) for d in get_args(Direction))
            raise SettingError(f"direction = {self.direction!r} is unknown; give {known}")

    def check_size(self, extent: float) -> None:
        """Refuse steps that are tiny beside the part's extent, mm, before they fill the memory."""
        for name in ("stepdown", "spacing"):
            value = getattr(self, name)
            if value < extent * FINEST_SHARE:
                raise SettingError(
                    f"{name} = {value:g} mm is below {extent * FINEST_SHARE:g} mm, the finest for a part of "
                    f"{extent:g} mm; give more, or check the part's unit"
                )


def _mesh(part: str | Path | trimesh.Trimesh, allow_open: bool) -> tuple[str, trimesh.Trimesh]:
    if isinstance(part, str | Path):
        return str(part), load_mesh(part, allow_open=allow_open)
    return "mesh", check_mesh(part, name="mesh", allow_open=allow_open)


def _cut_levels(
    surface: Surface, space: BallSpace, settings: _Settings, progress: Progress | None
) -> tuple[list[list[Pass]], Counter[str]]:
    """Find the passes of every section, from the top down."""
    heights = section_levels(surface, settings.stepdown)
    levels = []
    left_out: Counter[str] = Counter()
    for done, height in enumerate(heights, start=1):
        passes, lost = _cut_level(surface, space, settings, height)
        levels.append(passes)
        left_out += lost
        if progress is not None:
            progress(done, len(heights))
    return levels, left_out


def _cut_level(
    surface: Surface, space: BallSpace, settings: _Settings, height: float
) -> tuple[list[Pass], Counter[str]]:
    passes: list[Pass] = []
    left_out: Counter[str] = Counter()
    for loop in section_loops(surface, height):
        contacts = sample_loop(loop, surface, radius=space.radius, spacing=settings.spacing)
        if contacts is None:
            continue
        if settings.direction == "conventional":
            contacts = contacts.take(np.arange(len(contacts))[::-1], closed=contacts.closed)
        found, lost = split_passes(contacts, space, spacing=settings.spacing, overhang=settings.overhang)
        passes += found
        left_out += lost
    return passes, left_out


def _nothing_left(surface: Surface, left_out: Counter[str], tool: Tool, *, overhang: bool) -> str:
    """Say why there is no pass: no such wall, or none that the ball can follow."""
    wall = "overhanging wall" if overhang else "wall"
    if left_out:
        reasons = ", ".join(f"{count} {what}" for what, count in sorted(left_out.items()))
        return f"no {wall} can be cut with {tool} ({reasons}); take a smaller ball or a finer stepdown"
    size = " × ".join(f"{extent:.4g}" for extent in np.ptp(surface.bounds, axis=0))
    return f"has no {wall} on its sections (the part measures {size} mm)"


def _toolpath(
    linked: list[LinkedPass], tool: Tool, settings: _Settings, name: str, left_out: Counter[str]
) -> Toolpath:
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
        feed=np.full(n, settings.feed_mm_min / 60.0),
        kind=kind,
        source=np.arange(1, n + 1),
        name=name,
        ignored=dict(sorted(left_out.items())),
    )
    in_air = path.kind[1:] == MoveKind.LINK
    parts = np.where(in_air, np.ceil(path.lengths[1:] / LINK_SPACING), 1.0).astype(np.int64)
    path = divide(path, np.maximum(parts, 1))
    return replace(path, source=np.arange(1, len(path) + 1))


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
