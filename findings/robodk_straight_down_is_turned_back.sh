#!/bin/sh
# A tool that points straight down is written out turned about its axis the wrong way.
#
# Run: robodk 6.0.2 (PyPI), robomath.Pose_2_Catia, which gives a pose's three angles as its
# documentation says: transl(x, y, z)*rotz(a)*rotx(b)*rotz(c). No RoboDK is needed.
#
# Guess before the run: multiplied out again, the angles give the pose. Where the tool is straight up
# or down only a and c together are determined, so one of them is 0 and the other has the rest. The
# source, read before the run, put the rest into c and had the same sign for up and for down.
#
# What happens: straight up is right, and so is every tilt, up to 179.99 degrees. At 180 degrees a is
# 0, and c has the wrong sign, so the tool is turned by -30 degrees where 30 were asked: 60 off.
# There is no message. Turns of 0 and of 180 degrees come back right, which hides it in a first test.
#
# Why it matters: straight down is how a robot mills, drills and trims most of the time. A cutter that
# spins doesn't show it, but a saw, a knife or a probe stands across its path, while the next point,
# tilted by a hundredth of a degree, is right. Multiply the angles out and compare.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check robodk==6.0.2 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from importlib.metadata import version
from math import degrees, radians

from robodk.robomath import Pose_2_Catia, pose_angle_between, rotx, rotz, transl

STATED = {(0, 30): 0, (150, 30): 0, (179.99, 30): 0, (180, 0): 0, (180, 30): 60, (180, 90): 180, (180, 180): 0}


def pose(x, y, z, a, b, c):
    return transl(x, y, z) * rotz(radians(a)) * rotx(radians(b)) * rotz(radians(c))


print("robodk", version("robodk"))
print("expected: the angles give the pose that they were made from")
as_stated = True
for (tilt, turn), stated in STATED.items():
    asked = pose(100, 200, 300, 0, tilt, turn)
    given = Pose_2_Catia(asked)
    off = degrees(pose_angle_between(asked, pose(*given)))
    angles = ", ".join(f"{angle:.2f}" for angle in given[3:])
    print(f"seen, tilted by {tilt} and turned by {turn} deg: {angles}, off by {off:.2f} deg")
    as_stated &= abs(off - stated) < 0.001
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
