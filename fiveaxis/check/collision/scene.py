"""All bodies that may touch, each on its link, and the pairs of them that are checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiveaxis.base import JOB, MACHINE_FILE, TOOL_FILE, Array, Gap, inverse_transform, product, risk
from fiveaxis.cam import Mesh, kept_by_mesh, read_solid
from fiveaxis.check.collision.assumed import NOSE, TABLE, is_described, with_nose
from fiveaxis.check.collision.pieces import (
    PairQuery,
    Piece,
    box_piece,
    cylinder_piece,
    mesh_piece,
    revolved_pieces,
)
from fiveaxis.check.collision.surroundings import Clearances, Surroundings
from fiveaxis.model import (
    BED,
    CUTTER,
    HOLDER,
    SHANK,
    Body,
    Box,
    Cylinder,
    FormShapingCode,
    Machine,
    MeshShape,
    Tool,
)

PART, STOCK, FIXTURE, BODY = "part", "stock", "fixture", "body"
TOOL_KINDS = (CUTTER, SHANK, HOLDER)
# What settles the height of a cutter's edges, and what an open mesh leaves open.
LENGTH, WATERTIGHT = ("length", TOOL_FILE), ("a watertight mesh", JOB)
# For a mesh of more triangles the report states the memory it takes.
MANY_TRIANGLES = 1_000_000
MACHINE = "machine"
# mm: a rapid move that begins in the stock has to leave it within this length.
LONGEST_RETRACT = 10.0


@dataclass(frozen=True, eq=False)
class SceneBody:
    """One rigid body.

    Parameters
    ----------
    name : for findings
    kind : ``cutter``, ``shank``, ``holder``, ``part``, ``stock``, ``fixture`` or ``body`` (of the machine)
    link : the link that carries it
    pieces : at least one
    beside_cut : number of first pieces next to the cutter, and so near to what it cuts
    """

    name: str
    kind: str
    link: str
    pieces: tuple[Piece, ...]
    beside_cut: int = 0


@dataclass(frozen=True, eq=False)
class Scene:
    """All bodies of a machine with its tool and surroundings.

    Parameters
    ----------
    code : of the machine
    bodies : tool first, then the workpiece side, then the machine
    checked, not_checked : sentences on the bodies, and what is missing
    """

    code: FormShapingCode
    bodies: tuple[SceneBody, ...]
    checked: tuple[str, ...] = ()
    not_checked: tuple[Gap, ...] = ()


def build_scene(machine: Machine, tool: Tool, surroundings: Surroundings) -> Scene:
    """Place all bodies as they are with every axis at 0.

    Raises
    ------
    MeshError
        A body's mesh can't be read or is refused.
    """
    links, machine = machine.code.links, with_nose(machine, tool)
    standing, facts, gaps = _surrounding_bodies(surroundings, links[0])
    bodies, left_out = _machine_bodies(machine)
    return Scene(
        code=machine.code,
        bodies=(*tool_bodies(tool, machine.chain.tool_home, links[-1]), *standing, *bodies),
        checked=tuple(facts),
        not_checked=(*_unknown_of(tool, has_nose=is_described(machine, machine.code.head)), *gaps, *left_out),
    )


def tool_bodies(tool: Tool, home: Array, link: str) -> list[SceneBody]:
    """Build bodies of the parts of a tool that are known (`Tool.parts`), carried by a link.

    The first piece of a shank is as high as its radius. `home`, (4, 4) mm, is the tool-tip frame in the
    workpiece frame, every axis at 0.
    """
    bodies = []
    for part in tool.parts():
        outlines = [part.outline]
        if part.name == SHANK:
            (radius, low), (_, high) = part.outline.tolist()
            ends = [low, min(low + radius, high), high]
            outlines = [np.array([[radius, a], [radius, b]]) for a, b in pairwise(ends)]
        elif part.name == HOLDER:
            outlines = [part.outline[i : i + 2] for i in range(0, len(part.outline), 2)]
        pieces = tuple(piece for outline in outlines for piece in revolved_pieces(outline, home))
        if pieces:
            bodies.append(SceneBody(part.name, part.name, link, pieces, beside_cut=int(part.name == SHANK)))
    return bodies


def _unknown_of(tool: Tool, *, has_nose: bool) -> list[Gap]:
    unknown = []
    if tool.cutter.length is None:
        top = tool.parts()[0].outline[-1, 1]
        unknown.append(risk(f"cutting edges above {top:g} mm: the tool states no cutting length", *LENGTH))
    if tool.holder is None:
        what = "shank and holder" if has_nose else "shank, holder and spindle nose"
        unknown.append(risk(f"{what} against anything: the tool states no holder", "[holder]", TOOL_FILE))
    elif tool.shank_diameter is None:
        text = "shank diameter: not stated, taken as that of the cutter's upper end"
        unknown.append(risk(text, "shank_diameter", TOOL_FILE))
    return unknown


def _surrounding_bodies(
    surroundings: Surroundings, link: str
) -> tuple[list[SceneBody], list[str], list[Gap]]:
    """Build part, stock and fixtures, with sentences on their memory and what open meshes leave open."""
    bodies, facts, gaps = [], [], []
    for name, mesh in surroundings.meshes.items():
        piece = _of_mesh(mesh, np.eye(4))
        bodies.append(SceneBody(name, name, link, (piece,)))
        if len(mesh.faces) > MANY_TRIANGLES:
            facts.append(f"{name}: {len(mesh.faces):,} triangles, {piece.memory / 2**20:,.0f} MiB of memory")
        if not mesh.is_watertight:
            gaps.append(_inside(f"the {name}"))
    for fixture in surroundings.fixtures:
        name = f"fixture {fixture.name!r}"
        piece = _of_shape(fixture.shape, np.eye(4))
        bodies.append(SceneBody(name, FIXTURE, link, (piece,)))
        if piece.is_mesh and not piece.closed:
            gaps.append(_inside(name))
    return bodies, facts, gaps


def _inside(name: str) -> Gap:
    return risk(f"whether a body lies wholly inside {name}: its mesh isn't watertight", *WATERTIGHT)


def _machine_bodies(machine: Machine) -> tuple[list[SceneBody], list[Gap]]:
    """Build the machine's bodies; placing those that its file has on the head requires the tool length."""
    bodies, head = [], machine.code.head
    unplaced = machine.tool_length == 0.0 and any(b.link in head and not b.assumed for b in machine.bodies)
    for i, body in enumerate(machine.bodies):
        if unplaced and body.link in head:
            continue
        bodies.append(place_body(body, machine, i + 1))
    if unplaced:
        text = "bodies of the head: the machine states no tool_length, from spindle to tip"
        return bodies, [risk(text, "tool_length (--tool-length)", JOB)]
    if machine.clamped:
        text = "bodies of the machine: they aren't known while an axis is clamped"
        return bodies, [risk(text, "[[bodies]]", MACHINE_FILE)]
    if len(bodies) == sum(body.name == NOSE for body in bodies):
        text = f"bodies of the machine beyond an {TABLE} and spindle nose: its file states none"
        return bodies, [Gap(text, "[[bodies]]", MACHINE_FILE)]
    return bodies, []


