#!/bin/sh
# Surfaces counted back from their own block land on another part's points.
#
# Run: trimesh 5.2.0 (PyPI), its OBJ reader.
#
# Guess before the run: a negative index of an OBJ face counts back from the points read so
# far, as the format has it; a file that says the same with positive indices is the same mesh.
#
# What happens: negative indices count back from the last point of the whole file. Where each
# part's points come just before its faces, every part but the last loses its own shape: its
# triangles are drawn over the last part. There is no error and no warning. A file with all its
# points first is read well, so a test with a single part shows nothing.
#
# Why it matters: a fixture of a base and a clamp, exported part by part, comes in without its
# base, and a collision check passes through where it stands. Its issue 2364 is open; the documentation
# doesn't say so. Write positive indices, or compare the box around the
# mesh with the CAD system's.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" || exit 2
"$folder/venv/bin/pip" install -q --disable-pip-version-check trimesh==5.2.0 numpy==2.4.6 ||
    exit 2
cd "$folder"
venv/bin/python - <<'PYTHON'
import sys
from importlib.metadata import version

import trimesh

CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
BLOCKS = [((0, 0, 0), (100, 60, 10)), ((40, 20, 10), (20, 20, 30))]


def written(relative):
    lines = []
    for number, (start, size) in enumerate(BLOCKS):
        for corner in CORNERS:
            point = [s + c * e for s, c, e in zip(start, corner, size, strict=True)]
            lines.append("v {} {} {}".format(*point))
        for side in SIDES:
            indices = [i - 9 if relative else i + 8 * number for i in side]
            lines.append("f " + " ".join(map(str, indices)))
    return "\n".join(lines) + "\n"


found = {}
for name, relative in (("positive", False), ("negative", True)):
    with open(f"{name}.obj", "w", encoding="ascii") as file:
        file.write(written(relative))
    mesh = trimesh.load(f"{name}.obj", force="mesh")
    box = [[round(float(x), 3) for x in corner] for corner in mesh.bounds]
    found[name] = (len(mesh.faces), box, bool(mesh.is_watertight))

print("trimesh", version("trimesh"))
print("expected of both: 24 triangles, box 0 0 0 to 100 60 40, closed")
for name, seen in found.items():
    print(f"seen, {name} indices: {seen[0]} triangles, box {seen[1]}, closed {seen[2]}")
as_stated = found == {
    "positive": (24, [[0, 0, 0], [100, 60, 40]], True),
    "negative": (24, [[40, 20, 10], [60, 40, 40]], False),
}
print("as stated" if as_stated else "CHANGED")
sys.exit(not as_stated)
PYTHON
