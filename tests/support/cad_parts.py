"""Write CAD files with Open Cascade, and ask it about their faces, in a process of its own.

usage: python tests/support/cad_parts.py FOLDER
       python tests/support/cad_parts.py classify part.step points.npz answer.npy
       python tests/support/cad_parts.py impeller part.step 24
"""

import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np


def shapes() -> dict[str, list[Any]]:
    """Solids and shells by the name of their file."""
    import OCP.collections as lists
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut as Cut
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge as Edge
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert as Rational
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform as Transform
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox as Box
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone as Cone
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder as Cylinder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere as Sphere
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus as Torus
    from OCP.GeomAPI import GeomAPI_PointsToBSpline
    from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

    points = lists.Array1_gp_Pnt(1, 5)
    for i, (x, z) in enumerate(((10, 0), (14, 5), (8, 12), (11, 18), (9, 25))):
        points.SetValue(i + 1, gp_Pnt(x, 0, z))
    curve = Edge(GeomAPI_PointsToBSpline(points).Curve()).Edge()
    ruled = BRepOffsetAPI_ThruSections(True, True)
    loft = BRepOffsetAPI_ThruSections(True, False)
    for one in (ruled, loft):
        one.CheckCompatibility(False)  # else the sections are cut by arc length: more faces
    for z, twist, chord in ((0, 0.0, 30), (20, 0.25, 28), (40, 0.5, 24)):
        loft.AddWire(section(float(z), twist, float(chord)))
        if z != 20:
            ruled.AddWire(section(float(z), twist, float(chord)))
    post, cut = Cylinder(15.0, 40.0).Shape(), gp_Trsf()
    cut.SetRotation(gp_Ax1(gp_Pnt(0, 0, 20), gp_Dir(1, 0, 0)), 0.3)
    half = Transform(Box(gp_Pnt(-20, -20, 20), 40.0, 40.0, 40.0).Shape(), cut).Shape()
    hole = Cylinder(gp_Ax2(gp_Pnt(-30, 0, 9), gp_Dir(1, 0, 0)), 4.0, 60.0).Shape()
    return {
        "slanted": [Cut(Cut(post, half).Shape(), hole).Shape()],
        "sphere": [Sphere(10.0).Shape()],
        "torus": [Torus(12.0, 4.0).Shape()],
        "rational": [Rational(Torus(12.0, 4.0).Shape()).Shape()],
        "cylinder": [Cylinder(5.0, 20.0).Shape()],
        "cone": [Cone(8.0, 3.0, 12.0).Shape()],
        "tip": [Cone(8.0, 0.0, 12.0).Shape()],
        "blade": [loft.Shape()],
        "ruled": [ruled.Shape()],
        "inside_out": [Box(10.0, 20.0, 30.0).Shape().Reversed()],
        "two": [Box(10.0, 20.0, 30.0).Shape(), Sphere(gp_Pnt(50.0, 0.0, 0.0), 5.0).Shape()],
        "meeting": [Box(10.0, 20.0, 30.0).Shape(), Sphere(gp_Pnt(10.0, 10.0, 15.0), 5.0).Shape()],
        "swept": [
            BRepPrimAPI_MakeRevol(curve, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 5.0).Shape(),
            BRepPrimAPI_MakePrism(curve, gp_Vec(0, 30, 0)).Shape(),
        ],
        "wire": [curve],
    }


def impeller(blades: int) -> Any:
    """A hub with twisted blades around it, of nine faces each."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform as Transform
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone as Cone
    from OCP.collections import List_TopoDS_Shape
    from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

    loft = BRepOffsetAPI_ThruSections(True, False)
    loft.CheckCompatibility(False)
    for z, twist, chord in ((30.0, 0.3, 16.0), (60.0, 0.6, 14.0), (90.0, 0.9, 10.0)):
        loft.AddWire(section(z, twist, chord, sides=3))
    hub, tools = List_TopoDS_Shape(), List_TopoDS_Shape()
    x = gp_Dir(1, 0, 0)
    hub.Append(Cone(gp_Ax2(gp_Pnt(-15, 0, 0), x), 45.0, 40.0, 30.0).Shape())
    for k in range(blades):
        turn = gp_Trsf()
        turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), x), 2.0 * np.pi * k / blades)
        tools.Append(Transform(loft.Shape(), turn, True).Shape())
    joined = BRepAlgoAPI_Fuse()
    joined.SetArguments(hub)
    joined.SetTools(tools)
    joined.Build()
    return joined.Shape()


def section(z: float, twist: float, chord: float, sides: int = 1) -> Any:
    """Straight sides, of one or more edges, and round ends, turned about Z, for a loft of smooth faces."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge as Edge
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire as Wire
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.gp import gp_Pnt

    def at(x: float, y: float) -> Any:
        c, s = np.cos(twist), np.sin(twist)
        return gp_Pnt(c * x - s * y, s * x + c * y, z)

    def arc(sign: float) -> Any:
        ends = at(sign * h, -sign), at(sign * (h + 1.0), 0.0), at(sign * h, sign)
        return Edge(GC_MakeArcOfCircle(*ends).Value()).Edge()

    h = chord / 2.0
    wire = Wire()
    for y in (-1.0, 1.0):
        xs = (-y * np.linspace(-h, h, sides + 1)).tolist()
        for begin, end in pairwise(xs):
            wire.Add(Edge(at(begin, y), at(end, y)).Edge())
        wire.Add(arc(-y))
    return wire.Wire()


