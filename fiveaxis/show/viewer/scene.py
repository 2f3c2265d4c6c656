"""The scene, mm: the workpiece with its path, the machine's links and the tool, and what of them is in view.

The page's script moves the links by the chain (`chain.js`), so a scene has no frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.base import Array, Finding, IntArray, Severity, inverse_transform
from fiveaxis.cam import Mesh, Model
from fiveaxis.check import Standing, Surroundings, box_corners, shape_triangles, with_nose, with_stated_table
from fiveaxis.model import (
    BED,
    CUTTER,
    HOLDER,
    SHANK,
    Body,
    Machine,
    Shape,
    Tool,
    Toolpath,
    link_poses,
    tool_poses,
)
from fiveaxis.show.viewer.moves import Side, shown_points
from fiveaxis.show.viewer.numbers import number_marks
from fiveaxis.show.viewer.recorder import BY_VERTEX, Recorder, segments, triangles
from fiveaxis.show.viewer.schematic import schematic_bodies
from fiveaxis.show.viewer.shown import UNKNOWN, Shown

ROOT = "fiveaxis"
STAGE = f"{ROOT}/stage"
# Radius of a finding's mark, as a share of the path's size.
MARK = 0.018
# Sectors of a turn of the tool's parts; colours of the ends of the axes of a zero.
SECTORS = 36
TRIAD_COLOURS = ((1, 0, 0), (1, 0.6, 0), (0, 1, 0), (0.6, 1, 0), (0, 0, 1), (0, 0.6, 1))
BACKGROUND = ((0.16, 0.18, 0.22), (0.09, 0.10, 0.12))
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
# Rows at which the space that the tool and the part need is looked at.
LOOKED_AT = 200
# Without a holder, this many diameters of the tool are in view; a schematic spindle begins there.
TOOL_IN_VIEW = 4.0
PART_COLOUR, STOCK_COLOUR, FIXTURE_COLOUR = 0xB8BEC8, 0x8FB89A, 0xA77BCA
BED_COLOUR, TABLE_COLOUR, HEAD_COLOUR = 0x7C828D, 0x5B8FC7, 0xC9A24B
ASSUMED_COLOUR = 0xD06A4C
CUTTER_COLOUR = 0xE8C468
SHANK_COLOUR, HOLDER_COLOUR = 0xAEB6C2, 0x6F7C91
MARK_COLOURS = {Severity.ERROR: 0xFF4D5E, Severity.WARNING: 0xFFB224, Severity.NOTE: 0x6CB8FF}
# Part, path and tool stay visible behind the machine, and behind what is assumed of it.
MACHINE_OPACITY, ASSUMED_OPACITY = 0.3, 0.15
# Most triangles of part and stock, and of each fixture and machine body, which serve orientation only.
MOST_PART_TRIANGLES, MOST_TRIANGLES = 150_000, 20_000
# Corners and faces of an octahedron of radius 1, anticlockwise seen from outside.
CORNERS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], dtype=np.int64
)

# Diameters: length of the shank drawn if the tool has no holder.
SHANK_LENGTH = 4.0


@dataclass(frozen=True, eq=False)
class Extent:
    """A box that is in view, mm."""

    low: Array
    high: Array

    @classmethod
    def of(cls, points: Array) -> Extent:
        """Return the box around points, (p, 3)."""
        return cls(points.min(axis=0), points.max(axis=0))

    @property
    def middle(self) -> Array:
        """(3,), mm."""
        return (self.low + self.high) / 2.0

    @property
    def size(self) -> float:
        """The longest side, mm."""
        return max(float((self.high - self.low).max()), 1e-3)


@dataclass(frozen=True, eq=False)
class Scene:
    """Contents and arrangement of a scene.

    Parameters
    ----------
    extents : what is in view: ``part`` in the workpiece frame, ``work`` and ``machine`` in the machine frame
    has_numbers, has_marks : whether they are in the scene
    assumed : names of the bodies that nobody described and that are checked all the same
    """

    extents: dict[str, Extent]
    has_numbers: bool
    has_marks: bool
    assumed: tuple[str, ...]


def build_scene(recorder: Recorder, shown: Shown) -> Scene:
    """Build the scene of what is shown, every axis at 0; `MeshError` for a mesh that can't be read."""
    machine, path, mesh, around = shown.machine, shown.toolpath, shown.part, shown.surroundings
    # The way from a tool change isn't what there is to see.
    cuts = path.pivot[path.cutting] if path.cutting.any() else path.pivot
    part_box = Extent.of(cuts if mesh is None else np.vstack([cuts, mesh.vertices]))
    workpiece = f"{STAGE}/workpiece"
    model = None if mesh is None else mesh.model
    if mesh is not None:
        add_part(recorder, workpiece, mesh)
    if model is not None:
        add_numbers(recorder, workpiece, model)
    add_surroundings(recorder, workpiece, around)
    own = max(float(np.ptp(cuts, axis=0).max()), path.tool.diameter)
    marked = add_marks(recorder, workpiece, shown.marked, shown_points(path), MARK * own)
    tool_height = max(float(outlined.outline[-1, 1]) for outlined in path.tool.parts())
    if path.tool.holder is None:
        tool_height = max(TOOL_IN_VIEW * path.tool.diameter, min(tool_height, 2.0 * own))
    bodies = machine.bodies or schematic_bodies(
        machine, radius=max(0.75 * part_box.size, 40.0), nose_height=tool_height
    )
    assumed = _assumed(machine, path, around, shown.standing)
    add_bodies(recorder, f"{STAGE}/links", machine, (*bodies, *assumed))
    several = shown.sides[0].tool is not None
    for number, tool in enumerate(shown.tools):
        node = f"{STAGE}/tool/{number}" if several else f"{STAGE}/tool"
        add_tool(recorder, node, tool or UNKNOWN, machine.tool_length)
    boxes = [box_corners(part_box.low, part_box.high), *(_corners(f.shape) for f in around.fixtures)]
    extents = _extents(machine, shown.sides[0], np.vstack(boxes), tool_height, bodies)
    _set_stage(recorder, max(own, part_box.size))
    return Scene(extents, model is not None, marked, tuple(body.assumed for body in assumed))


