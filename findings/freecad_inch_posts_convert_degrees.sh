#!/bin/sh
# FreeCAD's inch programs turn rotary axes by a twenty-fifth of what was asked.
#
# Run: freecadcmd of Debian 12's freecad 0.20.2, its postprocessors linuxcnc, fanuc, mach3_mach4,
# uccnc, centroid and grbl with --inches, on three moves of X, A and C.
#
# Guess before the run: --inches divides lengths and feeds by 25.4. Degrees are degrees in G20,
# too, so A and C come out as they went in.
#
# What happens: five of the six posts treat A, B and C as lengths: A90 comes out as A3.5433, and
# C-180 as C-7.0866. The centroid post leaves C out altogether, in mm as well. The grbl post
# writes degrees. There is no message.
#
# Why it matters: an indexed part is cut at a wrong angle everywhere, beginning with a rapid move
# beside a part that was to have turned away. The path on the screen is right, and the numbers look
# like angles. Post in mm, or compare the rotary words of both programs.
#
# Exit: 0 as described, 1 it has changed, 2 another or no freecad is installed.
set -eu
version=$(dpkg-query -W -f '${Version}' freecad) || exit 2
echo "freecad $version"
[ "$version" = "0.20.2+dfsg1-4+deb12u1" ] || exit 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat >run.py <<'PYTHON'
import FreeCAD
import Path
import PathScripts.PathJob as PathJob
from PathScripts.PathPostProcessor import PostProcessor

document = FreeCAD.newDocument("part")
box = document.addObject("Part::Box", "Box")
document.recompute()
PathJob.Create("Job", [box], None)
operation = document.addObject("Path::Feature", "Operation")
operation.Path = Path.Path(
    [
        Path.Command("G0", {"X": 0, "A": 90}),
        Path.Command("G1", {"X": 25.4, "A": 45, "F": 10}),
        Path.Command("G1", {"X": 50.8, "C": -180, "F": 10}),
    ]
)
document.recompute()
for name in ("linuxcnc", "fanuc", "mach3_mach4", "uccnc", "centroid", "grbl"):
    PostProcessor.load(name).export([operation], name + ".nc", "--no-show-editor --inches")
PYTHON
HOME=$folder freecadcmd run.py >log 2>&1 </dev/null || true
echo "expected of each: X1 and X2 in inches, A90 A45 C-180 in degrees"
for name in linuxcnc fanuc mach3_mach4 uccnc centroid grbl; do
    words=$(grep '^G[01] \|^X' "$name.nc" | grep -oE '[XAC]-?[0-9]+\.[0-9]{3}' | tr '\n' ' ')
    echo "$name: $words"
done | tee seen
cat >wanted <<'TEXT'
linuxcnc: X0.000 A3.543 X1.000 A1.771 X2.000 C-7.086 
fanuc: X0.000 A3.543 X1.000 A1.771 X2.000 C-7.086 
mach3_mach4: X0.000 A3.543 X1.000 A1.771 X2.000 C-7.086 
uccnc: X0.000 A3.543 X1.000 A1.772 X2.000 C-7.087 
centroid: X0.000 A3.543 X1.000 A1.771 X2.000 
grbl: X0.000 A90.000 X1.000 A45.000 X2.000 C-180.000 
TEXT
if cmp -s seen wanted; then
    echo "as stated"
else
    echo "CHANGED"
    exit 1
fi
