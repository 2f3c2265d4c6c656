#!/bin/sh
# A part whose zero is its highest point gets a flat path, and its neighbourhood is cut down to zero.
#
# Run: opencamlib 2023.1.11 (PyPI), PathDropCutter with a ball cutter over a ramp.
#
# Guess before the run: the cutter is dropped until it touches the part, wherever the part's zero
# is; moving the part down by 40 mm moves the path down by 40 mm. Where there is no part, a point has
# no height, or says that nothing is touched.
#
# What happens: the cutter stops at Z 0, a floor that nobody set. A part wholly below Z 0 gets a path at
# Z 0 throughout. A part above it gets its surface, and beside it the path plunges to Z 0, from
# whatever height. The points say so only by their contact's type, and there is no message.
#
# Why it matters: the top of the blank is the usual zero, so all of the part is below it: the program
# cuts air. Or the part stands on a vice, and the cutter goes down beside it to the table. Call setZ
# with a height below the part, and leave out points that touch nothing.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check opencamlib==2023.1.11 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from importlib.metadata import version

from opencamlib import ocl


def dropped(base):
    """Heights of the ball cutter's tip on its way over a ramp of 10 mm that stands at a height."""
    corners = [(0, 0, base), (50, 0, base), (50, 50, base + 10), (0, 50, base + 10)]
    points = [ocl.Point(*corner) for corner in corners]
    part = ocl.STLSurf()
    part.addTriangle(ocl.Triangle(points[0], points[1], points[2]))
    part.addTriangle(ocl.Triangle(points[0], points[2], points[3]))
    path = ocl.Path()
    path.append(ocl.Line(ocl.Point(25, -30, 0), ocl.Point(25, 90, 0)))
    cutter = ocl.BallCutter(6.0, 30.0)
    drop = ocl.PathDropCutter()
    drop.setSTL(part)
    drop.setCutter(cutter)
    drop.setSampling(40.0)
    drop.setPath(path)
    drop.run()
    return [round(point.z, 1) for point in drop.getCLPoints()]


print(f"opencamlib {version('opencamlib')}")
seen = {base: dropped(base) for base in (0, 30, -40)}
print("expected on the ramp: 30 mm higher, and 40 mm lower, than over the ramp at 0; beside it no height")
for base, heights in seen.items():
    print(f"seen, ramp at {base}: {heights}")
beside = [i for i, height in enumerate(seen[0]) if height == 0.0]
stated = set(seen[-40]) == {0.0} and {seen[30][i] for i in beside} == {0.0} and max(seen[30]) > 36.0
print("as stated" if stated else "CHANGED")
sys.exit(0 if stated else 1)
PYTHON
