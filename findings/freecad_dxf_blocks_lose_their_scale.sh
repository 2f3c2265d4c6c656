#!/bin/sh
# A drawing's block that is scaled by 2 comes in 1.59 times as large, in width and in height.
#
# Run: freecadcmd of Debian 12's freecad 0.20.2, Import.readDXF, on drawings that ezdxf 1.4.5 (PyPI)
# writes, and takes apart as the judge.
#
# Guess before the run: a block is scaled and turned about its base point, and put where it is
# inserted, as often as rows and columns say, and what is in it may be a block, too; or a message says what
# isn't read.
#
# What happens: angles and mirroring are right. With 2, 2 and 1 for X, Y and Z the block is 1.587 times as
# large, by the cube root of 4, in every direction; with 2, 1 and 1 it is 1.26 times. The base point isn't
# looked at. Of a pattern of 3 by 2 there is one, and nothing of a block within a block that the file has
# before it. There is no message.
#
# Why it matters: a pocket that is drawn at twice its block's size is cut with walls in the wrong place,
# and what is around it is right. In a flat drawing nothing shows whether Z is scaled, too. Take blocks
# apart before the drawing is written, or measure one width of each after the import.
#
# Exit: 0 as described, 1 it has changed, 2 another or no freecad is installed, or ezdxf could not be.
set -eu
version=$(dpkg-query -W -f '${Version}' freecad) || exit 2
echo "freecad $version"
[ "$version" = "0.20.2+dfsg1-4+deb12u1" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv || exit 2
venv/bin/pip install -q --disable-pip-version-check ezdxf==1.4.5 || exit 2
cat >write.py <<'PYTHON'
import json

import ezdxf
from ezdxf.disassemble import recursive_decompose

CASES = {
    "turned by 30": ((0, 0), {"rotation": 30}),
    "mirrored in X": ((0, 0), {"xscale": -1}),
    "scaled by 2, 2 and 2": ((0, 0), {"xscale": 2, "yscale": 2, "zscale": 2}),
    "scaled by 2, 2 and 1": ((0, 0), {"xscale": 2, "yscale": 2}),
    "scaled by 2, 1 and 1": ((0, 0), {"xscale": 2}),
    "based on its other end": ((20, 0), {}),
    "3 by 2": ((0, 0), {"column_count": 3, "column_spacing": 30, "row_count": 2, "row_spacing": 10}),
    "within a later block": ((0, 0), {}),
    "within an earlier block": ((0, 0), {}),
}
expected = {}
for name, (base, placed) in CASES.items():
    drawing = ezdxf.new("R2000")
    drawing.header["$INSUNITS"] = 4  # mm
    space = drawing.modelspace()
    if name == "within an earlier block":
        drawing.blocks.new("OUTER")
    slot = drawing.blocks.new("SLOT", base_point=base)
    slot.add_line((0, 0), (20, 0))
    slot.add_line((20, 0), (20, 5))
    if name == "within a later block":
        drawing.blocks.new("OUTER")
    if "OUTER" in drawing.blocks:
        space.add_blockref("OUTER", (0, 0))
        space = drawing.blocks.get("OUTER")
    space.add_blockref("SLOT", (100, 50), dxfattribs=placed)
    lines = recursive_decompose(drawing.modelspace())
    points = [point for line in lines for point in (line.dxf.start, line.dxf.end)]
    expected[name] = [round(f(p[i] for p in points), 2) for i in (0, 1) for f in (min, max)]
    drawing.saveas(name + ".dxf")
with open("expected.json", "w") as file:
    json.dump(expected, file)
PYTHON
venv/bin/python write.py
cat >run.py <<'PYTHON'
import json

import FreeCAD
import Import

seen = {}
for name in json.load(open("expected.json")):
    document = FreeCAD.newDocument("drawing")
    Import.readDXF(name + ".dxf", document.Name)
    boxes = [each.Shape.BoundBox for each in document.Objects if hasattr(each, "Shape")]
    sides = [[box.XMin for box in boxes], [box.XMax for box in boxes]]
    sides += [[box.YMin for box in boxes], [box.YMax for box in boxes]]
    seen[name] = [round(f(side), 2) for f, side in zip((min, max) * 2, sides)] if boxes else None
    FreeCAD.closeDocument(document.Name)
with open("seen.json", "w") as file:
    json.dump(seen, file)
PYTHON
HOME=$folder freecadcmd run.py >log 2>&1 </dev/null || true
venv/bin/python - <<'PYTHON'
import json
import sys

STATED = {
    "scaled by 2, 2 and 1": [100.0, 131.75, 50.0, 57.94],
    "scaled by 2, 1 and 1": [100.0, 125.2, 50.0, 56.3],
    "based on its other end": [100.0, 120.0, 50.0, 55.0],
    "3 by 2": [100.0, 120.0, 50.0, 55.0],
    "within an earlier block": None,
}
expected, seen = json.load(open("expected.json")), json.load(open("seen.json"))
for name, box in expected.items():
    print(f"{name}: expected X and Y from and to {box}, seen {seen[name]}")
as_stated = seen == {**expected, **STATED} and all(expected[name] != STATED[name] for name in STATED)
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
