"""Read a STEP or IGES file into arrays, in a process of its own.

Open Cascade may crash, hang or take all memory on a damaged file, so only this module imports it, and
`fiveaxis.cam.mesh.cad.loading` starts it with limits. What planning needs goes into one ``.npz``. It runs as
a script that imports nothing of the package, whose libraries would take seconds to load.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

# rad: largest angle between the mesh and a curved surface or edge.
ANGLE = 0.35
# Of a face's area: relative error that Open Cascade estimates, and parts of its surface along each parameter.
# Without them it is 0.5 % off on splines; its estimate alone errs by as much where a surface bends sharply.
AREA_ERROR, AREA_PARTS = 1e-8, 16
# Points of a curved border per edge of a triangle: its depth shrinks by the square of it.
FINER = 8
# mm: faces of a file without solids are sewn where their edges are so near.
SEWN = 1e-3
# mm: bodies that are nearer touch.
TOUCHING = 1e-4
# Numbers of `fiveaxis.cam.mesh.cad.records.KINDS`: Open Cascade's class, and the methods that say its sizes.
ANALYTIC = {
    "Geom_Plane": (0, ()),
    "Geom_CylindricalSurface": (1, ("Radius",)),
    "Geom_ConicalSurface": (2, ("RefRadius", "SemiAngle")),
    "Geom_SphericalSurface": (3, ("Radius",)),
    "Geom_ToroidalSurface": (4, ("MajorRadius", "MinorRadius")),
}
SPLINE = 5
# Arrays that every face adds to; a file none of whose faces has a border fails here.
PARTS = ("points", "uv", "triangles", "owner", "border")


class Unreadable(Exception):
    """What is wrong with the file; the message is for users."""


class Document:
    """A file's shapes with names, colours and layers.

    Labels and tools point into Open Cascade's document, so it is kept.
    """

    def __init__(self, path: Path) -> None:
        from OCP.TCollection import TCollection_ExtendedString
        from OCP.TDocStd import TDocStd_Document
        from OCP.UnitsMethods import UnitsMethods_LengthUnit
        from OCP.XCAFApp import XCAFApp_Application
        from OCP.XCAFDoc import XCAFDoc_DocumentTool as Tool

        self.document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
        XCAFApp_Application.GetApplication_s().InitDocument(self.document)
        # The unit of the result, whatever that of the file.
        Tool.SetLengthUnit_s(self.document, 1.0, UnitsMethods_LengthUnit.UnitsMethods_LengthUnit_Millimeter)
        self.units = self._transfer(path)
        main = self.document.Main()
        self.shapes, self.colours, self.layers = (
            tool(main) for tool in (Tool.ShapeTool_s, Tool.ColorTool_s, Tool.LayerTool_s)
        )

    def _transfer(self, path: Path) -> list[str]:
        """Read the file into the document, and return the names of its units of length."""
        import OCP.collections as lists
        from OCP.IFSelect import IFSelect_ReturnStatus
        from OCP.IGESCAFControl import IGESCAFControl_Reader
        from OCP.STEPCAFControl import STEPCAFControl_Reader

        step = path.suffix.lower() in (".step", ".stp")
        reader = STEPCAFControl_Reader() if step else IGESCAFControl_Reader()
        for switch in (reader.SetColorMode, reader.SetNameMode, reader.SetLayerMode):
            switch(True)
        if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise Unreadable("isn't such a file, or is damaged; export it again")
        if step:
            lengths, *others = (lists.Sequence_TCollection_AsciiString() for _ in range(3))
            reader.ChangeReader().FileUnits(lengths, *others)
            units = [text.ToCString().lower() for text in lengths]
        else:
            units = [reader.IGESModel().GlobalSection().UnitName().ToCString().lower()]
        if not reader.Transfer(self.document):
            raise Unreadable("none of its shapes could be built; export it again")
        return units

    def leaves(self) -> Iterator[tuple[Any, Any, str, list[Any]]]:
        """Yield each shape that is no assembly, with its place, its name, and the labels from it outwards."""
        import OCP.collections as lists
        from OCP.TopLoc import TopLoc_Location

        roots = lists.Sequence_TDF_Label()
        self.shapes.GetFreeShapes(roots)
        for root in roots:
            yield from self._below(root, TopLoc_Location(), "", [])

    def _below(self, label: Any, place: Any, name: str, outer: list[Any]) -> Iterator[Any]:
        import OCP.collections as lists
        from OCP.TDataStd import TDataStd_Name
        from OCP.TDF import TDF_Label

        text, shapes = TDataStd_Name(), self.shapes
        if label.FindAttribute(TDataStd_Name.GetID_s(), text):
            name = text.Get().ToExtString()
        labels = [label, *outer]
        if shapes.IsReference_s(label):
            target = TDF_Label()
            shapes.GetReferredShape_s(label, target)
            yield from self._below(target, place.Multiplied(shapes.GetLocation_s(label)), name, labels)
        elif shapes.IsAssembly_s(label):
            parts = lists.Sequence_TDF_Label()
            shapes.GetComponents_s(label, parts)
            for part in parts:
                yield from self._below(part, place, name, labels)
        else:
            yield shapes.GetShape_s(label), place, name, labels

    def colour(self, holders: list[Any]) -> str:
        """Return the colour, ``#rrggbb``, of the first of some shapes and labels that has one, or nothing."""
        from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
        from OCP.TDF import TDF_Label
        from OCP.XCAFDoc import XCAFDoc_ColorType as Kind

        found = Quantity_Color()
        for holder in holders:
            for kind in (Kind.XCAFDoc_ColorSurf, Kind.XCAFDoc_ColorGen):
                ask = self.colours.GetColor_s if isinstance(holder, TDF_Label) else self.colours.GetColor
                if ask(holder, kind, found):
                    values = found.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
                    return "#" + "".join(f"{round(255.0 * value):02x}" for value in values)
        return ""

    def layer(self, holders: list[Any]) -> str:
        """Return the layer of the first of some shapes and labels that has one, or nothing."""
        for holder in holders:
            names = self.layers.GetLayers(holder)
            if names is not None and names.Length():
                return str(names.Value(1).ToExtString())
        return ""