def _assumed(
    machine: Machine, path: Toolpath, around: Surroundings, standing: Standing | None
) -> tuple[Body, ...]:
    """Return spindle nose and table as they are assumed where the machine has no bodies."""
    whole = with_nose(machine, path.tool)
    whole = with_stated_table(whole, around, path) if standing is None else whole
    bodies = whole.bodies if standing is None else (*whole.bodies, standing.body)
    return tuple(body for body in bodies if body.assumed)


def _extents(
    machine: Machine, side: Side, points: Array, tool_height: float, bodies: Sequence[Body]
) -> dict[str, Extent]:
    """Return what is in view in either frame; points, (p, 3) mm, are those of part and fixtures."""
    shown = side.on_path & side.motion.cutting
    positions = side.motion.positions[shown if shown.any() else side.on_path]
    rows = np.unique(np.linspace(0, len(positions) - 1, LOOKED_AT).astype(np.int64))
    tip, axis = tool_poses(machine, positions[rows])
    tool = np.stack([tip, tip + tool_height * axis], axis=1)
    beds = link_poses(machine, positions[rows])[BED]
    moved = []
    for ends, bed in zip(tool, beds, strict=True):
        to_machine = machine.setup.frame @ inverse_transform(bed)
        moved.append(np.vstack([points, ends]) @ to_machine[:3, :3].T + to_machine[:3, 3])
    drawn = [_corners(body.shape) for body in bodies]
    work = np.vstack(moved)
    return {
        "part": Extent.of(np.vstack([points, tool.reshape(-1, 3)])),
        "work": Extent.of(work),
        "machine": Extent.of(np.vstack([work, *drawn])),
    }


