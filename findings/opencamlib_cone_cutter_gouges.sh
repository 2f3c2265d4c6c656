#!/bin/sh
# A V-shaped cutter is put into steep faces, and into sloping edges the deeper the longer it is.
#
# Run: opencamlib 2023.1.11 (PyPI), BatchDropCutter with a ConeCutter of diameter 10 mm and half
# angle 30 degrees: a cone 8.66 mm high, and above it a shank of the length that is given.
#
# Guess before the run: every shape of cutter stops where it first touches, to rounding. For a
# cone on a plane that is its tip, or its rim where the plane is steeper than the flank. That the
# shank's length could have a part in it, where nothing of the workpiece is, wasn't guessed at all.
#
# What happens: on a face steeper than its flank the cone goes down until its tip touches, here
# with its rim 5 mm inside the part. On an edge that slopes and isn't under its axis it stops too
# low, the more the longer the shank; without one it is right. Level edges and flatter faces are
# right, and so is a ball in each case. Nothing is reported.
#
# Why it matters: paths for engraving and deburring with V-bits are made by this call, with the
# length that is in the tool table, and the cutter goes into the part wherever a wall or an edge
# rises. The library lists the shape as supported; its issue 93 speaks of a "singularity".
# A shank of length 0 cures the edges only: check the points against the cutter's profile.
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
from math import inf, radians, sqrt, tan

from opencamlib import ocl

RADIUS, HALF = 5.0, radians(30)
LENGTHS = (0, 20, 60)


def cone(r):
    return r / tan(HALF) if r <= RADIUS else inf


def ball(r):
    return RADIUS - sqrt(RADIUS**2 - r**2) if r <= RADIUS else inf


def dropped(cutter, corners):
    surface = ocl.STLSurf()
    surface.addTriangle(ocl.Triangle(*(ocl.Point(*p) for p in corners)))
    drop = ocl.BatchDropCutter()
    drop.setSTL(surface)
    drop.setCutter(cutter)
    drop.appendPoint(ocl.CLPoint(0, 0, -1000))
    drop.run()
    return drop.getCLPoints()[0].z


def first_touch(profile, slope, beside):
    """The highest of (height of a point of the line - the cutter's profile there)."""
    xs = (i / 4000 for i in range(-24000, 24001))
    return max(slope * x - profile(sqrt(x * x + beside * beside)) for x in xs)


def triangle(slope, beside):
    """One that rises along x: a wall below its edge `beside` the axis, or a face around the axis."""
    if beside:
        return (-40, beside, -40 * slope), (40, beside, 40 * slope), (40, beside, -400)
    return (-60, -40, -60 * slope), (60, -40, 60 * slope), (0, 80, 0)


CASES = [
    (45, 0, (0.0, 0.0, 0.0)),
    (70, 0, (-5.077, -5.077, -5.077)),
    (0, 2, (0.0, 0.0, 0.0)),
    (30, 2, (0.0, -0.099, -0.153)),
    (45, 2, (0.0, -0.335, -0.499)),
]
print("opencamlib", version("opencamlib"))
print("expected: the cutter stops where it first touches, whatever its length")
as_stated = True
for degrees, beside, stated in CASES:
    slope = tan(radians(degrees))
    corners = triangle(slope, beside)
    touch = first_touch(cone, slope, beside)
    cones = [dropped(ocl.ConeCutter(2 * RADIUS, HALF, length), corners) for length in LENGTHS]
    balls = [dropped(ocl.BallCutter(2 * RADIUS, 20 + length), corners) for length in LENGTHS]
    print(
        f"seen, {f'edge {beside} mm beside the axis' if beside else 'face'}, {degrees} degrees:"
        f" first touch {touch:.3f}; shank of "
        + ", ".join(f"{n} mm: {z:.3f}" for n, z in zip(LENGTHS, cones, strict=True))
    )
    as_stated &= all(abs(z - touch - d) < 0.003 for z, d in zip(cones, stated, strict=True))
    as_stated &= all(abs(z - first_touch(ball, slope, beside)) < 0.001 for z in balls)
print("as stated (and the ball right each time)" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
