#!/bin/sh
# FreeCAD imports a program's F600 as 600 mm/s, and posts it again as F36000.
#
# Run: freecadcmd of Debian 12's freecad 0.20.2, its G-code importer (gcode_pre) into a job, and its
# LinuxCNC postprocessor, on four moves in G21 G94.
#
# Guess before the run: inside FreeCAD a feed is in mm/s, so the importer divides by 60 and the
# post multiplies by 60: what comes out has the feeds of what went in.
#
# What happens: the importer takes the number as it is, and the post multiplies: every feed comes
# out sixty times as high. The path looks right on the screen, there is no message, and the post
# writes "machine units: mm/min" above it.
#
# Why it matters: programs are imported to be moved, or joined with new operations. A control cuts
# F36000 as fast as its axes go, so the first cut goes into the material at the speed of a rapid
# move, and nobody looks for a wrong F in a program that ran well before. Compare a feed of the
# posted file with one of the imported file.
#
# Exit: 0 as described, 1 it has changed, 2 another or no freecad is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' freecad) || exit 2
echo "freecad $version"
[ "$version" = "0.20.2+dfsg1-4+deb12u1" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
printf 'G21 G90 G94\nG0 X0 Y0\nG1 Z-1 F300\nG1 X10 F600\nG0 Z5\n' >part.nc
cat >run.py <<'PYTHON'
import FreeCAD
import PathScripts.PathJob as PathJob
import PathScripts.post.gcode_pre as importer
from PathScripts.PathPostProcessor import PostProcessor

document = FreeCAD.newDocument("part")
box = document.addObject("Part::Box", "Box")
document.recompute()
job = PathJob.Create("Job", [box], None)
importer.insert("part.nc", document.Name)
document.recompute()
post = PostProcessor.load("linuxcnc")
post.export(job.Operations.Group, "posted.nc", "--no-show-editor")
PYTHON
HOME=$folder freecadcmd run.py >log 2>&1 </dev/null || true
echo "expected: F300 and F600 in mm/min, as in the file that was imported"
seen=$(grep -oE 'F[0-9.]+' posted.nc | tr '\n' ' ')
echo "seen: $seen, below the comment $(grep 'machine units' posted.nc)"
if [ "$seen" = "F18000.000 F36000.000 " ]; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