def _set_stage(recorder: Recorder, size: float) -> None:
    for name in ("/Grid", "/Axes"):
        recorder.set(name, "visible", False)
    for key, colour in zip(("top_color", "bottom_color"), BACKGROUND, strict=True):
        recorder.set("/Background", key, colour)
    recorder.set("/Cameras/default/rotated/<object>", "position", CAMERA)
    ends = np.zeros((6, 3))
    ends[[1, 3, 5], [0, 1, 2]] = size / 6.0
    triad, look = segments(ends, np.array(TRIAD_COLOURS)), {"vertexColors": BY_VERTEX}
    place = f"{STAGE}/workpiece/zero"
    recorder.add(place, "zero", triad, look, kind="LineSegments", material="LineBasicMaterial")


def add_part(recorder: Recorder, root: str, mesh: Mesh) -> None:
    """Add the finished part, half transparent."""
    geometry = triangles(*thin_mesh(mesh.vertices, mesh.faces, MOST_PART_TRIANGLES))
    look = {"color": PART_COLOUR, "opacity": 0.55, "flatShading": True, "depthWrite": False}
    recorder.add(f"{root}/part", "part", geometry, look)


def add_numbers(recorder: Recorder, root: str, model: Model) -> None:
    """Add the numbers of a model's faces, seen from outside only, and hidden at first."""
    marks, look = triangles(*number_marks(model)), {"vertexColors": BY_VERTEX, "side": 0}
    recorder.add(f"{root}/numbers", "numbers", marks, look, material="MeshBasicMaterial")
    recorder.set(f"{root}/numbers", "visible", False)


def add_surroundings(recorder: Recorder, root: str, around: Surroundings) -> None:
    """Add fixtures, and a stock that isn't cut, hidden at first."""
    if around.stock is not None and around.blank is None:
        geometry = triangles(*thin_mesh(around.stock.vertices, around.stock.faces, MOST_PART_TRIANGLES))
        look = {"color": STOCK_COLOUR, "opacity": 0.25, "flatShading": True, "depthWrite": False}
        recorder.add(f"{root}/stock", "stock", geometry, look)
        recorder.set(f"{root}/stock", "visible", False)
    # Numbered, as a name may contain any characters.
    for i, fixture in enumerate(around.fixtures):
        name = f"fixtures/{i}"
        look = {"color": FIXTURE_COLOUR, "flatShading": True}
        recorder.add(f"{root}/{name}", name, _geometry(fixture.shape), look)


def add_bodies(recorder: Recorder, node: str, machine: Machine, bodies: Sequence[Body]) -> None:
    """Add the bodies of a machine, one object each, below a node per link; every axis at 0."""
    for i, body in enumerate(bodies):
        name = f"{node}/{body.link}/{i}"
        opacity = ASSUMED_OPACITY if body.assumed else MACHINE_OPACITY
        look = {"color": _body_colour(body, machine), "opacity": opacity}
        look |= {"flatShading": True, "depthWrite": False}
        recorder.add(name, name, _geometry(body.shape), look)
        recorder.place(name, machine.machine_frame)


def add_tool(recorder: Recorder, node: str, tool: Tool, length: float = 0.0) -> None:
    """Add a tool, each part a body of revolution about z, with its tip at zero.

    `length`, mm, is from the spindle's gauge point to the tip; 0 where it isn't known.
    """
    for part, outline in tool_outlines(tool, length).items():
        name = f"{node}/{part}"
        colour = {CUTTER: CUTTER_COLOUR, HOLDER: HOLDER_COLOUR}.get(part, SHANK_COLOUR)
        body = Mesh.revolved(outline, SECTORS)
        geometry = triangles(body.vertices, body.faces)
        recorder.add(name, name, geometry, {"color": colour, "flatShading": False})


