#!/bin/sh
# A Staubli target may be read once only, and a Nachi target comes back with its angles swapped.
#
# Run: robodk 6.0.2 (PyPI), its pairs of robomath for robots' own targets, NAME_2_Pose and
# Pose_2_NAME. No RoboDK is needed.
#
# Guess before the run: each pair is a there and back, and neither changes what it is given. That a
# list is changed was seen in the source, before that part was run.
#
# What happens: Staubli_2_Pose writes radians over the degrees of the list that it reads. The same
# target, read again, stands nearly upright: 20 degrees have become a third of a degree. Pose_2_Nachi
# puts the three angles in reverse order, and Nachi_2_Pose reads them in the order of Fanuc. KUKA,
# Fanuc, Motoman, Comau, Adept and UR come back, and leave their lists alone. There is no message.
#
# Why it matters: a target is read once for its approach and once for its cut, or for each
# pass, and all but the first go in with the spindle upright. A Nachi program that is read, moved and
# written has other postures throughout. Give Staubli_2_Pose a copy, and turn the last three
# numbers around before Nachi_2_Pose.
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
from math import degrees

from robodk import robomath
from robodk.robomath import pose_angle_between

TARGET = (100.0, 200.0, 300.0, 10.0, 20.0, 30.0)  # mm and degrees; UR's last three are a vector in rad
NAMES = ("KUKA", "Fanuc", "Motoman", "Comau", "Adept", "UR", "Staubli", "Nachi")

print("robodk", version("robodk"))
print("expected of each: read twice, the same pose; written again, the same pose")
seen = {}
for name in NAMES:
    read = getattr(robomath, f"{name}_2_Pose")
    write = getattr(robomath, f"Pose_2_{name}")
    target = list(TARGET[:3] + ((0.1, 0.2, 0.3) if name == "UR" else TARGET[3:]))
    first = read(target)
    after = [round(number, 4) for number in target[3:]]
    twice = degrees(pose_angle_between(first, read(target)))
    back = degrees(pose_angle_between(first, read(write(first))))
    seen[name] = (round(twice, 1), round(back, 1))
    print(f"seen, {name}: read twice, {twice:.1f} deg apart, now {after}; written and read, {back:.1f} deg")
right = all(seen[name] == (0.0, 0.0) for name in NAMES[:-2])
as_stated = right and seen["Staubli"] == (38.0, 0.0) and seen["Nachi"] == (0.0, 32.7)
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