def explore(shape: Any, kind: str, avoid: str = "SHAPE") -> Iterator[Any]:
    """Yield the shapes of a kind (``SOLID``, ``FACE``) in a shape, those within others left out."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    found = TopExp_Explorer(shape, *(getattr(TopAbs_ShapeEnum, f"TopAbs_{word}") for word in (kind, avoid)))
    while found.More():
        yield found.Current()
        found.Next()


def sewn(shape: Any) -> tuple[Any, list[Any]]:
    """Sew faces into shells; return them, and for each of their faces, in order, the one that it was."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
    from OCP.TopLoc import TopLoc_Location

    sewing = BRepBuilderAPI_Sewing(SEWN)
    sewing.Add(shape)
    sewing.Perform()
    whole = sewing.SewedShape()
    before = [(face, sewing.ModifiedSubShape(face)) for face in explore(shape, "FACE")]
    origin = []
    for face in explore(whole, "FACE"):
        origin.append(next((old for old, new in before if new.IsPartner(face)), face))
    return whole.Located(TopLoc_Location()) if whole.IsNull() else whole, origin


def surface_of(face: Any) -> dict[str, Any]:
    """Return the numbers of a face's surface, as in `fiveaxis.cam.mesh.cad.records.Surfaces`."""
    from OCP.BRep import BRep_Tool
    from OCP.GeomConvert import GeomConvert

    surface = BRep_Tool.Surface_s(face)
    if surface is None:
        raise Unreadable("has a face without a surface; export it again")
    while type(surface).__name__ == "Geom_RectangularTrimmedSurface":
        surface = surface.BasisSurface()
    name = type(surface).__name__
    if name in ANALYTIC:
        kind, sizes = ANALYTIC[name]
        axes = surface.Position()
        rows = axes.Location(), axes.XDirection(), axes.YDirection(), axes.Direction()
        frame = [[row.X(), row.Y(), row.Z()] for row in rows]
        size = [*(getattr(surface, size)() for size in sizes), 0.0, 0.0][:2]
        return {"kind": kind, "frame": frame, "size": size}
    if name != "Geom_BSplineSurface":
        surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
    surface = surface.Copy()
    if surface.IsUPeriodic():
        surface.SetUNotPeriodic()
    if surface.IsVPeriodic():
        surface.SetVNotPeriodic()
    shape = surface.NbUPoles(), surface.NbVPoles()
    poles = np.empty((*shape, 4))
    for i, j in np.ndindex(shape):
        pole, weight = surface.Pole(i + 1, j + 1), surface.Weight(i + 1, j + 1)
        poles[i, j] = weight * pole.X(), weight * pole.Y(), weight * pole.Z(), weight
    knots = [np.array(list(found())) for found in (surface.UKnotSequence, surface.VKnotSequence)]
    return {"kind": SPLINE, "degree": (surface.UDegree(), surface.VDegree()), "knots": knots, "poles": poles}