def place_body(body: Body, machine: Machine, number: int = 0) -> SceneBody:
    """Place a body of a machine, by its number in the machine's file, as it is with every axis at 0."""
    where = "the bed" if body.link == BED else f"link {body.link}"
    piece = _of_shape(body.shape, machine.machine_frame)
    return SceneBody(body.assumed or f"machine body {number} on {where}", BODY, body.link, (piece,))


def _of_shape(shape: Box | Cylinder | MeshShape, base: Array) -> Piece:
    """Build the piece of a shape that is placed in a frame, (4, 4) mm, of the workpiece frame."""
    frame = product(base, shape.frame)
    if isinstance(shape, Box):
        return box_piece(np.array(shape.size), frame)
    if isinstance(shape, Cylinder):
        return cylinder_piece(shape.radius, shape.height, frame)
    mesh = read_solid(shape.file)
    if shape.scale != 1.0:
        mesh = Mesh(shape.scale * mesh.vertices, mesh.faces)
    return _of_mesh(mesh, frame)


def _of_mesh(mesh: Mesh, frame: Array) -> Piece:
    return replace(_at_home(mesh), frame=frame)


@kept_by_mesh
def _at_home(mesh: Mesh) -> Piece:
    """Make a piece of a mesh in its own frame."""
    return mesh_piece(mesh.vertices, mesh.faces, np.eye(4), closed=mesh.is_watertight)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two bodies that move relative to each other.

    Parameters
    ----------
    kind : ``cutter``, ``shank``, ``holder`` or ``machine``: sets the code of findings and the clearance
    first, second : the bodies; the first one is nearer to the tool
    clearance : mm; nearer gets a warning
    rapid_only : check rapid moves only, as the cutter may touch the stock that it cuts
    """

    kind: str
    first: SceneBody
    second: SceneBody
    clearance: float
    rapid_only: bool = False

    @property
    def pieces(self) -> Iterator[tuple[Piece, Piece, float]]:
        """Pieces of the first and the second body, with their clearance, mm.

        The shank starts at the cutter, which touches part and stock, so its first piece has no clearance to
        them and only mustn't touch.
        """
        touched = self.second.kind in (PART, STOCK)
        for i, first in enumerate(self.first.pieces):
            for second in self.second.pieces:
                beside = touched and i < self.first.beside_cut
                yield first, second, 0.0 if beside else self.clearance


RETRACTS = risk(
    f"rapid moves of the cutter out of the stock, within {LONGEST_RETRACT:g} mm or back along the tool's "
    "axis: without a closed part the stock isn't cut"
)


def choose_pairs(scene: Scene, clearances: Clearances) -> tuple[tuple[Pair, ...], list[Gap]]:
    """Choose the pairs that can touch.

    Bodies of one link can't. Gouge checks cover the cutter against the part, and the cutter cuts the stock,
    so against that only its rapid moves count. Shank and holder don't cut, so they mustn't touch anything on
    the workpiece side. Machine bodies that carry one another often touch by construction: those that do with
    every axis at 0 aren't checked.

    Returns
    -------
    The pairs to be checked, and those that are left out, with the reason
    """
    pairs, skipped = [], []
    for kind, first, second in _candidates(scene):
        clearance = clearances.by_kind[kind]
        if _are_connected(scene, first, second) and touch_at_home(first, second, clearance):
            skipped.append((first, second, clearance))
            continue
        rapid_only = kind == CUTTER and second.kind == STOCK
        pairs.append(Pair(kind, first, second, clearance, rapid_only))
    left_out = [
        Gap(
            f"{first.name} against {second.name}: one carries the other, and they touch by construction: "
            f"with every axis at 0 they are nearer than {clearance:g} mm"
        )
        for first, second, clearance in skipped
    ]
    left_out += [RETRACTS] if any(p.rapid_only for p in pairs) else []
    return tuple(pairs), left_out


def touch_at_home(first: SceneBody, second: SceneBody, margin: float) -> bool:
    """Check whether two bodies are nearer than a margin, mm, with every axis at 0."""
    return any(
        PairQuery(a, b).nearer(product(inverse_transform(b.frame), a.frame), margin)
        for a in first.pieces
        for b in second.pieces
    )


def _candidates(scene: Scene) -> Iterator[tuple[str, SceneBody, SceneBody]]:
    """Yield pairs on different links, with their kind; the body nearer to the tool first."""
    order = scene.code.links.index
    for i, a in enumerate(scene.bodies):
        for b in scene.bodies[i + 1 :]:
            if a.link == b.link:
                continue
            first, second = (a, b) if order(a.link) > order(b.link) else (b, a)
            if first.kind in TOOL_KINDS:
                # The spindle holds the tool.
                apart = second.link not in scene.code.head
                if apart and not (first.kind == CUTTER and second.kind == PART):
                    yield first.kind, first, second
            else:
                yield MACHINE, first, second


def _are_connected(scene: Scene, first: SceneBody, second: SceneBody) -> bool:
    """Check whether two bodies of the machine are on neighbouring links, or both on one side of the bed."""
    if not first.kind == second.kind == BODY:
        return False
    order = scene.code.links.index
    same_side = any({first.link, second.link} <= set(s) for s in (scene.code.table, scene.code.head))
    return same_side or abs(order(first.link) - order(second.link)) == 1


def describe(pairs: Iterable[Pair]) -> Iterator[str]:
    """Describe pairs that were checked and are clear, in one sentence per first body."""
    against: dict[str, list[Pair]] = {}
    for pair in pairs:
        against.setdefault(pair.first.name, []).append(pair)
    for name, found in against.items():
        others = [
            f"{p.second.name}{' (rapid moves that enter it or stay in it)' * p.rapid_only}" for p in found
        ]
        beside = any(p.first.beside_cut and p.second.kind in (PART, STOCK) for p in found)
        above = ", to part and stock from half its diameter above the cutter" * beside
        yield (
            f"{name} against {', '.join(others)}: at every location and throughout the moves between them, "
            f"clearance {found[0].clearance:g} mm{above}"
        )