def write(path: Path, found: list[Any]) -> None:
    """Write shapes as STEP or IGES, in mm."""
    from OCP.IGESControl import IGESControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    if path.suffix == ".iges":
        writer = IGESControl_Writer("MM", 0)
        for shape in found:
            assert writer.AddShape(shape)
        writer.ComputeModel()
        assert writer.Write(str(path))
        return
    writer = STEPControl_Writer()
    for shape in found:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))


def write_assembly(path: Path) -> None:
    """A pin twice, turned and moved, in an assembly of an assembly, and a block; in inches.

    The pin is red, the block's first face blue and on the layer ``finish``.
    """
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.Interface import Interface_Static
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString as Text
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

    document = TDocStd_Document(Text("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    made, colours, layers = (
        tool(document.Main())
        for tool in (
            XCAFDoc_DocumentTool.ShapeTool_s,
            XCAFDoc_DocumentTool.ColorTool_s,
            XCAFDoc_DocumentTool.LayerTool_s,
        )
    )
    pin = made.AddShape(BRepPrimAPI_MakeCylinder(5.0, 20.0).Shape(), False)
    solid = BRepPrimAPI_MakeBox(10.0, 20.0, 30.0).Shape()
    block, (first, *_) = made.AddShape(solid, False), list(faces_of(solid))
    inner, outer = made.NewShape(), made.NewShape()
    for label, name in ((pin, "pin"), (block, "block"), (inner, "pins"), (outer, "all")):
        TDataStd_Name.Set_s(label, Text(name))
    surface = XCAFDoc_ColorType.XCAFDoc_ColorSurf
    colours.SetColor(pin, Quantity_Color(1.0, 0.0, 0.0, Quantity_TOC_sRGB), surface)
    face = made.AddSubShape(block, first)
    colours.SetColor(face, Quantity_Color(0.0, 0.0, 1.0, Quantity_TOC_sRGB), surface)
    layers.SetLayer(face, Text("finish"))
    turn, shift, away = gp_Trsf(), gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), np.pi / 2)
    shift.SetTranslation(gp_Vec(0, 0, 50))
    away.SetTranslation(gp_Vec(100, 0, 0))
    made.AddComponent(inner, pin, TopLoc_Location(turn))
    made.AddComponent(inner, pin, TopLoc_Location(shift))
    made.AddComponent(outer, inner, TopLoc_Location(away))
    made.AddComponent(outer, block, TopLoc_Location(gp_Trsf()))
    made.UpdateAssemblies()
    Interface_Static.SetCVal_s("write.step.unit", "INCH")
    writer = STEPCAFControl_Writer()
    writer.SetLayerMode(True)
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")


def damage(text: str) -> Iterator[tuple[str, str]]:
    """Damage a STEP file in the ways that its readers are known to stumble over."""
    lines = text.splitlines()
    yield "empty", ""
    yield "text", "hello world\n" * 100
    yield "half", text[: len(text) // 2]
    yield "no_data", text[: text.index("DATA;")] + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    yield "no_end", text.replace("ENDSEC;\nEND-ISO-10303-21;", "")
    yield "endless", text.replace("CARTESIAN_POINT('',(15.", "CARTESIAN_POINT('',(1e999", 40)
    yield "letters", text.replace("B_SPLINE_SURFACE", "B_SPLIME_SURFACE")
    yield "knots", text.replace("(4,4)", "(9,9)").replace("(3,3)", "(1,1)").replace("(2,2)", "(7,7)")
    yield "references", "\n".join(x.replace("#2", "#9") if i % 7 == 0 else x for i, x in enumerate(lines))
    yield "shuffled", "\n".join(x for i, x in enumerate(lines) if i < 12 or i % 5 or i > len(lines) - 3)


def without_unit(text: str) -> str:
    """Take the unit of length out of a STEP file."""
    return text.replace("GLOBAL_UNIT_ASSIGNED_CONTEXT", "GLOBAL_UNIT_FORGOTTEN_CONTEXT")


def faces_of(shape: Any) -> Iterator[Any]:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    found = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while found.More():
        yield TopoDS.Face(found.Current())
        found.Next()


def classify(part: Path, points: Path, answer: Path) -> None:
    """Ask Open Cascade's classifier which parameters, by face, are inside of the trimmed faces."""
    from OCP.gp import gp_Pnt2d
    from OCP.IntTools import IntTools_FClass2d
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_State

    reader = STEPControl_Reader()
    reader.ReadFile(str(part))
    reader.TransferRoots()
    asked = np.load(points)
    tests = [IntTools_FClass2d(face, 1e-7) for face in faces_of(reader.OneShape())]
    states = [
        tests[face].Perform(gp_Pnt2d(*map(float, uv))) != TopAbs_State.TopAbs_OUT
        for face, uv in zip(asked["face"].tolist(), asked["uv"], strict=True)
    ]
    np.save(answer, np.array(states))


def main() -> None:
    if sys.argv[1] == "classify":
        return classify(*map(Path, sys.argv[2:5]))
    if sys.argv[1] == "impeller":
        return write(Path(sys.argv[2]), [impeller(int(sys.argv[3]))])
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    made: Callable[[], dict[str, list[Any]]] = shapes
    for name, found in made().items():
        write(folder / f"{name}.step", found)
        if name in ("blade", "two"):
            write(folder / f"{name}.iges", found)
    write_assembly(folder / "assembly_inch.step")
    blade = (folder / "blade.step").read_text()
    for name, text in damage(blade):
        (folder / f"broken_{name}.step").write_text(text)
    (folder / "unitless.step").write_text(without_unit((folder / "two.step").read_text()))
    return None


if __name__ == "__main__":
    main()