def divide(face: Any) -> None:
    """Insert knots into a spline's own surface, which keep its shape and its borders' curves."""
    from OCP.BRep import BRep_Tool
    from OCP.TopLoc import TopLoc_Location

    surface = BRep_Tool.Surface_s(face, TopLoc_Location())
    while type(surface).__name__ == "Geom_RectangularTrimmedSurface":
        surface = surface.BasisSurface()
    if type(surface).__name__ != "Geom_BSplineSurface":
        return
    directions = (surface.UKnots, surface.InsertUKnot), (surface.VKnots, surface.InsertVKnot)
    for knots, insert in directions:
        found = list(knots())
        parts = -(-AREA_PARTS // (len(found) - 1))
        for begin, end in itertools.pairwise(found):
            for k in range(1, parts):
                insert(begin + (end - begin) * k / parts, 1, 0.0)


def border_of(edge: Any, face: Any, polygon: Any, index: int) -> np.ndarray:
    """Return rows (face, u0, v0, u1, v1) along an edge's curve in the parameters of its face.

    Seams come twice, once for each side, and edges at poles have no length in space.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.GeomAbs import GeomAbs_CurveType

    curve = BRepAdaptor_Curve2d(edge, face)
    if polygon is not None and polygon.HasParameters():
        t = np.array([polygon.Parameter(i + 1) for i in range(polygon.NbNodes())])
    else:
        t = np.array([curve.FirstParameter(), curve.LastParameter()])
    if curve.GetType() != GeomAbs_CurveType.GeomAbs_Line:
        t = np.interp(np.arange((len(t) - 1) * FINER + 1) / FINER, np.arange(len(t)), t)
    uv = np.array([(p.X(), p.Y()) for p in map(curve.Value, t.tolist())])
    return np.column_stack([np.full(len(uv) - 1, index), uv[:-1], uv[1:]])


class Collector:
    """Gathers the arrays of faces, one after the other."""

    def __init__(self) -> None:
        import OCP.collections as lists

        self.faces: list[dict[str, Any]] = []
        self.shapes: list[Any] = []
        self.surfaces: list[dict[str, Any]] = []
        self.parts: dict[str, list[np.ndarray]] = {name: [] for name in PARTS}
        self.edges: dict[int, list[int]] = {}
        self.known_edges = lists.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
        self.count = 0

    def add(self, face: Any, turned: bool, facts: dict[str, Any]) -> None:
        """Add a face that is meshed, with what is known of it; `turned` says that its body is inside out."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepTools import BRepTools
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopLoc import TopLoc_Location

        where, index = TopLoc_Location(), len(self.faces)
        mesh = BRep_Tool.Triangulation_s(face, where)
        if mesh is None or not mesh.NbTriangles():
            place = f"face {facts['number']} (of body {facts['body']})"
            raise Unreadable(f"{place} can't be meshed: its border is damaged; repair it where it was made")
        reversed_ = (face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED) != turned
        self.faces.append({**facts, "box": BRepTools.UVBounds_s(face), "reversed": reversed_})
        self.shapes.append(face)
        self.surfaces.append(surface_of(face))
        matrix, count = where.Transformation(), mesh.NbNodes()
        nodes, uv = np.empty((count, 3)), np.empty((count, 2))
        for i in range(count):
            p, q = mesh.Node(i + 1).Transformed(matrix), mesh.UVNode(i + 1)
            nodes[i], uv[i] = (p.X(), p.Y(), p.Z()), (q.X(), q.Y())
        triangles = np.array([mesh.Triangle(i + 1).Get() for i in range(mesh.NbTriangles())]) - 1
        self.parts["points"].append(nodes)
        self.parts["uv"].append(uv)
        self.parts["triangles"].append(triangles[:, :: -1 if reversed_ else 1] + self.count)
        self.parts["owner"].append(np.full(len(triangles), index))
        self.count += count
        self._add_edges(face, mesh, where, index)

    def _add_edges(self, face: Any, mesh: Any, where: Any, index: int) -> None:
        from OCP.BRep import BRep_Tool
        from OCP.TopoDS import TopoDS

        for shape in explore(face, "EDGE"):
            edge = TopoDS.Edge(shape)
            polygon = BRep_Tool.PolygonOnTriangulation_s(edge, mesh, where)
            self.parts["border"].append(border_of(edge, face, polygon, index))
            if not BRep_Tool.Degenerated_s(edge):
                self.edges.setdefault(self.known_edges.Add(edge), []).append(index)

    def measure(self) -> None:
        """Add the area of each face, mm²; nothing else may be asked of the surfaces afterwards."""
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        for face, facts in zip(self.shapes, self.faces, strict=True):
            area = GProp_GProps()
            divide(face)
            BRepGProp.SurfaceProperties_s(face, area, AREA_ERROR)
            facts["area"] = area.Mass()

    def arrays(self) -> dict[str, np.ndarray]:
        """Join them: the fields of `fiveaxis.cam.mesh.cad.records.Surfaces`, the mesh and the borders."""
        count = len(self.faces)
        frame, size, form = np.zeros((count, 4, 3)), np.zeros((count, 2)), np.zeros((count, 7), np.int64)
        knots, poles = [np.zeros(0)], [np.zeros((0, 4))]
        knots_end, poles_end = 0, 0
        for i, surface in enumerate(self.surfaces):
            if surface["kind"] != SPLINE:
                frame[i], size[i] = surface["frame"], surface["size"]
                continue
            (u, v), (n, m, _) = surface["knots"], surface["poles"].shape
            form[i] = *surface["degree"], n, m, knots_end, knots_end + len(u), poles_end
            knots += [u, v]
            poles.append(surface["poles"].reshape(-1, 4))
            knots_end += len(u) + len(v)
            poles_end += n * m
        pairs = [(a, b) for owners in self.edges.values() for a in owners for b in owners if a < b]
        return {
            "kind": np.array([surface["kind"] for surface in self.surfaces]),
            "frame": frame,
            "size": size,
            "form": form,
            "knots": np.concatenate(knots),
            "poles": np.vstack(poles),
            **{name: np.concatenate(parts) for name, parts in self.parts.items()},
            "shared": np.array(sorted(set(pairs)), dtype=np.int64).reshape(-1, 2),
        }


def is_inside_out(body: Any) -> bool:
    """Check whether a closed body that is meshed has its normals in its material."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    shells = list(explore(body, "SHELL"))
    if not shells or not all(BRep_Tool.IsClosed_s(shell) for shell in shells):
        return False
    volume = GProp_GProps()
    BRepGProp.VolumeProperties_s(body, volume, False, False, True)
    return bool(volume.Mass() < 0.0)


def meeting(bodies: list[Any]) -> list[tuple[int, int]]:
    """Find the pairs of meshed bodies, by their place in the list, that touch or reach into each other."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepExtrema import BRepExtrema_ShapeProximity

    boxes = [Bnd_Box() for _ in bodies]
    for body, box in zip(bodies, boxes, strict=True):
        BRepBndLib.Add_s(body, box)
    found = []
    for i, j in itertools.combinations(range(len(bodies)), 2):
        if not boxes[i].IsOut(boxes[j]):
            near = BRepExtrema_ShapeProximity(bodies[i], bodies[j], TOUCHING)
            near.Perform()
            if near.OverlapSubShapes1().Size():
                found.append((i, j))
    return found


def placed(shape: Any, place: Any, factor: float) -> Any:
    """Move a shape to its place, and scale it.

    Surfaces of extrusion, of revolution and of offset become B-splines, with their edges' curves in the new
    parameters; the others stay as they are.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Pnt, gp_Trsf
    from OCP.ShapeCustom import ShapeCustom

    moved = ShapeCustom.ConvertToBSpline_s(shape, True, True, True, False).Moved(place)
    if factor == 1.0:
        return moved
    scaling = gp_Trsf()
    scaling.SetScale(gp_Pnt(0.0, 0.0, 0.0), factor)
    return BRepBuilderAPI_Transform(moved, scaling, True).Shape()


def convert(path: Path, tolerance: float, factor: float, wanted: str) -> tuple[dict[str, Any], Collector]:
    """Read a file, and mesh its bodies, or the one that is wanted by name or number.

    `tolerance` is that of the mesh's chords, mm, `factor` mm per unit of a file that doesn't state its unit.
    """
    import OCP.collections as lists
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    document = Document(path)
    factor = factor if factor and not document.units else 1.0
    built, bodies = lists.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher(), []
    for shape, place, name, labels in document.leaves():
        origin = list(explore(shape, "FACE"))
        for face in origin:
            built.Add(face.Located(TopLoc_Location()))
        if len(origin) > 1 and not any(explore(shape, "SOLID")) and any(explore(shape, "FACE", "SHELL")):
            shape, origin = sewn(shape)
        bare = iter(origin)
        whole = placed(shape, place, factor)
        # Solids, shells outside of solids, and faces outside of shells.
        kinds = ("SOLID",), ("SHELL", "SOLID"), ("FACE", "SHELL")
        for body in (body for kind in kinds for body in explore(whole, *kind)):
            bodies.append((name, body, labels, shape, [next(bare) for _ in explore(body, "FACE")]))
    bodies = [body for body in bodies if body[4]]
    numbers = {str(i): i for i in range(1, len(bodies) + 1)}
    names = [body[0] for body in bodies]
    chosen = (
        [numbers[wanted]] if wanted in numbers else [i for i in numbers.values() if names[i - 1] == wanted]
    )
    facts = {"units": document.units, "bodies": names, "chosen": chosen, "built": built.Extent()}
    collector = Collector()
    if wanted and len(chosen) != 1:
        return facts, collector
    for number in chosen or numbers.values():
        name, body, labels, shape, origin = bodies[number - 1]
        number_of_face = 1 + sum(len(body[4]) for body in bodies[: number - 1])
        BRepMesh_IncrementalMesh(body, tolerance, False, ANGLE, True)
        turned = is_inside_out(body)
        for i, (face, old) in enumerate(zip(explore(body, "FACE"), origin, strict=True)):
            holders = [old, shape, *labels]
            known = {"number": number_of_face + i, "body": number, "body_name": name}
            known |= {"colour": document.colour(holders), "layer": document.layer(holders)}
            collector.add(TopoDS.Face(face), turned, known)
    collector.measure()
    taken = list(chosen or numbers.values())
    pairs = meeting([bodies[number - 1][1] for number in taken])
    return facts | {"meeting": [(taken[i], taken[j]) for i, j in pairs]}, collector


def main() -> int:
    """Read the file of the request, JSON; the last line of the standard error says what is wrong."""
    given = json.loads(sys.argv[1])
    os.dup2(2, 1)  # Open Cascade writes its messages to the standard output
    limit(given["memory"], given["seconds"])
    try:
        facts, found = convert(Path(given["file"]), given["tolerance"], given["factor"], given["body"])
        arrays: dict[str, Any] = found.arrays() if found.faces else {}
        np.savez(given["output"], facts=json.dumps({**facts, "faces": found.faces}), **arrays)
    except Unreadable as fault:
        sys.stderr.write(f"\n{fault}")
        return 2
    except MemoryError:
        return 3
    return 0


def limit(memory: int, seconds: int) -> None:
    """Limit this process's memory, bytes, and time of the processor where the system can."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))


if __name__ == "__main__":
    sys.exit(main())