def tool_outlines(tool: Tool, length: float = 0.0) -> dict[str, Array]:
    """Return the outlines of a tool's parts, closed at the bottom, as collision checks use them.

    Returns
    -------
    By name of the part, (m, 2), mm, as `Tool.parts`; a tool without a holder gets a shank of `SHANK_LENGTH`,
    as a cutter alone is hard to see
    """
    outlines = {part.name: part.outline for part in tool.parts()}
    if tool.holder is None:
        thick, top = tool.cutter.outline()[-1].tolist()
        thick = thick if tool.shank_diameter is None else tool.shank_diameter / 2.0
        end = max(length, top) if length else top + SHANK_LENGTH * tool.diameter
        outlines[SHANK] = np.array([[thick, top], [thick, end]])
    return {name: np.vstack([[0.0, rows[0, 1]], rows]) for name, rows in outlines.items()}


def add_marks(
    recorder: Recorder, root: str, findings: Sequence[Finding], points: Array, radius: float
) -> bool:
    """Add the findings' marks, one object per severity, visible through everything, if there are any.

    They stand at points, (n, 3) mm, where the result's locations are drawn; findings without one get none.
    """
    marked = False
    for severity, colour in MARK_COLOURS.items():
        found = (f.place.location for f in findings if f.severity is severity)
        rows = sorted({row for row in found if row is not None and 0 <= row < len(points)})
        if rows:
            name, marked = f"marks/{severity}", True
            body = triangles(*scatter_marks(points[rows], radius))
            # Transparent objects are drawn last; without a depth test nothing hides them.
            look = {"color": colour, "transparent": True, "depthTest": False}
            recorder.add(f"{root}/{name}", name, body, look, material="MeshBasicMaterial")
    return marked


def _body_colour(body: Body, machine: Machine) -> int:
    if body.assumed:
        return ASSUMED_COLOUR
    if body.link not in machine.code.letters:
        return BED_COLOUR
    return TABLE_COLOUR if body.link in machine.code.table else HEAD_COLOUR


def _solid(shape: Shape) -> Mesh:
    """Return a shape as collision checks see it, where it is placed."""
    corners = shape_triangles(shape).reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3)).merged()


def _corners(shape: Shape) -> Array:
    """Return the corners of a shape's box, (8, 3) mm."""
    return box_corners(*_solid(shape).bounds)


def _geometry(shape: Shape) -> dict[str, Any]:
    solid = _solid(shape)
    return triangles(*thin_mesh(solid.vertices, solid.faces, MOST_TRIANGLES))


def scatter_marks(points: Array, radius: float) -> tuple[Array, IntArray]:
    """Make one mesh, (6 m, 3) mm and (8 m, 3), with an octahedron at every point, (m, 3) mm."""
    vertices = (points[:, None] + radius * CORNERS).reshape(-1, 3)
    first = len(CORNERS) * np.arange(len(points))
    return vertices, (first[:, None, None] + FACES).reshape(-1, 3)


def thin_mesh(vertices: Array, faces: IntArray, most: int) -> tuple[Array, IntArray]:
    """Merge neighbouring vertices of a mesh until it has at most `most` triangles.

    Returns
    -------
    vertices, faces : (v, 3) mm and (f, 3); unchanged if few enough, else on a grid as fine as `most` allows
    """
    cells = 1024
    thin = vertices, faces
    while len(thin[1]) > most:
        thin = _merge_cells(vertices, faces, cells)
        # The number of triangles grows with the square of the cells, which nearly gives the right grid.
        cells = int(cells * min(0.95, np.sqrt(most / max(len(thin[1]), 1))))
    return thin


def _merge_cells(vertices: Array, faces: IntArray, cells: int) -> tuple[Array, IntArray]:
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    x, y, z = np.round((vertices - low) / size * cells).astype(np.int64).T
    # One number per cell, as unique rows take a hundred times as long.
    _, first, merged = np.unique(
        (x * (cells + 1) + y) * (cells + 1) + z, return_index=True, return_inverse=True
    )
    joined = merged[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    a, b, c = np.sort(kept, axis=1).T
    _, pair = np.unique(a * len(first) + b, return_inverse=True)
    return vertices[first], kept[np.sort(np.unique(pair * len(first) + c, return_index=True)[1])]
