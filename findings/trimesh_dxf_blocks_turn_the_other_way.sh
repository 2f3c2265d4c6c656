#!/bin/sh
# A drawing's block that is turned by 30 degrees is turned by -30, and one that is scaled lands elsewhere.
#
# Run: trimesh 5.2.0 (PyPI), load_path, on drawings that ezdxf 1.4.5 writes and takes apart as the judge.
#
# Guess before the run: a block is scaled and turned about its base point, and then put where it is
# inserted, as in every CAD system; or blocks are refused.
#
# What happens: the angle counts clockwise, the scale is applied to the insertion point as well, and the
# base point isn't looked at. A slot inserted at X100 Y50 and turned by 30 degrees points down instead
# of up; with a scale of 2 it is at X200 Y100; mirrored by a scale of -1 it is at X-120. Blocks that are
# only moved are right, and so are those turned by 180 degrees. There is no message.
#
# Why it matters: holes and pockets that repeat are blocks in most drawings. The slots of a bolt circle
# come in at the right places, each turned the wrong way, and the outline around them is right. Take blocks
# apart in the CAD system, or by ezdxf, before the drawing is read.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check trimesh==5.2.0 ezdxf==1.4.5 numpy==2.4.6 \
    networkx==3.6.1 scipy==1.17.1 || exit 2
cd "$folder"
venv/bin/python - <<'PYTHON'
import sys
from importlib.metadata import version

import ezdxf
import trimesh

STATED = {
    "moved": ((0, 0), {}, (100, 50, 120, 55)),
    "turned by 180": ((0, 0), {"rotation": 180}, (80, 45, 100, 50)),
    "turned by 30": ((0, 0), {"rotation": 30}, (100, 40, 119.82, 50)),
    "scaled by 2": ((0, 0), {"xscale": 2, "yscale": 2}, (200, 100, 240, 110)),
    "mirrored in X": ((0, 0), {"xscale": -1}, (-120, 50, -100, 55)),
    "based on its other end": ((20, 0), {}, (100, 50, 120, 55)),
}


def box(points):
    return tuple(round(float(f(p[i] for p in points)), 2) for f in (min, max) for i in (0, 1))


print("trimesh", version("trimesh"), "ezdxf", version("ezdxf"))
as_stated = True
for name, (base, placed, stated) in STATED.items():
    drawing = ezdxf.new("R2010")
    slot = drawing.blocks.new("SLOT", base_point=base)
    slot.add_line((0, 0), (20, 0))
    slot.add_line((20, 0), (20, 5))
    insert = drawing.modelspace().add_blockref("SLOT", (100, 50), dxfattribs=placed)
    expected = box([point for line in insert.virtual_entities() for point in (line.dxf.start, line.dxf.end)])
    drawing.saveas("part.dxf")
    seen = box(trimesh.load_path("part.dxf").vertices)
    print(f"{name}: expected the box {expected}, seen {seen}")
    as_stated &= seen == stated and (seen == expected) == (name in ("moved", "turned by 180"))
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
